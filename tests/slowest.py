"""Prints the ten slowest tests of a run of scripts/test, from what it left in a folder: `rust`, the output of
`cargo test` with times, and the reports of pytest."""

import re
import sys
from pathlib import Path
from xml.etree import ElementTree

folder = Path(sys.argv[1])
times: list[tuple[float, str]] = []
crate = ""
for line in (folder / "rust").read_text(encoding="utf-8").splitlines():
    if running := re.match(r"\s+Running .*/(\S+)-[0-9a-f]+\)", line):
        crate = running[1]
    elif test := re.match(r"test (\S+).* <([\d.]+)s>$", line):
        times.append((float(test[2]), f"{crate} {test[1]}"))
for report in folder.glob("*.xml"):
    cases = ElementTree.parse(report).iter("testcase")
    times += [(float(case.get("time", 0.0)), f"{case.get('classname')} {case.get('name')}") for case in cases]
for time, test in sorted(times, reverse=True)[:10]:
    print(f"{time:7.1f} s  {test}")
