"""Classifies which calibration pose a performer holds, so that poses are taken in their order.

It compares the stations' positions relative to each other, and their rotation since the first pose. It needs only the
nominal mounts. A rest or a wrong pose puts some station half a metre or 45 deg off. Body proportions, mounts and a
poor stance explain a quarter of that.
"""

from collections.abc import Sequence

import numpy as np

from harness.body import Body, Kinematics, Mount, locate_mounts
from harness.calibrate.hold import HoldReadings
from harness.calibrate.tpose_calibration import LEVEL_FROM_TRACKER
from harness.core import rotations
from harness.core.arrays import Floats

BODY_SCALES = 0.85, 1.15
"""Range of the performer's size over the body's: 1.5 m to 2 m of stature [choice]."""
LEVER_M = 0.3
"""Converts a rotation into the displacement of the end of a forearm or a shin [m/rad] [choice]."""
FIRST_POSE_DISTANCE_M, POSE_DISTANCE_M = 0.26, 0.40
"""Largest RMS distance of stations from a pose that is accepted [m]: for the first pose, which is compared by positions
alone, and for the others. Hinge errors of 5 deg stay within [choice]."""
AMBIGUITY_M = 0.02
"""A pose is accepted if no other one is nearer by more than this [m] [choice]."""


class PoseClassifier:
    """Distances from N poses (55,) of a body, for stations near these mounts."""

    def __init__(self, body: Body, mounts: Sequence[Mount], poses: Sequence[Floats]) -> None:
        kinematics = Kinematics(body)
        bones, mount_m, turn = locate_mounts(body.skeleton, mounts)
        place_m, turned = np.empty((len(poses), len(mounts), 3)), np.empty((len(poses), len(mounts), 4))
        for number, pose in enumerate(poses):
            kinematics.set(pose)
            place_m[number], turned[number] = kinematics.station_poses(bones, mount_m, turn)
        self._middle_m: Floats = place_m.mean(axis=1)
        """(N, 3) mean of the stations' positions in each pose [m]."""
        self._place_m: Floats = place_m - self._middle_m[:, None]
        """(N, S, 3) station positions about their mean [m]."""
        self._turned = rotations.multiply(turned, rotations.inverse(turned[0]))
        """(N, S, 4) rotation of each station since the first pose, world axes."""

    def distances_m(self, now: HoldReadings, first: HoldReadings | None = None) -> Floats:
        """(N,) RMS distance of the stations from each pose [m], at the best position, heading and size.

        Stations whose position is NaN do not count.
        With the readings of the `first` pose, rotations since then count as well.
        """
        return np.array([self._distance_m(now, first, pose) for pose in range(len(self._place_m))])

    def matches(self, pose: int, now: HoldReadings, first: HoldReadings | None = None) -> bool:
        """Whether the readings are compatible with this pose."""
        off_m = self.distances_m(now, first)
        return bool(off_m[pose] <= min(float(off_m.min()) + AMBIGUITY_M, _distance_limit_m(first)))

    def nearest(self, now: HoldReadings, first: HoldReadings | None = None) -> int | None:
        """Index of the nearest pose; None when all are too far away."""
        off_m = self.distances_m(now, first)
        best = int(np.argmin(off_m))
        return best if off_m[best] <= _distance_limit_m(first) else None

    def aligned_m(self, pose: int, position_m: Floats) -> tuple[Floats, Floats]:
        """Positions (S, 3) in the frame of a pose at the body's size, and distances (S,) from their places in it [m].

        Place, heading and size are those that fit the pose best.
        """
        heading, away_m = _align(position_m, self._place_m[pose])
        level_m = rotations.rotate(heading, position_m - position_m.mean(axis=0))
        size = _size(level_m, self._place_m[pose])
        return level_m / size + self._middle_m[pose], np.linalg.norm(away_m, axis=1)

    def _distance_m(self, now: HoldReadings, first: HoldReadings | None, pose: int) -> float:
        heard = np.isfinite(now.position_m).all(axis=1)
        heading, away_m = _align(now.position_m[heard], self._place_m[pose, heard])
        squares = np.sum(away_m**2, axis=1)
        if first is not None:
            before, _ = _align(first.position_m, self._place_m[0])
            turned = rotations.multiply(now.tracker_from_station, rotations.inverse(first.tracker_from_station))[heard]
            seen = rotations.multiply(rotations.multiply(heading, turned), rotations.inverse(before))
            squares = squares + (LEVER_M * rotations.angle_between_rad(seen, self._turned[pose, heard])) ** 2
        return float(np.sqrt(np.mean(squares)))


def _distance_limit_m(first: HoldReadings | None) -> float:
    return FIRST_POSE_DISTANCE_M if first is None else POSE_DISTANCE_M


def _align(found_m: Floats, place_m: Floats) -> tuple[Floats, Floats]:
    """Rotation (4,) about the vertical that fits stations (S, 3) to nominal ones (S, 3) best, and the residual (S, 3).

    Both sets are taken about their means, at the size that fits best.
    """
    level_m, place_m = (
        rotations.rotate(LEVEL_FROM_TRACKER, found_m - found_m.mean(axis=0)),
        place_m - place_m.mean(axis=0),
    )
    a, b = (points[:, :2] @ [1.0, 1.0j] for points in (level_m, place_m))
    heading = rotations.about_z(float(np.angle(np.vdot(a, b))))
    turned_m = rotations.rotate(heading, level_m)
    return rotations.multiply(heading, LEVEL_FROM_TRACKER), turned_m - _size(turned_m, place_m) * place_m


def _size(turned_m: Floats, place_m: Floats) -> float:
    """The performer's size over the body's."""
    return float(np.clip(np.sum(turned_m * place_m) / max(float(np.sum(place_m**2)), 1e-9), *BODY_SCALES))
