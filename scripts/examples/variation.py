"""The closed loop under 20 realisations of the noise. Writes out/variation.csv.

    python scripts/examples/variation.py CRMPC --seeds 20
"""

import csv
import math
import statistics

from closed_loop import arguments, mean_error, simulate

parser = arguments(__doc__)
parser.add_argument("--seeds", type=int, default=20, help="how many [20]")
given = parser.parse_args()

table = []
for seed in range(1, given.seeds + 1):
    rows = simulate(given.controller, given.stop, parameters={"disturbance.seed": seed}, fmus=given.fmus)
    largest_rate = max(math.hypot(*row[4:7]) for row in rows)
    table.append([seed, mean_error(rows), math.degrees(largest_rate)])

given.out.mkdir(exist_ok=True)
with open(given.out / "variation.csv", "w", newline="") as file:
    csv.writer(file).writerows([["seed", "EMS [deg]", "largest rate [deg/s]"], *table])
_, errors, rates = zip(*table)
print(f"{given.controller}, {given.seeds} seeds: EMS {statistics.mean(errors):.3f} deg on average, {max(errors):.3f} deg at most")
print(f"largest rate {max(rates):.3f} deg/s; {given.out / 'variation.csv'}")
