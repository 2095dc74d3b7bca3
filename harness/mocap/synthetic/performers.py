"""Performers of the motion generator: skeletons of different proportions, and individual habits of movement.

Bone lengths vary as in the 20 CMU skeletons behind the standard skeleton (their standard deviations are below), on top
of a common stature. Left and right limbs are mirror images.

Targets of hands and feet do not determine how a bend is shared along back and neck, and how the hands hang. That
differs between performers, a little between takes, and drifts within a take. Trackers observe little of it, so a
reconstruction cannot recover it exactly.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from harness.core import humanoid24
from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.core.skeleton import Skeleton
from harness.errors import UnknownName
from harness.mocap.synthetic.curves import smooth_noise
from harness.mocap.synthetic.style import Style, sample_style

_NAMES = tuple(f"p{number}" for number in range(1, 65))
UNLISTED_PERFORMERS = tuple(f"p{number}" for number in range(65, 129))
"""Performers that no list of takes names: what was chosen on the others is tested on them."""
REFERENCE_PERFORMERS = _NAMES[:8]
"""The performers of tables, placement studies and databases of benchmarks. Their style is neutral."""
_STATURE_STD = 0.035
"""Relative standard deviation of the stature, which scales all bones."""
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
"""Standard deviation of bone lengths among CMU's skeletons [m]; stature explains half of a leg's or an arm's."""
_BONE_DIRECTION_STD_RAD = {"hipjoint": 0.06, "clavicle": 0.05, "lowerback": 0.02, "upperback": 0.02, "thorax": 0.02}
"""Standard deviation of bone directions, in the sagittal plane or mirrored about it [rad]."""


@dataclass(frozen=True)
class Habits:
    """Properties of a performer's movement that all takes share."""

    hand: str
    """Dominant side, `r` or `l`."""
    pace: float
    """Relative tempo, about 1."""
    size: float
    """Relative amplitude, about 1."""
    bend_rad: float
    """Forward bend of the back in quiet standing."""
    spread_rad: float
    """Angle between a hanging arm and the body."""
    toes_out_rad: float
    pelvis_rad: float
    """Forward tilt of the pelvis."""
    elbow_rad: float
    """Flexion of the elbow of a hanging arm."""
    posture_rad: Mapping[str, tuple[float, ...]]
    """Constant offsets of the hinges of back, neck and hands, by bone."""
    style: Style
    """In what performers differ beyond these; neutral for `REFERENCE_PERFORMERS`."""


def performer_names() -> tuple[str, ...]:
    """Names of the performers in lists, which are part of the names of takes."""
    return _NAMES


@cache
def performer_skeleton(performer: str) -> Skeleton:
    """The performer's skeleton; raises UnknownName."""
    return _sample_skeleton(_performer_rng(performer, "skeleton"))


def sample_skeletons(count: int, seed: int) -> tuple[Skeleton, ...]:
    """`count` skeletons of other people, drawn from the performers' distribution.

    None is a performer's skeleton. A larger count leaves the first skeletons unchanged.
    """
    return tuple(_sample_skeleton(generator(seed, "population", which)) for which in range(count))


def _sample_skeleton(rng: np.random.Generator) -> Skeleton:
    """One draw from the distribution of skeletons."""
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
            rotated = (x, y * cosine - np.sign(y) * sine * z, z * cosine + sine * abs(y))
        else:
            rotated = (x * cosine + z * sine, y, z * cosine - x * sine)
        bones[b] = rotated
    return standard.with_bones(bones)


def performer_habits(performer: str) -> Habits:
    """The performer's habits; raises UnknownName."""
    rng, style = _performer_rng(performer, "habits"), _performer_style(performer)
    return Habits(
        hand="l" if style.left_handed else "r",
        pace=1.0 + 0.06 * float(np.clip(rng.normal(), -1.5, 1.5)) + style.pace,
        size=1.0 + 0.08 * float(np.clip(rng.normal(), -1.5, 1.5)) + style.size,
        bend_rad=float(rng.uniform(0.02, 0.10)) + style.bend_rad,
        spread_rad=float(rng.uniform(0.10, 0.20)) + style.spread_rad,
        toes_out_rad=float(rng.uniform(0.05, 0.17)) + style.toes_out_rad,
        pelvis_rad=float(rng.uniform(-0.03, 0.08)) + style.pelvis_rad,
        elbow_rad=float(rng.uniform(0.28, 0.60)) + style.elbow_rad,
        posture_rad=_sample_posture(rng, style.posture),
        style=style,
    )


def _performer_style(performer: str) -> Style:
    if performer in REFERENCE_PERFORMERS:
        return Style(left_handed=performer in ("p3", "p6"))
    return sample_style(_performer_rng(performer, "style"))


def _sample_posture(rng: np.random.Generator, size: float) -> dict[str, tuple[float, ...]]:
    """Hinge offsets of neighbouring bones that cancel, so that chest and head keep their orientation approximately."""
    back, neck = np.deg2rad(rng.normal(0.0, (2.5, 0.5, 0.8))), np.deg2rad(rng.normal(0.0, (4.0, 1.0, 1.5)))
    share = float(rng.uniform(0.3, 0.7))
    out = {
        "lowerback": back,
        "upperback": -share * back,
        "thorax": (share - 1.0) * back,
        "lowerneck": neck,
        "upperneck": -0.8 * neck,
        "head": -0.2 * neck,
    }
    for side in ("l", "r"):
        out[f"{side}wrist"] = np.deg2rad(rng.normal(0.0, 5.0, 1))
        out[f"{side}hand"] = np.deg2rad(rng.normal(0.0, (4.0, 5.0)))
    return {bone: tuple(size * float(x) for x in angles) for bone, angles in out.items()}


def _performer_rng(performer: str, what: str) -> np.random.Generator:
    if performer not in _NAMES and performer not in UNLISTED_PERFORMERS:
        raise UnknownName("performer", performer, _NAMES)
    return generator(0, "performer", performer, what)


PostureOffsets = Mapping[str, Floats]
"""(T, D) offsets of a bone's D hinges [rad]."""

_DRIFT_PERIOD_S = 1.8
_OFFSET_STD_DEG: dict[str, tuple[tuple[float, float], ...]] = {
    "lowerback": ((0.8, 0.5), (0.4, 0.4), (0.5, 0.5)),
    "upperback": ((0.8, 0.5), (0.4, 0.4), (0.5, 0.5)),
    "thorax": ((0.7, 0.5), (0.4, 0.4), (0.5, 0.4)),
    "lowerneck": ((1.0, 0.8), (0.6, 0.7), (0.6, 0.6)),
    "upperneck": ((1.0, 0.8), (0.6, 0.7), (0.6, 0.6)),
    "head": ((0.6, 0.5), (0.4, 0.5), (0.4, 0.5)),
    "wrist": ((1.8, 1.5),),
    "hand": ((1.8, 1.5), (1.8, 1.5)),
}
"""Standard deviations of a take's offset and of the drift within the take, for each hinge [deg]."""


def sample_posture_offsets(
    rng: np.random.Generator, t: Floats, habits: Habits, looseness: float = 1.0
) -> PostureOffsets:
    """The offsets of one take; `looseness` scales the take's offset and the drift, not the performer's posture."""
    out: dict[str, Floats] = {}
    for part, hinges in _OFFSET_STD_DEG.items():
        for side in ("l", "r") if part in ("wrist", "hand") else ("",):
            posture = habits.posture_rad[side + part]
            columns = [
                posture[k]
                + looseness
                * np.deg2rad(fixed * np.clip(rng.normal(), -2.0, 2.0) + smooth_noise(rng, t, _DRIFT_PERIOD_S, drift))
                for k, (fixed, drift) in enumerate(hinges)
            ]
            out[side + part] = np.stack(columns, axis=-1)
    return out
