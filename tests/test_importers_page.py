"""docs/importers.md agrees with the outcomes of the tests of this session."""

import pytest

import importers


@pytest.mark.whole_matrix
def test_the_page_says_what_was_found(pytestconfig):
    findings = pytestconfig.stash[importers.FINDINGS]
    reason = findings.missing()
    if reason:
        pytest.skip(f"the table needs all of them: {reason}")
    assert importers.split()[1] == findings.table(), "docs/importers.md is out of date: run scripts/update-generated"
