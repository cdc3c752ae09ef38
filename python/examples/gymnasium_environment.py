"""The vehicle as an environment of gymnasium, for reinforcement learning, and two agents that do not
learn: random moments, and proportional and derivative feedback. Prints the return of an episode of
each. Needs `pip install gymnasium`.

    python python/examples/gymnasium_environment.py
"""

from math import radians

import gymnasium
import numpy as np
from gymnasium import spaces
from reentry_fmus import ClosedLoop, InstanceError

STEP = 0.04  # s
MOMENT_LIMIT = 1.356e5  # N m, the norm of the moment that an action of norm 1 stands for
RATE_LIMIT = radians(5.0)  # norm of the body rates beyond which the reward is reduced
LOST, FASTEST = radians(60.0), radians(180.0)  # tracking error, and body rate, that end an episode


class AttitudeEnv(gymnasium.Env):
    """The vehicle tracks an attitude reference under a disturbance, and the agent chooses the moment
    of each step.

    The observation has three components each of the tracking error (rad), its time derivative (rad/s),
    the body rates (rad/s), the reference (rad) and the last action. The action is the roll, pitch and
    yaw moment by the moment limit, shortened to norm 1. An episode is truncated after `stop` seconds.
    """

    def __init__(self, stop=50.0):
        self.steps = round(stop / STEP)
        self.loop = ClosedLoop(step=STEP)
        high = np.repeat([LOST, FASTEST, FASTEST, np.pi, 1.0], 3).astype(np.float32)
        self.observation_space = spaces.Box(-high, high)
        self.action_space = spaces.Box(-1.0, 1.0, (3,))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.tick, self.action = 0, np.zeros(3)
        state = self.loop.reset({"plant.disturbance.seed": int(self.np_random.integers(2**31))})
        return self.observed(state), {"time": state.time}

    def step(self, action):
        self.action = np.asarray(action, float) / max(1.0, float(np.linalg.norm(action)))
        self.tick += 1
        try:
            state, is_refused = self.loop.step(self.action * MOMENT_LIMIT), False
        except InstanceError:
            state, is_refused = self.loop.state, True
        error = float(np.linalg.norm(state.attitude - state.reference))
        is_lost = bool(is_refused or error > LOST or np.abs(state.rate).max() > FASTEST)
        excess = max(0.0, float(np.linalg.norm(state.rate)) / RATE_LIMIT - 1.0)
        cost = np.degrees(error) ** 2 + 0.1 * self.action @ self.action + 10.0 * excess**2
        # What is left of a lost episode costs 100 a second.
        left = self.steps - self.tick
        reward = -STEP * float(cost + (100.0 * left if is_lost else 0.0))
        return self.observed(state), reward, is_lost, not is_lost and left <= 0, {"time": state.time}

    def observed(self, state):
        error_rate = state.attitude_rate - state.reference_rate
        values = [state.attitude - state.reference, error_rate, state.rate, state.reference, self.action]
        space = self.observation_space
        return np.clip(np.concatenate(values).astype(np.float32), space.low, space.high)

    def close(self):
        self.loop.close()


def pd(observation):
    """Feedback of the tracking error and its time derivative to each axis."""
    a = -0.25 * observation[:3] - 0.8 * observation[3:6]
    moment = np.array([0.6e6 * -a[2], 1.3e6 * a[0], 1.5e6 * -a[1]])
    return np.clip(moment / MOMENT_LIMIT, -1.0, 1.0).astype(np.float32)


if __name__ == "__main__":
    env = AttitudeEnv()
    env.action_space.seed(1)
    for name, agent in {"random": lambda _: env.action_space.sample(), "PD": pd}.items():
        (observation, info), total, is_over = env.reset(seed=1), 0.0, False
        while not is_over:
            observation, reward, terminated, truncated, info = env.step(agent(observation))
            total, is_over = total + reward, terminated or truncated
        print(f"{name}: return {total:.1f}, ended at {info['time']:.2f} s")
    env.close()
