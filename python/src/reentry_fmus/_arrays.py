"""Tables as xarray Datasets and as files of MATLAB."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
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


# MATLAB takes no longer names, and ignores what is beyond.
LONGEST_NAME = 63


def write_mat(path: Path, table: pd.DataFrame, metrics: Mapping[str, float]) -> None:
    """Writes a file of MATLAB with a column vector for each column and for the index, named as they
    are with "_" for whatever MATLAB takes in no name. Categoricals become cells of texts."""
    need("scipy", "matlab")
    from scipy.io import savemat

    columns = {str(table.index.name): table.index.to_numpy()}
    for column in table.columns:
        is_number = table[column].dtype.kind in "bif"
        texts = table[column].astype(str).to_numpy(dtype=object)
        columns[column] = table[column].to_numpy() if is_number else texts
    names: dict[str, str] = {}
    for column in columns:
        name = re.sub(r"\W", "_", column)
        if len(name) > LONGEST_NAME or name in (*names.values(), "units", "names", "metrics"):
            raise ValueError(f"{column} is no name for MATLAB, nor is {name}: rename the column")
        names[column] = name
    content: dict[str, object] = {names[column]: values for column, values in columns.items()}
    units = table.attrs["units"]
    content["units"] = {names[column]: units.get(column) or "" for column in table.columns}
    content["names"] = {name: column for column, name in names.items()}
    content["metrics"] = dict(metrics)
    savemat(path, content, long_field_names=True, oned_as="column", do_compression=True)
