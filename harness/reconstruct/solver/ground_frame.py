"""Poses split into a ground frame (x, y, yaw) and a posture that depends neither on position nor on heading.

The ground frame lies on the floor below the root. Its heading is the root's twist about the vertical: the `yaw` of
q = about_z(yaw) tilt, where tilt rotates about a horizontal axis. That heading is smooth for every posture but one
upside down, while the direction of the root's x axis flips as soon as someone bends over. A rotation or shift of the
room changes the ground frame alone.

Arrays of ground frames are (..., 3): x, y [m] and yaw [rad]. Postures are (..., 52): height [m], tilt as a rotation
vector (its z is 0) [rad], 48 hinges in the order of `qpos[7:]` [rad].
"""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, Singles
from harness.core.compiled import compiled

POSTURE_SIZE = 52
HEIGHT, TILT, HINGES = 0, slice(1, 4), slice(4, 52)
"""Indices into a posture."""


def ground_from_qpos(qpos: Floats) -> Floats:
    """Ground frames (..., 3) of configurations (..., 55)."""
    return np.stack([qpos[..., 0], qpos[..., 1], 2.0 * np.arctan2(qpos[..., 6], qpos[..., 3])], axis=-1)


def posture_from_qpos(qpos: Floats) -> Floats:
    """Postures (..., 52) of configurations (..., 55); hinge angles are copied."""
    out = np.empty((*qpos.shape[:-1], POSTURE_SIZE))
    w, x, y, z = np.moveaxis(qpos[..., 3:7], -1, 0)
    level, lean = np.hypot(w, z), np.hypot(x, y)
    # about_z(-yaw) q = (level, (x w + y z) / level, (y w - x z) / level, 0)
    factor = 2.0 * np.arctan2(lean, level) / np.maximum(level * lean, 1e-30)
    out[..., HEIGHT] = qpos[..., 2]
    out[..., 1] = factor * (x * w + y * z)
    out[..., 2] = factor * (y * w - x * z)
    out[..., 3] = 0.0
    out[..., HINGES] = qpos[..., 7:]
    return out


def qpos_from_postures(posture: Floats | Singles, ground: Floats) -> Floats:
    """Configurations (..., 55) of postures (..., 52) on ground frames (..., 3).

    The inverse of `posture_from_qpos` and `ground_from_qpos`.
    """
    tilt = np.asarray(posture[..., TILT], dtype=float)
    out = np.empty((*np.broadcast_shapes(posture.shape[:-1], ground.shape[:-1]), 55))
    out[..., :2] = ground[..., :2]
    out[..., 2] = posture[..., HEIGHT]
    out[..., 3:7] = rotations.multiply(rotations.about_z(ground[..., 2]), rotations.exp(tilt))
    out[..., 7:] = posture[..., HINGES]
    return out


def relative_ground(ground: Floats, other: Floats) -> Floats:
    """Ground frames `other` (..., 3) relative to `ground` (..., 3): forward, left [m], turn within +-pi [rad]."""
    cosine, sine = np.cos(ground[..., 2]), np.sin(ground[..., 2])
    x, y = other[..., 0] - ground[..., 0], other[..., 1] - ground[..., 1]
    turn = other[..., 2] - ground[..., 2]
    turn = turn - 2.0 * np.pi * np.round(turn / (2.0 * np.pi))
    return np.stack([cosine * x + sine * y, cosine * y - sine * x, turn], axis=-1)


@compiled
def qpos_from_posture(posture: Floats, ground: Floats) -> Floats:
    """The configuration (P + 3,) of one posture (P,) on a ground frame (3,): `qpos_from_postures`, compiled."""
    out = np.empty(len(posture) + 3)
    out[0], out[1], out[2] = ground[0], ground[1], posture[0]
    angle = np.sqrt(posture[1] ** 2 + posture[2] ** 2 + posture[3] ** 2)
    share = np.sin(0.5 * angle) / angle if angle > 1e-12 else 0.5
    w, x, y, z = np.cos(0.5 * angle), share * posture[1], share * posture[2], share * posture[3]
    c, s = np.cos(0.5 * ground[2]), np.sin(0.5 * ground[2])
    out[3], out[4], out[5], out[6] = c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w
    out[7:] = posture[4:]
    return out


@compiled
def ground_and_posture(qpos: Floats) -> Floats:
    """(P + 3,) ground frame, then posture, of one configuration (P + 3,): both functions above, compiled."""
    out = np.empty(len(qpos))
    w, x, y, z = qpos[3], qpos[4], qpos[5], qpos[6]
    level, lean = np.sqrt(w * w + z * z), np.sqrt(x * x + y * y)
    factor = 2.0 * np.arctan2(lean, level) / max(level * lean, 1e-30)
    out[0], out[1], out[2] = qpos[0], qpos[1], 2.0 * np.arctan2(z, w)
    out[3], out[4], out[5], out[6] = qpos[2], factor * (x * w + y * z), factor * (y * w - x * z), 0.0
    out[7:] = qpos[7:]
    return out
