"""Restores a unit from a file and continues it in a process of its own.

The arguments are the archive, the folder to unpack to, parameters and recorded inputs (JSON), the
saved state, the first tick and the step. The program prints the outputs at each tick as hexadecimal
floats, so that no digit is lost.
"""

import json
import sys
from pathlib import Path

from fmi import Fmu, Unit


def main() -> None:
    archive, folder, script, saved, first, step = sys.argv[1:]
    script = json.loads(Path(script).read_text())
    unit = Unit(Fmu.open(Path(archive), Path(folder)), script["parameters"], "elsewhere").start()
    unit.restore(Path(saved).read_bytes())
    for tick, inputs in enumerate(script["inputs"], int(first)):
        unit.set(inputs)
        print(json.dumps([float(value).hex() for value in unit.outputs()]))
        unit.step(tick * float(step), float(step))
    unit.close()


if __name__ == "__main__":
    main()
