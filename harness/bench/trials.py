"""What the methods' bench is run on: a database of built-in takes, and held-out ones as six stations read them.

The setting is that of the accuracy tables: their body, stations and mounts, 40 Hz, exact calibration, level `clean`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from harness.bench.index import RATE_HZ, TAKE_S, built_in
from harness.body import humanoid
from harness.body.humanoid import Body
from harness.config import load_scenario
from harness.core.arrays import Floats
from harness.core.motion import Take
from harness.mocap import performer
from harness.reconstruct.contract import LearnsFromDatabase, Method, Reconstructor
from harness.reconstruct.database import MotionDatabase
from harness.score.angles import wrapped
from harness.setting import mounts_of, noise_of, tracker_of
from harness.simulate.simulate import Simulation, simulate

SETTING = "walking"
"""The scenario whose stations, tracker and calibration are taken."""
FRAMES_EACH = round(TAKE_S * RATE_HZ) + 1
HELD_OUT = 1_000_000
"""Seeds of held-out takes start so much higher."""
WARM_UP = round(1.0 * RATE_HZ)
"""Frames at the start of every take that count neither for time nor for error, as in the tables."""

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Trial:
    """A held-out take as the trackers read it, and its truth."""

    take: str
    simulation: Simulation
    truth: Floats
    """(F, 55) at each frame."""


def body() -> Body:
    """The common body."""
    return humanoid.build()


def database(folder: Path, frames: int, seed: int, workers: int, progress: Progress | None = None) -> MotionDatabase:
    """At least so many frames of built-in takes with distinct seeds, on disk and memory-mapped."""
    makers = [partial(built_in, which, seed) for which in range(-(-frames // FRAMES_EACH))]
    return MotionDatabase.build(body(), makers, workers=workers, progress=progress, folder=folder)


def trials(seed: int, seconds: float) -> list[Trial]:
    """The first seconds of one held-out take of each behaviour."""
    scenario, on = replace(load_scenario(SETTING), noise="clean", components={}), body()
    found = []
    for which in range(len(performer.BEHAVIOURS)):
        whole = built_in(which, seed + HELD_OUT)
        qpos = whole.qpos[: round(seconds * RATE_HZ) + 1]
        take = Take(whole.name, whole.subject, whole.source, whole.behaviour, whole.rate_hz, qpos)
        seen = simulate(on, take, mounts_of(scenario), tracker_of(scenario), noise_of(scenario), seed=seed)
        found.append(Trial(whole.name, seen, seen.truth_qpos[seen.frame_index]))
    return found


def fitted(method: Method, on: Body, learnt: MotionDatabase, rng: np.random.Generator) -> Reconstructor:
    """Trained on a database; a method that asks for takes is given them."""
    if isinstance(method, LearnsFromDatabase):
        return method.fit_database(on, learnt, rng)
    return method.fit(on, takes(learnt) if method.needs_examples else [], rng)


def takes(learnt: MotionDatabase) -> list[Take]:
    """The runs of a database as takes that start at the origin."""
    found = []
    for run in learnt.runs:
        rows = slice(run.start, run.stop)
        ground = courses(np.asarray(learnt.step[rows], float))
        found.append(Take(run.take, run.subject, run.source, run.behaviour, learnt.rate_hz, learnt.qpos(rows, ground)))
    return found


def courses(step: Floats) -> Floats:
    """(T, 3) ground frames (x, y, yaw) that steps (T, 3) lead through, from the origin."""
    yaw = np.cumsum(step[:, 2])
    before = yaw - step[:, 2]
    forward, left = step[:, 0], step[:, 1]
    x = np.cumsum(np.cos(before) * forward - np.sin(before) * left)
    y = np.cumsum(np.sin(before) * forward + np.cos(before) * left)
    return np.stack([x, y, yaw], axis=-1)


def error_deg(estimate: Floats, truth: Floats) -> float:
    """Joint angle error (D1) of configurations (F, 55)."""
    return float(np.rad2deg(np.abs(wrapped(estimate[:, 7:] - truth[:, 7:])).mean()))
