"""Makes the manual, a site of the pages in docs/, by Sphinx. `scripts/manual` starts it.

The sources of the site are a copy of the repository's pages (`stage.py`), so that nothing is
written beside them. A link to a file of the repository leads to a page that shows it
(`sources.py`).
"""

import os
import re
import sys
import tomllib
from pathlib import Path

from pygments.lexers.special import TextLexer
from sphinxcontrib import katex

SITE = Path(__file__).resolve().parent
ROOT = SITE.parents[1]
sys.path[:0] = [str(SITE), str(ROOT / "python" / "src")]

project = "Re-entry Attitude Control"
html_title = project
author = "Re-entry Attitude Control contributors"
root_doc = "docs/index"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinxcontrib.katex",
    "entries",
    "sources",
]
nitpicky = True
# Names that Python's documentation describes, and the packages whose types are in signatures.
nitpick_ignore_regex = [("py:.*", ".*")]

# Pages: GitHub's Markdown, with its anchors of headings and its formulas.
myst_enable_extensions = ["dollarmath", "attrs_inline"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
myst_dmath_allow_labels = False

# Formulas are rendered while the site is built. A faulty one is an error.
katex_prerender = True
katex_css_path = "katex/katex.min.css"
katex.KATEX_DEFAULT_OPTIONS["throwOnError"] = True

# The package is imported for its docstrings, without the packages that it needs to run.
imported = {
    name
    for file in (ROOT / "python" / "src").rglob("*.py")
    for name in re.findall(r"^\s*(?:import|from) (\w+)", file.read_text(encoding="utf-8"), re.M)
}
autodoc_mock_imports = sorted(imported - sys.stdlib_module_names - {"reentry_fmus"})
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
toc_object_entries = False
# Names in docstrings stand between single backticks.
default_role = "literal"

html_theme = "furo"
html_static_path = [str(SITE / "static"), os.environ["MANUAL_STATIC"]]
html_css_files = ["manual.css"]
templates_path = [str(SITE / "templates")]
html_additional_pages = {"index": "home.html"}
html_use_index = False
html_show_copyright = False
html_copy_source = False
html_show_sphinx = False
# Opened from a file, the site cannot read the pages for excerpts: it finds pages and sections.
html_show_search_summary = False
html_search_scorer = str(SITE / "scorer.js")
html_theme_options = {"navigation_with_keys": True}
# A block without a language is text.
highlight_language = "text"
pygments_style = "a11y-high-contrast-light"
pygments_dark_style = "a11y-high-contrast-dark"


def add_chapters(app, docname, source):
    """Puts the chapters below the front page, which is plain Markdown."""
    if docname == root_doc:
        if "MANUAL_TRY" in os.environ:
            first, rest = source[0].split("\n\n", 1)
            link = '<p><a href="../try.html"><strong>Drag a setting and see the flight and its guarantee</strong></a></p>'
            source[0] = f"{first}\n\n{link}\n\n{rest}"
        for part in tomllib.loads((SITE / "chapters.toml").read_text(encoding="utf-8"))["part"]:
            # Paths begin at the root of the pages, also in brackets behind a title.
            pages = "\n".join(re.sub(r"^([^<]*<)?(?=[^<]*$)", r"\g<0>/", page) for page in part["pages"])
            source[0] += f"\n```{{toctree}}\n:hidden:\n:caption: {part['title']}\n\n{pages}\n```\n"


def setup(app):
    app.connect("source-read", add_chapters)
    for language in ("csv", "bat"):
        app.add_lexer(language, TextLexer)
