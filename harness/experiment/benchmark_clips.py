"""What methods are timed on: built-in takes to learn from, however many, and held-out ones as trackers see them.

The setting is that of the accuracy tables: their body, stations and mounts, 40 Hz, exact calibration, level `clean`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from harness.body import humanoid
from harness.body.humanoid import Body
from harness.core.arrays import Floats
from harness.core.humanoid24 import pack
from harness.core.motion import Take
from harness.core.seeds import generator
from harness.experiment.clip_evaluation import mounts_of, noise_of, tracker_of
from harness.experiment.scenario import Scenario, load_scenario
from harness.mocap import synthetic
from harness.reconstruct import registry
from harness.reconstruct.contract import LearnsFromDatabase, Method, Reconstructor
from harness.reconstruct.database import MotionDatabase
from harness.score.angles import wrapped
from harness.simulate.simulation import Simulation, simulate

RATE_HZ, TAKE_S = 40.0, 20.0
FRAMES_EACH = round(TAKE_S * RATE_HZ) + 1
HELD_OUT = 1_000_000
"""Seeds of held-out takes start so much higher."""
WARM_UP = round(1.0 * RATE_HZ)
"""Frames at the start of every take that count neither for time nor for error, as in the tables."""
SETTING = "walking"
"""The scenario whose stations and tracker are taken, where no other is named."""


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


def scenario(name: str = SETTING) -> Scenario:
    """One of the project's own, as good as it can be: level `clean`."""
    return replace(load_scenario(name), noise="clean", components={})


def built_in(
    which: int, seed: int, behaviours: Sequence[str] = synthetic.BEHAVIOURS, frames: int = FRAMES_EACH
) -> Take:
    """One of endlessly many takes: behaviours and performers in turn, then a new seed; the angles as they are."""
    people = synthetic.performers()
    again, which = divmod(which, len(behaviours) * len(people))
    behaviour, who = behaviours[which % len(behaviours)], people[which // len(behaviours)]
    clip = synthetic.generate(behaviour, who, 1, seed=seed + again, duration_s=TAKE_S, rate_hz=RATE_HZ)
    qpos = pack(clip.root_m, clip.world_from_root, clip.angles_rad)[:frames]
    return Take(f"{clip.name}_{seed + again}", clip.subject, clip.source, clip.behaviour, RATE_HZ, qpos)


def makers(frames: int, seed: int, behaviours: Sequence[str] = synthetic.BEHAVIOURS) -> list[Callable[[], Take]]:
    """Functions that make takes of exactly so many frames together, all with names of their own; the last is cut."""
    whole, rest = divmod(frames, FRAMES_EACH)
    counts = [FRAMES_EACH] * whole + [rest] * (rest > 0)
    return [partial(built_in, which, seed, behaviours, count) for which, count in enumerate(counts)]


def held_out(count: int, seed: int, seconds: float, behaviours: Sequence[str] = synthetic.BEHAVIOURS) -> list[Take]:
    """The first seconds of takes that are in no database of this seed."""
    return [built_in(w, seed + HELD_OUT, behaviours, round(seconds * RATE_HZ) + 1) for w in range(count)]


def trials(seed: int, seconds: float) -> list[Trial]:
    """The first seconds of one held-out take of each behaviour."""
    return trials_of(held_out(len(synthetic.BEHAVIOURS), seed, seconds), seed, scenario())


def trials_of(takes: Sequence[Take], seed: int, worn: Scenario) -> list[Trial]:
    """Takes as the stations of a scenario read them."""
    on, found = body(), []
    for take in takes:
        seen = simulate(on, take, mounts_of(worn), tracker_of(worn), noise_of(worn), seed=seed)
        found.append(Trial(take.name, seen, seen.truth_qpos[seen.frame_index]))
    return found


def learner(name: str, learnt: MotionDatabase, seed: int) -> Reconstructor:
    """The method of that name, which has learnt from a database."""
    return fitted(registry.resolve(name), body(), learnt, generator(seed, "method", name))


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
