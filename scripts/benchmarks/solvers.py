"""Times of CRMPC's optimisations over the 50 s scenario of Chai 2022: our solver, CasADi with
IPOPT, CasADi's sqpmethod, QOCO.

All solvers get the same samples. IPOPT and sqpmethod solve the nonlinear problem as it is (multiple
shooting, exact derivatives, warm-started with the previous plan, shifted). QOCO solves the cone
problem of our cone solver's last pass, with its data updated in place. The program ends with an error
if a cost differs from ours by more than SAME_COST: the problem would not be the same. Only the solve
calls are timed; ours include the preview of the references, the
linearisation and the certificate. The fastest repetition of each sample counts, as other load on
the machine can only add time. This is no test: times differ from machine to machine, so only the
ratios of one run count.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from scipy import sparse

import nlp
from conftest import ROOT, TARGET
from samples import SCALE, H, N, Sample, hessian, taken, target

OURS = ["shortcuts, riccati", "riccati", "cone"]
# Largest relative difference of two costs of the same problem.
SAME_COST = 1e-6
# Time in seconds that another solver may take for one constraint set before it gets every k-th
# sample only.
PATIENCE = 60.0


def pieces(kind: str) -> ca.Function:
    """The two norm constraints of a stage as (theta, x_omega, a) -> the vectors y of rates and of input, not
    yet divided by their bounds.

    W = R^-1 is used in closed form, so that the expressions are as short as ours: m = I (W a +
    (dW/dt) x_omega) + omega x I omega.
    """
    angles, rates, a = (ca.SX.sym(name, 3) for name in ("angles", "rates", "a"))
    sa, ca_, sb, cb = ca.sin(angles[0]), ca.cos(angles[0]), ca.sin(angles[1]), ca.cos(angles[1])
    w = ca.vertcat(
        ca.horzcat(-ca_ * sb * cb, sa, -ca_ * cb),
        ca.horzcat(cb * cb, 0.0, -sb),
        ca.horzcat(-sa * sb * cb, -ca_, -sa * cb),
    )
    w_dot = ca.reshape(ca.jtimes(ca.reshape(w, 9, 1), angles, rates), 3, 3)
    inertia = ca.DM(nlp.INERTIA)
    omega = ca.mtimes(w, rates)
    m = ca.mtimes(inertia, ca.mtimes(w, a) + ca.mtimes(w_dot, rates)) + ca.cross(omega, ca.mtimes(inertia, omega))
    u = ca.mtimes(nlp.kinematics(angles), ca.mtimes(ca.inv(inertia), m))
    check = ca.Function("check", [angles, rates, a], [u - (a - nlp.drift_function()(angles, rates))])
    assert np.abs(np.array(check([0.2, -0.1, 0.3], [0.05, 0.02, -0.04], [0.03, -0.02, 0.01]))).max() < 1e-12
    return ca.Function("norm_constraints", [angles, rates, a], [rates, u] if kind == "paper" else [omega, m])


class Casadi:
    """The nonlinear problem with start, references and bounds as its parameters. Weights, and whether
    there is a terminal set, are those of the first sample."""

    def __init__(self, sample: Sample, plugin: str, options: dict):
        norm_constraints = pieces(sample.kind)
        x, a = ca.SX.sym("x", 6, N + 1), ca.SX.sym("a", 3, N)
        start, references = ca.SX.sym("start", 6), ca.SX.sym("references", 9, N + 1)
        bounds, radius = ca.SX.sym("bounds", 2 * N), ca.SX.sym("radius")
        w, v, g = (ca.DM(weight) for weight in sample.weights)
        cost = 0.0
        equal, below_one = [x[:, 0] - start], []
        for k in range(N):
            cost += ca.bilin(w, x[:, k] - references[:6, k]) + ca.bilin(v, a[:, k] - references[6:, k])
            angles, rates = x[:3, k], x[3:, k]
            equal += [x[:3, k + 1] - (angles + H * rates + 0.5 * H * H * a[:, k]), x[3:, k + 1] - (rates + H * a[:, k])]
            after, _ = norm_constraints(x[:3, k + 1], x[3:, k + 1], np.zeros(3))
            _, moment = norm_constraints(angles, rates, a[:, k])
            below_one += [ca.sumsqr(after / bounds[k]), ca.sumsqr(moment / bounds[N + k])]
        terminal = ca.bilin(g, x[:, N] - references[:6, N])
        if sample.bounds.terminal is not None:
            below_one.append(terminal / radius**2)
        equalities, inequalities = ca.vertcat(*equal), ca.vertcat(*below_one)
        problem = {
            "x": ca.veccat(x, a),
            "f": SCALE * (cost + terminal),
            "g": ca.vertcat(equalities, inequalities),
            "p": ca.veccat(start, references, bounds, radius),
        }
        self.solver = ca.nlpsol("solver", plugin, problem, {"print_time": False, "error_on_fail": False, **options})
        self.lower = ca.DM(np.concatenate([np.zeros(equalities.numel()), np.full(inequalities.numel(), -np.inf)]))
        self.upper = ca.DM(np.concatenate([np.zeros(equalities.numel()), np.ones(inequalities.numel())]))

    def solve(self, sample: Sample) -> tuple[float, int, float | None]:
        """Returns seconds, iterations and cost; the cost is None if the solver failed."""
        bounds = sample.bounds
        parameters = ca.DM(
            np.concatenate([sample.start, sample.references.ravel(), bounds.stages.ravel(), [bounds.terminal or 1.0]])
        )
        guess = ca.DM(sample.guess)
        begin = time.perf_counter()
        solution = self.solver(x0=guess, p=parameters, lbg=self.lower, ubg=self.upper)
        seconds = time.perf_counter() - begin
        stats = self.solver.stats()
        return seconds, stats["iter_count"], float(solution["f"]) / SCALE if stats["success"] else None


class Qoco:
    """The cone problem of the last pass of our cone solver."""

    def __init__(self, sample: Sample):
        norm_constraints = pieces(sample.kind)
        arguments = [ca.SX.sym(name, 3) for name in ("angles", "rates", "a")]
        rate, moment = norm_constraints(*arguments)
        point = ca.vertcat(*arguments)
        values = [rate, ca.jacobian(rate, point), moment, ca.jacobian(moment, point)]
        self.norm_constraints = ca.Function("linear", arguments, [ca.densify(value) for value in values]).map(N + 1)
        self.p = hessian(sample)
        e, b = sparse.eye(6), np.vstack([0.5 * H * H * np.eye(3), H * np.eye(3)])
        step = np.block([[np.eye(3), H * np.eye(3)], [np.zeros((3, 3)), np.eye(3)]])
        moved = sparse.kron(sparse.eye(N, N + 1, k=1), e) - sparse.kron(sparse.eye(N, N + 1), step)
        chain = sparse.hstack([moved, -sparse.kron(sparse.eye(N), b)])
        first = sparse.hstack([e, sparse.csc_matrix((6, 9 * N))])
        self.a = sparse.csc_matrix(sparse.vstack([first, chain]))
        # Rows and columns of G's blocks: for each stage the norm constraint on its state, then that on
        # its input, with zeros included.
        column = lambda k, kind: 6 * k + np.arange(6) if kind == "x" else 6 * (N + 1) + 3 * k + np.arange(3)
        self.columns = [(column(k + 1, "x"), np.concatenate([column(k, "x"), column(k, "a")])) for k in range(N)]
        rows, columns = [], []
        for k, (state, both) in enumerate(self.columns):
            for row, of_row in ((8 * k + 1, state), (8 * k + 5, both)):
                rows.append(np.repeat(row + np.arange(3), len(of_row)))
                columns.append(np.tile(of_row, 3))
        self.cones = [4] * 2 * N
        self.root = np.linalg.cholesky(sample.weights[2]).T
        if sample.bounds.terminal is not None:
            rows.append(np.repeat(8 * N + 1 + np.arange(6), 6))
            columns.append(np.tile(column(N, "x"), 6))
            self.cones.append(7)
        self.rows, self.at = np.concatenate(rows), np.concatenate(columns)
        self.m, self.n = sum(self.cones), 9 * N + 6
        # Position of each entry in column-by-column storage.
        marked = sparse.csc_matrix((np.arange(1.0, len(self.rows) + 1.0), (self.rows, self.at)), (self.m, self.n))
        self.order = marked.data.astype(int) - 1
        self.marked = marked
        self.solver = None

    def linearise(self, sample: Sample) -> tuple[np.ndarray, np.ndarray]:
        """Returns the entries of G, column by column, and h, so that h - G z lies in the cones."""
        point, (on_rates, on_inputs) = sample.point, sample.point_bounds.stages
        states, inputs = point[: 6 * (N + 1)].reshape(N + 1, 6), point[6 * (N + 1) :].reshape(N, 3)
        rate, by_rate, moment, by_moment = (
            np.array(value) for value in self.norm_constraints(states[:, :3].T, states[:, 3:].T, np.vstack([inputs, np.zeros(3)]).T)
        )
        entries, h = [], np.zeros(self.m)
        for k, (state, both) in enumerate(self.columns):
            block = by_rate[:, 9 * (k + 1) : 9 * (k + 1) + 6] / on_rates[k]
            entries.append(-block.ravel())
            h[8 * k] = h[8 * k + 4] = 1.0
            h[8 * k + 1 : 8 * k + 4] = rate[:, k + 1] / on_rates[k] - block @ point[state]
            block = by_moment[:, 9 * k : 9 * k + 9] / on_inputs[k]
            entries.append(-block.ravel())
            h[8 * k + 5 : 8 * k + 8] = moment[:, k] / on_inputs[k] - block @ point[both]
        if sample.point_bounds.terminal is not None:
            root = self.root / sample.point_bounds.terminal
            entries.append(-root.ravel())
            h[8 * N] = 1.0
            h[8 * N + 1 :] = -root @ sample.references[N, :6]
        return np.concatenate(entries)[self.order], h

    def solve(self, sample: Sample) -> tuple[float, int, float | None]:
        """Returns seconds, iterations and cost; the cost is None if the solver failed."""
        best = target(sample)
        c = -self.p @ best
        b = np.concatenate([sample.start, np.zeros(6 * N)])
        g, h = self.linearise(sample)
        if self.solver is None:
            # The tests do without it.
            import qoco

            self.solver = qoco.QOCO()
            tolerances = {"abstol": 3e-10, "reltol": 3e-10}
            matrix = sparse.csc_matrix((g, self.marked.indices, self.marked.indptr), (self.m, self.n))
            sizes = (self.n, self.m, 6 * (N + 1))
            self.solver.setup(*sizes, self.p, c, self.a, b, matrix, h, 0, len(self.cones), np.array(self.cones), **tolerances)
        else:
            self.solver.update_vector_data(c=c, b=b, h=h)
            self.solver.update_matrix_data(G=g)
        begin = time.perf_counter()
        result = self.solver.solve()
        seconds = time.perf_counter() - begin
        if result.status != "QOCO_SOLVED":
            return seconds, result.iters, None
        error = np.array(result.x) - best
        return seconds, result.iters, float(0.5 * error @ (self.p @ error)) / SCALE


def nonlinear(sample: Sample) -> dict:
    """The other solvers of the nonlinear problem."""
    ipopt = {"print_level": 0, "sb": "yes", "tol": 1e-9, "bound_relax_factor": 0.0}
    quiet = {"print_header": False, "print_iteration": False, "print_status": False}
    qp = {"print_iter": False, "print_header": False, "print_info": False, "error_on_fail": False}
    sqp = {**quiet, "qpsol": "qrqp", "qpsol_options": qp, "tol_pr": 1e-8, "tol_du": 1e-6, "max_iter": 50}
    return {
        "CasADi + IPOPT": Casadi(sample, "ipopt", {"ipopt": ipopt}),
        "CasADi sqpmethod": Casadi(sample, "sqpmethod", sqp),
    }


# Our variant that solves the same problem as each other solver.
SAME = {"CasADi + IPOPT": "riccati", "CasADi sqpmethod": "riccati", "QOCO": "cone"}


@dataclass
class Timed:
    """Results of one solver for the samples that it got."""

    samples: list[int] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    iterations: list[int] = field(default_factory=list)
    costs: list[float | None] = field(default_factory=list)

    def add(self, sample: int, seconds: float, iterations: int, cost: float | None) -> None:
        self.samples.append(sample)
        self.seconds.append(seconds)
        self.iterations.append(iterations)
        self.costs.append(cost)


def measure(kind: str, samples: list[Sample], every: int | None, repeat: int) -> dict[str, Timed]:
    """Runs all solvers on the samples of one constraint set."""
    timed_by_solver = {name: Timed() for name in OURS}
    for index, sample in enumerate(samples):
        for name in OURS:
            way = sample.ways[name]
            timed_by_solver[name].add(index, way["seconds"], way["iterations"], sample.cost_of(name))
    for name, solver in {**nonlinear(samples[0]), "QOCO": Qoco(samples[0])}.items():
        step = every
        if step is None:
            trial = [solver.solve(sample)[0] for sample in samples[:: max(1, len(samples) // 8)]]
            step = max(1, int(np.ceil(np.mean(trial) * len(samples) * repeat / PATIENCE)))
        if step > 1:
            print(f"{kind}: {name} gets every {step}th sample only", flush=True)
        timed_by_solver[name] = Timed()
        for index in range(0, len(samples), step):
            timed_by_solver[name].add(index, *min((solver.solve(samples[index]) for _ in range(repeat)), key=lambda result: result[0]))
    return timed_by_solver


def difference(timed_by_solver: dict[str, Timed], name: str) -> float:
    """Largest relative difference of a solver's costs from ours of the same problem."""
    timed, other = timed_by_solver[name], timed_by_solver[SAME[name]].costs
    pairs = [(cost, other[i]) for i, cost in zip(timed.samples, timed.costs)]
    return max((abs(cost / ours - 1.0) for cost, ours in pairs if cost and ours), default=np.nan)


def table(kind: str, timed_by_solver: dict[str, Timed]) -> None:
    """Prints a table of the times, iterations and costs."""
    ours = np.array(timed_by_solver[OURS[0]].seconds)
    print(f"\n{kind} set, {len(ours)} optimisations, times in ms; the ratio is that of the means over the same samples")
    columns = ("mean", "median", "p99", "max", "first", "iterations", "solved", "ratio", "cost differs by")
    print(f"  {'':<18}" + "".join(f"{column:>11}" for column in columns[:-1]) + f"{columns[-1]:>18}")
    for name, timed in timed_by_solver.items():
        ms = np.array(timed.seconds) * 1e3
        ratio = np.mean(timed.seconds) / np.mean(ours[timed.samples])
        numbers = [ms.mean(), np.median(ms), np.percentile(ms, 99), ms.max(), ms[0]]
        solved = sum(cost is not None for cost in timed.costs)
        text = f"  {name:<18}" + "".join(f"{number:11.4f}" for number in numbers)
        text += f"{np.mean(timed.iterations):11.1f}{solved:>7}/{len(ms):<3}{ratio:11.1f}"
        if name in SAME:
            text += f"{difference(timed_by_solver, name):18.1e}"
        print(text)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeat", type=int, default=20, help="repetitions of each sample by ours")
    parser.add_argument("--repeat-others", type=int, default=3, help="repetitions of each sample by the others")
    parser.add_argument("--every", type=int, help="solve every k-th sample by the others; all, unless they take minutes")
    arguments = parser.parse_args()
    samples = taken(TARGET / "release" / "examples" / "samples", arguments.repeat)
    out = ROOT / "out" / "bench"
    out.mkdir(parents=True, exist_ok=True)
    by_kind = {}
    for kind in ("robust", "paper"):
        of_kind = [sample for sample in samples if sample.kind == kind]
        by_kind[kind] = measure(kind, of_kind, arguments.every, arguments.repeat_others)
        table(kind, by_kind[kind])
    with (out / "solvers.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["set", "solver", "time_s", "seconds", "iterations", "cost"])
        for kind, solvers in by_kind.items():
            times = [sample.time for sample in samples if sample.kind == kind]
            for name, timed in solvers.items():
                for row in zip(timed.samples, timed.seconds, timed.iterations, timed.costs):
                    writer.writerow([kind, name, times[row[0]], *row[1:]])
    print(f"\n{out}: solvers.csv")
    others = [(kind, name, difference(by_kind[kind], name)) for kind in by_kind for name in SAME]
    if far := [f"{kind}, {name}: {by:.1e}" for kind, name, by in others if not by <= SAME_COST]:
        sys.exit(f"costs differ from ours by more than {SAME_COST}: {'; '.join(far)}")


if __name__ == "__main__":
    main()
