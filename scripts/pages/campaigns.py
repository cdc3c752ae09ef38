"""Flies the campaigns of orchestrator/experiments/campaigns with every controller that they are for, and
writes who keeps what, with which probability, to docs/results.md: campaigns.py [CAMPAIGN…]

The FMUs are built and packed first. What is flown already in out/campaigns is not flown again; about
an hour on two processors from nothing. The page is written when all campaigns are flown.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).absolute()
OUT = ROOT / "out" / "campaigns"
PAGE = ROOT / "docs" / "results.md"
BEGIN, END = "<!-- campaigns: written by scripts/pages/campaigns.py -->\n", "<!-- end of campaigns -->\n"
PAPER_SETS = ["controller.constraints=paper", "controller.feedback.k1=-5", "controller.feedback.k2=-5"]
FURTHER = ("FBL", "BTVSMC", "BTVSMC_DO", "SOTVSMC_DO", "TwoLoopSMC")


def exchanged(fmu: str, *changes: str) -> list[str]:
    """Returns the arguments that replace the controller by an FMU, and change its settings."""
    return ["--fmu", f"controller={fmu}.fmu", *(word for each in changes for word in ("--set", each))]


# Controllers with the arguments that choose them.
CHAI = {name: ["--experiment", name] for name in ("crmpc-robust", "crmpc-paper", "dlmpc-tuned", "lqr")}
ON_CHAI = {fmu: ["--experiment", "exchange/crmpc-2022", *exchanged(fmu)] for fmu in FURTHER}
ANY = {
    "CRMPC": exchanged("CRMPC"),
    "CRMPC, paper sets": exchanged("CRMPC", *PAPER_SETS),
    **{fmu: exchanged(fmu) for fmu in ("DLMPC", "LQR", *FURTHER)},
}


@dataclass(frozen=True)
class Campaign:
    """Controllers of a campaign, and whether its cases are drawn, so that shares are probabilities."""

    controllers: dict[str, list[str]]
    is_drawn: bool = True


CAMPAIGNS = {
    "white": Campaign(CHAI),
    "corners": Campaign(CHAI, is_drawn=False),
    "square-waves": Campaign(CHAI, is_drawn=False),
    "adversaries": Campaign(CHAI, is_drawn=False),
    "everything": Campaign({**CHAI, **ON_CHAI}),
    "everything-measured": Campaign(ANY),
    "everything-wu": Campaign(ANY),
    "everything-jia": Campaign(ANY),
    "entry": Campaign(ANY),
    "entry-told": Campaign({"CRMPC": ANY["CRMPC"]}),
    "entry-navigated": Campaign({"CRMPC, told": ["--experiment", "navigated-told"], "LQR": ANY["LQR"]}),
}
# Name of a limit, its measure, and what the largest value is called, by the limit's id.
LIMITS = {
    "range": ("range limit", "range_off_km", "largest range off"),
    "error": ("error limit", "late-error-deg", "largest late error"),
    "rate": ("rate limit", "max_rate_deg_s", "largest rate"),
    "moment": ("moment limit", "max_moment_ratio", "largest moment / limit"),
}


def folder(campaign: str, controller: str) -> Path:
    return OUT / f"{campaign}-{controller.replace(', ', '-').replace(' ', '-')}"


def share(broken: dict, is_drawn: bool) -> str:
    events, cases = broken["events"], broken["cases"]
    if not is_drawn:
        return f"{events} of {cases}"
    if events == 0:
        return f"≤ {percent(broken['high'])} (0 of {cases})"
    return f"{percent(broken['low'])} to {percent(broken['high'])} ({events} of {cases})"


def percent(probability: float) -> str:
    return f"{100 * probability:.3g} %"


def measure(summary: dict, name: str) -> tuple[dict | None, str]:
    matches = [each for each in summary["measures"] if each["name"] == name]
    return (matches[0]["summary"], matches[0]["unit"]) if matches else (None, "")


def largest(summary: dict, name: str) -> str:
    numbers, unit = measure(summary, name)
    return f"{numbers['quantiles'][-1]['value']:.3f} {unit}".strip() if numbers else "–"


def mean(summary: dict, name: str) -> str:
    numbers, unit = measure(summary, name)
    return f"{numbers['mean']:.3f} {unit}".strip() if numbers else "–"


def guarantee(summary: dict) -> str:
    in_force, _ = measure(summary, "guarantee_share")
    broken, _ = measure(summary, "guarantee_broken")
    if in_force is None or broken is None:
        return "–"
    return f"{percent(in_force['mean'])}, {round(broken['mean'] * broken['cases'])} broken"


def section(name: str) -> str:
    campaign = CAMPAIGNS[name]
    texts = {each: (folder(name, each) / "summary.json").read_text("utf-8") for each in campaign.controllers}
    summaries = {controller: json.loads(text) for controller, text in texts.items()}
    first = next(iter(summaries.values()))
    limits = [LIMITS[limit["id"]] for limit in first["limits"]]
    heading = ["controller", "mean EMS", "largest EMS"]
    heading += [column for what, _, greatest in limits for column in (f"{what} broken", greatest)]
    heading += ["lost", "guarantee in force"]
    lines = [
        f"\n### {first['title']}\n",
        f"[{name}.toml](../orchestrator/experiments/campaigns/{name}.toml)\n",
        f"| {' | '.join(heading)} |",
        "|---" * len(heading) + "|",
    ]
    for controller, summary in summaries.items():
        cells = [controller, mean(summary, "ems_deg"), largest(summary, "ems_deg")]
        for limit, (_, measured, _) in zip(summary["limits"], limits, strict=True):
            cells += [share(limit["broken"], campaign.is_drawn), largest(summary, measured)]
        cells += [str(summary["status"]["lost"]), guarantee(summary)]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    names = sys.argv[1:]
    if unknown := sorted(set(names) - set(CAMPAIGNS)):
        sys.exit(f"there is no campaign {unknown[0]}; there are {', '.join(CAMPAIGNS)}")
    subprocess.run([ROOT / "scripts" / "build-fmus"], check=True)
    for name in names or CAMPAIGNS:
        for controller, arguments in CAMPAIGNS[name].controllers.items():
            command = [TARGET / "release" / "orchestrator", "campaign", name, *arguments]
            command += ["--fmu-dir", TARGET / "fmu", "--out", folder(name, controller)]
            subprocess.run(command, cwd=ROOT, check=True)
    missing = [
        f"{name} with {controller}"
        for name, campaign in CAMPAIGNS.items()
        for controller in campaign.controllers
        if not (folder(name, controller) / "summary.json").is_file()
    ]
    if missing:
        sys.exit(f"{PAGE} stays as it is: there is no {missing[0]} in {OUT}, and {len(missing) - 1} more are missing")
    before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
    PAGE.write_text(before + BEGIN + "".join(map(section, CAMPAIGNS)) + "\n" + END + rest.split(END)[1], encoding="utf-8")


if __name__ == "__main__":
    main()
