"""Poses and readings seen from a frame on the floor, so that neither place nor heading in the room matters.

A pose is split into the ground frame (x, y, yaw) below the root, and a posture. The heading is the root's twist about
the vertical: the `yaw` of q = about_z(yaw) tilt, where tilt rotates about a horizontal axis. That heading is smooth for
every posture but one upside down, while the direction of the root's x axis flips as soon as someone bends over.

Arrays of ground frames are (..., 3): x, y [m] and yaw [rad]. Postures are (..., 52): height [m], tilt as a rotation
vector (its z is 0) [rad], 48 hinges in the order of `qpos[7:]` [rad].

Readings are seen from the anchor frame: a point above one station on the trunk, and its bone's heading (docs/papers.md
E, "world invariance"). Kim et al. 2012 compare readings with examples in the room of the T-pose calibration (B2), so
their database knows only the places where it was captured. Without orientations the heading is estimated from the
positions, by the same linear map for examples and readings (F5).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Singles
from harness.core.compiled import compiled

POSTURE_SIZE = 52
HEIGHT, TILT, HINGES = 0, slice(1, 4), slice(4, 52)
"""Indices into a posture."""
Complexes = NDArray[np.complex128]
_TRUNK = ("lhipjoint", "rhipjoint", "lowerback", "upperback", "thorax", "lowerneck", "upperneck", "head")
"""Bones that show the performer's position and heading, best first."""
_LIMBS = ("femur", "tibia", "foot", "clavicle", "humerus", "radius", "wrist", "hand")
"""Bones for stations elsewhere, best first: a shin follows the body's heading better than a hand.

On validation blocks of boxing, two hands and two ankles have errors of 3.0, 3.0 and 1.9 deg with this order, in place
of 3.6, 3.3 and 2.5; walking does not change."""
MIN_HEADING_EXPLAINED = 0.8
"""Least explained share of the heading for its estimate from positions: six stations reach 0.94, two below 0.78."""


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


@compiled
def step_ground(ground: Floats, step: Floats) -> Floats:
    """Ground frame (3,) after a step (3,): forward, left [m] and rotation [rad]."""
    cosine, sine = np.cos(ground[2]), np.sin(ground[2])
    forward, left, turn = step[0], step[1], step[2]
    x, y = ground[0] + cosine * forward - sine * left, ground[1] + sine * forward + cosine * left
    return np.array([x, y, ground[2] + turn])


@compiled
def ground_after_step(qpos: Floats, step: Floats) -> Floats:
    """Ground frame (3,) after a step (3,) from that of a configuration (55,)."""
    return step_ground(np.array([qpos[0], qpos[1], 2.0 * np.arctan2(qpos[6], qpos[3])]), step)


@compiled
def features_from_readings(position_m: Floats, turned: Floats, ground: Floats, lever_m: float) -> Singles:
    """(9 S,) `station_features` of positions (S, 3) and orientations (S, 4), relative to a ground frame (3,)."""
    cosine, sine = np.cos(ground[2]), np.sin(ground[2])
    out = np.empty((len(position_m), 9), np.float32)
    for k in range(len(position_m)):
        x, y = position_m[k, 0] - ground[0], position_m[k, 1] - ground[1]
        out[k, 0], out[k, 1] = cosine * x + sine * y, cosine * y - sine * x
        out[k, 2] = position_m[k, 2]
        a, b, c, d = turned[k, 0], turned[k, 1], turned[k, 2], turned[k, 3]
        forward = 1.0 - 2.0 * (c * c + d * d), 2.0 * (b * c + a * d), 2.0 * (b * d - a * c)
        left = 2.0 * (b * c - a * d), 1.0 - 2.0 * (b * b + d * d), 2.0 * (c * d + a * b)
        out[k, 3], out[k, 4] = (
            lever_m * (cosine * forward[0] + sine * forward[1]),
            lever_m * (cosine * left[0] + sine * left[1]),
        )
        out[k, 5], out[k, 6] = (
            lever_m * (cosine * forward[1] - sine * forward[0]),
            lever_m * (cosine * left[1] - sine * left[0]),
        )
        out[k, 7], out[k, 8] = lever_m * forward[2], lever_m * left[2]
    return out.reshape(-1)


class AnchorFrame(NamedTuple):
    """A point on the floor and a heading."""

    x_m: float
    """World x [m]."""
    y_m: float
    """World y [m]."""
    yaw_rad: float
    """Heading about the vertical [rad]."""


def anchor_of(bones: Sequence[str]) -> int:
    """Index of the anchor among stations on these bones (S,): the bone nearest to the pelvis, the first of equals."""

    def distance(bone: str) -> int:
        return _TRUNK.index(bone) if bone in _TRUNK else len(_TRUNK) + _LIMBS.index(bone[1:])

    return min(range(len(bones)), key=lambda k: distance(bones[k]))


def on_trunk(bone: str) -> bool:
    """Whether a bone belongs to the trunk and so shows the performer's heading."""
    return bone in _TRUNK


def twist_rad(orientation: Floats) -> Floats:
    """(...,) heading of orientations (..., 4): their twist about the vertical [rad]."""
    out: Floats = 2.0 * np.arctan2(orientation[..., 3], orientation[..., 0])
    return out


class HeadingEstimator(NamedTuple):
    """Linear estimator of the performer's heading from station positions relative to the anchor.

    It is equivariant: rotating the stations about the vertical rotates the estimate.
    """

    anchor: int
    stations: Bools
    """(S,) stations that it uses, the anchor among them."""
    weight: Complexes
    """(S,) complex weight of each horizontal position x + i y relative to the anchor; 0 for unused stations."""
    explained: float
    """Share of the heading's variance that it explains in its training examples, 0 to 1."""

    @classmethod
    def fit(cls, at_m: Floats, anchor: int, used: Bools) -> "HeadingEstimator":
        """Fit by least squares to positions (N, S, 3) of performers who face along x, over `used` stations (S,)."""
        offsets = _horizontal_offsets(at_m, anchor)[:, used]
        product, towards = offsets.conj().T @ offsets, offsets.conj().sum(axis=0)
        weight = np.zeros(len(used), complex)
        least = 1e-6 * np.trace(product).real + 1e-12  # the anchor is at 0 from itself
        weight[used] = np.linalg.solve(product + least * np.eye(len(product)), towards)
        return cls(anchor, used, weight, float((towards.conj() @ weight[used]).real) / len(at_m))

    def heading_rad(self, at_m: Floats) -> Floats:
        """(...,) heading estimated from station positions (..., S, 3) [rad]."""
        out: Floats = np.angle(_horizontal_offsets(at_m, self.anchor) @ self.weight)
        return out


def _horizontal_offsets(at_m: Floats, anchor: int) -> Complexes:
    """(..., S) horizontal positions x + i y of stations (..., S, 3) relative to the anchor [m]."""
    offset_m = at_m[..., :2] - at_m[..., anchor, None, :2]
    out: Complexes = offset_m[..., 0] + 1j * offset_m[..., 1]
    return out
