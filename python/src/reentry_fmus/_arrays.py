"""Tables as xarray Datasets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import pandas as pd

from ._data import need

if TYPE_CHECKING:
    from xarray import Dataset


def dataset(
    table: pd.DataFrame, title: str, attributes: Mapping[str, Any], index_unit: str | None = None
) -> Dataset:
    """Makes a Dataset of a table whose `attrs` give units and descriptions by column. Categoricals
    become texts."""
    need("xarray", "xarray")
    import xarray

    name = str(table.index.name)
    data = xarray.Dataset(coords={name: (name, table.index.to_numpy())})
    if index_unit is not None:
        data[name].attrs["units"] = index_unit
    descriptions = table.attrs.get("descriptions", {})
    for column in table.columns:
        values = table[column]
        is_number = not isinstance(values.dtype, pd.CategoricalDtype) and values.dtype.kind in "bif"
        array = values.to_numpy() if is_number else values.astype(str).to_numpy(dtype=str)
        about = {"units": table.attrs["units"].get(column), "long_name": descriptions.get(column)}
        data[column] = (name, array, {key: text for key, text in about.items() if text})
    # A truth value is no attribute of a netCDF file.
    numbers = {key: int(v) if isinstance(v, bool) else v for key, v in attributes.items()}
    return data.assign_attrs(title=title, **numbers)
