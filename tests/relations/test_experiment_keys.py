"""A key of an experiment that has no effect beside the others is refused, or a warning says so."""

import pytest

from conftest import EXPERIMENTS, TARGET, call

ORDER = 'order = ["controller", "plant"]'
METRIC = '{{ kind = "{}", signals = "rate", unit = {{ name = "cm", factor = 100.0 }}, {} }}'


def run(folder, *lines, arguments=(), code=0):
    file = folder / "idle.toml"
    file.write_text("\n".join([f"extends = '{EXPERIMENTS / 'lqr.toml'}'", 'title = "Idle"', *lines]), encoding="utf-8")
    command = ["run", file, "--out", folder / "out", "--fmu-dir", TARGET / "fmu", "--stop", "0.4", "--quiet"]
    return call(*command, *arguments, code=code)


@pytest.mark.parametrize(
    ("lines", "arguments", "words"),
    [
        (["[isolation]", "memory = 512"], [], "[isolation] memory has no effect"),
        (["[isolation]", "cpu = 60"], [], "[isolation] cpu has no effect"),
        (["[isolation]", "call_timeout = 5"], [], "[isolation] call_timeout has no effect"),
        (["[simulation]", 'coupling = "jacobi"', ORDER], [], "[simulation] order has no effect"),
        (["[components.plant.parameters]", '"aerodynamics.lift.scale" = 0.9', '"planet.rate" = 0.0'], [], "planet.rate, aerodynamics.lift.scale have no effect: they are used with translation = entry"),
        (["[components.plant.parameters]", '"air.wind.east[1]" = 1e3'], [], "air.wind.east[1] has no effect: it is used with translation = entry and air.rows >= 1"),
    ],
)
def test_a_key_without_effect_is_told(tmp_path, lines, arguments, words):
    finished = run(tmp_path, *lines, arguments=arguments)
    assert words in finished.stderr, finished.stderr


@pytest.mark.parametrize(
    ("kind", "rest"), [("settling", "band = 0.1"), ("leaving", "bound = 1"), ("share", "bound = 1"), ("pulses", ""), ("rises", "")]
)
def test_a_unit_of_what_has_none_is_refused(tmp_path, kind, rest):
    finished = run(tmp_path, "[observe.metrics]", f"new = {METRIC.format(kind, rest).replace(', }', ' }')}", code=2)
    assert "leave unit out" in finished.stderr, finished.stderr


@pytest.mark.parametrize("lines", [["[isolation]", "isolate = true", "memory = 2048"], ["[simulation]", ORDER]])
def test_a_key_with_effect_is_silent(tmp_path, lines):
    finished = run(tmp_path, *lines)
    assert "no effect" not in finished.stderr, finished.stderr
