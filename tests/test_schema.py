"""The JSON Schemas of experiments, studies and campaigns: every file keeps to its own, as it is written and with what it extends."""

import json
import re
import subprocess

import jsonschema
import pytest

from conftest import EXPERIMENTS, ROOT, program, tomllib


FILES = sorted(EXPERIMENTS.parent.glob("*/*.toml"))
WRITTEN = {path: path.read_text(encoding="utf-8") for path in FILES}
STUDIES = [path for path in FILES if path.name == "study.toml"]
CAMPAIGNS = [path for path in FILES if path.parent.name == "campaigns" or path.stem == "campaigns"]
EXPERIMENTS_THERE = [
    path
    for path in FILES
    if path not in CAMPAIGNS and "title" in (table := tomllib.loads(WRITTEN[path])) and "paper" not in table
]


def check(kind: str, text: str) -> None:
    schema = json.loads((ROOT / "orchestrator" / "schema" / f"{kind}.json").read_text(encoding="utf-8"))
    jsonschema.validate(tomllib.loads(text), schema, cls=jsonschema.Draft7Validator)


def named(path) -> str:
    return f"{path.parent.name}/{path.stem}"


@pytest.mark.parametrize("path", EXPERIMENTS_THERE, ids=named)
def test_every_experiment_keeps_to_its_schema_and_names_it(path):
    assert WRITTEN[path].startswith("#:schema ../../schema/experiment.json\n")
    check("experiment", WRITTEN[path])
    shown = subprocess.run([program("orchestrator"), "show", path], capture_output=True, text=True, check=True).stdout
    assert "extends" not in tomllib.loads(shown)
    check("experiment", shown)


@pytest.mark.parametrize("path", STUDIES, ids=named)
def test_every_study_keeps_to_its_schema_and_names_it(path):
    assert WRITTEN[path].startswith("#:schema ../../schema/study.json\n")
    check("study", WRITTEN[path])
    shown = subprocess.run([program("orchestrator"), "show", path], capture_output=True, text=True, check=True).stdout
    assert re.findall(r"^(?:extends|for)\b|^\[+lists\b|\{\w+\}", shown, re.MULTILINE) == []
    check("study", shown)


@pytest.mark.parametrize("path", CAMPAIGNS, ids=named)
def test_every_campaign_keeps_to_its_schema_and_names_it(path):
    assert WRITTEN[path].startswith("#:schema ../../schema/campaign.json\n")
    check("campaign", WRITTEN[path])


@pytest.mark.parametrize(
    ("old", "new"),
    [("[simulation]", "[simulaton]"), ("step = 0.04", 'step = "0.04"'), ("horizon\" = 100", "horizon\" = [100]")],
)
def test_a_fault_is_found_by_the_schema(old, new):
    text = WRITTEN[EXPERIMENTS / "crmpc-robust.toml"]
    assert old in text
    with pytest.raises(jsonschema.ValidationError):
        check("experiment", text.replace(old, new))


def test_every_key_says_what_it_is():
    """The manual's tables of keys have nothing else to say. What another table explains by the same name is explained."""
    schemas = [json.loads(path.read_text(encoding="utf-8")) for path in (ROOT / "orchestrator" / "schema").glob("*.json")]
    tables = [table for schema in schemas for table in (schema, *schema.get("definitions", {}).values())]
    keys = [(name, "description" in key) for table in tables for name, key in table.get("properties", {}).items()]
    explained = {name for name, has in keys if has}
    assert len(keys) >= 100 and [name for name, _ in keys if name not in explained] == []
