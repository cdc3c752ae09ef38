"""The pages about the package, and the examples in its docstrings, are true."""

import contextlib
import doctest
import importlib
import io
import pkgutil
import re

import pytest
import reentry_fmus
from conftest import PAGES, ROOT


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_page_prints_what_it_says(page, tmp_path, monkeypatch):
    """The whole of docs/python.md takes half a minute, campaigns and all: readers begin by copying these lines."""
    monkeypatch.chdir(tmp_path)
    text = page.read_text(encoding="utf-8")
    # A block of Python, and what it prints if the page says so at once.
    blocks = re.findall(r"```python\n(.*?)```(?:\n\n```text\n(.*?)```)?", text, re.DOTALL)
    # Blocks that read the FMUs of a build are run by tests/test_snippets.py.
    blocks = [(code, said) for code, said in blocks if "target/fmu" not in code]
    assert len(blocks) >= PAGES[page]
    names: dict[str, object] = {}
    for code, said in blocks:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, str(page), "exec"), names)
        assert printed.getvalue() == said


def test_the_docstrings_examples_hold():
    tried = 0
    for module in pkgutil.iter_modules(reentry_fmus.__path__, "reentry_fmus."):
        result = doctest.testmod(importlib.import_module(module.name))
        assert result.failed == 0, module.name
        tried += result.attempted
    assert tried >= 15


def test_everything_public_has_a_docstring():
    for name in reentry_fmus.__all__:
        assert getattr(reentry_fmus, name).__doc__, name


def test_the_page_opens_where_the_package_has_it(monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    try:
        page = reentry_fmus.browse()
    except FileNotFoundError as error:
        assert "without the page" in str(error) and not opened
    else:
        assert opened == [page.as_uri()] and "CRMPC" in page.read_text(encoding="utf-8")
