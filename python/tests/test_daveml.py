"""Models in DAVE-ML: their check cases, the vehicle's file that follows, and what is refused."""

import math
import sys
from pathlib import Path

import pytest

from reentry_fmus.daveml import Model, grid_of, main

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


HEIGHT = ('<variableDef name="clean lift"', '<variableDef name="height" varID="H_rwy" units="f"/><variableDef name="clean lift"')


def higher(tmp_path, value=""):
    """The glider with a drag that depends on a height."""
    file = changed(tmp_path, HEIGHT[0], HEIGHT[1].replace("/>", f" {value}/>", 1))
    text = file.read_text(encoding="utf-8").partition("<checkData>")[0] + "</DAVEfunc>"
    file.write_text(text.replace("<m:cn>0.05</m:cn>", "<m:ci>H_rwy</m:ci>"), encoding="utf-8")
    return file


def drag(made):
    return tomllib.loads(made.read_text(encoding="utf-8"))["forces"]["drag"]["table"]["values"][0][0]


def test_an_input_without_a_value_is_refused_and_can_be_set(tmp_path, capsys):
    file, made = higher(tmp_path), tmp_path / "vehicle.toml"
    assert main([str(file), "-o", str(made), *CHOICES]) == 2
    assert "H_rwy (height) in f; give --set H_rwy=…" in capsys.readouterr().err
    assert main([str(file), "-o", str(made), *CHOICES, "--set", "H_rwy=0.25"]) == 0
    assert drag(made) == 0.25


@pytest.mark.parametrize(
    ("pair", "named"),
    [("nothing=1", 'no input "nothing"'), ("cl0=1", 'no input "cl0"'), ("alp=1", "is sampled"), ("sref=nan", "no finite number")],
)
def test_a_wrong_setting_is_refused(tmp_path, capsys, pair, named):
    assert main([str(GLIDER), "-o", str(tmp_path / "vehicle.toml"), *CHOICES, "--set", pair]) == 2
    assert named in capsys.readouterr().err


def test_inputs_with_initial_values_are_told(tmp_path, capsys):
    file, made = higher(tmp_path, 'initialValue="0.125"'), tmp_path / "vehicle.toml"
    assert main([str(file), "-o", str(made), *CHOICES]) == 0
    assert "initial value: H_rwy (height) = 0.125 f" in capsys.readouterr().out and drag(made) == 0.125


def test_without_a_moment_point_what_the_model_says_of_it_is_told(tmp_path, capsys):
    place = '<variableDef name="vrsPositionOfMrc_X" varID="XRP" units="fracMAC" initialValue="0.54"/><variableDef name="clean lift"'
    file, made = changed(tmp_path, HEIGHT[0], place), tmp_path / "vehicle.toml"
    assert main([str(file), "-o", str(made), *CHOICES]) == 0
    assert "vrsPositionOfMrc_X = 0.54 fracMAC" in capsys.readouterr().err
    assert main([str(file), "-o", str(made), *CHOICES, "--moment-point", "1", "0", "0"]) == 0
    assert capsys.readouterr().err == ""


def test_names_with_quotes_are_written_as_toml(tmp_path):
    file = changed(tmp_path, "A glider, invented for tests", "models\\new &quot;K&quot;&#10;second line \x7f")
    made = tmp_path / "vehicle.toml"
    assert main([str(file), "-o", str(made), *CHOICES[:4], "--mass", "9000", "--surface", 'a "flap"=dflap']) == 0
    vehicle = tomllib.loads(made.read_text(encoding="utf-8"))
    assert vehicle["title"].startswith('models\\new "K"\nsecond line \x7f, from ')
    assert vehicle["surfaces"]["names"] == ['a "flap"'] and vehicle["surfaces"]["table"][0]["surface"] == 'a "flap"'


def test_the_model_is_not_overwritten(tmp_path, capsys):
    file = changed(tmp_path, "<m:cn>0.05</m:cn>", "<m:cn>0.06</m:cn>")
    before = file.read_bytes()
    assert main([str(file), "-o", str(file), *CHOICES, "--force"]) == 2
    assert "-o names the model itself" in capsys.readouterr().err and file.read_bytes() == before


def test_the_grid_is_by_default_that_of_the_breakpoints(tmp_path, capsys):
    made = tmp_path / "vehicle.toml"
    assert main([str(GLIDER), "-o", str(made), "--mass", "9000"]) == 0
    lift = tomllib.loads(made.read_text(encoding="utf-8"))["forces"]["lift"]["table"]
    assert lift["alpha_deg"] == [0, 10, 20] and lift["mach"] == [0.5, 2]
    # Half-way, the square of the lift is less than the mean by a quarter of the square of its step.
    assert "half-way between grid points drag differs by 0.05 at most, at 5 deg and Mach 0.5" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("old", "named"),
    [
        ('varID="alp" units="deg"', '"alp" (alpha) has the unit "mrad", which cannot be converted to deg'),
        ('varID="qb" units="r_s"', '"qb" (q) has the unit "mrad", which cannot be converted to rad/s'),
        ('varID="dflap" units="deg"', '"dflap" (surface "flap") has the unit "mrad", which cannot be converted to deg'),
    ],
)
def test_a_role_with_an_unknown_unit_is_refused(tmp_path, capsys, old, named):
    file = changed(tmp_path, old, old.rpartition("units")[0] + 'units="mrad"')
    file.write_text(file.read_text(encoding="utf-8").partition("<checkData>")[0] + "</DAVEfunc>", encoding="utf-8")
    assert main([str(file), "-o", str(tmp_path / "vehicle.toml"), *CHOICES]) == 2
    assert named in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "named"),
    [
        ("--alpha=0:40:3", "steps of 3 from 0 do not reach 40"),
        ("--alpha=0,nan", "is not of the form"),
        ("--mach=2,1", "does not increase"),
        ("--mass=nan", "no positive number"),
        ("--mass=-9", "no positive number"),
    ],
)
def test_a_wrong_number_is_refused(capsys, option, named):
    with pytest.raises(SystemExit):
        main([str(GLIDER), option])
    assert named in capsys.readouterr().err


def test_a_range_has_both_ends():
    assert grid_of("-20:20:10") == [-20, -10, 0, 10, 20]
