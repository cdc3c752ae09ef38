"""Writes docs/campaigns-results.md from the summaries of campaigns: campaigns.py FOLDER CAMPAIGN... -- CONTROLLER..."""

from __future__ import annotations

import json
import sys
from pathlib import Path

HEAD = """# Who keeps what, with which probability

`scripts/campaigns` flies the campaigns below
[orchestrator/experiments/campaigns](../orchestrator/experiments/campaigns) with each controller and
writes this page. Probabilities are those of breaking a limit, with 95 % confidence by Clopper and
Pearson; at corners, levels and for adversaries they are no more than shares.
[campaigns.md](campaigns.md) says what the numbers mean.
"""


def share(broken: dict, is_drawn: bool) -> str:
    events, cases = broken["events"], broken["cases"]
    if not is_drawn:
        return f"{events} of {cases}"
    if events == 0:
        return f"≤ {percent(broken['high'])} (0 of {cases})"
    return f"{percent(broken['low'])} to {percent(broken['high'])} ({events} of {cases})"


def percent(probability: float) -> str:
    return f"{100 * probability:.3g} %"


def largest(summary: dict, name: str) -> str:
    [measure] = [each for each in summary["measures"] if each["name"] == name]
    if not measure["summary"]:
        return "–"
    value = measure["summary"]["quantiles"][-1]["value"]
    return f"{value:.3f} {measure['unit']}".strip()


def mean(summary: dict, name: str) -> str:
    [measure] = [each for each in summary["measures"] if each["name"] == name]
    return f"{measure['summary']['mean']:.3f} {measure['unit']}".strip() if measure["summary"] else "–"


def section(folder: Path, campaign: str, controllers: list[str]) -> str:
    summaries = {}
    for controller in controllers:
        text = (folder / f"{campaign}-{controller}" / "summary.json").read_text(encoding="utf-8")
        summaries[controller] = json.loads(text)
    title = next(iter(summaries.values()))["title"]
    is_drawn = campaign in ("white", "everything")
    lines = [
        f"\n## {title}\n",
        f"[{campaign}.toml](../orchestrator/experiments/campaigns/{campaign}.toml)\n",
        "| controller | mean EMS | largest EMS | rate limit broken | largest rate | moment limit broken | largest moment / limit | lost |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for controller, summary in summaries.items():
        broken = {limit["id"]: limit["broken"] for limit in summary["limits"]}
        cells = [
            controller,
            mean(summary, "ems_deg"),
            largest(summary, "ems_deg"),
            share(broken["rate"], is_drawn),
            largest(summary, "max_rate_deg_s"),
            share(broken["moment"], is_drawn),
            largest(summary, "max_moment_ratio"),
            str(summary["status"]["lost"]),
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    folder, *names = sys.argv[1:]
    middle = names.index("--")
    campaigns, controllers = names[:middle], names[middle + 1 :]
    page = HEAD + "".join(section(Path(folder), each, controllers) for each in campaigns)
    Path("docs/campaigns-results.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
