"""Pages that show files of the repository, for the links to them. Part of the manual's site."""

import html
import posixpath
import shutil
from pathlib import Path

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.transforms.post_transforms import SphinxPostTransform

ROOT = Path(__file__).resolve().parents[2]
# Folders of data of which stage.py has made a page.
MADE = {"docs/claims": "reference/claims"}
# Files that a browser shows itself or hands to another program.
AS_THEY_ARE = {".svg", ".png", ".ipynb"}


class LinkSources(SphinxPostTransform):
    """Replaces links to files and folders that are no pages."""

    default_priority = 8  # before MyST looks for what they name

    def run(self, **options):
        for node in list(self.document.findall(pending_xref)):
            if node["reftype"] != "myst" or node.get("refdomain"):
                continue
            name = posixpath.normpath(posixpath.join(posixpath.dirname(self.env.docname), node["reftarget"].split("#")[0]))
            if name.startswith("..") or not (ROOT / name).exists():
                continue
            if name not in MADE:
                self.env.linked_sources.add(name)
            address = self.app.builder.get_relative_uri(self.env.docname, MADE.get(name) or page_of(name))
            if Path(name).suffix in AS_THEY_ARE:
                address = address.removesuffix(".html")
            node.replace_self(nodes.reference("", "", *node.children, internal=True, refuri=address))


def page_of(name):
    return f"source/{name}" + ("/index" if (ROOT / name).is_dir() else "")


def begin(app):
    app.env.linked_sources = set()


def pages(app):
    """Yields the pages, and those that their folders list."""
    waiting, done = sorted(app.env.linked_sources), set()
    while waiting:
        name = waiting.pop()
        path = ROOT / name
        if name in done:
            continue
        done.add(name)
        if path.is_dir():
            entries = sorted(entry.name for entry in path.iterdir() if entry.is_file())
            waiting += [f"{name}/{entry}" for entry in entries]
            links = "".join(f'<li><a href="{address(entry)}">{html.escape(entry)}</a></li>' for entry in entries)
            body = f"<ul>{links}</ul>"
        elif path.suffix in AS_THEY_ARE:
            copy = Path(app.outdir) / "source" / name
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, copy)
            continue
        else:
            body = shown(app, path)
        title = html.escape(name)
        yield page_of(name), {"title": title, "body": f"<h1><code>{title}</code></h1>{body}"}, "page.html"


def address(entry):
    return html.escape(entry) + ("" if Path(entry).suffix in AS_THEY_ARE else ".html")


def shown(app, path):
    languages = {".rs": "rust", ".py": "python", ".toml": "toml", ".json": "json", "": "bash"}
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return "<p>This is not a text file.</p>"
    language = languages.get(path.suffix, "text")
    if language == "bash" and not text.startswith("#!"):
        language = "text"
    return app.builder.highlighter.highlight_block(text, language)


def setup(app):
    app.add_post_transform(LinkSources)
    app.connect("builder-inited", begin)
    app.connect("html-collect-pages", pages)
    return {"parallel_read_safe": False}
