"""Re-entry attitude control as FMI 2.0 units, with the orchestrator that steps them.

`fmu` gives the path of a unit for FMPy or any other tool, `ClosedLoop` puts a controller in Python
against the vehicle, and `experiment` runs a paper's experiment and returns its table. `campaign`
flies thousands of cases of an experiment, on this machine or on a cluster (`reentry_fmus.cluster`),
and `falsify` looks for the worst. Quantities are in SI units and radians unless `units="deg"` asks
for degrees.
"""

from ._campaign import Campaign, Flown, Search, campaign, falsify
from ._data import experiments, fmu, units
from ._experiment import Figure, OrchestratorError, OrchestratorWarning, Run, experiment
from ._loop import ClosedLoop, State
from ._unit import UnitError, UnitWarning

__all__ = [
    "Campaign",
    "ClosedLoop",
    "Figure",
    "Flown",
    "OrchestratorError",
    "OrchestratorWarning",
    "Run",
    "Search",
    "State",
    "UnitError",
    "UnitWarning",
    "campaign",
    "experiment",
    "experiments",
    "falsify",
    "fmu",
    "units",
]
