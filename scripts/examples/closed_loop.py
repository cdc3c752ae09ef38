"""The closed loop of a controller and ReentryPlant, stepped by hand with FMPy. Writes out/closed_loop.csv.

    python scripts/examples/closed_loop.py CRMPC
"""

import argparse
import csv
import math
import shutil
from pathlib import Path

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

FMUS = Path(__file__).absolute().parents[2] / "target" / "fmu"
ATTITUDE = ["attitude.alpha", "attitude.beta", "attitude.sigma"]  # rad
RATE = ["rate.p", "rate.q", "rate.r"]  # rad/s
MOMENT = ["moment.x", "moment.y", "moment.z"]  # N m
REFERENCE = ["reference.alpha", "reference.beta", "reference.sigma"]  # rad


class Instance:
    """An instance of an FMU whose variables, real or integer, are read and set by name."""

    def __init__(self, path, parameters=None):
        description = read_model_description(path)
        self.folder = extract(path)
        self.proposed_step = float(description.defaultExperiment.stepSize)
        self.variables = {variable.name: variable for variable in description.modelVariables}
        self.fmu = FMU2Slave(
            guid=description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=description.modelName,
        )
        self.fmu.instantiate()
        for name, value in (parameters or {}).items():
            self.set([name], [value])
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def get(self, names):
        return self.fmu.getReal([self.variables[name].valueReference for name in names])

    def set(self, names, values):
        set_values = self.fmu.setReal if self.variables[names[0]].type == "Real" else self.fmu.setInteger
        set_values([self.variables[name].valueReference for name in names], values)

    def close(self):
        self.fmu.terminate()
        self.fmu.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)


def simulate(controller, stop=50.0, parameters=None, fmus=FMUS):
    """Steps a loop with these parameters of the plant. Returns time, attitude, rate, moment, reference."""
    plant = Instance(str(fmus / "ReentryPlant.fmu"), parameters)
    law = Instance(str(fmus / f"{controller}.fmu"))
    # A controller that works faster than the plant proposes would see old inputs.
    step = min(plant.proposed_step, law.proposed_step)
    rows = []
    for k in range(round(stop / step)):
        state, reference = plant.get(ATTITUDE + RATE), law.get(REFERENCE)
        # Each instance is set, stepped, and then read: FMI 2.0 forbids reading between setting and
        # stepping. The controller is stepped first, so there is no delay in the loop.
        law.set(ATTITUDE + RATE, state)
        law.fmu.doStep(k * step, step)
        moment = law.get(MOMENT)
        plant.set(MOMENT, moment)
        plant.fmu.doStep(k * step, step)
        rows.append([k * step, *state, *moment, *reference])
    rows.append([stop, *plant.get(ATTITUDE + RATE), *law.get(MOMENT), *law.get(REFERENCE)])
    plant.close()
    law.close()
    return rows


def mean_error(rows):
    """The metric EMS of the papers, in degrees: the root of the mean of
    |attitude - reference|^2 over the instants at which steps begin."""
    squares = [sum((row[1 + i] - row[10 + i]) ** 2 for i in range(3)) for row in rows[:-1]]
    return math.degrees(math.sqrt(sum(squares) / len(squares)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("controller", nargs="?", default="CRMPC", help="name of a controller's FMU [CRMPC]")
    parser.add_argument("--fmus", type=Path, default=FMUS, help="folder of the FMUs [target/fmu]")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the results [out]")
    options = parser.parse_args()
    result = simulate(options.controller, fmus=options.fmus)
    options.out.mkdir(exist_ok=True)
    with open(options.out / "closed_loop.csv", "w", newline="") as file:
        csv.writer(file).writerows([["time", *ATTITUDE, *RATE, *MOMENT, *REFERENCE], *result])
    print(f"{options.controller}: EMS {mean_error(result):.3f} deg; {options.out / 'closed_loop.csv'}")
