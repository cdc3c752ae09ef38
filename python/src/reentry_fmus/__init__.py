"""Re-entry attitude control as FMI 2.0 units, with the orchestrator that steps them.

`fmu` gives the path of a unit for FMPy or any other tool, `ClosedLoop` puts a controller in Python
against the vehicle, and `experiment` runs a paper's experiment and returns its table. Quantities
are in SI units and radians unless `units="deg"` asks for degrees.
"""

from ._data import experiments, fmu, units
from ._experiment import Figure, OrchestratorError, OrchestratorWarning, Run, experiment
from ._loop import ClosedLoop, State
from ._unit import UnitError, UnitWarning

__all__ = [
    "ClosedLoop",
    "Figure",
    "OrchestratorError",
    "OrchestratorWarning",
    "Run",
    "State",
    "UnitError",
    "UnitWarning",
    "experiment",
    "experiments",
    "fmu",
    "units",
]
