"""Three agents in the environment of gymnasium, none of which learns: no moment, random moments, and
proportional and derivative feedback. Prints the return of an episode of each.

    python python/examples/gymnasium_agents.py --stop 50 --seed 1
"""

import argparse

import gymnasium
import numpy as np
from reentry_fmus.environment import ID

LIMIT = 1.356e5  # N m, the moment that an action of norm 1 stands for


def no_moment(observation):
    return np.zeros(3, np.float32)


def pd(observation):
    """Proportional and derivative feedback to each axis, from the tracking error (rad) and its
    time derivative (rad/s)."""
    error, error_rate = observation[:3], observation[3:6]
    a = -0.25 * error - 0.8 * error_rate
    moment = np.array([0.6e6 * -a[2], 1.3e6 * a[0], 1.5e6 * -a[1]])
    return np.clip(moment / LIMIT, -1.0, 1.0).astype(np.float32)


def episode(env, agent, seed):
    """Flies an episode. Returns the sum of its rewards, and the last info."""
    observation, info = env.reset(seed=seed)
    total, is_over = 0.0, False
    while not is_over:
        observation, reward, terminated, truncated, info = env.step(agent(observation))
        total += reward
        is_over = terminated or truncated
    return total, info


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--stop", type=float, default=50.0, help="length of an episode, s")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    env = gymnasium.make(ID, stop=arguments.stop)
    env.action_space.seed(arguments.seed)
    agents = {
        "no moment": no_moment,
        "random": lambda observation: env.action_space.sample(),
        "PD": pd,
    }
    for name, agent in agents.items():
        total, info = episode(env, agent, arguments.seed)
        print(f"{name}: return {total:.1f}, ended at {info['time']:.2f} s")
    env.close()


if __name__ == "__main__":
    main()
