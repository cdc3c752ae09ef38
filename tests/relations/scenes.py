"""Settings in which some variables act and no experiment has them, with an experiment's inputs. An input
may be given as a list, one value a communication point."""

from conftest import ROOT, TARGET


def skew() -> str:
    """A shipped vehicle without a plane of symmetry. Several processes may write it, the same each."""
    text = (ROOT / "orchestrator" / "experiments" / "entry" / "vehicles" / "lifting-body.toml").read_text(encoding="utf-8")
    path = TARGET / "skew-body.toml"
    path.write_text(text.replace("\nIxz =", "\nIxy = 5000.0\nIyz = 5000.0\nIxz ="), encoding="utf-8")
    return str(path)


ROWS = range(1, 9)
# Air is measured only as long as every sample is received.
AIR = {"initial.altitude": 6e4, "initial.speed": 6500.0, "measured.accelerometer.x": -3.0, "measured.accelerometer.z": -4.0}
AIR |= {"measured.sample": [k + 1 for k in range(61)], "measured.time": [0.04 * k for k in range(61)]}
FAILING = ("tvsmc-2015/allocated", {"effector.fault.kind": "slow", "effector.fault.number": 1})
TURNING = ("entry/from-120km", {"reference.externalRate.beta": 0.01})
SCENES = {
    "DLMPC": {"a sideslip angle that is to turn": TURNING},
    "CRMPC": {
        "a sideslip angle that is to turn": TURNING,
        "settings without guarantee": ("crmpc-2022/crmpc-robust", {"disturbance.bound": 0.2}),
        "limits that are scheduled": ("crmpc-2022/crmpc-robust", {"scheduled.limitMoment": 1.3e5, "scheduled.disturbanceBound": 0.01, "scheduled.disturbanceParts": 2}),
    },
    "EntryGuidance": {"limits that are reached": (TURNING[0], {"limit.heatFlux": 3e5, "limit.load": 1.15, "limit.pressure": 1.29e4})},
    "AttitudeEstimator": {"a gyroscope that is stuck": ("crmpc-2022/estimator", {f"measured.gyroscope.{axis}": 0.01 for axis in "xyz"})},
    "EntryNavigation": {
        "a star tracker": ("entry/navigated", {"star.fix": 1, "star.attitude.w": 0.7, "star.attitude.x": 0.7}),
        "a start without a fix": ("entry/navigated", {"gnss.fix": 0}),
        "a start in the air": ("entry/navigated", AIR | {"gnss.fix": 0}),
    },
    "ControlAllocator": {"a surface that becomes slow": FAILING},
    "ReentryPlant": {
        "a surface that becomes slow": FAILING,
        "fixes of a star tracker": ("entry/navigated", {"sensor.star.period": 0.2, "sensor.gnss.period": 0.2}),
        "a body without a plane of symmetry": ("entry/own-vehicle", {"vehicle.file": skew()}),
        "rotating Earth": ("crmpc-2022/lqr", {"trajectory.earthRate": 7.292115e-5}),
        "air of six rows": ("entry/from-120km", {"air.rows": 6} | {f"air.altitude[{k}]": 117e3 + 500 * k for k in ROWS[:6]} | {f"air.wind.{axis}[{k}]": 9.0 * k for k in ROWS[:6] for axis in ("north", "east")}),
        "disturbance of eight rows": ("crmpc-2022/lqr", {"disturbance.kind": "table", "disturbance.table.rows": 8} | {f"disturbance.table.time[{k}]": 4.0 * k for k in ROWS} | {f"disturbance.table.{axis}[{k}]": (-0.1) ** k for k in ROWS for axis in ("alpha", "beta", "sigma")}),
    },
}
