"""Accuracy of the calibration from eight poses, on simulated performers (docs/calibration.md).

Errors against the truth stand next to the Cramér-Rao bound and to the errors of the mean skeleton.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.bench.common import MOUNTS
from harness.body import build_body
from harness.calibrate import (
    POSES,
    PoseCalibration,
    SkeletonPrior,
    UnusableHold,
    calibrate_poses,
    fit_skeleton_prior,
    pose_configuration,
)
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.number_format import format_fixed
from harness.core.progress import ProgressCallback
from harness.core.seeds import generator
from harness.core.skeleton import Skeleton
from harness.core.text_table import Table
from harness.experiment import TrackerSession
from harness.mocap import POPULATION_SIZE, LibraryFolders, read_skeletons
from harness.mocap.synthetic import sample_skeletons
from harness.simulate import TrackerConfig, hold_poses, hold_times_s, noise_preset, perturb_mounts, simulate_tracker
from harness.stream import TrackerFrame

HOLD_S, MOVE_S, HOLD_MARGIN_S = 3.0, 1.5, 0.2
"""Duration of a hold, of the move to the next, and of the margin that is left out at both ends of a hold [s]."""
MOUNT_OFFSET_SD_M = 0.01
"""Standard deviation of the mounts' offset on each axis [m]. The orientation of a tracker is arbitrary."""


CalibrationErrors = Mapping[str, Floats]
"""Errors of the calibration of one performer with N bones and S stations, by name:

- length_m (N,): errors of bone lengths; length_sd_m: their Cramér-Rao bound; mean_m: errors of the mean skeleton of
  other people [m];
- from_prior (N,): whether the length comes from the prior instead of the trackers;
- mount_m (S,): errors of mounts in the frames of the bones that carry the trackers; mount_sd_m: their bound [m];
- elbow_m (S,): the same errors, for trackers on wrists measured from the elbow [m]. The joint between radius and wrist
  turns about their common line. No tracker observes its place on that line;
- turn_rad (S,): errors of the mounts' orientation; turn_sd_rad: their bound [rad];
- miss_rad (): estimated standard deviation of the angles by which poses were missed [rad].
"""


@dataclass(frozen=True)
class ErrorStatistics:
    """Statistics of errors over performers and over bones or stations, in `unit` (mm or deg)."""

    what: str
    unit: str
    rms: float
    median: float
    worst: float
    bound: float
    """Root mean square of the Cramér-Rao bounds, which include the priors on bone lengths and mounts."""
    mean_skeleton: float
    """Root mean square of the mean skeleton's errors; NaN where it does not apply."""
    count: int

    def as_dict(self) -> dict[str, object]:
        """Content for JSON; None stands for NaN."""
        return {name: None if value != value else value for name, value in vars(self).items() if name != "what"}

    def row(self) -> list[str]:
        numbers = [self.rms, self.median, self.worst, self.bound, self.mean_skeleton]
        return [
            f"{self.what} [{self.unit}]",
            *("" if np.isnan(x) else format_fixed(x, 2) for x in numbers),
            str(self.count),
        ]


TABLE_HEADER = ["error", "rms", "median", "worst", "bound", "mean skeleton", "values"]


@dataclass(frozen=True, eq=False)
class CalibrationAccuracy:
    """Errors of several performers."""

    miss_rad: float
    noise: str
    source: str
    done: tuple[CalibrationErrors, ...]
    refused: dict[str, str]
    """Performer -> why the calibration was refused."""
    seconds: tuple[float, ...]
    """Processor time of each calibration [s]."""

    def spreads(self) -> list[ErrorStatistics]:
        """Statistics of bone lengths (all, determined by the trackers, from the prior), mounts and orientations.

        Empty when every performer was refused.
        """
        if not self.done:
            return []
        of = {name: np.array([errors[name] for errors in self.done]) for name in self.done[0]}
        lengths = [1e3 * of[name] for name in ("length_m", "length_sd_m", "mean_m")]
        prior, none = of["from_prior"], np.full(of["mount_m"].shape, np.nan)
        kinds = ("bone lengths", prior | ~prior), ("determined by trackers", ~prior), ("from the prior", prior)
        turned = np.rad2deg(of["turn_rad"]), np.rad2deg(of["turn_sd_rad"])
        return [
            *(_error_statistics(what, "mm", *(x[kept] for x in lengths)) for what, kept in kinds if kept.any()),
            _error_statistics("mounts", "mm", 1e3 * of["mount_m"], 1e3 * of["mount_sd_m"], none),
            _error_statistics("mounts, wrists from the elbow", "mm", 1e3 * of["elbow_m"], none, none),
            _error_statistics("mounts turned", "deg", *turned, none),
        ]

    def as_dict(self) -> dict[str, object]:
        """Content for JSON."""
        return {
            "performers": len(self.seconds),
            "refused": self.refused,
            "bones_of": self.source,
            "noise": self.noise,
            "miss_deg": float(np.rad2deg(self.miss_rad)),
            "miss_found_deg": [float(np.rad2deg(errors["miss_rad"])) for errors in self.done],
            "seconds": list(self.seconds),
            "errors": {spread.what: spread.as_dict() for spread in self.spreads()},
        }

    def lines(self) -> list[str]:
        """Lines for a terminal."""
        lines = [f"{len(self.seconds)} performers, bones learnt from {self.source}"]
        lines += [f"noise {self.noise!r}, poses missed by {np.rad2deg(self.miss_rad):.2f} deg"]
        if self.done:
            found = np.rad2deg([errors["miss_rad"] for errors in self.done])
            lines[1] += f" (found: {found.mean():.2f}, {found.min():.2f} to {found.max():.2f})"
        table = Table(TABLE_HEADER, [spread.row() for spread in self.spreads()])
        return [
            *lines,
            *(table.lines() if self.done else []),
            *(f"{name}: {why}" for name, why in self.refused.items()),
        ]


def measure_calibration_accuracy(
    count: int,
    *,
    miss_rad: float = float(np.deg2rad(2.5)),
    noise: str = "default",
    seed: int = 1,
    folder: LibraryFolders | None = None,
    progress: ProgressCallback = lambda name, done, planned: None,
) -> CalibrationAccuracy:
    """Measure calibration errors of `count` performers, each with a prior on bone lengths from other people.

    Performers are drawn from the built-in population, or are the subjects of the ASF files below `folder`. BadInput,
    BadFile, UnknownName.
    """
    done, refused, seconds = [], {}, []
    for number, (name, own, space) in enumerate(people := _performers(count, folder), 1):
        session = _session(f"{number} {name}", own, noise, seed)
        frames, began_s = simulate_pose_holds(session, miss_rad), time.process_time()
        try:
            done.append(_calibration_errors(calibrate_poses(frames, space, MOUNTS), session))
        except UnusableHold as error:
            refused[session.name] = str(error)
        seconds.append(time.process_time() - began_s)
        progress(name, number, len(people))
    return CalibrationAccuracy(miss_rad, noise, people[0][2].source, tuple(done), refused, tuple(seconds))


def simulate_pose_holds(session: TrackerSession, miss_rad: float) -> list[list[TrackerFrame]]:
    """Frames of the tracker while the performer holds each of the eight poses."""
    configurations = [pose_configuration(pose, session.body.skeleton) for pose in POSES]
    rng = generator(session.seed, "calibration trial", session.name)
    take = hold_poses(session.body, configurations, miss_rad=miss_rad, rng=rng, hold_s=HOLD_S, move_s=MOVE_S)
    seen = simulate_tracker(session.body, take, session.true_mounts, session.tracker, session.noise, seed=session.seed)
    # Frames are selected by the host's clock, on which they arrive up to 0.1 s late.
    holds = hold_times_s(len(POSES), HOLD_S, MOVE_S)
    return [[f for f in seen.frames if a + HOLD_MARGIN_S <= f.received_s <= b - HOLD_MARGIN_S + 0.1] for a, b in holds]


def _performers(count: int, folder: LibraryFolders | None) -> list[tuple[str, Skeleton, SkeletonPrior]]:
    """Name, skeleton and prior from other people, for each of `count` performers."""
    if folder is None:
        everyone = sample_skeletons(POPULATION_SIZE + count, seed=0)
        space = fit_skeleton_prior(
            everyone[:POPULATION_SIZE], source=f"{POPULATION_SIZE} other people of the built-in spread"
        )
        return [
            (f"person {POPULATION_SIZE + n + 1}", skeleton, space)
            for n, skeleton in enumerate(everyone[POPULATION_SIZE:])
        ]
    known = read_skeletons(folder)
    names = [list(known)[n % len(known)] for n in range(count)]
    spaces = {name: _bone_space_without(known, name) for name in set(names)}
    return [(name, known[name], spaces[name]) for name in names]


def _bone_space_without(known: Mapping[str, Skeleton], name: str) -> SkeletonPrior:
    others = [skeleton for other, skeleton in known.items() if other != name]
    return fit_skeleton_prior(others, source=f"the {len(others)} other people of the library")


def _session(name: str, own: Skeleton, noise: str, seed: int) -> TrackerSession:
    worn = perturb_mounts(MOUNTS, beside_m=MOUNT_OFFSET_SD_M, turned_rad=np.pi, seed=seed, session=name)
    tracker = TrackerConfig(slot_s=0.0) if noise == "clean" else TrackerConfig()
    return TrackerSession(name, seed, build_body(own), MOUNTS, worn, tracker, noise_preset(noise))


def _calibration_errors(found: PoseCalibration, session: TrackerSession) -> CalibrationErrors:
    true, own, known = session.true_calibration, session.body.skeleton, found.calibration
    off_m = known.mount_m - true.mount_m
    elbow_m = np.array(off_m)
    for row, bone in enumerate(known.bones):
        if bone in ("lwrist", "rwrist"):
            radius = own.index(f"{bone[0]}radius")
            elbow_m[row] += found.skeleton.bone_m[radius] - own.bone_m[radius]
    return {
        "length_m": found.skeleton.length_m - own.length_m,
        "length_sd_m": found.length_sd_m,
        "from_prior": found.from_prior,
        "mean_m": found.mean_m - own.length_m,
        "mount_m": np.linalg.norm(off_m, axis=1),
        "elbow_m": np.linalg.norm(elbow_m, axis=1),
        "mount_sd_m": found.mount_sd_m,
        "turn_rad": rotations.angle_between_rad(known.bone_from_station, true.bone_from_station),
        "turn_sd_rad": found.mount_sd_rad,
        "miss_rad": np.asarray(found.hinge_error_rad),
    }


def _error_statistics(what: str, unit: str, off: Floats, bound: Floats, mean: Floats) -> ErrorStatistics:
    size = np.abs(off)
    return ErrorStatistics(
        what, unit, _rms(off), float(np.median(size)), float(size.max()), _rms(bound), _rms(mean), int(size.size)
    )


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
