"""The built-in performers: bodies of different proportions, with habits of their own.

Bone lengths spread as the 20 CMU skeletons behind the standard one do (their standard deviations below), on top of a
common stature; legs and arms stay mirror images.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from harness.core import humanoid24
from harness.core.seeds import generator
from harness.core.skeleton import Skeleton
from harness.errors import UnknownName

_NAMES = ("p1", "p2", "p3", "p4", "p5", "p6", "p7", "p8")
_STATURE_STD = 0.035
"""Relative standard deviation of what all bones share."""
_BONE_LENGTH_STD_M = {
    "humerus": 0.014,
    "radius": 0.017,
    "femur": 0.027,
    "tibia": 0.018,
    "hipjoint": 0.006,
    "clavicle": 0.008,
    "foot": 0.005,
    "wrist": 0.006,
    "hand": 0.003,
    "lowerback": 0.0055,
    "upperback": 0.0055,
    "thorax": 0.0055,
    "lowerneck": 0.006,
    "upperneck": 0.006,
    "head": 0.006,
}
"""Standard deviation of bone lengths among CMU's skeletons [m]; half of a leg's or arm's is shared with the stature."""
_BONE_DIRECTION_STD_RAD = {"hipjoint": 0.06, "clavicle": 0.05, "lowerback": 0.02, "upperback": 0.02, "thorax": 0.02}
"""Standard deviation of bone directions, in the plane of the body's symmetry or mirrored [rad]."""


@dataclass(frozen=True)
class Habits:
    """What a performer does in every take."""

    hand: str
    """`r` or `l`: the side that leads."""
    pace: float
    """Tempo of everything, about 1."""
    size: float
    """Amplitude of everything, about 1."""
    bend_rad: float
    """How far the back is bent forward in quiet standing."""
    spread_rad: float
    """How far the arms hang off the body."""
    toes_out_rad: float
    pelvis_rad: float
    """Forward tilt of the pelvis."""
    elbow_rad: float
    """How far the elbows of hanging arms are bent."""
    posture_rad: Mapping[str, tuple[float, ...]]
    """Standing offsets of the hinges of back, neck and hands, by bone."""


def performer_names() -> tuple[str, ...]:
    """Names of the performers; a take's name carries its performer's."""
    return _NAMES


@cache
def performer_skeleton(performer: str) -> Skeleton:
    """The performer's skeleton; UnknownName."""
    return _sample_skeleton(_performer_rng(performer, "skeleton"))


def sample_skeletons(count: int, seed: int) -> tuple[Skeleton, ...]:
    """Skeletons of so many other people of the same spread; none is a performer's, and more leave the first as are."""
    return tuple(_sample_skeleton(generator(seed, "population", which)) for which in range(count))


def _sample_skeleton(rng: np.random.Generator) -> Skeleton:
    """A draw from the spread."""
    standard = humanoid24.standard_skeleton()
    stature = 1.0 + _STATURE_STD * float(np.clip(rng.normal(), -1.5, 1.5))
    scale, tilt = {}, {}
    for part, spread_m in _BONE_LENGTH_STD_M.items():
        scale[part] = 0.7 * spread_m * float(np.clip(rng.normal(), -1.8, 1.8))
        tilt[part] = _BONE_DIRECTION_STD_RAD.get(part, 0.0) * float(np.clip(rng.normal(), -1.8, 1.8))
    bones = np.array(standard.bone_m)
    for b, name in enumerate(standard.names):
        part = name if name in _BONE_LENGTH_STD_M else name[1:]
        length = float(standard.length_m[b])
        bones[b] *= (stature * length + scale[part]) / length
        sine, cosine = np.sin(tilt[part]), np.cos(tilt[part])
        x, y, z = bones[b]
        if part in ("clavicle", "hipjoint"):
            turned = (x, y * cosine - np.sign(y) * sine * z, z * cosine + sine * abs(y))
        else:
            turned = (x * cosine + z * sine, y, z * cosine - x * sine)
        bones[b] = turned
    return standard.with_bones(bones)


def performer_habits(performer: str) -> Habits:
    """The performer's ways; UnknownName."""
    rng = _performer_rng(performer, "habits")
    return Habits(
        hand="l" if performer in ("p3", "p6") else "r",
        pace=1.0 + 0.06 * float(np.clip(rng.normal(), -1.5, 1.5)),
        size=1.0 + 0.08 * float(np.clip(rng.normal(), -1.5, 1.5)),
        bend_rad=float(rng.uniform(0.02, 0.10)),
        spread_rad=float(rng.uniform(0.10, 0.20)),
        toes_out_rad=float(rng.uniform(0.05, 0.17)),
        pelvis_rad=float(rng.uniform(-0.03, 0.08)),
        elbow_rad=float(rng.uniform(0.28, 0.60)),
        posture_rad=_sample_posture(rng),
    )


def _sample_posture(rng: np.random.Generator) -> dict[str, tuple[float, ...]]:
    """Offsets that leave the carriage of chest and head about as it is: what one bone adds, the next takes away."""
    back, neck = np.deg2rad(rng.normal(0.0, (2.5, 0.5, 0.8))), np.deg2rad(rng.normal(0.0, (4.0, 1.0, 1.5)))
    low = float(rng.uniform(0.3, 0.7))
    out = {
        "lowerback": back,
        "upperback": -low * back,
        "thorax": (low - 1.0) * back,
        "lowerneck": neck,
        "upperneck": -0.8 * neck,
        "head": -0.2 * neck,
    }
    for side in ("l", "r"):
        out[f"{side}wrist"] = np.deg2rad(rng.normal(0.0, 5.0, 1))
        out[f"{side}hand"] = np.deg2rad(rng.normal(0.0, (4.0, 5.0)))
    return {bone: tuple(float(x) for x in angles) for bone, angles in out.items()}


def _performer_rng(performer: str, what: str) -> np.random.Generator:
    if performer not in _NAMES:
        raise UnknownName("performer", performer, _NAMES)
    return generator(0, "performer", performer, what)
