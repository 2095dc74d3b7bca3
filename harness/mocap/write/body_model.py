"""What a 3-D file shows of a body besides its bones: the surface, and the stations worn on it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from harness.core.arrays import Floats, freeze
from harness.mocap.write.posed_motion import ExportableCell, PosedMotion

_STICK_RADIUS_M = 0.03


class Shape(Protocol):
    """One shape in the frame of its bone, such as a `harness.body.anatomy.BodyGeom`."""

    @property
    def bone(self) -> str:
        """Name of the bone, or "root"."""
        ...

    @property
    def kind(self) -> str:
        """`capsule` (along its z; size: radius, half length, 0) or `ellipsoid` (size: half axes)."""
        ...

    @property
    def centre_m(self) -> Floats:
        """(3,) [m]."""
        ...

    @property
    def bone_from_shape(self) -> Floats:
        """(4,) unit quaternion (w, x, y, z)."""
        ...

    @property
    def size_m(self) -> Floats:
        """(3,) [m]; see `kind`."""
        ...


@dataclass(frozen=True, eq=False)
class MountedStation:
    """Place of a station in the frame of its bone."""

    name: str
    bone: str
    position_m: Floats
    """(3,) [m]."""
    bone_from_station: Floats
    """(4,) unit quaternion (w, x, y, z)."""

    def __post_init__(self) -> None:
        freeze(self, position_m=(3,), bone_from_station=(4,))


@dataclass(frozen=True)
class BodyModel:
    """Surface and stations of one body."""

    shapes: Sequence[Shape]
    stations: Sequence[MountedStation] = ()


@dataclass(frozen=True, eq=False)
class Stick:
    """A capsule from end to end of a bone."""

    bone: str
    vector_m: Floats
    """(3,) the bone [m]."""
    kind: str = "capsule"

    @property
    def centre_m(self) -> Floats:
        return 0.5 * self.vector_m

    @property
    def bone_from_shape(self) -> Floats:
        turn = np.array([np.linalg.norm(self.vector_m) + self.vector_m[2], -self.vector_m[1], self.vector_m[0], 0.0])
        length = float(np.linalg.norm(turn))
        return turn / length if length > 0.0 else np.array([0.0, 1.0, 0.0, 0.0])

    @property
    def size_m(self) -> Floats:
        return np.array([_STICK_RADIUS_M, 0.5 * float(np.linalg.norm(self.vector_m)), 0.0])


def stick_figure(cell: ExportableCell, motion: PosedMotion) -> BodyModel:
    """A model with a thin capsule for each bone, and without stations."""
    skeleton = motion.skeleton
    return BodyModel([Stick(name, vector) for name, vector in zip(skeleton.names, skeleton.bone_m, strict=True)])
