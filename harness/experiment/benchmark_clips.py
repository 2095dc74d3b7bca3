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
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.experiment.clip_evaluation import mounts_of, noise_of, tracker_of
from harness.experiment.scenario import Scenario, load_scenario
from harness.mocap import synthetic
from harness.reconstruct import registry
from harness.reconstruct.contract import DatabaseMethod, Method, Reconstructor
from harness.reconstruct.database import MotionDatabase
from harness.score.angles import wrap_angle
from harness.simulate.simulation import Simulation, simulate_tracker

RATE_HZ, TAKE_S = 40.0, 20.0
FRAMES_PER_TAKE = round(TAKE_S * RATE_HZ) + 1
HELD_OUT_SEED_OFFSET = 1_000_000
"""Seeds of held-out takes start so much higher."""
WARM_UP_FRAMES = round(1.0 * RATE_HZ)
"""Frames at the start of every take that count neither for time nor for error, as in the tables."""
DEFAULT_SCENARIO = "walking"
"""The scenario whose stations and tracker are taken, where no other is named."""


@dataclass(frozen=True, eq=False)
class BenchmarkClip:
    """A held-out take as the trackers read it, and its truth."""

    take: str
    simulation: Simulation
    truth: Floats
    """(F, 55) at each frame."""


def build_common_body() -> Body:
    """The common body."""
    return humanoid.build_body()


def load_clean_scenario(name: str = DEFAULT_SCENARIO) -> Scenario:
    """One of the project's own, as good as it can be: level `clean`."""
    return replace(load_scenario(name), noise="clean", components={})


def generate_take(
    which: int, seed: int, behaviours: Sequence[str] = synthetic.BEHAVIOURS, frames: int = FRAMES_PER_TAKE
) -> BodyMotion:
    """One of endlessly many takes: behaviours and performers in turn, then a new seed; the angles as they are."""
    people = synthetic.performer_names()
    again, which = divmod(which, len(behaviours) * len(people))
    behaviour, who = behaviours[which % len(behaviours)], people[which // len(behaviours)]
    clip = synthetic.generate(behaviour, who, 1, seed=seed + again, duration_s=TAKE_S, rate_hz=RATE_HZ)
    qpos = pack(clip.root_m, clip.world_from_root, clip.angles_rad)[:frames]
    return BodyMotion(f"{clip.name}_{seed + again}", clip.subject, clip.source, clip.behaviour, RATE_HZ, qpos)


def make_take_factories(
    frames: int, seed: int, behaviours: Sequence[str] = synthetic.BEHAVIOURS
) -> list[Callable[[], BodyMotion]]:
    """Functions that make takes of exactly so many frames together, all with names of their own; the last is cut."""
    whole, rest = divmod(frames, FRAMES_PER_TAKE)
    counts = [FRAMES_PER_TAKE] * whole + [rest] * (rest > 0)
    return [partial(generate_take, which, seed, behaviours, count) for which, count in enumerate(counts)]


def generate_held_out_takes(
    count: int, seed: int, seconds: float, behaviours: Sequence[str] = synthetic.BEHAVIOURS
) -> list[BodyMotion]:
    """The first seconds of takes that are in no database of this seed."""
    return [
        generate_take(w, seed + HELD_OUT_SEED_OFFSET, behaviours, round(seconds * RATE_HZ) + 1) for w in range(count)
    ]


def generate_held_out_clips(seed: int, seconds: float) -> list[BenchmarkClip]:
    """The first seconds of one held-out take of each behaviour."""
    return simulate_clips(
        generate_held_out_takes(len(synthetic.BEHAVIOURS), seed, seconds), seed, load_clean_scenario()
    )


def simulate_clips(takes: Sequence[BodyMotion], seed: int, worn: Scenario) -> list[BenchmarkClip]:
    """Takes as the stations of a scenario read them."""
    on, found = build_common_body(), []
    for take in takes:
        seen = simulate_tracker(on, take, mounts_of(worn), tracker_of(worn), noise_of(worn), seed=seed)
        found.append(BenchmarkClip(take.name, seen, seen.truth_qpos[seen.frame_index]))
    return found


def fit_named_method(name: str, learnt: MotionDatabase, seed: int) -> Reconstructor:
    """The method of that name, which has learnt from a database."""
    return fit_method(registry.resolve(name), build_common_body(), learnt, generator(seed, "method", name))


def fit_method(method: Method, on: Body, learnt: MotionDatabase, rng: np.random.Generator) -> Reconstructor:
    """Trained on a database; a method that asks for takes is given them."""
    if isinstance(method, DatabaseMethod):
        return method.fit_database(on, learnt, rng)
    return method.fit(on, extract_takes(learnt) if method.needs_examples else [], rng)


def extract_takes(learnt: MotionDatabase) -> list[BodyMotion]:
    """The runs of a database as takes that start at the origin."""
    found = []
    for run in learnt.segments:
        rows = slice(run.start, run.stop)
        ground = integrate_steps(np.asarray(learnt.step[rows], float))
        found.append(
            BodyMotion(run.take, run.subject, run.source, run.behaviour, learnt.rate_hz, learnt.qpos(rows, ground))
        )
    return found


def integrate_steps(step: Floats) -> Floats:
    """(T, 3) ground frames (x, y, yaw) that steps (T, 3) lead through, from the origin."""
    yaw = np.cumsum(step[:, 2])
    before = yaw - step[:, 2]
    forward, left = step[:, 0], step[:, 1]
    x = np.cumsum(np.cos(before) * forward - np.sin(before) * left)
    y = np.cumsum(np.sin(before) * forward + np.cos(before) * left)
    return np.stack([x, y, yaw], axis=-1)


def joint_angle_error_deg(estimate: Floats, truth: Floats) -> float:
    """Joint angle error (D1) of configurations (F, 55)."""
    return float(np.rad2deg(np.abs(wrap_angle(estimate[:, 7:] - truth[:, 7:])).mean()))
