"""Clips for benchmarks of speed: any number of built-in takes to learn from, and simulated held-out takes.

Body, stations, mounts, rate (40 Hz) and calibration (exact) are those of the accuracy tables; the noise preset is
`clean`.
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
"""Offset from the seeds of takes for training to those of held-out takes."""
WARM_UP_FRAMES = round(1.0 * RATE_HZ)
"""Number of frames at the start of every take that are neither timed nor scored, as in the accuracy tables."""
DEFAULT_SCENARIO = "walking"
"""Scenario that stations and tracker are taken from by default."""


@dataclass(frozen=True, eq=False)
class BenchmarkClip:
    """A held-out take with its simulated stream and its truth."""

    take: str
    simulation: Simulation
    truth: Floats
    """(F, 55) true configuration at each frame."""


def build_common_body() -> Body:
    """The body of the standard skeleton, on which benchmarks run."""
    return humanoid.build_body()


def load_clean_scenario(name: str = DEFAULT_SCENARIO) -> Scenario:
    """A shipped scenario with the noise preset `clean`."""
    return replace(load_scenario(name), noise="clean", components={})


def generate_take(
    which: int, seed: int, behaviours: Sequence[str] = synthetic.BEHAVIOURS, frames: int = FRAMES_PER_TAKE
) -> BodyMotion:
    """Take number `which` of an endless series: behaviours and performers in turn, then the next seed."""
    people = synthetic.performer_names()
    again, which = divmod(which, len(behaviours) * len(people))
    behaviour, who = behaviours[which % len(behaviours)], people[which // len(behaviours)]
    clip = synthetic.generate(behaviour, who, 1, seed=seed + again, duration_s=TAKE_S, rate_hz=RATE_HZ)
    qpos = pack(clip.root_m, clip.world_from_root, clip.angles_rad)[:frames]
    return BodyMotion(f"{clip.name}_{seed + again}", clip.subject, clip.source, clip.behaviour, RATE_HZ, qpos)


def make_take_factories(
    frames: int, seed: int, behaviours: Sequence[str] = synthetic.BEHAVIOURS
) -> list[Callable[[], BodyMotion]]:
    """Functions that generate takes with `frames` frames in all and distinct names; the last take is cut."""
    whole, rest = divmod(frames, FRAMES_PER_TAKE)
    counts = [FRAMES_PER_TAKE] * whole + [rest] * (rest > 0)
    return [partial(generate_take, which, seed, behaviours, count) for which, count in enumerate(counts)]


def generate_held_out_takes(
    count: int, seed: int, seconds: float, behaviours: Sequence[str] = synthetic.BEHAVIOURS
) -> list[BodyMotion]:
    """The first seconds of `count` takes that no training database of this seed contains."""
    return [
        generate_take(w, seed + HELD_OUT_SEED_OFFSET, behaviours, round(seconds * RATE_HZ) + 1) for w in range(count)
    ]


def generate_held_out_clips(seed: int, seconds: float) -> list[BenchmarkClip]:
    """The first seconds of one held-out take of each behaviour."""
    return simulate_clips(
        generate_held_out_takes(len(synthetic.BEHAVIOURS), seed, seconds), seed, load_clean_scenario()
    )


def simulate_clips(takes: Sequence[BodyMotion], seed: int, worn: Scenario) -> list[BenchmarkClip]:
    """Simulate the streams of takes for the stations of a scenario."""
    body, clips = build_common_body(), []
    for take in takes:
        seen = simulate_tracker(body, take, mounts_of(worn), tracker_of(worn), noise_of(worn), seed=seed)
        clips.append(BenchmarkClip(take.name, seen, seen.truth_qpos[seen.frame_index]))
    return clips


def fit_named_method(name: str, learnt: MotionDatabase, seed: int) -> Reconstructor:
    """The method of that name, fitted to a database on the standard body."""
    return fit_method(registry.resolve(name), build_common_body(), learnt, generator(seed, "method", name))


def fit_method(method: Method, on: Body, learnt: MotionDatabase, rng: np.random.Generator) -> Reconstructor:
    """Fit a method to a database; a method that takes examples receives the database's runs as takes."""
    if isinstance(method, DatabaseMethod):
        return method.fit_database(on, learnt, rng)
    return method.fit(on, extract_takes(learnt) if method.needs_examples else [], rng)


def extract_takes(learnt: MotionDatabase) -> list[BodyMotion]:
    """The runs of a database as takes that begin at the origin."""
    found = []
    for run in learnt.runs:
        rows = slice(run.start, run.stop)
        ground = integrate_steps(np.asarray(learnt.step[rows], float))
        found.append(
            BodyMotion(run.take, run.subject, run.source, run.behaviour, learnt.rate_hz, learnt.qpos(rows, ground))
        )
    return found


def integrate_steps(step: Floats) -> Floats:
    """Ground frames (T, 3) (x, y, yaw) [m, m, rad] after each of the steps (T, 3), starting at the origin."""
    yaw = np.cumsum(step[:, 2])
    before = yaw - step[:, 2]
    forward, left = step[:, 0], step[:, 1]
    x = np.cumsum(np.cos(before) * forward - np.sin(before) * left)
    y = np.cumsum(np.sin(before) * forward + np.cos(before) * left)
    return np.stack([x, y, yaw], axis=-1)


def joint_angle_error_deg(estimate: Floats, truth: Floats) -> float:
    """Mean joint angle error (metric D1) of configurations (F, 55) [deg]."""
    return float(np.rad2deg(np.abs(wrap_angle(estimate[:, 7:] - truth[:, 7:])).mean()))
