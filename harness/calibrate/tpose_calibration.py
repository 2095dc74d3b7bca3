"""T-pose calibration (Kim et al. 2012, eq. 1; docs/papers.md B2; docs/calibration.md).

While the performer stands in T-pose for some seconds, the readings give the room's frame and the mount of each
tracker. Gravity is the tracker's z axis (docs/is900.md 5.3). The performer's position and heading in the pose define
the world's frame: by default its origin, facing x. Straps may be put on in any orientation.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.special import chdtri

from harness.body import Body, Mount, body_scale, tpose
from harness.calibrate.held_pose_model import FREE_DOFS, HeldPoseFit, HeldPoseModel
from harness.calibrate.hold import UnusableHold, measure_hold
from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.core.calibration import Calibration
from harness.stream import TrackerFrame

LEVEL_FROM_TRACKER: Floats = np.array([0.0, 1.0, 0.0, 0.0])
"""World from tracker without the heading: x forward, y right, z down is half a turn about x from the world's axes."""
CONFIDENCE = 0.99
"""Probability that a T-pose with the errors of `held_pose_model` is accepted [choice]."""
EXCHANGE_ODDS = 100.0
"""Stations are reported as exchanged if exchanging them gives a T-pose that is this many times likelier [choice]."""
HEADING_SD_RAD = float(np.deg2rad(20.0))
"""Largest standard deviation of the heading that is accepted [rad] [choice]."""
_STATURE_M = 1.755
"""Stature of the standard body (harness/body/anatomy.py) [m]."""


@dataclass(frozen=True, eq=False)
class TPoseCalibration:
    """Result of a T-pose calibration of S stations."""

    calibration: Calibration
    """Mounts and room, of kind `tpose`."""
    residual_m: Floats
    """(S,) distance of each station from its nominal position [m]: pose error, proportions and mounts."""
    moved_m: Floats
    """(S,) three quarters of its readings lie within this distance of the median [m]."""
    seconds: float
    """Length of the hold [s]."""
    heading_sd_rad: float
    """Standard deviation of the performer's heading [rad]."""

    def __post_init__(self) -> None:
        freeze(self, residual_m=("S",), moved_m=("S",))


def calibrate_tpose(
    frames: Sequence[TrackerFrame], body: Body, mounts: Sequence[Mount], pose: Floats | None = None
) -> TPoseCalibration:
    """Calibrate from frames of a performer in T-pose, with trackers near their nominal mounts in any orientation.

    `mounts` are in the order of the stream's stations. `pose` (55,) is the configuration that the performer holds;
    the default is the T-pose at the world's origin. UnusableHold says what is wrong with the readings and what to do.
    BadInput for stations that are not the stream's.
    """
    names = [mount.station for mount in mounts]
    hold = measure_hold(frames, names)
    model = HeldPoseModel(body, mounts, tpose(body.skeleton) if pose is None else pose)
    level_m = rotations.rotate(LEVEL_FROM_TRACKER, hold.position_m)
    fit = model.fit(level_m)
    require_heading(model.heading_sd_rad, mounts)
    _require_no_exchange(model, level_m, fit, mounts)
    _require_pose(fit, names, body)
    beside_m, turned = model.decompose_residual(fit.residual_m)
    world_from_tracker = rotations.multiply(rotations.about_z(fit.heading_rad), LEVEL_FROM_TRACKER)
    bone_from_world = rotations.inverse(rotations.multiply(rotations.exp(turned), model.world_from_bone))
    world_from_station = rotations.multiply(world_from_tracker, hold.tracker_from_station)
    calibration = Calibration(
        kind="tpose",
        stations=tuple(names),
        bones=tuple(mount.bone for mount in mounts),
        mount_m=model.mount_m + rotations.rotate(bone_from_world, beside_m),
        bone_from_station=rotations.multiply(bone_from_world, world_from_station),
        world_from_tracker=world_from_tracker,
        tracker_origin_m=fit.origin_m,
    )
    residual_m = np.linalg.norm(fit.residual_m, axis=1)
    return TPoseCalibration(calibration, residual_m, hold.moved_m, hold.seconds, model.heading_sd_rad)


def _require_no_exchange(model: HeldPoseModel, level_m: Floats, fit: HeldPoseFit, mounts: Sequence[Mount]) -> None:
    """UnusableHold when exchanging two stations, or all left and right ones, makes a far likelier T-pose."""
    fits = [(model.fit(level_m[rows]).chi_square, pairs) for rows, pairs in possible_exchanges(mounts)]
    best, pairs = min(fits, key=lambda each: each[0])
    if best <= _chi_square_limit(len(mounts)) and fit.chi_square - best >= 2.0 * np.log(EXCHANGE_ODDS):
        raise exchange_error(mounts, pairs, "T-pose")


def possible_exchanges(mounts: Sequence[Mount]) -> list[tuple[list[int], list[tuple[int, int]]]]:
    """Orders of the stations with two of them exchanged, or all left and right ones, and the pairs that change."""
    bones = [mount.bone for mount in mounts]
    sides = [(bones.index(b), bones.index(f"r{b[1:]}")) for b in bones if b[0] == "l" and f"r{b[1:]}" in bones]
    exchanges = []
    for pairs in [*([pair] for pair in combinations(range(len(mounts)), 2)), sides]:
        rows = list(range(len(mounts)))
        for a, b in pairs:
            rows[a], rows[b] = b, a
        exchanges.append((rows, pairs))
    return exchanges


def exchange_error(mounts: Sequence[Mount], pairs: Sequence[tuple[int, int]], held: str) -> UnusableHold:
    """The error for stations that are worn at each other's places; `held` is what to hold again."""
    names = " and ".join(f"{mounts[a].station!r} with {mounts[b].station!r}" for a, b in pairs)
    return UnusableHold(
        f"Stations look exchanged: {names}.",
        f"Check which tracker is worn where, or name the stations the other way round; then hold the {held} again.",
    )


def require_heading(heading_sd_rad: float, mounts: Sequence[Mount]) -> None:
    """UnusableHold when the stations do not tell which way the performer faces."""
    if heading_sd_rad > HEADING_SD_RAD:
        raise UnusableHold(
            f"Stations {', '.join(mount.station for mount in mounts)} do not determine which way the performer faces.",
            "Wear trackers on both sides of the body: a left and a right wrist, hand or ankle.",
        )


def _require_pose(fit: HeldPoseFit, names: Sequence[str], body: Body) -> None:
    """UnusableHold when the stations are too far from a T-pose of this body."""
    if fit.chi_square <= _chi_square_limit(len(names)):
        return
    residual_m = np.linalg.norm(fit.residual_m, axis=1)
    rms_m, worst = float(np.sqrt(np.mean(residual_m**2))), int(np.argmax(residual_m))
    raise UnusableHold(
        f"This is not a T-pose of the body: stations are {1e3 * rms_m:.0f} mm from their places (root mean square, "
        f"{rms_m / (_STATURE_M * body_scale(body.skeleton)):.1%} of the stature), {names[worst]!r} most with "
        f"{1e3 * residual_m[worst]:.0f} mm.",
        "Stand upright, arms straight out to the sides, palms down, feet below the hips; or give the performer's body.",
    )


def _chi_square_limit(stations: int) -> float:
    """Largest squared Mahalanobis residual that is accepted as a T-pose."""
    degrees = max(3 * stations - len(FREE_DOFS), 1)
    return float(chdtri(degrees, 1.0 - CONFIDENCE))  # scipy.stats has it too, but loads for a second
