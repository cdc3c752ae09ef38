"""FMUs run by libcosim: one alone, or several wired by an SSP or OSP system structure. libcosim
steps all instances, then passes values on (Jacobi)."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from libcosimpy.CosimEnums import CosimVariableType
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

OSP = "http://opensimulationplatform.com/MSMI/OSPSystemStructure"
log_output_level(CosimLogLevel.ERROR)


def nanoseconds(step: float) -> int:
    return round(step * 1e9)


def alone(path: Path, step: float, steps: int, names: list[str]) -> np.ndarray:
    execution = CosimExecution.from_step_size(nanoseconds(step))
    execution.add_local_slave(CosimLocalSlave(str(path), "instance"))
    return observed(execution, steps, [("instance", name) for name in names])


def archive(folder: Path, step: float, steps: int, names: list[tuple[str, str]]) -> np.ndarray:
    """Runs an unpacked SSP archive."""
    return observed(CosimExecution.from_ssp_file(str(folder), nanoseconds(step)), steps, names)


def structure(folder: Path, steps: int, names: list[tuple[str, str]]) -> np.ndarray:
    """Runs a folder with an OspSystemStructure.xml."""
    return observed(CosimExecution.from_osp_config_file(str(folder)), steps, names)


def write_structure(folder: Path, step: float, components: dict, connections: list[tuple[str, str, str]]) -> None:
    """Writes OspSystemStructure.xml. Components are given as name: (archive, parameters that are
    numbers), connections as (from, to, variable)."""
    simulators = "".join(
        f'<Simulator name="{name}" source={quoteattr(path.as_uri())} stepSize="{step}"><InitialValues>'
        + "".join(f'<InitialValue variable="{key}"><{kind(value)} value="{value}"/></InitialValue>' for key, value in values.items())
        + "</InitialValues></Simulator>"
        for name, (path, values) in components.items()
    )
    wires = "".join(
        f'<VariableConnection><Variable simulator="{source}" name="{name}"/><Variable simulator="{sink}" name="{name}"/></VariableConnection>'
        for source, sink, name in connections
    )
    (folder / "OspSystemStructure.xml").write_text(
        f'<?xml version="1.0" encoding="UTF-8"?><OspSystemStructure xmlns="{OSP}" version="0.1"><StartTime>0.0</StartTime>'
        f"<BaseStepSize>{step}</BaseStepSize><Algorithm>fixedStep</Algorithm><Simulators>{simulators}</Simulators>"
        f"<Connections>{wires}</Connections></OspSystemStructure>"
    )


def kind(value) -> str:
    return "Integer" if isinstance(value, int) else "Real"


def observed(execution: CosimExecution, steps: int, names: list[tuple[str, str]]) -> np.ndarray:
    """Returns the values of Real variables after each step."""
    observer = CosimObserver.create_last_value()
    assert execution.add_observer(observer)
    indices = {component: execution.slave_index_from_instance_name(component) for component, _ in names}
    known = {
        (component, variable.name.decode()): variable.reference
        for component, index in indices.items()
        for variable in execution.slave_variables(index)
        if variable.type == CosimVariableType.REAL.value
    }
    rows = []
    for _ in range(steps):
        assert execution.step(), "libcosim could not do a step"
        row = {}
        for component, index in indices.items():
            own = [name for name in names if name[0] == component]
            row.update(zip(own, observer.last_real_values(index, [known[name] for name in own])))
        rows.append([row[name] for name in names])
    return np.array(rows)
