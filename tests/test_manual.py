"""The manual as scripts/manual makes it: its chapters, links, search, formulas, and reference."""

import json
import os
import re
import shutil
import subprocess
import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit
from xml.etree import ElementTree

import pytest

from browsing import ARGUMENTS, CHROMIUM, in_chromium
from conftest import NAMES, ROOT, TARGET, tomllib

pytestmark = pytest.mark.tier("manual")


SITE = TARGET / "manual"
CHAPTERS = tomllib.loads((ROOT / "docs" / "site" / "chapters.toml").read_text())["part"]
can_build = pytest.mark.skipif(
    os.name == "nt" or sys.version_info < (3, 11) or not (shutil.which("node") and shutil.which("npm")),
    reason="the manual needs Python 3.11 or later, node and npm",
)


@pytest.fixture(scope="module")
def site():
    done = subprocess.run([ROOT / "scripts" / "manual"], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    return SITE


class Page(HTMLParser):
    """Addresses, anchors and classes of a page."""

    def __init__(self, path: Path):
        super().__init__()
        self.links, self.loaded, self.anchors, self.classes = [], [], set(), []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.anchors |= {found[key] for key in ("id", "name") if found.get(key)}
        self.classes += (found.get("class") or "").split()
        if tag == "a" and found.get("href"):
            self.links.append(found["href"])
        if found.get("src") or (tag == "link" and found.get("rel") in ("stylesheet", "icon")):
            self.loaded.append(found.get("src") or found["href"])


@cache
def page(path: Path) -> Page:
    return Page(path)


def pages(site):
    return [path for path in site.rglob("*.html") if "rust" not in path.relative_to(site).parts]


def test_every_page_has_a_chapter():
    listed = [re.sub(r".*<(.*)>", r"\1", name) for part in CHAPTERS for name in part["pages"]]
    assert len(listed) == len(set(listed))
    written = {f"docs/{path.stem}" for path in (ROOT / "docs").glob("*.md")} - {"docs/index"}
    assert written == {name for name in listed if name.startswith("docs/")}


@can_build
def test_every_link_leads_somewhere(site):
    broken = []
    for path in pages(site):
        for link in page(path).links:
            address = urlsplit(link)
            if address.scheme or address.netloc or link == "#":
                continue
            target = path if not address.path else (path.parent / unquote(address.path)).resolve()
            known = target.is_file() and (target.suffix != ".html" or not address.fragment or unquote(address.fragment) in page(target).anchors)
            if not known:
                broken.append(f"{path.relative_to(site)}: {link}")
    assert not broken


@can_build
def test_the_site_needs_no_network(site):
    for path in pages(site):
        for address in page(path).loaded:
            assert not urlsplit(address).netloc, f"{path}: {address}"
            assert address.startswith("data:") or (path.parent / unquote(urlsplit(address).path)).resolve().is_file(), f"{path}: {address}"
    for style in site.rglob("_static/**/*.css"):
        assert not re.search(r"url\([\"']?https?:|@import", style.read_text(encoding="utf-8")), style


@can_build
def test_every_formula_is_rendered(site):
    formulas = 0
    for path in (ROOT / "docs").glob("*.md"):
        written = len(re.findall(r"^```math$", path.read_text(encoding="utf-8"), re.MULTILINE))
        assert page(site / "docs" / f"{path.stem}.html").classes.count("katex-display") == written, path.name
        formulas += written
    assert formulas >= 40
    assert not [path for path in pages(site) if "katex-error" in page(path).classes]


@can_build
def test_the_reference_has_every_variable_and_every_key(site):
    for name in NAMES:
        [file] = ROOT.glob(f"fmu-*/generated/{name}.xml")
        text = (site / "reference" / "variables" / f"{name}.html").read_text(encoding="utf-8")
        anchors = page(site / "reference" / "variables" / f"{name}.html").anchors
        assert "None" not in text
        for variable in ElementTree.parse(file).getroot().iter("ScalarVariable"):
            if variable.get("causality") in ("input", "output", "parameter"):
                # Of a long vector the table has the first and the last entry.
                stem = re.sub(r"\[[\d,]+\]$", "[", variable.get("name"))
                assert any(anchor.startswith(f"{name}.{stem}") for anchor in anchors), f"{name}.{variable.get('name')}"
    for kind in ("experiment", "study", "campaign"):
        schema = json.loads((ROOT / "orchestrator" / "schema" / f"{kind}.json").read_text())
        tables = {kind: schema, **{f"{kind}.{name}": table for name, table in schema["definitions"].items()}}
        anchors = page(site / "reference" / f"{kind}-keys.html").anchors
        assert {f"{owner}.{key}" for owner, table in tables.items() for key in table.get("properties", {})} <= anchors


def browse(address, profile, *options):
    """The page as Chromium has it when its scripts have run."""
    command = [CHROMIUM, "--headless", *ARGUMENTS, *options, f"--user-data-dir={profile}", "--virtual-time-budget=60000", "--dump-dom", address]
    return subprocess.run(command, capture_output=True, text=True, timeout=300).stdout


@can_build
@in_chromium
@pytest.mark.parametrize(
    "text, place",
    [
        ("guarantee", "docs/guarantee.html"),
        ("k1", "reference/variables/CRMPC.html#CRMPC.feedback.k1"),
        ("EMS", "docs/symbols.html"),
        ("guarantee.rateMargin", "reference/variables/CRMPC.html#CRMPC.guarantee.rateMargin"),
        ("at_most", "reference/campaign-keys.html#campaign.Limit.at_most"),
        ("disk margin", "docs/margins.html"),
    ],
)
def test_the_search_finds(site, text, place, tmp_path):
    """Opened from a file, as a reader without a server does."""
    shown = browse(f"{(site / 'search.html').as_uri()}?q={text.replace(' ', '+')}", tmp_path)
    found = re.findall(r'<a href="([^"]+)"', shown[shown.index('id="search-results"') :])
    assert any(link.startswith(place) for link in found[:4]), found
