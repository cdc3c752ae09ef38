"""Parameters in SSP archives of other tools: mappings, parameters and connectors of systems, their
precedence, and what is left out or refused. The expected values follow from SSP 1.0.1, sections 4.5.2,
5.3 and 7."""

import json
import math
import zipfile

import pytest

from conftest import archive, results
from test_ssp import run

LAW = '<Component name="law" source="resources/LQR.fmu">{}</Component>'
BODY = '<Component name="body" source="resources/ReentryPlant.fmu">{}</Component>'
SSD = """<?xml version="1.0" encoding="UTF-8"?>
<SystemStructureDescription xmlns="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:c="http://ssp-standard.org/SSP1/SystemStructureCommon" xmlns:v="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
    xmlns:m="http://ssp-standard.org/SSP1/SystemStructureParameterMapping" name="x" version="1.0">
  <System name="outer">{system}</System>
  <Units><c:Unit name="deg"><c:BaseUnit rad="1" factor="0.017453292519943295"/></c:Unit>
    <c:Unit name="rad"><c:BaseUnit rad="1"/></c:Unit><c:Unit name="mrad"><c:BaseUnit rad="1" factor="0.001"/></c:Unit></Units>
  <DefaultExperiment startTime="0" stopTime="0.08"/>
</SystemStructureDescription>"""


def values(text: str) -> str:
    """A parameter set of lines such as `gain Real 2 deg`."""
    parameters = ""
    for line in filter(None, map(str.strip, text.splitlines())):
        name, kind, value, *unit = line.split()
        unit = f' unit="{unit[0]}"' if unit else ""
        parameters += f'<v:Parameter name="{name}"><v:{kind} value="{value}"{unit}/></v:Parameter>'
    return f'<v:ParameterSet xmlns:v="v" version="1.0" name="set"><v:Parameters>{parameters}</v:Parameters></v:ParameterSet>'


def mapping(text: str) -> str:
    """A parameter mapping of lines such as `source target <transformation/>`."""
    entries = ""
    for line in filter(None, map(str.strip, text.splitlines())):
        source, target, *transformation = line.split(maxsplit=2)
        entries += f'<m:MappingEntry source="{source}" target="{target}">{"".join(transformation)}</m:MappingEntry>'
    return f'<m:ParameterMapping xmlns:m="m" xmlns:c="c" version="1.0">{entries}</m:ParameterMapping>'


def bound(text: str, mapped: str = "", prefix: str = "") -> str:
    """A binding with its values and its mapping in itself."""
    mapped = mapped and f"<ParameterMapping>{mapping(mapped)}</ParameterMapping>"
    return f'<ParameterBinding prefix="{prefix}"><ParameterValues>{values(text)}</ParameterValues>{mapped}</ParameterBinding>'


def bindings(*each: str) -> str:
    return f"<ParameterBindings>{''.join(each)}</ParameterBindings>"


def elements(*each: str) -> str:
    return f"<Elements>{''.join(each)}</Elements>"


def connectors(**kinds: str) -> str:
    """Connectors of a system by name, each with its kind and perhaps a unit."""
    each = ""
    for name, kind in kinds.items():
        kind, *unit = kind.split()
        each += f'<Connector name="{name}" kind="{kind}"><c:Real{f" unit={chr(34)}{unit[0]}{chr(34)}" if unit else ""}/></Connector>'
    return f"<Connectors>{each}</Connectors>"


def connected(*lines: str) -> str:
    """Connections of lines such as `element.connector connector <transformation/>`; the first dot ends the
    element's name, a leading dot means the system itself."""
    each = ""
    for line in lines:
        start, end, *transformation = line.split(maxsplit=2)
        sides = ""
        for side, (element, connector) in (("start", start.split(".", 1)), ("end", end.split(".", 1))):
            sides += f' {side}Element="{element}"' * bool(element) + f' {side}Connector="{connector}"'
        each += f"<Connection{sides}>{''.join(transformation)}</Connection>"
    return f"<Connections>{each}</Connections>"


def packed(folder, system: str, **files: str):
    """Writes an archive of this system with the two FMUs and more files."""
    path = folder / "x.ssp"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("SystemStructure.ssd", SSD.format(system=system))
        for name, content in files.items():
            file.writestr(name.replace("_", "."), content)
        for name in ("LQR", "ReentryPlant"):
            file.write(archive(name), f"resources/{name}.fmu")
    return path


def parameters(folder, system: str, **files: str) -> tuple[dict, str]:
    """Runs an archive. Returns the values that it sets, by component, and what was printed."""
    finished = run(packed(folder, system, **files), folder / "out", "--step", "0.04")
    return given(folder / "out"), finished.stderr


def given(out) -> dict:
    components = json.loads((out / "results.json").read_text())["components"]
    return {name: component["set"] for name, component in components.items()}


def refusal(folder, system: str, **files: str) -> str:
    finished = run(packed(folder, system, **files), folder / "out", "--step", "0.04", code=2)
    assert finished.stderr.count("\n") == 1 and not (folder / "out").exists()
    return finished.stderr


TABLE = "<c:{0}MappingTransformation><c:MapEntry source='{1}' target='{2}'/></c:{0}MappingTransformation>"
MAPPED = """
  angle Real 2 deg
  plain Real 0.25
  seed Integer 3
  on Boolean true
  kind Enumeration off
  profile Enumeration sine
"""


@pytest.mark.parametrize("place", ["component", "system", "file"])
def test_oracle_a_mapping_renames_and_transforms(place, tmp_path):
    entries = """
      angle {}initial.alpha
      angle {}initial.beta <c:LinearTransformation factor="3" offset="0.5"/>
      plain {}initial.sigma <c:LinearTransformation offset="0.5"/>
      seed {}disturbance.seed <c:IntegerMappingTransformation><c:MapEntry source="3" target="7"/></c:IntegerMappingTransformation>
      kind {}disturbance.kind <c:EnumerationMappingTransformation><c:MapEntry source="off" target="none"/></c:EnumerationMappingTransformation>
    """
    if place == "component":
        system = elements(BODY.format(bindings(bound(MAPPED, entries.replace("{}", "")))))
        found, said = parameters(tmp_path, system)
    elif place == "system":
        system = bindings(bound(MAPPED, entries.replace("{}", "body."))) + elements(BODY.format(""))
        found, said = parameters(tmp_path, system)
    else:
        binding = '<ParameterBinding source="set.ssv"><ParameterMapping source="map.ssm"/></ParameterBinding>'
        files = {"set_ssv": values(MAPPED), "map_ssm": mapping(entries.replace("{}", ""))}
        found, said = parameters(tmp_path, elements(BODY.format(bindings(binding))), **files)
    # What has no entry, such as profile, is not applied, and nothing is said about it.
    assert "left out" not in said
    assert found["body"] == {
        "initial.alpha": pytest.approx(math.radians(2), rel=1e-15),
        # The unit is converted first.
        "initial.beta": pytest.approx(3 * math.radians(2) + 0.5, rel=1e-15),
        "initial.sigma": 0.75,
        "disturbance.seed": 7,
        "disturbance.kind": "none",
    }


def test_oracle_a_mapping_keeps_what_its_table_does_not_name(tmp_path):
    entries = f"""
      seed disturbance.seed {TABLE.format("Integer", 4, 7)}
      number disturbance.kind {TABLE.format("Integer", 9, 3)}
    """
    text = "seed Integer 3\n number Integer 9"
    found, _ = parameters(tmp_path, elements(BODY.format(bindings(bound(text, entries)))))
    # An enumeration may be given by its number.
    assert found["body"] == {"disturbance.seed": 3, "disturbance.kind": "constant"}


@pytest.mark.parametrize(("source", "target", "set_to"), [("1", "0", False), ("0", "0", True)])
def test_oracle_a_mapping_transforms_truth_values(source, target, set_to, tmp_path):
    table = TABLE.format("Boolean", source, target)
    found, _ = parameters(tmp_path, elements(LAW.format(bindings(bound("on Boolean true", f"on saturation {table}")))))
    assert found["law"] == {"saturation": set_to}


def test_a_mapping_may_suppress_the_conversion_of_units(tmp_path):
    system = elements(BODY.format(bindings(bound("angle Real 2 deg", 'angle initial.alpha <c:LinearTransformation factor="0.1"/>'))))
    system = system.replace("<m:MappingEntry ", '<m:MappingEntry suppressUnitConversion="true" ')
    assert parameters(tmp_path, system)[0]["body"] == {"initial.alpha": pytest.approx(0.2, rel=1e-15)}


def test_a_prefix_precedes_the_names_before_they_are_mapped(tmp_path):
    text = "delay Real 0.1\n seed Integer 5"
    system = bindings(
        bound("delay Real 0.02", prefix="law."),
        bound(text, "p.seed body.disturbance.seed", prefix="p."),
    )
    found, said = parameters(tmp_path, system + elements(LAW.format(""), BODY.format("")))
    assert found == {"law": {"delay": 0.02}, "body": {"disturbance.seed": 5}} and "left out" not in said


def nested(inner: str = "", outer: str = "", component: str = "") -> str:
    subsystem = f'<System name="vehicle">{inner}{elements(BODY.format(component))}</System>'
    return outer + elements(subsystem, LAW.format(""))


def test_outer_bindings_override_inner_ones_and_later_ones_earlier_ones(tmp_path):
    system = nested(
        component=bindings(bound("initial.alpha Real 1\n initial.beta Real 1"), bound("initial.sigma Real 1\n initial.alpha Real 2")),
        inner=bindings(bound("body.initial.beta Real 0.3\n body.disturbance.seed Integer 3")),
        outer=bindings(
            bound("vehicle.body.disturbance.seed Integer 4"), bound("vehicle.body.disturbance.seed Integer 5\n law.delay Real 0.1")
        ),
    )
    found, _ = parameters(tmp_path, system)
    assert found["vehicle/body"] == {"initial.alpha": 2.0, "initial.beta": 0.3, "initial.sigma": 1.0, "disturbance.seed": 5}
    assert found["law"] == {"delay": 0.1}


def test_oracle_connectors_of_systems_pass_values_on(tmp_path):
    inner = connectors(start="parameter mrad", roll="input", plain="parameter") + connected(
        '.start body.initial.alpha <c:LinearTransformation factor="2"/>',
        ".roll body.moment.x",
        # The direction follows from the kinds of the connectors, not from the order.
        "body.initial.sigma .plain",
    )
    # An empty name of an element means the system itself.
    inner = inner.replace('<Connection startConnector="roll"', '<Connection startElement="" startConnector="roll"')
    assert 'startElement=""' in inner
    outer = connectors(angle="parameter deg", torque="input", unused="parameter") + bindings(
        bound("angle Real 0.5 rad\n torque Real 3\n vehicle.plain Real 4 [deg]\n vehicle.body.initial.alpha Real 9")
    )
    links = connected('.angle vehicle.start <c:LinearTransformation offset="1"/>', ".torque vehicle.roll", ".unused law.delay")
    system = f'{outer}{elements(f"""<System name="vehicle">{inner}{elements(BODY.format(""))}</System>""", LAW.format(bindings(bound("delay Real 0.1"))))}{links}'
    found, said = parameters(tmp_path, system)
    # 0.5 rad = 500 mrad; plus 1 mrad; then doubled in rad. A value that is passed on counts more than one
    # of the variable itself, and a connector without a value passes nothing on.
    assert found["vehicle/body"] == {
        "initial.alpha": pytest.approx(2 * 0.501, rel=1e-14),
        "moment.x": 3.0,
        "initial.sigma": pytest.approx(math.radians(4), rel=1e-14),
    }
    assert found["law"] == {"delay": 0.1} and "left out" not in said


def test_values_of_connectors_of_inner_systems_yield_to_those_passed_from_outside(tmp_path):
    inner = bindings(bound("start Real 1\n second Real 0.5")) + connectors(start="parameter", second="parameter")
    inner += connected(".start body.initial.alpha", ".second body.initial.beta")
    system = f'<System name="vehicle">{inner}{elements(BODY.format(""))}</System>'
    outer = bindings(bound("angle Real 3")) + connectors(angle="parameter")
    found, _ = parameters(tmp_path, outer + elements(system) + connected(".angle vehicle.start"))
    assert found["vehicle/body"] == {"initial.alpha": 3.0, "initial.beta": 0.5}


def test_a_value_for_a_connected_input_is_only_its_start(tmp_path):
    system = elements(LAW.format(bindings(bound("attitude.alpha Real 0.3\n rate.p Real 0.1"))), BODY.format(""))
    found, _ = parameters(tmp_path, system + connected("body.attitude.alpha law.attitude.alpha"))
    assert found["law"] == {"rate.p": 0.1}


def test_connections_from_end_to_start_are_turned_by_their_kinds(tmp_path):
    system = elements(LAW.format(""), BODY.format(""))
    text = connected("body.moment.x law.moment.x <c:LinearTransformation factor='4'/>", "law.attitude.alpha body.attitude.alpha")
    run(packed(tmp_path, system + text), tmp_path / "out", "--step", "0.04")
    row = results(tmp_path / "out").iloc[0]
    assert row["body.moment.x"] == 4 * row["law.moment.x"] != 0 and row["law.attitude.alpha"] == row["body.attitude.alpha"]


def test_values_without_a_variable_are_left_out_with_a_warning(tmp_path):
    many = "".join(f"other{k} Real 1\n" for k in range(6))
    system = bindings(bound("lau.delay Real 1\n" + many)) + elements(LAW.format(bindings(bound("delai Real 1\n delay Real 0.1"))), BODY.format(""))
    found, said = parameters(tmp_path, system)
    assert found == {"law": {"delay": 0.1}, "body": {}}
    said = said[: said.index("\n")]
    assert "law.delai, lau.delay, other0" in said and said.endswith("and 3 more")


def test_archives_with_backslashes_are_read(tmp_path):
    path = packed(tmp_path, bindings(r'<ParameterBinding source="sets\set.ssv"/>') + elements(LAW.format("")).replace("resources/", "resources\\"))
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(tmp_path / "y.ssp", "w") as new:
        for entry in old.namelist():
            new.writestr(entry.replace("/", "\\"), old.read(entry))
        new.writestr("sets\\set.ssv", values("law.delay Real 0.1"))
    run(tmp_path / "y.ssp", tmp_path / "out", "--step", "0.04")
    assert given(tmp_path / "out")["law"] == {"delay": 0.1}
    with zipfile.ZipFile(tmp_path / "z.ssp", "w") as bad:
        bad.writestr("..\\evil", b"")
    assert "leads out" in run(tmp_path / "z.ssp", tmp_path / "out", code=2).stderr


@pytest.mark.parametrize(
    ("system", "said"),
    [
        (elements('<Component name="a" source="resources/LQR.fmu" implementation="ModelExchange"/>'), 'LQR.fmu offers no model exchange'),
        (elements('<Component name="a" source="x.ssp" type="application/x-ssp-package"/>'), "as a System within this one"),
        (elements('<System name="a"/>'), "has no component that could be run"),
        (elements('<Component name="a" source=""/>'), "has no FMU: put one into the archive"),
        (elements('<SignalDictionaryReference name="bus" dictionary="d"/>'), "connect the components with one another"),
        (bindings('<ParameterBinding source="a.ssv" sourceBase="component"/>'), "leave out sourceBase"),
        (bindings('<ParameterBinding source="a.csv" type="text/csv"/>'), "write them as SSV and SSM files"),
        (bindings('<ParameterBinding source="a.ssv"/>') + elements(LAW.format("")), "a.ssv: No such file"),
        (bindings("<ParameterBinding/>"), "the parameters of the system: there is a ParameterBinding without values"),
        (elements(LAW.format(bindings(bound("a Real 1").replace("</ParameterBinding>", "<ParameterMapping/></ParameterBinding>")))), "empty ParameterMapping"),
        (elements(LAW.format(bindings(bound("a Real 1", f"a delay {TABLE.format('Integer', 1, 2)}")))), "1.0 is not of the type"),
        (elements(LAW.format(bindings(bound("a Real 1", f"a delay {TABLE.format('Integer', 1, 'x')}")))), '"x" is not a valid integer'),
        (elements(LAW.format(bindings(bound("a Boolean 1", "a saturation <c:LinearTransformation factor='2'/>")))), "no number to be scaled"),
        (elements(LAW.format(bindings(bound("delay Binary 00")))), "type Binary is not supported: leave the parameter out"),
        (elements(LAW.format(bindings(bound("limit.rate Real 1 deg")))), "measure different quantities"),
        (
            elements(LAW.format(""), BODY.format("")) + connected(f"law.moment.x body.moment.x {TABLE.format('Integer', 1, 2)}"),
            "supported for parameters only",
        ),
        (
            connectors(a="parameter", b="parameter") + elements(LAW.format("")) + connected(".a law.delay", ".b law.delay"),
            "law.delay is connected twice",
        ),
    ],
)
def test_refusals_say_what_to_do(system, said, tmp_path):
    assert said in refusal(tmp_path, system)
