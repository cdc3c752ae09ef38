"""Restores an instance from a file and continues it in a process of its own.

The arguments are the archive, the folder to unpack to, parameters and recorded inputs (JSON), the
saved state, the first tick and the step. The program prints the outputs at each tick as hexadecimal
floats, so that no digit is lost.
"""

import json
import sys
from pathlib import Path

from fmi import Fmu, Instance


def main() -> None:
    archive, folder, script, saved, first, step = sys.argv[1:]
    script = json.loads(Path(script).read_text())
    instance = Instance(Fmu.open(Path(archive), Path(folder)), script["parameters"], "elsewhere").start()
    instance.restore(Path(saved).read_bytes())
    for tick, inputs in enumerate(script["inputs"], int(first)):
        instance.set(inputs)
        print(json.dumps([float(value).hex() for value in instance.outputs()]))
        instance.step(tick * float(step), float(step))
    instance.close()


if __name__ == "__main__":
    main()
