"""Mounts of stations on the surface of the body.

The axes of a station: z outward along the ray from the bone to the skin, x along the bone (towards its far
end), y = z cross x. In the rest pose (arms to the sides, palms down) the angle around a bone is 0 where it faces
forward (upward for a bone that itself points forward, such as a foot) and grows by the right-hand rule about the
bone's direction: +90 deg faces down on a left arm, up on a right arm, right on a leg, left on the trunk.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from harness.body import anatomy
from harness.core import rotations
from harness.core.arrays import Floats, immutable
from harness.core.skeleton import Skeleton
from harness.core.working_folder import plain_import
from harness.errors import BadInput

with plain_import():
    import mujoco

_GEOM = {"capsule": mujoco.mjtGeom.mjGEOM_CAPSULE, "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID}
_RAY_START_M = 1.0
"""Start of a ray outside the body, as a distance from the bone [m]."""


@dataclass(frozen=True)
class Mount:
    """Place and orientation of one station on the body."""

    station: str
    bone: str
    along: float = 0.5
    """Position along the bone, 0 at its joint to 1 at its far end."""
    around_rad: float = 0.0
    """Angle around the bone [rad]."""
    stand_off_m: float = 0.01
    """Distance of the tracker's origin from the skin [m]."""
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Deviation of its position from that place, along the station's nominal axes [m]."""
    rotation_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Deviation of its orientation from the nominal axes, a rotation vector in them [rad]."""


def _mount(station: str, bone: str, along: float, around_deg: float) -> Mount:
    return Mount(station, bone, along, math.radians(around_deg))


DEFAULT_MOUNTS: Mapping[str, Mount] = MappingProxyType(
    {
        mount.station: mount
        for mount in (
            _mount("left_wrist", "lwrist", 0.6, -90.0),  # back of the forearm, as a watch
            _mount("right_wrist", "rwrist", 0.6, 90.0),
            _mount("left_hand", "lhand", 1.0, -90.0),  # back of the hand
            _mount("right_hand", "rhand", 1.0, 90.0),
            _mount("left_ankle", "ltibia", 0.9, -90.0),  # outside of the shin, which does not observe the foot
            _mount("right_ankle", "rtibia", 0.9, 90.0),
            _mount("left_foot", "lfoot", 0.5, 0.0),  # instep, an alternative to the ankles
            _mount("right_foot", "rfoot", 0.5, 0.0),
            _mount("torso", "thorax", 0.5, 0.0),  # breastbone
            _mount("head", "head", 1.0, 0.0),  # forehead
            _mount("pelvis", "lhipjoint", 0.0, 165.0),  # sacrum, on the midline; hip bones are rigid with the root
        )
    }
)
"""Stations that scenarios name: the six of the first paper, the five of the second, and the feet."""


@lru_cache(maxsize=256)
def locate_mount(skeleton: Skeleton, mount: Mount) -> tuple[Floats, Floats]:
    """Origin (3,) [m] and orientation `bone_from_station` (4,) of a station in the frame of its bone.

    Both arrays are immutable, since later calls with the same skeleton return them again. Raises UnknownName for the
    bone and BadInput where the bone has no surface at that place.
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
            f"Station {mount.station!r} misses its bone: {mount.bone} has no surface at {mount.along:.2f} along it.",
            "Choose another place along the bone or another angle around it.",
        )
    nominal = rotations.from_matrix(np.stack([along, np.cross(outward, along), outward], axis=1))
    offset_m = rotations.rotate(nominal, np.array(mount.offset_m))
    rotation = rotations.multiply(nominal, rotations.exp(np.array(mount.rotation_rad)))
    return immutable(axis_m + (skin_m + mount.stand_off_m) * outward + offset_m), immutable(rotation)


def locate_mounts(skeleton: Skeleton, mounts: Sequence[Mount]) -> tuple[list[int], Floats, Floats]:
    """Bones (S,) of stations, and their origins (S, 3) [m] and orientations (S, 4) in the frames of these."""
    origins_m, turns = zip(*(locate_mount(skeleton, mount) for mount in mounts), strict=True)
    return [skeleton.index(mount.bone) for mount in mounts], np.array(origins_m), np.array(turns)


def _zero_direction(along: Floats) -> Floats:
    """Unit vector at angle 0, perpendicular to the bone: forward, or up for a bone that points forward."""
    reference = np.array([0.0, 0.0, 1.0]) if abs(along[0]) > math.sqrt(0.5) else np.array([1.0, 0.0, 0.0])
    perpendicular = reference - (reference @ along) * along
    out: Floats = perpendicular / np.sqrt(perpendicular @ perpendicular)
    return out


def _skin_m(skeleton: Skeleton, bone: str, axis_m: Floats, outward: Floats) -> float | None:
    """Distance from the bone's axis to the outermost surface along a ray from outside [m]; None if the ray misses."""
    bones = {bone} | ({"root"} if bone in ("lhipjoint", "rhipjoint") else set())
    start_m = axis_m + _RAY_START_M * outward
    hits = [
        mujoco.mju_rayGeom(
            geom.centre_m,
            rotations.to_matrix(geom.bone_from_shape).ravel(),
            geom.size_m,
            start_m,
            -outward,
            _GEOM[geom.kind],
        )
        for geom in anatomy.body_geoms(skeleton)
        if geom.bone in bones
    ]
    depths = [_RAY_START_M - hit for hit in hits if 0.0 <= hit < _RAY_START_M]
    return max(depths, default=None)
