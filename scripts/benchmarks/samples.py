"""Optimisations of CRMPC along a flight, as control/examples/samples.rs exports them."""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import sparse

import nlp

N, H = nlp.HORIZON, nlp.STEP
# The solvers get the cost in deg^2, so that their absolute tolerances make sense.
SCALE = (180.0 / np.pi) ** 2


def flat(trajectory: dict) -> np.ndarray:
    """The unknowns of a trajectory, in the order x_0 ... x_N, a_0 ... a_N-1."""
    return np.concatenate([np.ravel(trajectory["states"]), np.ravel(trajectory["accelerations"])])


@dataclass(frozen=True)
class Bounds:
    """Bounds on the rates of stages 1 ... N and on the inputs, and the radius of the terminal set, if
    there is one."""

    stages: np.ndarray
    terminal: float | None

    @staticmethod
    def read(raw: dict) -> Bounds:
        return Bounds(np.array([raw["rate"], raw["input"]], float), raw["terminal"])


@dataclass(frozen=True)
class Sample:
    """Data of one optimisation: the problem, the last linearisation of our cone solver with its bounds, a
    guess for the other solvers, and what ours found."""

    kind: str
    time: float
    start: np.ndarray
    references: np.ndarray
    bounds: Bounds
    point: np.ndarray
    point_bounds: Bounds
    guess: np.ndarray
    weights: tuple[np.ndarray, np.ndarray, np.ndarray]
    ways: dict

    @staticmethod
    def read(line: str) -> Sample:
        raw = json.loads(line)
        references = np.array(raw["references"]).reshape(N + 1, 9)
        previous = raw["previous"]
        if previous is None:
            states, inputs = references[:, :6], references[:N, 6:]
        else:
            # By (31) the first interval is dropped. The last acceleration is repeated.
            states, inputs = np.array(previous["states"]), np.array(previous["accelerations"])
            last, a = states[-1], inputs[-1]
            end = np.concatenate([last[:3] + H * last[3:] + 0.5 * H * H * a, last[3:] + H * a])
            states, inputs = np.vstack([states[1:], end]), np.vstack([inputs[1:], a])
        weights, linearised = raw["weights"], raw["linearised"]
        return Sample(
            kind=raw["set"],
            time=raw["time"],
            start=np.array(raw["start"]),
            references=references,
            bounds=Bounds.read(raw["bounds"]),
            point=flat(linearised["point"]),
            point_bounds=Bounds.read(linearised["bounds"]),
            guess=flat({"states": states, "accelerations": inputs}),
            weights=(
                np.diag(np.ravel(weights["state"])),
                np.diag(weights["input"]),
                np.block([[np.diag(block) for block in row] for row in weights["end"]]),
            ),
            ways=raw["ways"],
        )

    def cost_of(self, way: str) -> float | None:
        """The cost that one of our solvers found; None if it found no optimum of its problem."""
        found = self.ways[way]
        is_other = found["status"] in ("Fallback", "Kept") or way == "riccati" and found["status"] == "Cone"
        return None if is_other else found["cost"]


def hessian(sample: Sample) -> sparse.csc_matrix:
    """Matrix P of the cost z'Pz / 2, in deg^2."""
    w, v, g = sample.weights
    return sparse.csc_matrix(2.0 * SCALE * sparse.block_diag([w] * N + [g] + [v] * N))


def target(sample: Sample) -> np.ndarray:
    """Values of the unknowns without any error."""
    return np.concatenate([sample.references[:, :6].ravel(), sample.references[:N, 6:].ravel()])


def taken(program: Path, repeat: int) -> list[Sample]:
    """The samples that control/examples/samples.rs prints."""
    done = subprocess.run([program, str(repeat)], check=True, capture_output=True, text=True)
    return [Sample.read(line) for line in done.stdout.splitlines()]
