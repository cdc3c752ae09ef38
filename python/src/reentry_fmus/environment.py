"""The vehicle as an environment of gymnasium, for reinforcement learning.

Importing this module registers "reentry_fmus/Attitude-v0" (`gymnasium.make`).
"""

from __future__ import annotations

from collections.abc import Mapping
from math import radians
from typing import Any

import numpy as np
import numpy.typing as npt

from ._data import need
from ._instance import InstanceError, Value
from ._loop import ClosedLoop
from ._state import State

need("gymnasium", "gymnasium")

import gymnasium  # noqa: E402
from gymnasium import spaces  # noqa: E402

__all__ = ["ID", "AttitudeEnv"]

ID = "reentry_fmus/Attitude-v0"
"""Name under which gymnasium knows the environment."""

LOST = radians(60.0)
"""Tracking error at which the attitude is lost, rad, as in the papers' experiments."""
FASTEST = radians(180.0)
"""Largest body rate, and largest rate of the error, that is observed, rad/s."""
ERROR_SCALE = radians(1.0)

Observation = npt.NDArray[np.float32]


class AttitudeEnv(gymnasium.Env[Observation, npt.NDArray[np.float32]]):
    """The vehicle tracks an attitude reference under a disturbance. The agent is the controller,
    which chooses a moment at every communication step.

    ========  ==============================================  =====  =======
    index     observation                                     unit   between
    ========  ==============================================  =====  =======
    0 to 2    tracking error: angle of attack, sideslip       rad    ±π/3
              angle, bank angle, less their references
    3 to 5    time derivative of the tracking error           rad/s  ±π
    6 to 8    body rates p, q, r                              rad/s  ±π
    9 to 11   reference of the three angles                   rad    ±π
    12 to 14  moment of the last step, as in the action       1      ±1
    ========  ==============================================  =====  =======

    The **action** has the shape (3,): roll, pitch and yaw moment between -1 and 1, in units of the
    moment limit (`moment_limit`, 1.356e5 N m). An action whose norm exceeds 1 is shortened to 1, so
    that the moment keeps its limit. It acts for one step of 0.04 s.

    The **reward** of a step is::

        -step · (|e|² / (1 deg)² + 0.1 |m|² / limit² + 10 max(0, |ω| / rate limit - 1)²)

    with the tracking error e after the step, the moment m and the body rates ω: what is small when
    the metrics "ems_deg" and "cms" of an experiment are small and the rate limit of 5 deg/s is
    kept. An episode that is lost gets -100 for each second that was left.

    An episode **terminates** when the norm of the tracking error exceeds 60 deg, when a body rate
    exceeds 180 deg/s, or when the vehicle's FMU refuses to go on. It is **truncated** after
    `stop` (50 s, 1250 steps). Neither the rate limit nor the moment limit ends it.

    `reset(seed=…)` seeds the vehicle's disturbance: the same seed and actions give the same episode
    bit for bit. `reset(options={"parameters": {…}})` sets further parameters of `ClosedLoop` for
    this episode, such as {"plant.initial.beta": 0.1}. `info` holds the time ("time", s), the moment
    ("moment", N m), the norm of the rate by its limit ("rate_ratio") and the seed of the
    disturbance ("disturbance_seed").

    >>> env = AttitudeEnv(stop=1.0)
    >>> observation, info = env.reset(seed=1)
    >>> observation.shape, info["time"]
    ((15,), 0.0)
    >>> observation, reward, terminated, truncated, info = env.step(np.zeros(3, np.float32))
    >>> terminated, truncated, info["time"]
    (False, False, 0.04)
    >>> env.close()

    Args:
        stop: Length of an episode, s: a multiple of 0.04 s.
        parameters: Parameters of `ClosedLoop` for all episodes, such as
            {"plant.inertia.scale": 1.05}.
        moment_limit: Largest norm of the moment, N m.
        rate_limit: Norm of the body rates beyond which the reward is reduced, rad/s.
    """

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(
        self,
        stop: float = 50.0,
        parameters: Mapping[str, Value] | None = None,
        moment_limit: float = 1.356e5,
        rate_limit: float = radians(5.0),
    ) -> None:
        for name, value in (("moment_limit", moment_limit), ("rate_limit", rate_limit)):
            if not (np.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} = {value}, but a positive number is needed")
        self._parameters = dict(parameters or {})
        self._moment_limit = moment_limit
        self._rate_limit = rate_limit
        self._step = 0.04
        self._steps = round(stop / self._step) if np.isfinite(stop) else 0
        if self._steps < 1 or abs(self._steps * self._step - stop) > 1e-9 * stop:
            raise ValueError(f"stop = {stop} s is no positive multiple of {self._step} s")
        self._loop = ClosedLoop(parameters=self._parameters)
        self._tick = 0
        self._action = np.zeros(3)
        self._seed = 0
        high = np.repeat([LOST, FASTEST, FASTEST, np.pi, 1.0], 3).astype(np.float32)
        self.observation_space = spaces.Box(-high, high, dtype=np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (3,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begins an episode. Without a seed the disturbance is another one in each episode."""
        super().reset(seed=seed)
        drawn = {"plant.disturbance.seed": int(self.np_random.integers(2**31))}
        chosen = (options or {}).get("parameters", {})
        parameters = {**drawn, **self._parameters, **chosen}
        state = self._loop.reset(parameters)
        self._seed = int(parameters["plant.disturbance.seed"])
        self._tick, self._action = 0, np.zeros(3)
        return self._observed(state), self._info(state)

    def step(
        self, action: npt.NDArray[np.float32]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Holds a moment for one step."""
        asked = np.asarray(action, dtype=np.float64)
        self._action = asked / max(1.0, float(np.linalg.norm(asked)))
        try:
            state = self._loop.step(self._action * self._moment_limit)
            is_lost = self._is_lost(state)
        except InstanceError:
            state, is_lost = self._loop.state, True
        self._tick += 1
        reward = self._step * self._reward(state)
        if is_lost:
            reward -= 100.0 * self._step * (self._steps - self._tick)
        is_over = self._tick >= self._steps
        return self._observed(state), reward, is_lost, is_over and not is_lost, self._info(state)

    def close(self) -> None:
        """Frees the instances."""
        self._loop.close()

    @staticmethod
    def _is_lost(state: State) -> bool:
        error = np.linalg.norm(state.attitude - state.reference)
        return bool(error > LOST or np.abs(state.rate).max() > FASTEST)

    def _reward(self, state: State) -> float:
        error = np.linalg.norm(state.attitude - state.reference) / ERROR_SCALE
        excess = max(0.0, self._rate_ratio(state) - 1.0)
        effort = np.linalg.norm(self._action)
        return -float(error**2 + 0.1 * effort**2 + 10.0 * excess**2)

    def _rate_ratio(self, state: State) -> float:
        return float(np.linalg.norm(state.rate) / self._rate_limit)

    def _observed(self, state: State) -> Observation:
        values = np.concatenate(
            [
                state.attitude - state.reference,
                state.attitude_rate - state.reference_rate,
                state.rate,
                state.reference,
                self._action,
            ]
        )
        space = self.observation_space
        assert isinstance(space, spaces.Box)
        # Only the last observation of a lost episode lies outside.
        return np.clip(values.astype(np.float32), space.low, space.high)

    def _info(self, state: State) -> dict[str, Any]:
        return {
            "time": state.time,
            "moment": self._action * self._moment_limit,
            "rate_ratio": self._rate_ratio(state),
            "disturbance_seed": self._seed,
        }


if ID not in gymnasium.registry:
    gymnasium.register(ID, entry_point="reentry_fmus.environment:AttitudeEnv")
