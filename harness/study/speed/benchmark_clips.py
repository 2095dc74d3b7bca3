"""Databases and held-out clips that methods are timed on: synthetic motion of any length.

The conditions are those of the accuracy tables: common body, the same stations and mounts, 40 Hz, exact calibration,
noise preset `clean`.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from harness.body import Body, build_body
from harness.core.arrays import Floats
from harness.core.humanoid24 import pack
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.experiment.scenarios import Scenario, load_scenario
from harness.mocap import synthetic
from harness.reconstruct import DatabaseMethod, Method, MotionDatabase, Reconstructor, make_method
from harness.score import wrap_difference
from harness.simulate import Simulation, simulate_tracker

RATE_HZ, TAKE_S = 40.0, 20.0
FRAMES_PER_TAKE = round(TAKE_S * RATE_HZ) + 1
HELD_OUT_SEED_OFFSET = 1_000_000
"""Added to the seed of a database to obtain that of its held-out takes."""
WARM_UP_FRAMES = round(1.0 * RATE_HZ)
"""Frames at the start of every take that are left out of times and errors, as in the accuracy tables."""
DEFAULT_SCENARIO = "walking"
"""The scenario whose stations and tracker are used by default."""


@dataclass(frozen=True, eq=False)
class BenchmarkClip:
    """A held-out take as the stations read it, and its truth."""

    take: str
    simulation: Simulation
    truth: Floats
    """(F, 55) true configuration at each tracker frame."""

    @classmethod
    def from_simulation(cls, take: str, simulation: Simulation) -> "BenchmarkClip":
        """A simulated take with the true poses at its frames."""
        return cls(take, simulation, simulation.truth_qpos[simulation.frame_index])


def build_common_body() -> Body:
    """Build the body that all benchmark takes move on."""
    return build_body()


def load_clean_scenario(name: str = DEFAULT_SCENARIO) -> Scenario:
    """Load a shipped scenario with the noise preset `clean` and no error components."""
    return replace(load_scenario(name), noise="clean", components={})


def generate_take(
    index: int, seed: int, behaviours: Sequence[str] = synthetic.BEHAVIOURS, frames: int = FRAMES_PER_TAKE
) -> BodyMotion:
    """Generate the take of an index >= 0; the sequence of takes has no end.

    Behaviours and performers alternate; after all combinations the seed is increased. Angles are not clipped.
    """
    performers = synthetic.REFERENCE_PERFORMERS
    round_index, index = divmod(index, len(behaviours) * len(performers))
    behaviour, performer = behaviours[index % len(behaviours)], performers[index // len(behaviours)]
    clip = synthetic.generate(behaviour, performer, 1, seed=seed + round_index, duration_s=TAKE_S, rate_hz=RATE_HZ)
    qpos = pack(clip.root_m, clip.world_from_root, clip.angles_rad)[:frames]
    return BodyMotion(f"{clip.name}_{seed + round_index}", clip.subject, clip.source, clip.behaviour, RATE_HZ, qpos)


def make_take_factories(
    frames: int, seed: int, behaviours: Sequence[str] = synthetic.BEHAVIOURS
) -> list[Callable[[], BodyMotion]]:
    """Picklable functions that generate takes with distinct names and `frames` frames in total; the last is cut."""
    complete, rest = divmod(frames, FRAMES_PER_TAKE)
    counts = [FRAMES_PER_TAKE] * complete + [rest] * (rest > 0)
    return [partial(generate_take, index, seed, behaviours, count) for index, count in enumerate(counts)]


def build_database(
    folder: Path,
    takes: Iterable[BodyMotion | Callable[[], BodyMotion]],
    *,
    workers: int = 1,
    progress: Callable[[str, int, int], None] | None = None,
) -> MotionDatabase:
    """Build the database of takes on the common body in `folder`, memory-mapped; a folder that exists is opened."""
    if folder.is_dir():
        return MotionDatabase.open(folder)
    return MotionDatabase.build(build_common_body(), takes, workers=workers, progress=progress, folder=folder)


def generate_held_out_takes(
    count: int, seed: int, seconds: float, behaviours: Sequence[str] = synthetic.BEHAVIOURS
) -> list[BodyMotion]:
    """Generate the first seconds of takes that no database of this seed contains."""
    frames = round(seconds * RATE_HZ) + 1
    return [generate_take(index, seed + HELD_OUT_SEED_OFFSET, behaviours, frames) for index in range(count)]


def generate_held_out_clips(seed: int, seconds: float) -> list[BenchmarkClip]:
    """Generate and simulate the first seconds of one held-out take of each behaviour."""
    takes = generate_held_out_takes(len(synthetic.BEHAVIOURS), seed, seconds)
    return simulate_clips(takes, seed, load_clean_scenario())


def simulate_clips(takes: Sequence[BodyMotion], seed: int, scenario: Scenario) -> list[BenchmarkClip]:
    """Simulate takes as the stations of a scenario read them."""
    body, sensors = build_common_body(), (scenario.nominal_mounts, scenario.device, scenario.noise_model)
    return [BenchmarkClip.from_simulation(t.name, simulate_tracker(body, t, *sensors, seed=seed)) for t in takes]


def fit_named_method(name: str, database: MotionDatabase, seed: int) -> Reconstructor:
    """Fit a registered method to a database."""
    return fit_method(make_method(name), build_common_body(), database, generator(seed, "method", name))


def fit_method(method: Method, body: Body, database: MotionDatabase, rng: np.random.Generator) -> Reconstructor:
    """Fit a method to a database; a method that takes examples instead receives its runs as takes."""
    if isinstance(method, DatabaseMethod):
        return method.fit_database(body, database, rng)
    return method.fit(body, extract_takes(database) if method.needs_examples else [], rng)


def extract_takes(database: MotionDatabase) -> list[BodyMotion]:
    """The runs of a database as takes that start at the origin."""
    takes = []
    for run in database.segments:
        rows = slice(run.start, run.stop)
        qpos = database.qpos(rows, integrate_steps(np.asarray(database.step[rows], float)))
        takes.append(BodyMotion(run.take, run.subject, run.source, run.behaviour, database.rate_hz, qpos))
    return takes


def integrate_steps(step: Floats) -> Floats:
    """Integrate steps (T, 3) (forward, left [m], turn [rad]) to ground frames (T, 3) (x, y, yaw) from the origin."""
    yaw = np.cumsum(step[:, 2])
    before = yaw - step[:, 2]
    forward, left = step[:, 0], step[:, 1]
    x = np.cumsum(np.cos(before) * forward - np.sin(before) * left)
    y = np.cumsum(np.sin(before) * forward + np.cos(before) * left)
    return np.stack([x, y, yaw], axis=-1)


def joint_angle_error_deg(estimate: Floats, truth: Floats) -> float:
    """Joint angle error (D1) between configurations (F, 55), averaged over frames and joints [deg]."""
    return float(np.rad2deg(np.abs(wrap_difference(estimate[:, 7:] - truth[:, 7:])).mean()))
