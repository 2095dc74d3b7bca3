"""Coordinates in which `local_regression` blends and smooths poses: hinge angles, or the joints' quaternions.

A pose is (55,): height, tilt and 48 hinge angles, then the root's ground frame relative to the anchor. Kim et al. 2012
regress and smooth the quaternions of all joints (docs/papers.md B3 to B5). The database has one representation of each
hinge, so blending hinge angles gives nearly the same poses in a tenth of the time.

Smoothing over three frames bridges short losses: eq. 6, y = y_t + ((y_t-1 + (y_t-2 - y_t-1)^alpha) - y_t)^beta, where
the difference of two rotations is a rotation, its power is a share of its angle, and y_t-1, y_t-2 are earlier outputs.
For hinge angles and plain vectors this is a weighted sum: 0.60, 0.28 and 0.12 with the paper's alpha 0.3 and beta 0.4.
"""

from typing import Protocol

import numpy as np

from harness.body import Body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.core.humanoid24 import QPOS_OF_DOF
from harness.core.skeleton import hinge_angles, hinge_rotation
from harness.reconstruct.solver.ground_frame import HINGES
from harness.reconstruct.solver.hinge_limits import HingeLimits

_PLAIN = 7
"""Leading coordinates of `JointQuaternions` that are no quaternions: height, tilt, and the root's ground frame."""


class PoseSpace(Protocol):
    """Coordinates of poses."""

    def encode(self, poses: Floats) -> Floats:
        """Coordinates (m, d) of poses (m, 55), the nearest neighbour's first."""
        ...

    def decode(self, coordinates: Floats) -> Floats:
        """The pose (55,) of coordinates (d,)."""
        ...

    def blend(self, weights: Floats, coordinates: Floats) -> Floats:
        """(d,) coordinates of the weighted mean of (m, d); `weights` (m,) have the sum 1."""
        ...

    def smooth(self, now: Floats, before: Floats, earlier: Floats, alpha: float, beta: float) -> Floats:
        """Eq. 6 for coordinates (d,) at t, t-1 and t-2."""
        ...


class HingeAngles:
    """A `PoseSpace`: the pose itself."""

    def encode(self, poses: Floats) -> Floats:
        return poses

    def decode(self, coordinates: Floats) -> Floats:
        return coordinates

    def blend(self, weights: Floats, coordinates: Floats) -> Floats:
        out: Floats = np.matmul(weights, coordinates)
        return out

    def smooth(self, now: Floats, before: Floats, earlier: Floats, alpha: float, beta: float) -> Floats:
        return smooth(now, before, earlier, alpha, beta)


class JointQuaternions:
    """A `PoseSpace`: height, tilt and root (7), then the quaternion of each hinged bone relative to its parent.

    Signs are those of the nearest neighbour, and blends are normalised (docs/papers.md E, "y as quaternions"). One or
    two hinges cannot take every blend; they take the nearest rotation.
    """

    def __init__(self, body: Body, limits: HingeLimits) -> None:
        skeleton, self._limits = body.skeleton, limits
        self._dofs = [where for where in skeleton.dof_of_bone if where.start < where.stop]
        self._axes = [skeleton.axes[where] for where in self._dofs]

    def encode(self, poses: Floats) -> Floats:
        angles = poses[:, HINGES][:, QPOS_OF_DOF]
        joints = [hinge_rotation(axes, angles[:, where]) for axes, where in zip(self._axes, self._dofs, strict=True)]
        joint = np.stack(joints, axis=1)
        joint = joint * np.copysign(1.0, np.vecdot(joint, joint[0]))[..., None]
        plain = [poses[:, : HINGES.start], poses[:, HINGES.stop :]]
        return np.concatenate([*plain, joint.reshape(len(poses), -1)], axis=1)

    def decode(self, coordinates: Floats) -> Floats:
        joint, angles = _joints(coordinates), np.empty(len(QPOS_OF_DOF))
        for axes, where, rotation in zip(self._axes, self._dofs, joint, strict=True):
            angles[where] = hinge_angles(axes, rotation[None])[0]
        hinges = self._limits.principal(angles[QPOS_OF_DOF])
        return np.concatenate([coordinates[: HINGES.start], hinges, coordinates[HINGES.start : _PLAIN]])

    def blend(self, weights: Floats, coordinates: Floats) -> Floats:
        out: Floats = np.matmul(weights, coordinates)
        joint = _joints(out)
        joint /= np.maximum(np.linalg.norm(joint, axis=1, keepdims=True), 1e-12)
        return out

    def smooth(self, now: Floats, before: Floats, earlier: Floats, alpha: float, beta: float) -> Floats:
        plain = smooth(now[:_PLAIN], before[:_PLAIN], earlier[:_PLAIN], alpha, beta)
        joint = smooth_rotation(_joints(now), _joints(before), _joints(earlier), alpha, beta)
        return np.concatenate([plain, joint.reshape(-1)])


def _joints(coordinates: Floats) -> Floats:
    """(J, 4) quaternions in coordinates (7 + 4 J,), as a view."""
    return coordinates[_PLAIN:].reshape(-1, 4)


def slerp(start: Floats, stop: Floats, share: float) -> Floats:
    """Spherical interpolation of unit quaternions (..., 4) by a share, along the shorter arc."""
    turn = rotations.log(rotations.multiply(rotations.inverse(start), stop))
    return rotations.multiply(start, rotations.exp(share * turn))


def smooth_rotation(now: Floats, before: Floats, earlier: Floats, alpha: float, beta: float) -> Floats:
    """Eq. 6 for quaternions (..., 4) at t, t-1 and t-2."""
    return slerp(now, slerp(before, earlier, alpha), beta)


def smooth(now: Floats, before: Floats, earlier: Floats, alpha: float, beta: float) -> Floats:
    """Eq. 6 for vectors (n,) at t, t-1 and t-2."""
    return _weighted_sum(now, before, earlier, *smoothing_weights(alpha, beta))


def smoothing_weights(alpha: float, beta: float) -> tuple[float, float, float]:
    """Weights of t, t-1 and t-2 in eq. 6 for a vector, such as hinge angles."""
    return 1.0 - beta, beta * (1.0 - alpha), beta * alpha


@compiled
def _weighted_sum(
    now: Floats, before: Floats, earlier: Floats, share: float, share_before: float, share_earlier: float
) -> Floats:
    return share * now + share_before * before + share_earlier * earlier
