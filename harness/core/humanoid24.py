"""The body's skeleton in numbers: 24 bones and 48 hinges of Liu et al. 2011 (docs/papers.md A2), in CMU's convention.

Bone vectors are the mean over 20 skeletons of the CMU motion capture library, mirrored left to right. Hinge axes
are common to all of them. Limits are the envelope of 146 CMU clips plus 10 deg (the files' own limits are broken by
most recorded frames). The scenarios boxing, walking and jumping test none of these clips; others do. Angles were taken
in principal form: each wrapped to +-180 deg, the middle one of three within +-90 deg. The data was obtained from
mocap.cs.cmu.edu, created with funding from NSF EIA-0196217.

A configuration `qpos` is MuJoCo's: root position, root quaternion, then the hinges of each bone outermost first,
because MuJoCo composes the joints of a body in the order listed; the skeleton (and an AMC row) names them innermost
first. Only `pack` and `unpack` convert between the two orders.
"""

from collections.abc import Mapping
from functools import cache

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.skeleton import Skeleton

_Axes = Mapping[str, tuple[float, float, float]]
_TRUNK: _Axes = {"rx": (0.0, 1.0, 0.0), "ry": (0.0, 0.0, 1.0), "rz": (1.0, 0.0, 0.0)}
_LEFT_ARM: _Axes = {"rx": (0.5, 0.0, -0.866025404), "ry": (0.0, -1.0, 0.0), "rz": (-0.866025404, 0.0, -0.5)}
_RIGHT_ARM: _Axes = {"rx": (-0.5, 0.0, 0.866025404), "ry": (0.0, 1.0, 0.0), "rz": (-0.866025404, 0.0, -0.5)}
_LEFT_HAND: _Axes = {"rx": (-1.0, 0.0, 0.0), "rz": (0.0, 0.0, 1.0)}
_RIGHT_HAND: _Axes = {"rx": (1.0, 0.0, 0.0), "rz": (0.0, 0.0, 1.0)}
_LEFT_LEG: _Axes = {
    "rx": (0.0, 0.939692621, 0.342020143),
    "ry": (0.0, -0.342020143, 0.939692621),
    "rz": (1.0, 0.0, 0.0),
}
_LEFT_FOOT: _Axes = {"rx": (0.0, 0.939692621, 0.342020143), "rz": (0.0, -0.342020143, 0.939692621)}
_RIGHT_FOOT: _Axes = {"rx": (0.0, 0.939692621, -0.342020143), "rz": (0.0, 0.342020143, 0.939692621)}
_RIGHT_LEG: _Axes = {
    "rx": (0.0, 0.939692621, -0.342020143),
    "ry": (0.0, 0.342020143, 0.939692621),
    "rz": (1.0, 0.0, 0.0),
}
"""Hinge axes by channel that bones share."""
_BONES: tuple[tuple[str, str, tuple[float, float, float], _Axes], ...] = (
    ("lowerback", "root", (-0.0097, 0.0, 0.1163), _TRUNK),
    ("upperback", "lowerback", (-0.0005, 0.0, 0.117), _TRUNK),
    ("thorax", "upperback", (0.0041, 0.0, 0.1181), _TRUNK),
    ("lowerneck", "thorax", (0.01, 0.0, 0.0956), _TRUNK),
    ("upperneck", "lowerneck", (-0.0149, 0.0, 0.0953), _TRUNK),
    ("head", "upperneck", (-0.0063, 0.0, 0.0983), _TRUNK),
    ("lclavicle", "thorax", (-0.0148, 0.1799, 0.0652), _TRUNK),
    ("lhumerus", "lclavicle", (0.0, 0.3001, 0.0), _LEFT_ARM),
    ("lradius", "lhumerus", (0.0, 0.1882, 0.0), _LEFT_ARM),
    ("lwrist", "lradius", (0.0, 0.0941, 0.0), _LEFT_ARM),
    ("lhand", "lwrist", (0.0, 0.038, 0.0), _LEFT_HAND),
    ("rclavicle", "thorax", (-0.0148, -0.1799, 0.0652), _TRUNK),
    ("rhumerus", "rclavicle", (0.0, -0.3001, 0.0), _RIGHT_ARM),
    ("rradius", "rhumerus", (0.0, -0.1882, 0.0), _RIGHT_ARM),
    ("rwrist", "rradius", (0.0, -0.0941, 0.0), _RIGHT_ARM),
    ("rhand", "rwrist", (0.0, -0.038, 0.0), _RIGHT_HAND),
    ("lhipjoint", "root", (0.0431, 0.0878, -0.1005), _LEFT_LEG),
    ("lfemur", "lhipjoint", (0.0, 0.1387, -0.3812), _LEFT_LEG),
    ("ltibia", "lfemur", (0.0, 0.1488, -0.409), _LEFT_LEG),
    ("lfoot", "ltibia", (0.1184, 0.0105, -0.0289), _LEFT_FOOT),
    ("rhipjoint", "root", (0.0431, -0.0878, -0.1005), _RIGHT_LEG),
    ("rfemur", "rhipjoint", (0.0, -0.1387, -0.3812), _RIGHT_LEG),
    ("rtibia", "rfemur", (0.0, -0.1488, -0.409), _RIGHT_LEG),
    ("rfoot", "rtibia", (0.1184, -0.0105, -0.0289), _RIGHT_FOOT),
)
"""Bone, parent, vector [m] in the rest pose (x forward, y left, z up), and axes of its hinges."""
_LIMITS_DEG: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "lowerback": {"rx": (-53.0, 111.0), "ry": (-26.0, 27.0), "rz": (-38.0, 43.0)},
    "upperback": {"rx": (-34.0, 38.0), "ry": (-31.0, 35.0), "rz": (-23.0, 29.0)},
    "thorax": {"rx": (-40.0, 23.0), "ry": (-20.0, 23.0), "rz": (-41.0, 28.0)},
    "lowerneck": {"rx": (-59.0, 40.0), "ry": (-36.0, 54.0), "rz": (-43.0, 71.0)},
    "upperneck": {"rx": (-46.0, 69.0), "ry": (-47.0, 75.0), "rz": (-57.0, 49.0)},
    "head": {"rx": (-186.0, 49.0), "ry": (-65.0, 30.0), "rz": (-69.0, 169.0)},
    "lclavicle": {"ry": (-11.0, 11.0), "rz": (-11.0, 11.0)},
    "lhumerus": {"rx": (-126.0, 130.0), "ry": (-99.0, 94.0), "rz": (-186.0, 168.0)},
    "lradius": {"rx": (-12.0, 157.0)},
    "lwrist": {"ry": (-183.0, 114.0)},
    "lhand": {"rx": (-75.0, 90.0), "rz": (-110.0, 135.0)},
    "rclavicle": {"ry": (-11.0, 11.0), "rz": (-11.0, 11.0)},
    "rhumerus": {"rx": (-190.0, 190.0), "ry": (-100.0, 93.0), "rz": (-190.0, 190.0)},
    "rradius": {"rx": (-10.0, 162.0)},
    "rwrist": {"ry": (-190.0, 189.0)},
    "rhand": {"rx": (-87.0, 110.0), "rz": (-188.0, 127.0)},
    "lhipjoint": {},
    "lfemur": {"rx": (-186.0, 61.0), "ry": (-52.0, 94.0), "rz": (-129.0, 138.0)},
    "ltibia": {"rx": (-11.0, 166.0)},
    "lfoot": {"rx": (-95.0, 80.0), "rz": (-72.0, 76.0)},
    "rhipjoint": {},
    "rfemur": {"rx": (-185.0, 178.0), "ry": (-92.0, 50.0), "rz": (-79.0, 126.0)},
    "rtibia": {"rx": (-11.0, 167.0)},
    "rfoot": {"rx": (-93.0, 70.0), "rz": (-73.0, 42.0)},
}
"""Lowest and highest angle of each hinge, innermost first [deg]."""

BONES: tuple[str, ...] = tuple(bone for bone, *_ in _BONES)


@cache
def standard_skeleton() -> Skeleton:
    """The mean CMU skeleton."""
    return Skeleton(
        names=BONES,
        parents=tuple(-1 if parent == "root" else BONES.index(parent) for _, parent, _, _ in _BONES),
        bone_m=np.array([vector for _, _, vector, _ in _BONES]),
        hinges=tuple(tuple(_LIMITS_DEG[bone]) for bone in BONES),
        axes=_unit(np.array([axes[channel] for bone, _, _, axes in _BONES for channel in _LIMITS_DEG[bone]])),
    )


def has_bones(skeleton: Skeleton) -> bool:
    """Whether a clip's skeleton has the 24 bones."""
    return set(BONES) <= set(skeleton.names)


def select_bones(skeleton: Skeleton) -> tuple[Skeleton, Ints]:
    """The 24 bones of a clip's skeleton and the (D,) hinges that they have; UnknownName if it lacks a bone."""
    return skeleton.subset(BONES)


def limits_rad() -> Floats:
    """(48, 2) lowest and highest hinge angle [rad]."""
    return np.deg2rad([limits for bone in BONES for limits in _LIMITS_DEG[bone].values()])


def pack(root_m: Floats, world_from_root: Floats, angles_rad: Floats) -> Floats:
    """Configurations (..., 55) of root positions (..., 3), quaternions (..., 4) and hinge angles (..., 48) [rad]."""
    angles = np.asarray(angles_rad, dtype=float)[..., QPOS_OF_DOF]
    return np.concatenate([np.asarray(root_m, dtype=float), np.asarray(world_from_root, dtype=float), angles], axis=-1)


def unpack(qpos: Floats) -> tuple[Floats, Floats, Floats]:
    """Root positions (..., 3), quaternions (..., 4) and hinge angles (..., 48) in the skeleton's order."""
    return qpos[..., :3], qpos[..., 3:7], qpos[..., 7:][..., QPOS_OF_DOF]


def _unit(rows: Floats) -> Floats:
    out: Floats = rows / np.sqrt(np.sum(rows**2, axis=1, keepdims=True))
    return out


QPOS_OF_DOF: Ints = np.concatenate(
    [np.arange(where.start, where.stop)[::-1] for where in standard_skeleton().dof_of_bone], dtype=np.int64
)
"""(48,) the place in `qpos[7:]` of each of the skeleton's hinges: each bone's run reversed, hence its own inverse."""
