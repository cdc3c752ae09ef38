"""Attitude against its reference, and the moment, of a closed loop. Writes out/closed_loop.png.

    python scripts/examples/plot.py CRMPC
"""

import math

import matplotlib

matplotlib.use("Agg")  # to a file, with no window
import matplotlib.pyplot as plt
from closed_loop import arguments, simulate

given = arguments(__doc__).parse_args()
time, *columns = zip(*simulate(given.controller, given.stop, fmus=given.fmus))
degrees = [[math.degrees(value) for value in column] for column in columns]

figure, (angles, moments) = plt.subplots(2, 1, sharex=True, figsize=(8, 6), layout="constrained")
for i, name in enumerate(["α", "β", "σ"]):
    (line,) = angles.plot(time, degrees[i], label=name)
    angles.plot(time, degrees[9 + i], "--", color=line.get_color(), linewidth=1)
angles.set_ylabel("attitude, dashed: reference [°]")
angles.legend()
for values, name in zip(columns[6:9], ["x", "y", "z"]):
    moments.step(time, [value / 1e3 for value in values], where="post", label=name)
moments.set(xlabel="time [s]", ylabel="moment [kN m]")
moments.legend()
for axes in (angles, moments):
    axes.grid(alpha=0.3)
figure.suptitle(given.controller)
given.out.mkdir(exist_ok=True)
figure.savefig(given.out / "closed_loop.png", dpi=150)
print(given.out / "closed_loop.png")
