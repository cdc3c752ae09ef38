"""Linear models and stability margins: against matrices written by hand with python-control, structured singular values by
Slycot, and the nonlinear loop in flight, on both sides of the computed margin."""

import json
import subprocess
import tempfile
from pathlib import Path

import control
import numpy as np
import pandas as pd
import pytest
import slycot
from scipy.optimize import brentq

import conftest
import margins_in_flight
from conftest import EXPERIMENTS, TARGET, program

FOLDER = EXPERIMENTS.parent
SIGNALS = "plant.moment.*"
FILES = {
    "LQR": FOLDER / "crmpc-2022" / "lqr.toml",
    "FBL": FOLDER / "tvsmc-2015" / "fbl.toml",
    "BTVSMC": FOLDER / "tvsmc-2015" / "btvsmc.toml",
    "TwoLoopSMC": FOLDER / "two-loop-smc" / "two-loop.toml",
}
PERIOD = {"LQR": 0.04, "FBL": 0.01, "BTVSMC": 0.01, "TwoLoopSMC": 0.01}
# The gains of the angle and of its rate: LQR's follow from the weights 50 and 10 by the Riccati equation of a double integrator.
GAINS = {"LQR": (np.sqrt(5.0), np.sqrt(5.0 + 2.0 * np.sqrt(5.0))), "FBL": (3.0, 3.0)}
# alpha, beta, sigma in deg.
ATTITUDES = [(10.0, 0.0, -25.0), (25.0, 3.0, 40.0), (35.0, -4.0, 80.0)]
INERTIA = np.array([[588791.0, 0.0, -24242.0], [0.0, 1303212.0, 0.0], [-24242.0, 0.0, 1534164.0]])
# Of the axes, deg/s. TwoLoopSMC's gain grows with the amplitude: its reaching law is of the power 1.5 inside its layer.
START = {"LQR": 1e-5, "FBL": 1e-5, "BTVSMC": 1e-5, "TwoLoopSMC": 1e-8}


def value(loop: control.StateSpace, frequency: float) -> np.ndarray:
    """Frequency response. (That of python-control 0.10 with Slycot is wrong by some thousandths beside poles at zero.)"""
    z = np.exp(1j * frequency * loop.dt)
    return loop.C @ np.linalg.solve(z * np.eye(loop.nstates) - loop.A, loop.B) + loop.D


def settings(attitude, delay: float, scale: float = 1.0, start: float = 0.0) -> list[str]:
    """Arguments for a loop at rest at this attitude, with the actual inertia in relation to the nominal one."""
    values = {
        "controller.reference.profile": "constant",
        "controller.vehicle.file": "wu2015",
        "plant.vehicle.file": "wu2015",
        "plant.disturbance.kind": "none",
        "plant.inertia.scale": scale,
        "plant.actuation.delay": delay,
    }
    for name, angle in zip(("alpha", "beta", "sigma"), attitude):
        values[f"controller.reference.angle.{name}"] = values[f"plant.initial.{name}"] = f"{angle} deg"
    for name, rate in zip("pqr", (1.3, 1.0, 0.7)):
        values[f"plant.initial.{name}"] = f"{rate * start} deg/s"
    return [part for name, value in values.items() for part in ("--set", f"{name}={value}")]


def call(*arguments) -> str:
    return conftest.call(*arguments, "--fmu-dir", TARGET / "fmu").stdout


def margins(law: str, attitude, delay: float = 0.0) -> dict:
    return json.loads(
        call("margins", FILES[law], "--at", "10", "--open", SIGNALS, "--json", *settings(attitude, delay))
    )


def model(*arguments) -> dict:
    """The model that `margins` writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "model.json")
        call("margins", *arguments, "--model", path)
        return json.loads(path.read_text())


def open_loop(law: str, attitude, delay: float = 0.0) -> control.StateSpace:
    found = model(FILES[law], "--at", "10", "--open", SIGNALS, *settings(attitude, delay))
    a, b, c, d = (np.array(found[key]) for key in "abcd")
    # The feedback is positive: the return ratio is the negative of the open loop.
    return control.ss(a, b, -c, -d, found["period"])


def by_hand(law: str, attitude, delay_steps: int = 0) -> control.StateSpace:
    """The return ratio at the moment: Θ̇ = R ω, I ω̇ = m, and m = I R⁻¹ (−k₁ (Θ − Θ_r) − k₂ R ω), sampled and held."""
    alpha, beta, _ = np.radians(attitude)
    (sa, ca), (sb, cb) = [(np.sin(angle), np.cos(angle)) for angle in (alpha, beta)]
    r = np.array([[-ca * sb / cb, 1.0, -sa * sb / cb], [sa, 0.0, -ca], [-ca * cb, -sb, -sa * cb]])
    none = np.zeros((3, 3))
    a, b = np.block([[none, r], [none, none]]), np.vstack([none, np.linalg.inv(INERTIA)])
    plant = control.c2d(control.ss(a, b, np.eye(6), np.zeros((6, 3))), PERIOD[law], "zoh")
    k1, k2 = GAINS[law]
    to_moment = INERTIA @ np.linalg.inv(r)
    gain = control.ss([], [], [], to_moment @ np.hstack([k1 * np.eye(3), k2 * r]), PERIOD[law])
    wait = control.tf([1.0], [1.0] + [0.0] * delay_steps, PERIOD[law])
    return gain * plant * control.append(*[control.ss(wait)] * 3)


@pytest.mark.parametrize("attitude", ATTITUDES)
@pytest.mark.parametrize("steps", [0, 1])
@pytest.mark.parametrize("law", GAINS)
def test_oracle_the_open_loop_is_that_of_matrices_by_hand(law, steps, attitude):
    found, expected = open_loop(law, attitude, steps * PERIOD[law]), by_hand(law, attitude, steps)
    for frequency in np.geomspace(1e-2, 0.99 * np.pi / PERIOD[law], 30):
        ours, theirs = (value(system, frequency) for system in (found, expected))
        # Two integrators whose eigenvalues are off by the rate s are off by (s/ω)².
        near = 1e-6 * max(1.0, (0.03 / frequency) ** 2)
        assert np.abs(ours - theirs).max() <= near * np.abs(theirs).max()
        ours, theirs = (np.linalg.inv(np.eye(3) + loop) for loop in (ours, theirs))
        assert np.abs(ours - theirs).max() <= near * np.abs(theirs).max() and np.abs(ours - theirs).max() <= 1e-9


@pytest.mark.parametrize("attitude", ATTITUDES)
@pytest.mark.parametrize("steps", [0, 1])
@pytest.mark.parametrize("law", GAINS)
def test_oracle_the_margins_are_those_of_frequency_responses_and_slycot(law, steps, attitude):
    found, loop = margins(law, attitude, steps * PERIOD[law]), by_hand(law, attitude, steps)

    def disk(frequency: float) -> float:
        """By the structured singular value for three independent complex numbers."""
        sensitivity = np.linalg.inv(np.eye(3) + value(loop, frequency))
        return 1.0 / slycot.ab13md(sensitivity - 0.5 * np.eye(3), np.ones(3, int), 2 * np.ones(3, int))[0]

    peak = found["together"]["disk"]
    assert peak["alpha"] == pytest.approx(disk(peak["frequency"]), rel=1e-6)
    assert peak["alpha"] <= min(map(disk, np.geomspace(1e-2, np.pi / PERIOD[law], 200))) * (1.0 + 1e-6)
    for channel, row in enumerate(found["loops"]):
        # The loops of the other axes stay closed.
        others = [other for other in range(3) if other != channel]
        closed = control.feedback(loop, control.ss([], [], [], np.diag([float(i in others) for i in range(3)]), PERIOD[law]))
        single = control.ss(closed.A, closed.B[:, [channel]], closed.C[[channel]], 0.0, PERIOD[law])
        gain, phase, crossing = crossings(single, np.pi / PERIOD[law])
        assert row["classical"]["gain_above"]["value"] == pytest.approx(gain, rel=1e-5)
        assert row["classical"]["phase"]["value"] == pytest.approx(phase, rel=1e-5)
        assert row["classical"]["phase"]["frequency"] == pytest.approx(crossing, rel=1e-3)


def crossings(loop: control.StateSpace, last: float) -> tuple[float, float, float]:
    """Gain margin, and phase margin (deg) with its frequency, from the frequency response. (python-control 0.10 misses the
    crossing of a sampled loop at half the sampling frequency.)"""

    def response(frequency: float) -> complex:
        return complex(value(loop, frequency)[0, 0])

    def roots(function) -> list[float]:
        grid = np.geomspace(1e-2, last, 2000)
        values = [function(frequency) for frequency in grid]
        pairs = zip(grid, grid[1:], values, values[1:])
        return [brentq(function, a, b, xtol=1e-12) for a, b, fa, fb in pairs if fa * fb < 0.0]

    at_real = [response(frequency).real for frequency in [*roots(lambda w: response(w).imag), last]]
    gain = min(-1.0 / value for value in at_real if -1.0 < value < 0.0)
    margins = [(180.0 + np.degrees(np.angle(response(w))), w) for w in roots(lambda w: abs(response(w)) - 1.0)]
    return gain, *min(margins)


def final_over_initial(law: str, attitude, delay: float, gain: float, stop: float, out, *more: str) -> float:
    """Rates at the end of a flight from a small start, by those of the start. A loop gain is raised by a lower inertia."""
    arguments = settings(attitude, delay, 1.0 / gain, START[law])
    command = [program("orchestrator"), "run", FILES[law], "--quiet", "--force", "--no-plot", "--out", out]
    command += ["--stop", str(stop), "--fmu-dir", TARGET / "fmu", *arguments, *more]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    if done.returncode != 0:
        assert done.returncode in (1, 3) and ("singular" in done.stderr or "lost" in done.stderr), done.stderr
        return np.inf
    table = pd.read_csv(out / "results.csv", index_col="time")
    rates = table[[f"plant.rate.{name}" for name in "pqr"]].abs().max(axis=1)
    return rates[rates.index > 0.8 * stop].max() / np.radians(START[law])


@pytest.mark.parametrize("attitude", ATTITUDES)
@pytest.mark.parametrize("steps", [0, 1])
@pytest.mark.parametrize("law", FILES)
def test_oracle_flights_are_stable_below_the_margin_and_unstable_above_it(law, attitude, steps, tmp_path):
    delay = steps * PERIOD[law]
    found = margins(law, attitude, delay)["together"]["classical"]
    stop = 200.0 if law == "TwoLoopSMC" else 80.0
    for share, is_stable in ((0.98, True), (1.02, False)):
        gain = share * found["gain_above"]["value"]
        longer = delay + share * found["delay"]["value"]
        for setting in ((delay, gain), (longer, 1.0)):
            growth = final_over_initial(law, attitude, *setting, stop, tmp_path / "run")
            assert (growth < 0.5) if is_stable else (growth > 2.0), f"{share} {setting}: {growth}"


@pytest.mark.tier("studies")
@pytest.mark.parametrize("law", ["LQR", "FBL"])
def test_oracle_the_other_order_of_calls_is_a_step_of_delay_in_flight_too(law, tmp_path):
    jacobi = ["--coupling", "jacobi"]
    arguments = ["--at", "10", "--open", SIGNALS, "--json", *settings(ATTITUDES[1], 0.0), *jacobi]
    found = json.loads(call("margins", FILES[law], *arguments))["together"]
    late = margins(law, ATTITUDES[1], PERIOD[law])["together"]
    assert found["disk"]["alpha"] == pytest.approx(late["disk"]["alpha"], rel=1e-5)
    gain = found["classical"]["gain_above"]["value"]
    assert gain == pytest.approx(late["classical"]["gain_above"]["value"], rel=1e-5)
    for share, is_stable in ((0.98, True), (1.02, False)):
        growth = final_over_initial(law, ATTITUDES[1], 0.0, share * gain, 80.0, tmp_path / "run", *jacobi)
        assert (growth < 0.5) if is_stable else (growth > 2.0), f"{share}: {growth}"


@pytest.mark.tier("studies")
@pytest.mark.parametrize("law", ["FBL", "TwoLoopSMC", "CRMPC"])
def test_oracle_surfaces_give_small_motions_the_margins_of_the_loop_without_them(law, tmp_path):
    experiment = FOLDER / "margins" / "allocated.toml"
    arguments = ["--fmu", f"controller={law}.fmu", *settings(ATTITUDES[0], 0.0)]
    arguments = [part for part in arguments if part not in ("--set", "plant.actuation.delay=0.0")]
    arguments = [part for value in arguments[2:] for part in ("--set", value)]
    law_of = ["--fmu", f"controller={law}.fmu"]
    found = json.loads(call("margins", experiment, "--json", *law_of, *arguments))
    # All surfaces together have no edge. At the small changes that TwoLoopSMC needs, that of a single one shows.
    assert ("sides" in found) is (law == "TwoLoopSMC")
    ideal = json.loads(call("margins", FOLDER / "margins" / "rest.toml", "--json", *law_of, *arguments))
    assert found["together"]["disk"]["alpha"] == pytest.approx(ideal["together"]["disk"]["alpha"], rel=5e-3)
    gain = found["together"]["classical"]["gain_above"]["value"]
    assert gain == pytest.approx(ideal["together"]["classical"]["gain_above"]["value"], rel=5e-3)
    # The gain of TwoLoopSMC depends on the amplitude. Smaller motions drown in what the allocator's iterations leave.
    if (start := {"FBL": 3e-5, "CRMPC": 1e-4}.get(law)) is None:
        return
    # Beyond the margin a small motion grows until the surfaces are too slow for it, and stays.
    for share, is_stable in ((0.98, True), (1.02, False)):
        rates = [f"plant.initial.{name}={rate * start} deg/s" for name, rate in zip("pqr", (1.3, 1.0, 0.7))]
        more = [f"plant.inertia.scale={1.0 / (share * gain)}", *rates]
        command = ["run", experiment, *law_of, *arguments, *(part for value in more for part in ("--set", value))]
        call(*command, "--quiet", "--force", "--no-plot", "--stop", "80", "--out", tmp_path / "run")
        table = pd.read_csv(tmp_path / "run" / "results.csv", index_col="time")
        rates = table[[f"plant.rate.{name}" for name in "pqr"]].abs().max(axis=1)
        growth = rates[rates.index > 32.0].max() / np.radians(start)
        assert (growth < 0.5) if is_stable else (growth > 1.0), f"{share}: {growth}"


def test_the_margins_of_a_law_that_is_replanned_are_those_of_its_period():
    found = json.loads(
        call("margins", FOLDER / "crmpc-2022" / "crmpc-robust.toml", "--at", "10", "--open", SIGNALS, "--json",
             "--set", "plant.disturbance.kind=none")
    )  # fmt: skip
    assert found["period"] == pytest.approx(0.2) and found["stable"]
    assert "samples of 0.04 s, which repeat after 5 of them" in found["note"]


@pytest.mark.parametrize(("law", "step"), [("LQR", 0.001), ("LQR", 0.002), ("CRMPC", 0.002)])
def test_oracle_margins_do_not_depend_on_the_communication_step(law, step):
    """The controllers sample with periods of their own, and act at once. So do the samples of the model."""
    command = ["margins", FOLDER / "margins" / "rest.toml", "--fmu", f"controller={law}.fmu", "--json"]
    whole, fine = (json.loads(call(*command, *more)) for more in ((), ("--step", str(step))))
    for one, other in zip([*whole["loops"], whole["together"]], [*fine["loops"], fine["together"]]):
        for margin in ("gain_above", "gain_below", "phase", "delay"):
            a, b = (row["classical"][margin] for row in (one, other))
            assert (a is None) == (b is None) and (a is None or b["value"] == pytest.approx(a["value"], rel=1e-4)), margin
        assert other["disk"]["alpha"] == pytest.approx(one["disk"]["alpha"], rel=1e-4)
        assert other["sensitivity"]["value"] == pytest.approx(one["sensitivity"]["value"], rel=1e-3)


def test_a_signal_has_the_same_margins_whatever_else_is_opened():
    command = ["margins", FOLDER / "margins" / "rest.toml", "--fmu", "controller=LQR.fmu", "--json"]
    alone, beside = (json.loads(call(*command, "--open", SIGNALS, *more)) for more in ((), ("--open", "plant.rate.*")))
    for one, other in zip(alone["loops"], beside["loops"]):
        assert other["signal"] == one["signal"]
        for margin in ("gain_above", "phase", "delay"):
            # Rates arrive every 0.01 s, moments every 0.04 s.
            assert other["classical"][margin]["value"] == pytest.approx(one["classical"][margin]["value"], rel=1e-6), margin
    # N m and rad/s are compared in their typical magnitudes.
    assert beside["together"]["sensitivity"]["value"] < 10.0


def test_margins_are_the_same_from_a_closed_process():
    command = ["margins", FOLDER / "margins" / "rest.toml", "--fmu", "controller=TwoLoopSMC.fmu", "--json"]
    assert call(*command, "--isolate") == call(*command, "--isolate=false")


@pytest.mark.parametrize(
    ("experiment", "arguments", "code", "problem"),
    [
        # While the plan turns at a limit, no step is like another.
        ("crmpc-2022/crmpc-robust.toml", ("--at", "1", "--open", SIGNALS), 1, "do not repeat within 25 steps"),
        ("entry/from-120km.toml", ("--at", "1900", "--open", SIGNALS), 1, "needs its motion beyond"),
        ("crmpc-2022/lqr.toml", ("--at", "10.01", "--open", SIGNALS), 2, "--at 10.01: must be a communication point"),
        ("crmpc-2022/lqr.toml", ("--at", "10", "--open", "plant.momnt.*"), 2, 'did you mean "plant.moment.'),
    ],
)
def test_where_there_is_no_linear_model_none_is_given(experiment, arguments, code, problem):
    command = [program("orchestrator"), "margins", FOLDER / experiment, "--fmu-dir", TARGET / "fmu", *arguments]
    for more in ((), ("--json",)):
        done = subprocess.run([*command, *more], capture_output=True, text=True, timeout=300)
        assert done.returncode == code and problem in done.stderr, done.stderr
        if more:
            # Where the answer would be JSON, the refusal is.
            answer = json.loads(done.stdout)
            assert problem in answer["error"] and answer["exit_code"] == code
        else:
            assert done.stdout == ""


@pytest.mark.tier("studies")
# scripts/oracles/margins_in_flight.py holds all delays up to 1 s against flights.
@pytest.mark.parametrize("law", ["LQR", "FBL"])
@pytest.mark.parametrize("delay", [0.0, 0.25, 0.3, 0.31, 0.355, 0.5, 0.995, 1.0])
def test_oracle_the_verdict_on_a_delayed_loop_is_that_of_a_flight(law, delay):
    found, decays = margins_in_flight.judged(["--fmu", f"controller={law}.fmu", "--set", f"plant.actuation.delay={delay}"])
    assert found is decays is (delay < 0.4)


def test_a_loop_with_rounded_readings_has_no_verdict():
    changes = [f"{component}.sensor.set=2" for component in ("plant", "estimator")]
    arguments = [part for change in changes for part in ("--set", change)]
    found = margins_in_flight.verdict(["--fmu", "controller=LQR.fmu", *arguments], FOLDER / "margins" / "measured.toml")
    assert found.startswith("plant failed ") and "it rounds its outputs" in found


SINE = """
extends = "{rest}"
title = "A sine is added to the moment"
[simulation]
order = ["sine", "controller", "plant"]
[components.sine]
fmu = "sine.csv"
[components.controller]
fmu = "{law}.fmu"
[components.plant]
unconnected = ["disturbanceMoment.x", "disturbanceMoment.z", "surface*", "jet*", "trajectory.*", "prescribed*", "trim.alpha"]
[[connections]]
from = "sine.y"
to = "plant.disturbanceMoment.y"
[[connections]]
from = "plant.attitude.*"
to = "controller.attitude.*"
[[connections]]
from = "plant.rate.*"
to = "controller.rate.*"
[[connections]]
from = "controller.moment.*"
to = "plant.moment.*"
[record]
every = 1
"""


@pytest.mark.parametrize("law", ["LQR", "CRMPC", "TwoLoopSMC"])
def test_oracle_the_loop_in_flight_has_the_frequency_response_of_the_model(law, tmp_path):
    """A sine is added to what the plant receives, until the transient is gone: it and the controller's answer are the
    sensitivity, and from it follows the return ratio."""
    found = model(FOLDER / "margins" / "rest.toml", "--fmu", f"controller={law}.fmu", "--open", "plant.moment.y")
    a, b, c, d = (np.array(found[key]).reshape(-1, found["samples"]) if key in "bd" else np.array(found[key]) for key in "abcd")
    period, samples = found["period"], found["samples"]
    step = period / samples
    # The gain of TwoLoopSMC grows with the amplitude: by 0.4 % from 1e-5 to 1e-4.
    amplitude = 1e-5 if law == "TwoLoopSMC" else 0.01
    (tmp_path / "sine.toml").write_text(SINE.format(rest=FOLDER / "margins" / "rest.toml", law=law))
    for frequency in np.geomspace(0.3, 0.77 * np.pi / step, 5):
        # A periodic loop responds at all frequencies that its period mixes with that of the sine.
        mixed = frequency + 2.0 * np.pi * np.arange(samples) / period
        sines = np.exp(1j * np.outer(np.arange(samples) * step, mixed))
        z = np.exp(1j * frequency * period)
        lifted = np.linalg.inv(np.eye(samples) - c @ np.linalg.solve(z * np.eye(len(a)) - a, b) - d)
        predicted = 1.0 / (np.linalg.inv(sines) @ lifted @ sines)[0, 0] - 1.0

        settled, window = 40.0, max(8.0 * np.pi / frequency, 60.0 * period)
        times = step * np.arange(round((settled + window) / step))
        added = amplitude * np.sin(frequency * times)
        rows = [f"{time:.3f},{value!r}" for time, value in zip(times, map(float, added))]
        (tmp_path / "sine.csv").write_text("\n".join(["time,y [N.m]", *rows]))
        call("run", tmp_path / "sine.toml", "--stop", f"{times[-1] + step:.3f}", "--no-plot", "--quiet", "--force", "--out", tmp_path / "run")
        table = pd.read_csv(tmp_path / "run" / "results.csv", index_col="time")["controller.moment.y"]
        received = added + np.interp(times, table.index, table)
        is_settled = times >= settled
        terms = np.column_stack([np.ones(is_settled.sum()), *(f(np.outer(times[is_settled], mixed)) for f in (np.cos, np.sin))])

        def amplitude_of(values: np.ndarray) -> complex:
            fit = np.linalg.lstsq(terms, values[is_settled], rcond=None)[0]
            return fit[1] - 1j * fit[1 + samples]

        measured = amplitude_of(added) / amplitude_of(received) - 1.0
        assert abs(measured - predicted) <= 0.01 * abs(predicted)
