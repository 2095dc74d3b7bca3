"""Which of some poses someone holds, told by where the stations are to each other and how they have turned since the
first one: to keep poses in their order.

Nothing need be known but about where trackers are worn. A performer who rests, or holds a pose that is not the next
one, has some station half a metre elsewhere or turned by half a right angle; proportions, mounts and a poor stance make
a quarter of it.
"""

from collections.abc import Sequence

import numpy as np

from harness.body.humanoid import Body
from harness.body.kinematics import Kinematics
from harness.body.mounts import Mount, locate_mount
from harness.calibrate.hold import HoldReadings
from harness.calibrate.tpose_calibration import LEVEL_FROM_TRACKER
from harness.core import rotations
from harness.core.arrays import Floats

BODY_SCALES = 0.85, 1.15
"""Performers are so many times as large as the body: 1.5 m to 2 m [choice]."""
LEVER_M = 0.3
"""A turn counts as what it does to the end of a forearm or a shin [choice]."""
FIRST_POSE_DISTANCE_M, POSE_DISTANCE_M = 0.26, 0.40
"""Stations farther than this from a pose, root mean square, are not in it: from the first one, of which only places
tell, and from the others. Whoever misses hinges by 5 deg stays within [choice]."""
AMBIGUITY_M = 0.02
"""A pose is held when no other one is nearer by more than this [m] [choice]."""


class PoseClassifier:
    """Poses (N, 55) of a body, for stations at about these mounts."""

    def __init__(self, body: Body, mounts: Sequence[Mount], poses: Sequence[Floats]) -> None:
        kinematics = Kinematics(body)
        bones = [body.skeleton.index(mount.bone) for mount in mounts]
        placed = [locate_mount(body.skeleton, mount) for mount in mounts]
        mount_m, turn = np.array([at_m for at_m, _ in placed]), np.array([turned for _, turned in placed])
        found = []
        for pose in poses:
            kinematics.set(pose)
            place_m, turned = kinematics.station_poses(bones, mount_m, turn)
            found.append((place_m - place_m.mean(axis=0), np.array(turned)))
        self._place_m = np.array([place_m for place_m, _ in found])
        """(N, S, 3) of the stations, about their mean [m]."""
        turned = np.array([turned for _, turned in found])
        self._turned = rotations.multiply(turned, rotations.inverse(turned[0]))
        """(N, S, 4) since the first pose, in the room."""

    def distances_m(self, now: HoldReadings, first: HoldReadings | None = None) -> Floats:
        """(N,) how far stations are from each pose, root mean square [m], for a performer who stands anywhere, faces
        anywhere and is of any size; by their turns too, once it is known how they were in the first pose."""
        return np.array([self._distance_m(now, first, pose) for pose in range(len(self._place_m))])

    def matches(self, pose: int, now: HoldReadings, first: HoldReadings | None = None) -> bool:
        """Whether it may be this pose."""
        off_m = self.distances_m(now, first)
        return bool(off_m[pose] <= min(float(off_m.min()) + AMBIGUITY_M, _distance_limit_m(first)))

    def nearest(self, now: HoldReadings, first: HoldReadings | None = None) -> int | None:
        """The pose that it looks like most; None when it looks like none."""
        off_m = self.distances_m(now, first)
        best = int(np.argmin(off_m))
        return best if off_m[best] <= _distance_limit_m(first) else None

    def _distance_m(self, now: HoldReadings, first: HoldReadings | None, pose: int) -> float:
        heading, away_m = _align(now.position_m, self._place_m[pose])
        squares = np.sum(away_m**2, axis=1)
        if first is not None:
            before, _ = _align(first.position_m, self._place_m[0])
            turned = rotations.multiply(now.tracker_from_station, rotations.inverse(first.tracker_from_station))
            seen = rotations.multiply(rotations.multiply(heading, turned), rotations.inverse(before))
            squares = squares + (LEVER_M * rotations.angle_between_rad(seen, self._turned[pose])) ** 2
        return float(np.sqrt(np.mean(squares)))


def _distance_limit_m(first: HoldReadings | None) -> float:
    return FIRST_POSE_DISTANCE_M if first is None else POSE_DISTANCE_M


def _align(found_m: Floats, place_m: Floats) -> tuple[Floats, Floats]:
    """The level turn (4,) of the tracker's frame that brings stations (S, 3) nearest to places (S, 3) about their mean,
    and how far they are from these then (S, 3), at the size that fits best."""
    level_m = rotations.rotate(LEVEL_FROM_TRACKER, found_m - found_m.mean(axis=0))
    a, b = (points[:, :2] @ [1.0, 1.0j] for points in (level_m, place_m))
    heading = rotations.about_z(float(np.angle(np.vdot(a, b))))
    turned_m = rotations.rotate(heading, level_m)
    size = np.clip(np.sum(turned_m * place_m) / max(float(np.sum(place_m**2)), 1e-9), *BODY_SCALES)
    return rotations.multiply(heading, LEVEL_FROM_TRACKER), turned_m - size * place_m
