"""Where trackers are worn: on the surface of a bone's flesh.

The axes of a station: z outward along the ray from the bone to the skin, x along the bone (towards its far
end), y = z cross x. In the rest pose (arms to the sides, palms down) the angle around a bone is 0 where it faces
forward (upward for a bone that itself points forward, such as a foot) and grows by the right-hand rule about the
bone's direction: +90 deg faces down on a left arm, up on a right arm, right on a leg, left on the trunk.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import mujoco
import numpy as np

from harness.body import anatomy
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.errors import BadInput

_GEOM = {"capsule": mujoco.mjtGeom.mjGEOM_CAPSULE, "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID}
_RAY_START_M = 1.0
"""Farther from any bone than its skin."""


@dataclass(frozen=True)
class Mount:
    """One tracker on the body."""

    station: str
    bone: str
    along: float = 0.5
    """Position along the bone, 0 at its joint to 1 at its far end."""
    around_rad: float = 0.0
    """Angle around the bone [rad]."""
    stand_off_m: float = 0.01
    """Distance of the tracker's origin from the skin [m]."""
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """How far from that place it really sits, along its axes there [m]."""
    rotation_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """How far it is really turned from those axes, a rotation vector in them [rad]: straps are put on anyhow."""


def _mount(station: str, bone: str, along: float, around_deg: float) -> Mount:
    return Mount(station, bone, along, math.radians(around_deg))


DEFAULT_MOUNTS: Mapping[str, Mount] = MappingProxyType(
    {
        mount.station: mount
        for mount in (
            _mount("left_wrist", "lwrist", 0.6, -90.0),  # back of the forearm, where a watch sits
            _mount("right_wrist", "rwrist", 0.6, 90.0),
            _mount("left_hand", "lhand", 1.0, -90.0),  # back of the hand
            _mount("right_hand", "rhand", 1.0, 90.0),
            _mount("left_ankle", "ltibia", 0.9, -90.0),  # outside of the shin; the foot stays unseen
            _mount("right_ankle", "rtibia", 0.9, 90.0),
            _mount("left_foot", "lfoot", 0.5, 0.0),  # instep, the option for the ankles
            _mount("right_foot", "rfoot", 0.5, 0.0),
            _mount("torso", "thorax", 0.5, 0.0),  # breastbone
            _mount("head", "head", 1.0, 0.0),  # forehead
            _mount("pelvis", "lhipjoint", 0.0, 165.0),  # sacrum, in the middle; hip bones are rigid with the root
        )
    }
)
"""The stations that scenarios name: six of the first paper, five of the second, and the foot option."""


def locate_mount(skeleton: Skeleton, mount: Mount) -> tuple[Floats, Floats]:
    """Origin (3,) [m] and orientation `bone_from_station` (4,) of a station in the frame of its bone.

    Raises UnknownName for the bone and BadInput where the bone has no flesh at that place.
    """
    bone = skeleton.index(mount.bone)
    if not skeleton.length_m[bone] > 0.0:
        raise BadInput(
            f"Station {mount.station!r} cannot sit on {mount.bone}, which has no length.", "Choose a neighbouring bone."
        )
    along = skeleton.bone_m[bone] / skeleton.length_m[bone]
    facing = _zero_direction(along)
    outward = math.cos(mount.around_rad) * facing + math.sin(mount.around_rad) * np.cross(along, facing)
    axis_m = mount.along * skeleton.bone_m[bone]
    skin_m = _skin_m(skeleton, mount.bone, axis_m, outward)
    if skin_m is None:
        raise BadInput(
            f"Station {mount.station!r} misses its bone: nothing of {mount.bone} is at {mount.along:.2f} along it.",
            "Choose another place along the bone or another angle around it.",
        )
    nominal = rotations.from_matrix(np.stack([along, np.cross(outward, along), outward], axis=1))
    beside_m = rotations.rotate(nominal, np.array(mount.offset_m))
    turned = rotations.multiply(nominal, rotations.exp(np.array(mount.rotation_rad)))
    return axis_m + (skin_m + mount.stand_off_m) * outward + beside_m, turned


def _zero_direction(along: Floats) -> Floats:
    """The unit vector at angle 0: square to the bone, forward, or up for a bone that points forward."""
    reference = np.array([0.0, 0.0, 1.0]) if abs(along[0]) > math.sqrt(0.5) else np.array([1.0, 0.0, 0.0])
    square = reference - (reference @ along) * along
    out: Floats = square / np.sqrt(square @ square)
    return out


def _skin_m(skeleton: Skeleton, bone: str, axis_m: Floats, outward: Floats) -> float | None:
    """Distance from the bone's axis to the outermost skin, found by a ray from outside; None where there is none."""
    carriers = {bone} | ({"root"} if bone in ("lhipjoint", "rhipjoint") else set())
    eye = axis_m + _RAY_START_M * outward
    hits = [
        mujoco.mju_rayGeom(
            shape.centre_m,
            rotations.to_matrix(shape.bone_from_shape).ravel(),
            shape.size_m,
            eye,
            -outward,
            _GEOM[shape.kind],
        )
        for shape in anatomy.body_geoms(skeleton)
        if shape.bone in carriers
    ]
    depths = [_RAY_START_M - hit for hit in hits if 0.0 <= hit < _RAY_START_M]
    return max(depths, default=None)
