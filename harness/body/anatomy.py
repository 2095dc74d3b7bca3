"""Geoms of the body: capsules and ellipsoids with masses, for any 24-bone skeleton.

Masses are the segment shares of de Leva 1996 (Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters,
J. Biomechanics 29, Table 4, men): head and neck 6.94 %, upper, middle and lower trunk 15.96, 16.33 and 11.17 %,
upper arm 2.71, forearm 1.62, hand 0.61, thigh 14.16, shank 4.33, foot 1.37 %. The shares of a segment's bones are our
choice. The total mass is that of a person with the body-mass index of his mean man (73.0 kg at 1.741 m). Girths are our
choice, set by eye for a person with the mean CMU skeleton; they scale with the body, not with each bone. Heads, hands
and feet extend beyond their bones, whose far ends are joints (the ball of the foot, the knuckles).
"""

from functools import lru_cache

import numpy as np

from harness.core import humanoid24, rotations
from harness.core.arrays import Floats
from harness.core.skeleton import BodyGeom, Skeleton

_STANDARD_MASS_KG = 74.2
"""BMI of de Leva's mean man (24.08 kg/m2) times the square of the standard body's height, 1.755 m."""
_LEAST_M = 1e-3
"""Half length of the capsule of a bone of zero length, as some BVH files have [m]."""

# bone: share of the body's mass, radius [m], and which part of the bone the capsule covers
_LIMBS: tuple[tuple[str, float, float, float, float], ...] = (
    ("lowerneck", 0.0072, 0.058, 0.15, 0.9),
    ("upperneck", 0.0072, 0.056, 0.0, 1.0),
    ("clavicle", 0.0300, 0.054, 0.20, 0.90),
    ("humerus", 0.0271, 0.047, 0.0, 1.0),
    ("radius", 0.0118, 0.040, 0.0, 1.0),
    ("wrist", 0.0044, 0.031, 0.0, 1.0),
    ("hipjoint", 0.0300, 0.082, 0.35, 0.92),
    ("femur", 0.1416, 0.074, 0.05, 1.0),
    ("tibia", 0.0433, 0.050, 0.0, 0.95),
)
# bone, name, share of the mass, centre along the bone, then forward and up of it [m], half sizes (x, y, z) [m]
_TRUNK: tuple[tuple[str, str, float, float, tuple[float, float], tuple[float, float, float]], ...] = (
    ("root", "pelvis", 0.0517, 0.0, (0.0, -0.035), (0.112, 0.160, 0.115)),
    ("lowerback", "lowerback", 0.0733, 0.55, (0.0, 0.0), (0.106, 0.145, 0.135)),
    ("upperback", "upperback", 0.0900, 0.6, (0.006, 0.0), (0.112, 0.152, 0.140)),
    ("thorax", "thorax", 0.0996, 0.65, (0.008, 0.0), (0.117, 0.166, 0.140)),
    ("head", "head", 0.0550, 0.75, (0.022, 0.0), (0.098, 0.077, 0.118)),
)
_HAND_SHARE, _FOOT_SHARE = 0.0061, 0.0137


def body_scale(skeleton: Skeleton) -> float:
    """Size of the body relative to the standard one, by the lengths of legs and spine, which make up the height."""
    return _height_chain_m(skeleton) / _height_chain_m(humanoid24.standard_skeleton())


@lru_cache(maxsize=64)
def body_geoms(skeleton: Skeleton) -> tuple[BodyGeom, ...]:
    """The geoms of the root and the 24 bones, in the order of the model's bodies."""
    scale = body_scale(skeleton)
    mass_kg = _STANDARD_MASS_KG * scale**2
    geoms = [_trunk(skeleton, row, scale, mass_kg) for row in _TRUNK]
    for part, share, radius, start, stop in _LIMBS:
        for bone in (part,) if part in skeleton.names else (f"l{part}", f"r{part}"):
            vector = skeleton.bone_m[skeleton.index(bone)]
            geoms.append(_capsule(bone, bone, start * vector, stop * vector, scale * radius, mass_kg * share))
    for side in "lr":
        geoms += [_hand(skeleton, side, scale, mass_kg), *_foot(skeleton, side, scale, mass_kg)]
    order = ("root", *skeleton.names)
    return tuple(sorted(geoms, key=lambda geom: order.index(geom.bone)))


# The sole is 80 mm below the ankle: the median ankle height in stance is 76 to 80 mm in eight CMU clips.
_SOLE_DROP_M, _SOLE_RADIUS_M, _SOLE_HALF_WIDTH_M = 0.049, 0.031, 0.017
_HEEL_M, _BALL_M, _TOE_M = -0.027, 0.118, 0.172
"""Positions along the foot from the ankle [m]. Real toes bend at the ball; the model's foot is rigid."""


def sole_below_ankle_m(skeleton: Skeleton) -> float:
    """Height of the ankle joint of a flat foot above the ground [m]."""
    return (_SOLE_DROP_M + _SOLE_RADIUS_M) * body_scale(skeleton)


def sole_points_m(skeleton: Skeleton) -> Floats:
    """(2, 4, 3) corners of the left and right sole (heel and ball, inner and outer edge) in the foot's frame [m]."""
    scale, points = body_scale(skeleton), np.empty((2, 4, 3))
    for side, name in enumerate("lr"):
        ahead, down, across = _foot_axes(skeleton, name)
        corners = [(x, y) for x in (_HEEL_M, _BALL_M) for y in (-_SOLE_HALF_WIDTH_M, _SOLE_HALF_WIDTH_M)]
        for k, (x, y) in enumerate(corners):
            points[side, k] = scale * (x * ahead + y * across) + sole_below_ankle_m(skeleton) * down
    return points


def _foot_axes(skeleton: Skeleton, side: str) -> tuple[Floats, Floats, Floats]:
    """Unit vectors ahead, down and across of a foot in its bone's frame; down is along the shin in the rest pose."""
    down = _unit(skeleton.bone_m[skeleton.index(f"{side}tibia")])
    toes = skeleton.bone_m[skeleton.index(f"{side}foot")]
    ahead = _unit(toes - (toes @ down) * down)
    return ahead, down, np.cross(ahead, down)


def _foot(skeleton: Skeleton, side: str, scale: float, mass_kg: float) -> list[BodyGeom]:
    """A sole of two capsules from heel to toe, and an instep."""
    ahead, down, across = _foot_axes(skeleton, side)
    bone, share = f"{side}foot", mass_kg * _FOOT_SHARE / 3
    ball = ahead * _BALL_M + down * (_SOLE_DROP_M - 0.004)
    parts = [_capsule(bone, f"{bone}_instep", 0.0 * down, scale * ball, 0.034 * scale, share)]
    for name, sign in (("inner", -1.0), ("outer", 1.0)):
        sideways = sign * (1.0 if side == "r" else -1.0) * _SOLE_HALF_WIDTH_M * across
        heel, toe = (scale * (x * ahead + _SOLE_DROP_M * down + sideways) for x in (_HEEL_M, _TOE_M))
        parts.append(_capsule(bone, f"{bone}_{name}", heel, toe, _SOLE_RADIUS_M * scale, share))
    return parts


def _hand(skeleton: Skeleton, side: str, scale: float, mass_kg: float) -> BodyGeom:
    """A flat ellipsoid from the wrist to the finger tips, palm down in the rest pose."""
    along = _unit(skeleton.bone_m[skeleton.index(f"{side}hand")])
    across = _unit(np.array([1.0, 0.0, 0.0]) - along[0] * along)
    frame = np.stack([across, np.cross(along, across), along], axis=1)
    size = scale * np.array([0.043, 0.017, 0.092])
    bone = f"{side}hand"
    rotation = rotations.from_matrix(frame)
    return BodyGeom(bone, bone, "ellipsoid", 0.085 * scale * along, rotation, size, mass_kg * _HAND_SHARE)


def _trunk(
    skeleton: Skeleton,
    row: tuple[str, str, float, float, tuple[float, float], tuple[float, float, float]],
    scale: float,
    mass_kg: float,
) -> BodyGeom:
    bone, name, share, along, (forward, up), size = row
    vector = np.zeros(3) if bone == "root" else skeleton.bone_m[skeleton.index(bone)]
    centre = along * vector + scale * np.array([forward, 0.0, up])
    return BodyGeom(bone, name, "ellipsoid", centre, rotations.IDENTITY, scale * np.array(size), mass_kg * share)


def _capsule(bone: str, name: str, start_m: Floats, stop_m: Floats, radius_m: float, mass_kg: float) -> BodyGeom:
    span = stop_m - start_m
    length = float(np.sqrt(span @ span))
    rotation = _rotation_of_z_to(span / length) if length > 0.0 else rotations.IDENTITY
    size = np.array([radius_m, max(0.5 * length, _LEAST_M), 0.0])
    return BodyGeom(bone, name, "capsule", 0.5 * (start_m + stop_m), rotation, size, mass_kg)


def _rotation_of_z_to(direction: Floats) -> Floats:
    """Quaternion of the shortest rotation of z onto a unit vector."""
    if direction[2] < -1.0 + 1e-12:
        return np.array([0.0, 1.0, 0.0, 0.0])
    return _unit(np.array([1.0 + direction[2], -direction[1], direction[0], 0.0]))


def _unit(v: Floats) -> Floats:
    out: Floats = v / np.sqrt(v @ v)
    return out


def _height_chain_m(skeleton: Skeleton) -> float:
    spine = ("lowerback", "upperback", "thorax", "lowerneck", "upperneck", "head")
    legs = ("lfemur", "ltibia", "rfemur", "rtibia")
    length = skeleton.length_m
    return float(sum(length[skeleton.index(b)] for b in spine) + 0.5 * sum(length[skeleton.index(b)] for b in legs))
