"""Studies: a paper's comparison, with the numbers of every run and the verdicts on its claims."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from ._data import FMUS
from ._orchestrator import OrchestratorError, orchestrate


@dataclass(frozen=True, eq=False)
class Study:
    """Results of a study."""

    runs: dict[str, pd.DataFrame]
    """A table for each run by its id, with one row for each case. Columns are the varied
    parameters, in SI units, and the numbers under the names by which the study refers to them, such
    as "ems_deg" and "measure.late", in the units of its files."""

    claims: pd.DataFrame
    """One row for each check of a claim: what the claim says ("says"), its verdict, what the check
    compares ("label"), in how many of how many cases the relation holds ("held", "of"), and the
    ends of the interval of how often it holds, with 95 % confidence ("low", "high"; NaN for a
    single case)."""

    folder: Path
    """Folder of the results: report.html, results.json, figures, and the parts of the runs."""

    @property
    def report(self) -> Path:
        """Path of the report, a page for the browser."""
        return self.folder / "report.html"

    def __repr__(self) -> str:
        verdicts = self.claims.drop_duplicates("says")["verdict"].value_counts()
        counts = ", ".join(f"{count} {verdict}" for verdict, count in verdicts.items())
        return f"Study: {len(self.runs)} runs, claims: {counts}\n  {self.report}"


def reproduce(
    name: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    *,
    members: int | None = None,
) -> Study:
    """Runs a study and returns the numbers of all runs and the verdicts on the claims. What was
    finished before in the folder is not run again.

    Args:
        name: Path of a study file or of its folder, or the name of a study of this package.
        out: Folder of the results, by default out/NAME.
        jobs: Number of threads, by default one for each core.
        members: Largest number of cases of each run, for a quick look.

    Raises:
        OrchestratorError: The study was refused, or a run failed.
    """
    path = Path(name)
    stem = path.absolute().parent.name if path.is_file() else path.name
    folder = Path("out", stem) if out is None else Path(out)
    command = ["reproduce", os.fspath(name), "--fmu-dir", str(FMUS), "--quiet"]
    command += ["--out", str(folder)]
    for option, number in (("--jobs", jobs), ("--members", members)):
        if number is not None:
            command += [option, str(number)]
    # A study may have a thousand runs, and its report counts their warnings.
    exit_code, error, _ = orchestrate(command, level="error")
    if exit_code != 0:
        raise OrchestratorError(error, exit_code, None)
    results = json.loads((folder / "results.json").read_text("utf-8"))
    checks = [
        {
            "says": claim["says"],
            "verdict": claim["verdict"],
            "label": check["label"],
            "held": check["held"],
            "of": check["of"],
            "low": (check["probability"] or {}).get("low"),
            "high": (check["probability"] or {}).get("high"),
        }
        for claim in results["claims"]
        for check in claim["checks"]
    ]
    columns = ["says", "verdict", "label", "held", "of", "low", "high"]
    return Study(
        runs={run: table(result["members"]) for run, result in results["runs"].items()},
        claims=pd.DataFrame(checks, columns=columns).astype({"low": float, "high": float}),
        folder=folder.absolute(),
    )


def table(members: list[dict[str, Any]]) -> pd.DataFrame:
    """Makes a table of the cases of a run, with their numbers as index."""
    return pd.DataFrame(members).set_index("case")
