"""ReentryPlant as model exchange under FMPy's CVode against its own co-simulation."""

import numpy as np
import pytest
from fmpy import simulate_fmu

from fmi import ANGLES, MOMENT, RATES, Unit

STOP = 20.0
STEP = 0.04
# Moments that swing the vehicle by some 0.7 rad without leaving |beta| < 90 deg.
AMPLITUDE = np.array([2e4, 3e4, -4e4])
FREQUENCY = np.array([0.5, 0.7, 0.9])


def moment(tick: int) -> np.ndarray:
    """Piecewise constant, so that both interfaces see the very same input."""
    return AMPLITUDE * np.sin(FREQUENCY * tick * STEP)


@pytest.fixture(scope="module", params=["none", "white", "square", "sine"])
def settings(request):
    return {"inertia.scale": 1.05, "disturbance.kind": request.param, "disturbance.seed": 7}


def co_simulated(fmu, settings) -> np.ndarray:
    rows = []
    with Unit(fmu, settings).start(inputs=dict(zip(MOMENT, moment(0)))) as plant:
        for tick in range(round(STOP / STEP) + 1):
            plant.set(dict(zip(MOMENT, moment(tick))))
            rows.append(plant.get(ANGLES + RATES))
            if tick * STEP < STOP - STEP / 2:
                plant.step(tick * STEP, STEP)
    return np.array(rows)


def exchanged(fmu, settings, solver, **options) -> np.ndarray:
    # A jump at each tick: a row for the old value and one for the new, which FMPy takes for an event.
    rows = []
    for tick in range(round(STOP / STEP) + 1):
        if tick > 0:
            rows.append((tick * STEP, *moment(tick - 1)))
        rows.append((tick * STEP, *moment(tick)))
    signal = np.array(rows, dtype=[("time", float), *((name, float) for name in MOMENT)])
    values = {
        name: fmu.item(name, value) if isinstance(value, str) else value for name, value in settings.items()
    }
    result = simulate_fmu(
        str(fmu.path),
        fmi_type="ModelExchange",
        solver=solver,
        start_values=values,
        input=signal,
        stop_time=STOP,
        output_interval=STEP,
        output=ANGLES + RATES,
        record_events=False,
        **options,
    )
    np.testing.assert_allclose(result["time"], STEP * np.arange(len(result)), atol=1e-9)
    return np.array([result[name] for name in ANGLES + RATES]).T


def test_oracle_cvode_agrees_with_co_simulation(fmu, settings):
    plant = fmu("ReentryPlant")
    expected = co_simulated(plant, settings)
    assert np.ptp(expected[:, :3], axis=0).min() > 0.02
    found = exchanged(plant, settings, "CVode", relative_tolerance=1e-10)
    assert np.abs(found - expected).max() < 1e-6
