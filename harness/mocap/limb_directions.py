"""Limb directions of recorded motion: ten unit vectors a frame, which do not depend on the performer's size."""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.compiled import compiled
from harness.core.humanoid24 import standard_skeleton
from harness.core.motion import Clip

_LIMBS = (
    ("lowerback", "upperback", "thorax"),
    ("lowerneck", "upperneck", "head"),
    ("lhumerus",),
    ("rhumerus",),
    ("lradius", "lwrist"),
    ("rradius", "rwrist"),
    ("lfemur",),
    ("rfemur",),
    ("ltibia",),
    ("rtibia",),
)
"""The bones of each limb. Single hands and feet are too short: a millimetre of noise turns them by a degree."""
_MOVED = tuple(bone for bone in standard_skeleton().names if bone[1:] not in ("hand", "foot"))
"""The bones of the limbs, and those that carry them."""
MIRRORED = np.array([0, 1, 3, 2, 5, 4, 7, 6, 9, 8])
"""(10,) the limb that each one becomes when left and right change places."""
UPPER_BODY = np.array([0, 1, 2, 3, 4, 5])
"""The limbs without the legs."""


def limb_directions(clip: Clip, rows: Ints) -> Floats:
    """(N, 10, 3) unit vectors of the limbs in the world in these frames (N,); zero for a limb without length."""
    skeleton, dofs = clip.skeleton.subset(_MOVED)
    ends = np.cumsum([0, *(len(hinges) for hinges in skeleton.hinges)])
    limb = np.full(len(_MOVED), -1)
    for number, bones in enumerate(_LIMBS):
        limb[[skeleton.index(bone) for bone in bones]] = number
    vectors_m = _limb_vectors(
        np.array(skeleton.parents),
        ends,
        standard_skeleton().subset(_MOVED)[0].bone_m,
        np.ascontiguousarray(skeleton.axes),
        limb,
        rotations.to_matrix(clip.world_from_root[rows]),
        np.ascontiguousarray(clip.angles_rad[rows][:, dofs]),
    )
    out: Floats = vectors_m / np.maximum(np.sqrt(np.sum(vectors_m**2, axis=2, keepdims=True)), 1e-9)
    return out


@compiled
def _limb_vectors(
    parents: Ints, ends: Ints, bone_m: Floats, axes: Floats, limb: Ints, world_from_root: Floats, angles_rad: Floats
) -> Floats:
    """(N, 10, 3) sums of bone vectors by limb [m]. Rotations compose as in `core.skeleton`, last hinge outermost."""
    out = np.zeros((len(angles_rad), len(MIRRORED), 3))
    world = np.empty((len(parents), 3, 3))
    for n in range(len(angles_rad)):
        for b in range(len(parents)):
            world[b] = world_from_root[n] if parents[b] < 0 else world[parents[b]]
            for d in range(ends[b + 1] - 1, ends[b] - 1, -1):
                _turn(world[b], axes[d], angles_rad[n, d])
            if limb[b] >= 0:
                for axis in range(3):
                    x, y, z = world[b, axis]
                    out[n, limb[b], axis] += x * bone_m[b, 0] + y * bone_m[b, 1] + z * bone_m[b, 2]
    return out


@compiled
def _turn(rotation: Floats, axis: Floats, angle_rad: float) -> None:
    """Multiply a rotation (3, 3) in place from the right by a turn about a unit axis (Rodrigues)."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    for row in range(3):
        a, b, c = rotation[row]
        along = (1.0 - cosine) * (a * axis[0] + b * axis[1] + c * axis[2])
        rotation[row, 0] = cosine * a + sine * (b * axis[2] - c * axis[1]) + along * axis[0]
        rotation[row, 1] = cosine * b + sine * (c * axis[0] - a * axis[2]) + along * axis[1]
        rotation[row, 2] = cosine * c + sine * (a * axis[1] - b * axis[0]) + along * axis[2]
