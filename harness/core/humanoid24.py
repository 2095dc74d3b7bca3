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

from functools import cache

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.skeleton import Skeleton

# bone, parent, vector [m] in the rest pose (x forward, y left, z up), hinges: (channel, axis, lowest, highest [deg])
_BONES: tuple[tuple[str, str, tuple[float, ...], tuple[tuple[str, tuple[float, ...], float, float], ...]], ...] = (
    (
        "lowerback",
        "root",
        (-0.0097, 0.0, 0.1163),
        (
            ("rx", (0.0, 1.0, 0.0), -53.0, 111.0),
            ("ry", (0.0, 0.0, 1.0), -26.0, 27.0),
            ("rz", (1.0, 0.0, 0.0), -38.0, 43.0),
        ),
    ),
    (
        "upperback",
        "lowerback",
        (-0.0005, 0.0, 0.117),
        (
            ("rx", (0.0, 1.0, 0.0), -34.0, 38.0),
            ("ry", (0.0, 0.0, 1.0), -31.0, 35.0),
            ("rz", (1.0, 0.0, 0.0), -23.0, 29.0),
        ),
    ),
    (
        "thorax",
        "upperback",
        (0.0041, 0.0, 0.1181),
        (
            ("rx", (0.0, 1.0, 0.0), -40.0, 23.0),
            ("ry", (0.0, 0.0, 1.0), -20.0, 23.0),
            ("rz", (1.0, 0.0, 0.0), -41.0, 28.0),
        ),
    ),
    (
        "lowerneck",
        "thorax",
        (0.01, 0.0, 0.0956),
        (
            ("rx", (0.0, 1.0, 0.0), -59.0, 40.0),
            ("ry", (0.0, 0.0, 1.0), -36.0, 54.0),
            ("rz", (1.0, 0.0, 0.0), -43.0, 71.0),
        ),
    ),
    (
        "upperneck",
        "lowerneck",
        (-0.0149, 0.0, 0.0953),
        (
            ("rx", (0.0, 1.0, 0.0), -46.0, 69.0),
            ("ry", (0.0, 0.0, 1.0), -47.0, 75.0),
            ("rz", (1.0, 0.0, 0.0), -57.0, 49.0),
        ),
    ),
    (
        "head",
        "upperneck",
        (-0.0063, 0.0, 0.0983),
        (
            ("rx", (0.0, 1.0, 0.0), -186.0, 49.0),
            ("ry", (0.0, 0.0, 1.0), -65.0, 30.0),
            ("rz", (1.0, 0.0, 0.0), -69.0, 169.0),
        ),
    ),
    (
        "lclavicle",
        "thorax",
        (-0.0148, 0.1799, 0.0652),
        (
            ("ry", (0.0, 0.0, 1.0), -11.0, 11.0),
            ("rz", (1.0, 0.0, 0.0), -11.0, 11.0),
        ),
    ),
    (
        "lhumerus",
        "lclavicle",
        (0.0, 0.3001, 0.0),
        (
            ("rx", (0.5, 0.0, -0.866025404), -126.0, 130.0),
            ("ry", (0.0, -1.0, 0.0), -99.0, 94.0),
            ("rz", (-0.866025404, 0.0, -0.5), -186.0, 168.0),
        ),
    ),
    (
        "lradius",
        "lhumerus",
        (0.0, 0.1882, 0.0),
        (("rx", (0.5, 0.0, -0.866025404), -12.0, 157.0),),
    ),
    (
        "lwrist",
        "lradius",
        (0.0, 0.0941, 0.0),
        (("ry", (0.0, -1.0, 0.0), -183.0, 114.0),),
    ),
    (
        "lhand",
        "lwrist",
        (0.0, 0.038, 0.0),
        (
            ("rx", (-1.0, 0.0, 0.0), -75.0, 90.0),
            ("rz", (0.0, 0.0, 1.0), -110.0, 135.0),
        ),
    ),
    (
        "rclavicle",
        "thorax",
        (-0.0148, -0.1799, 0.0652),
        (
            ("ry", (0.0, 0.0, 1.0), -11.0, 11.0),
            ("rz", (1.0, 0.0, 0.0), -11.0, 11.0),
        ),
    ),
    (
        "rhumerus",
        "rclavicle",
        (0.0, -0.3001, 0.0),
        (
            ("rx", (-0.5, 0.0, 0.866025404), -190.0, 190.0),
            ("ry", (0.0, 1.0, 0.0), -100.0, 93.0),
            ("rz", (-0.866025404, 0.0, -0.5), -190.0, 190.0),
        ),
    ),
    (
        "rradius",
        "rhumerus",
        (0.0, -0.1882, 0.0),
        (("rx", (-0.5, 0.0, 0.866025404), -10.0, 162.0),),
    ),
    (
        "rwrist",
        "rradius",
        (0.0, -0.0941, 0.0),
        (("ry", (0.0, 1.0, 0.0), -190.0, 189.0),),
    ),
    (
        "rhand",
        "rwrist",
        (0.0, -0.038, 0.0),
        (
            ("rx", (1.0, 0.0, 0.0), -87.0, 110.0),
            ("rz", (0.0, 0.0, 1.0), -188.0, 127.0),
        ),
    ),
    ("lhipjoint", "root", (0.0431, 0.0878, -0.1005), ()),
    (
        "lfemur",
        "lhipjoint",
        (0.0, 0.1387, -0.3812),
        (
            ("rx", (0.0, 0.939692621, 0.342020143), -186.0, 61.0),
            ("ry", (0.0, -0.342020143, 0.939692621), -52.0, 94.0),
            ("rz", (1.0, 0.0, 0.0), -129.0, 138.0),
        ),
    ),
    (
        "ltibia",
        "lfemur",
        (0.0, 0.1488, -0.409),
        (("rx", (0.0, 0.939692621, 0.342020143), -11.0, 166.0),),
    ),
    (
        "lfoot",
        "ltibia",
        (0.1184, 0.0105, -0.0289),
        (
            ("rx", (0.0, 0.939692621, 0.342020143), -95.0, 80.0),
            ("rz", (0.0, -0.342020143, 0.939692621), -72.0, 76.0),
        ),
    ),
    ("rhipjoint", "root", (0.0431, -0.0878, -0.1005), ()),
    (
        "rfemur",
        "rhipjoint",
        (0.0, -0.1387, -0.3812),
        (
            ("rx", (0.0, 0.939692621, -0.342020143), -185.0, 178.0),
            ("ry", (0.0, 0.342020143, 0.939692621), -92.0, 50.0),
            ("rz", (1.0, 0.0, 0.0), -79.0, 126.0),
        ),
    ),
    (
        "rtibia",
        "rfemur",
        (0.0, -0.1488, -0.409),
        (("rx", (0.0, 0.939692621, -0.342020143), -11.0, 167.0),),
    ),
    (
        "rfoot",
        "rtibia",
        (0.1184, -0.0105, -0.0289),
        (
            ("rx", (0.0, 0.939692621, -0.342020143), -93.0, 70.0),
            ("rz", (0.0, 0.342020143, 0.939692621), -73.0, 42.0),
        ),
    ),
)

BONES: tuple[str, ...] = tuple(bone for bone, *_ in _BONES)


@cache
def standard_skeleton() -> Skeleton:
    """The mean CMU skeleton."""
    return Skeleton(
        names=BONES,
        parents=tuple(-1 if parent == "root" else BONES.index(parent) for _, parent, _, _ in _BONES),
        bone_m=np.array([vector for _, _, vector, _ in _BONES]),
        hinges=tuple(tuple(hinge[0] for hinge in hinges) for *_, hinges in _BONES),
        axes=_unit(np.array([axis for *_, hinges in _BONES for _, axis, _, _ in hinges])),
    )


def limits_rad() -> Floats:
    """(48, 2) lowest and highest hinge angle [rad]."""
    return np.deg2rad([[low, high] for *_, hinges in _BONES for _, _, low, high in hinges])


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
