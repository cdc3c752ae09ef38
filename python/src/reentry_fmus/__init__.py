"""Re-entry attitude control as FMUs for FMI 2.0, with the orchestrator that steps them.

`fmu` gives the path of an FMU for FMPy or any other importer, `ClosedLoop` connects a controller in
Python to the vehicle, and `experiment` runs a paper's experiment and returns its table. `campaign`
flies thousands of cases of an experiment, and looks for the worst one. `linearise` gives the linear
model of a loop, and `margins` its stability margins. `reproduce` runs a paper's comparison and
judges its claims.
Quantities are in SI units and radians unless `units="deg"` selects degrees.
"""

from ._campaign import Campaign, Flown, Search, campaign
from ._data import browse, experiments, fmu, fmus
from ._experiment import experiment
from ._instance import InstanceError, InstanceWarning
from ._linear import OpenLoop, linearise, margins
from ._loop import ClosedLoop
from ._orchestrator import OrchestratorError, OrchestratorWarning
from ._run import Figure, Run
from ._state import LawError, State
from ._study import Study, reproduce

__all__ = [
    "Campaign",
    "ClosedLoop",
    "Figure",
    "Flown",
    "InstanceError",
    "InstanceWarning",
    "LawError",
    "OpenLoop",
    "OrchestratorError",
    "OrchestratorWarning",
    "Run",
    "Search",
    "State",
    "Study",
    "browse",
    "campaign",
    "experiment",
    "experiments",
    "fmu",
    "fmus",
    "linearise",
    "margins",
    "reproduce",
]
