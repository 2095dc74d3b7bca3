"""Stations on the skin: their distance from the bone's axis, the tissue below them and the force that moves it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.body.mounts import Mount
from harness.body.soft_tissue import tissue_thickness_m
from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.core.calibration import Calibration
from harness.core.skeleton import Skeleton
from harness.simulate.readings import GRAVITY_M_S2


@dataclass(frozen=True, eq=False)
class Skin:
    """What lies between S stations and their bones."""

    radius_m: Floats
    """(S,) distance of the station from the axis of its bone [m]; the station's z points away from it, x along it."""
    tissue_m: Floats
    """(S,) thickness of the soft tissue between bone and skin at the station [m]."""

    def __post_init__(self) -> None:
        freeze(self, radius_m=("S",), tissue_m=("S",))


def skin_below(skeleton: Skeleton, mounts: Sequence[Mount], calibration: Calibration) -> Skin:
    """The skin below stations on these mounts, whose exact calibration is given."""
    along_m = [mount.along * skeleton.bone_m[skeleton.index(mount.bone)] for mount in mounts]
    return Skin(
        radius_m=np.linalg.norm(calibration.mount_m - along_m, axis=1),
        tissue_m=np.array([tissue_thickness_m(mount.bone, mount.along) for mount in mounts]),
    )


def tissue_force_m_s2(
    turn: Floats, acceleration_m_s2: Floats, calibration: Calibration, frame_from_world: Floats = rotations.IDENTITY
) -> Floats:
    """(N, S, 3) specific force at each station minus that in the rest pose, in the station's axes [m/s^2].

    Orientations (N, S, 4) and accelerations (N, S, 3) are those of the stations in a frame; the world's by default.
    """
    up = np.array([0.0, 0.0, GRAVITY_M_S2])
    specific_force = rotations.rotate(
        rotations.inverse(turn), acceleration_m_s2 + rotations.rotate(frame_from_world, up)
    )
    out: Floats = specific_force - rotations.rotate(rotations.inverse(calibration.bone_from_station), up)
    return out
