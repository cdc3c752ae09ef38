"""Check of figures for people who see no red or no green: curves of a panel differ by their dashes, or by colours that
differ for them."""

import itertools
import re
from pathlib import Path

from colorspacious import cspace_convert, deltaE

# Differences of colours, in CAM02-UCS.
LEAST = 15.0
KINDS = ["deuteranomaly", "protanomaly"]


def seen(color: str, kind: str) -> list[float]:
    """Colour as somebody without these cones sees it."""
    rgb = [int(color[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    return cspace_convert(rgb, {"name": "sRGB1+CVD", "cvd_type": kind, "severity": 100}, "sRGB1")


def difference(a: str, b: str) -> float:
    """Smallest difference of two colours."""
    return min(float(deltaE(seen(a, kind), seen(b, kind), input_space="sRGB1")) for kind in KINDS)


def lines(panel: str) -> dict[str, tuple[str, str]]:
    """Colour and dashes of the lines of a panel, by name. Pale lines accompany one of the same name or colour."""
    found = {}
    for name, attributes in re.findall(r'<path data-name="([^"]*)"([^>]*)', panel):
        if 'fill="none"' not in attributes or "stroke-opacity" in attributes or 'class="limit"' in attributes:
            continue
        color = re.search(r'stroke="(#\w+)"', attributes)
        dashes = re.search(r'stroke-dasharray="([^"]*)"', attributes)
        found[name] = (color[1] if color else "#000000", dashes[1] if dashes else "")
    return found


def check(svg: str) -> None:
    for panel in svg.split('<g class="panel"')[1:]:
        curves = lines(panel)
        assert len(curves) <= 8, f"{len(curves)} curves: {list(curves)}"
        for (a, (color_a, dashes_a)), (b, (color_b, dashes_b)) in itertools.combinations(curves.items(), 2):
            if dashes_a == dashes_b:
                assert difference(color_a, color_b) >= LEAST, f"{a} and {b}: {color_a} {color_b}"


def check_folder(folder: Path) -> None:
    """Checks every figure of a study's results."""
    figures = sorted((folder / "figures").glob("*.svg"))
    assert figures
    for path in figures:
        check(path.read_text())
