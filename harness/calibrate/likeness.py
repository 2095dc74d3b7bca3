"""Which of some poses someone holds, told by where the stations are to each other: to keep poses in their order.

Nothing need be known but about where trackers are worn: a performer who rests, or holds a pose that is not the next
one, has some station half a metre elsewhere; proportions, mounts and a poor stance make a tenth of it.
"""

from collections.abc import Sequence

import numpy as np

from harness.body.humanoid import Body
from harness.body.kinematics import Kinematics
from harness.body.mounts import Mount, place
from harness.calibrate.tpose import LEVEL
from harness.core import rotations
from harness.core.arrays import Floats

SIZES = 0.7, 1.3
"""Performers are so many times as large as the body [choice]."""
FAR_M = 0.25
"""Stations farther than this from a pose, root mean square, are not in it [choice]."""
AS_NEAR = 0.04
"""A pose is held when no other one is nearer by more than this [m] [choice]."""


class Likeness:
    """Poses (N, 55) of a body, for stations at about these mounts."""

    def __init__(self, body: Body, mounts: Sequence[Mount], poses: Sequence[Floats]) -> None:
        kinematics = Kinematics(body)
        bones = [body.skeleton.index(mount.bone) for mount in mounts]
        placed = [place(body.skeleton, mount) for mount in mounts]
        mount_m, turn = np.array([at_m for at_m, _ in placed]), np.array([turned for _, turned in placed])
        self.place_m: list[Floats] = []
        """(S, 3) of the stations in each pose, about their mean [m]."""
        for pose in poses:
            kinematics.set(pose)
            at_m, _ = kinematics.station_poses(bones, mount_m, turn)
            self.place_m.append(np.array(at_m - at_m.mean(axis=0)))

    def off_m(self, position_m: Floats) -> Floats:
        """(N,) how far stations (S, 3), in the tracker's frame, are from each pose, root mean square [m]: of a
        performer who stands anywhere, faces anywhere and is of any size."""
        level_m = rotations.rotate(LEVEL, position_m)
        level_m = level_m - level_m.mean(axis=0)
        return np.array([_off_m(level_m, place_m) for place_m in self.place_m])

    def nearest(self, position_m: Floats) -> int | None:
        """The pose that stations (S, 3) look like most; None when they look like none."""
        off_m = self.off_m(position_m)
        best = int(np.argmin(off_m))
        return best if off_m[best] <= FAR_M else None

    def held(self, position_m: Floats, pose: int) -> bool:
        """Whether it may be this pose."""
        off_m = self.off_m(position_m)
        return bool(off_m[pose] <= min(float(off_m.min()) + AS_NEAR, FAR_M))


def _off_m(found_m: Floats, place_m: Floats) -> float:
    """Of centred points (S, 3), after the turn about the vertical and the size that bring them nearest."""
    a, b = (points[:, :2] @ [1.0, 1.0j] for points in (found_m, place_m))
    turned_m = rotations.rotate(rotations.about_z(float(np.angle(np.vdot(a, b)))), found_m)
    size = np.clip(np.sum(place_m**2) / max(float(np.sum(turned_m * place_m)), 1e-9), *SIZES)
    return float(np.sqrt(np.mean(np.sum((turned_m - size * place_m) ** 2, axis=1))))
