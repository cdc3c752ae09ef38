"""Models in DAVE-ML: their check cases, the vehicle's file that follows, and what is refused."""

import math
import sys
from pathlib import Path

import pytest

from reentry_fmus.daveml import Model, main

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

GLIDER = Path(__file__).with_name("glider.dml")
CHOICES = ["--alpha", "0:20:5", "--mach", "0.5,2", "--surface", "flap=dflap", "--mass", "9000"]


def test_the_check_cases_are_kept(capsys):
    assert main([str(GLIDER), "--check"]) == 0
    text = capsys.readouterr().out
    assert "5 values of 1 check cases, 0 of them wrong" in text
    assert "ok      supersonic: totalCoefficientOfLift = 0.45" in text


def test_a_wrong_check_case_is_named_and_converts_nothing(tmp_path, capsys):
    wrong, made = tmp_path / "wrong.dml", tmp_path / "vehicle.toml"
    wrong.write_text(GLIDER.read_text(encoding="utf-8").replace("<signalValue>0.45<", "<signalValue>0.46<"), encoding="utf-8")
    assert main([str(wrong), "-o", str(made), *CHOICES]) == 1
    assert "WRONG   supersonic: totalCoefficientOfLift = 0.45" in capsys.readouterr().out
    assert not made.exists()


def test_oracle_the_vehicle_has_the_coefficients_of_the_model(tmp_path):
    made = tmp_path / "vehicle.toml"
    assert main([str(GLIDER), "-o", str(made), *CHOICES]) == 0
    vehicle = tomllib.loads(made.read_text(encoding="utf-8"))
    assert vehicle["reference"]["area"]["square_metres"] == pytest.approx(300 * 0.3048**2)
    lift = vehicle["forces"]["lift"]["table"]
    assert lift["alpha_deg"] == [0, 5, 10, 15, 20] and lift["mach"] == [0.5, 2]
    assert lift["values"] == [[0, 0.25, 0.5, 0.65, 0.8], [0, 0.2, 0.4, 0.5, 0.6]]
    moments = vehicle["moments"]
    beta = math.radians(2)
    assert vehicle["forces"]["side"]["table"]["values"][0][0] == pytest.approx(-0.5)
    assert moments["roll_by_sideslip"]["table"]["values"][1][2] == pytest.approx(-math.sin(beta) / beta)
    assert moments["pitch_damping"]["table"]["values"][0][0] == pytest.approx(-0.6)
    assert "roll" not in moments and vehicle["surfaces"]["min_deg"] == [-20]
    (table,) = vehicle["surfaces"]["table"]
    assert (table["surface"], table["axis"]) == ("flap", "pitch")
    at = table["deflection_deg"].index
    assert table["values"][at(30)] == [[pytest.approx(-0.06)] * 5] * 2
    # The effect of a negative deflection is halved from Mach 1 on.
    assert table["values"][at(-20)] == [[pytest.approx(0.04)] * 5, [pytest.approx(0.02)] * 5]
    assert table["values"][at(0)] == [[0] * 5] * 2


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("<griddedTableRef gtID=\"CL_TABLE\"/>", "<ungriddedTableRef utID=\"X\"/>", "<ungriddedTableRef>"),
        ("</DAVEfunc>", "<ungriddedTableDef/></DAVEfunc>", "<ungriddedTableDef>"),
        ("<m:sin/>", "<m:int/>", '"int" is not supported'),
        ("0.8, 0.6</dataTable>", "0.8</dataTable>", "5 values"),
        ("<m:ci>deff</m:ci>", "<m:ci>nothing</m:ci>", '"nothing"'),
        ("<m:cn>0.5</m:cn><m:ci>dflap</m:ci>", "<m:ci>deff</m:ci>", "depends on itself"),
        ("units=\"rad\" initialValue=\"0\"", "units=\"rad\" initialValue=\"none\"", '"none" is no number'),
        ("</function>", "</functions>", "mismatched tag"),
    ],
)
def test_a_fault_is_refused_with_its_line(tmp_path, capsys, old, new, named):
    text = GLIDER.read_text(encoding="utf-8")
    assert old in text
    wrong = tmp_path / "wrong.dml"
    wrong.write_text(text.replace(old, new), encoding="utf-8")
    assert main([str(wrong), "--check"]) == 2
    message = capsys.readouterr().err
    assert named in message and "line " in message


def test_units_of_signals_are_converted():
    assert Model(GLIDER).check()[4].value == pytest.approx(math.atan2(math.radians(2), 2))


def changed(tmp_path, old, new):
    """The glider with another text."""
    text, file = GLIDER.read_text(encoding="utf-8"), tmp_path / "changed.dml"
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")
    return file


def test_tolerances_have_the_unit_of_their_signal(tmp_path, capsys):
    signal = "<signal><varID>bet</varID><signalUnits>deg</signalUnits><signalValue>2.5</signalValue><tol>0.1</tol></signal>"
    file = changed(tmp_path, "<checkOutputs>", f"<checkOutputs>{signal}")
    assert main([str(file), "--check"]) == 1
    assert "WRONG   supersonic: bet" in capsys.readouterr().out


def test_a_unit_of_a_signal_that_cannot_be_converted_is_refused(tmp_path, capsys):
    file = changed(tmp_path, "<signalUnits>f_s</signalUnits>", "<signalUnits>mrad</signalUnits>")
    assert main([str(file), "--check"]) == 2
    assert '"trueAirspeed" has the unit "mrad", which cannot be converted to "f_s"' in capsys.readouterr().err


def test_a_quotient_is_a_real_division(tmp_path):
    file = changed(tmp_path, "<m:cn>0.05</m:cn>", "<m:apply><m:quotient/><m:cn>6</m:cn><m:cn>5</m:cn></m:apply>")
    assert Model(file).evaluate({"cl0": 0.0})("CD") == pytest.approx(1.2)
