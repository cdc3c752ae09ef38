"""Every variable that can be set acts in some shipped experiment, or says under which other settings it acts."""

import pytest
from fmpy import fmi2

from conftest import NAMES, archive
from fmi import Fmu
from settable import STEPPED, condition, look

# Three minutes of flights, one for each value of each setting.
pytestmark = pytest.mark.tier("studies")


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return look(NAMES, tmp_path_factory.mktemp("settable"))


def test_every_setting_acts_or_speaks(found):
    """It takes a minute, as each of some 800 settings is flown until it acts. Nothing else finds one that does nothing."""
    _, faults = found
    assert faults == [], "\n".join(faults)


def test_model_exchange_says_what_acts_in_co_simulation_only(tmp_path):
    plant = Fmu.open(archive("ReentryPlant"), tmp_path)
    variable = plant.variables["integrator.step"]
    assert condition(variable.description) == STEPPED
    heard = []
    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(lambda *message: heard.append(message[-1].decode()))
    callbacks.allocateMemory, callbacks.freeMemory = fmi2.defaultCallbacks.allocateMemory, fmi2.defaultCallbacks.freeMemory
    model = fmi2.FMU2Model(instanceName="plant", **plant.arguments("modelExchange"))
    model.instantiate(callbacks=callbacks, loggingOn=True)
    model.setReal([variable.valueReference], [0.02])
    model.setupExperiment(startTime=0.0)
    model.enterInitializationMode()
    model.exitInitializationMode()
    model.freeInstance()
    assert "integrator.step has no effect: it is used with co-simulation" in heard
