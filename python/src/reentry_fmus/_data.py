"""The data of the wheel: the FMUs, the orchestrator and its experiments."""

from __future__ import annotations

import inspect
import json
import os
import subprocess
import webbrowser
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

DATA = Path(__file__).parent / "data"
FMUS = DATA / "fmu"
EXPERIMENTS = DATA / "experiments"


def hint(wrong: str, right: Iterable[str]) -> str:
    """Ends a message about an unknown name with the nearest right one, or with all of them."""
    names = list(right)
    by_case = {name.lower(): name for name in names}
    wrong = wrong.lower()
    near = get_close_matches(wrong, by_case, n=1)
    if not near and len(wrong) > 2:
        near = [name for name in by_case if wrong in name]
    if near:
        return f'; did you mean "{by_case[near[0]]}"?'
    listed = ", ".join(names[:12]) + (", …" if len(names) > 12 else "")
    return f"; there are: {listed}"


def fmus() -> list[str]:
    """Returns the names of the FMUs, in alphabetical order.

    >>> fmus()[:3]
    ['AttitudeEstimator', 'BTVSMC', 'BTVSMC_DO']
    """
    return sorted((path.stem for path in FMUS.glob("*.fmu")), key=str.lower)


def fmu(name: str) -> Path:
    """Returns the path of an FMU (an FMI 2.0 archive) by its name.

    >>> fmu("CRMPC").name
    'CRMPC.fmu'
    >>> fmu("CRPMC")
    Traceback (most recent call last):
        ...
    ValueError: there is no FMU "CRPMC"; did you mean "CRMPC"?

    Raises:
        ValueError: there is no FMU of this name. The message gives the nearest one.
    """
    names = fmus()
    if name not in names:
        raise ValueError(f'there is no FMU "{name}"{hint(name, names)}')
    return FMUS / f"{name}.fmu"


def fmu_path(name_or_file: str | os.PathLike[str]) -> Path:
    """Returns the path of an FMU that is given by its name or as a file."""
    path = Path(name_or_file)
    if path.suffix != ".fmu":
        return fmu(str(name_or_file))
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such FMU")
    return path.absolute()


def program() -> Path:
    """Returns the path of the orchestrator, an executable file."""
    return DATA / ("orchestrator.exe" if os.name == "nt" else "orchestrator")


def browse() -> Path:
    """Opens the page "Try it in the browser", which flies the controllers while their settings are
    dragged, and returns its path. It needs no network.

    Raises:
        FileNotFoundError: the package was built without the page.
    """
    page = DATA / "try.html"
    if not page.is_file():
        raise FileNotFoundError(f"{page}: this package was built without the page for browsers")
    webbrowser.open(page.as_uri())
    return page


def experiments() -> dict[str, str]:
    """Returns the experiments that the package contains, as titles by name. A name that several
    papers use is preceded by its folder.

    >>> experiments()["lqr"]
    'LQR, scenario of Chai 2022'
    """
    command = [str(program()), "list", "--json", str(EXPERIMENTS)]
    listed = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=True)
    rows = [row for row in json.loads(listed.stdout) if row["kind"] == "experiment"]
    folder = EXPERIMENTS.resolve()
    titles = {
        Path(row["path"]).resolve().relative_to(folder).with_suffix("").as_posix(): row["title"]
        for row in rows
    }
    stems = [name.rpartition("/")[2] for name in titles]
    return {
        stem if stems.count(stem) == 1 else name: title
        for stem, (name, title) in zip(stems, titles.items(), strict=True)
    }


def experiment_path(experiment: str | os.PathLike[str]) -> str:
    """Returns the file of an experiment of this package. Any other name is returned as it is, and
    the orchestrator looks it up."""
    if Path(experiment).is_file():
        return str(Path(experiment).absolute())
    file = os.fspath(experiment).removesuffix(".toml") + ".toml"
    paths = [
        path
        for path in EXPERIMENTS.rglob("*.toml")
        if path.as_posix().endswith(f"/{file}") and path.name != "study.toml"
    ]
    return str(paths[0]) if len(paths) == 1 else os.fspath(experiment)


def need(module: str, extra: str) -> None:
    """Raises an error if an optional package is not installed."""
    try:
        __import__(module)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != module:
            raise
        message = f'{module} is not installed: pip install "reentry-fmus[{extra}]"'
        raise ModuleNotFoundError(message, name=module) from None


def caller() -> int:
    """Returns how many levels of calls further up the line is that called this package."""
    frame, level = inspect.currentframe(), 0
    package = __name__.partition(".")[0]
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == package:
        frame, level = frame.f_back, level + 1
    return level
