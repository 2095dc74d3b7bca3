"""Joint limits, and hinge angles in the representation for which the limits hold.

An angle plus 2 pi is the same rotation, and three perpendicular hinges have the equivalent angles
(a + pi, pi - b, c + pi). Motion files use all of these; the limits hold for one (`core.humanoid24`). Hinges that may
rotate by a full turn have no limits here. Angles are in the order of `qpos[7:]`.
"""

import numpy as np

from harness.body import Body
from harness.core.arrays import Floats, Ints
from harness.core.compiled import compiled
from harness.core.humanoid24 import QPOS_OF_DOF
from harness.core.skeleton import are_gimbal, equivalent_euler_angles

_UNLIMITED_RANGE_RAD = np.deg2rad(350.0)
_FULL_TURN_RAD = 2.0 * np.pi


class HingeLimits:
    """The limits of one body's 48 hinges."""

    def __init__(self, body: Body, keep: bool = True) -> None:
        """With `keep` False no hinge has limits."""
        low, high = body.limits_rad[QPOS_OF_DOF].T
        free = (high - low >= _UNLIMITED_RANGE_RAD) | (not keep)
        self.low_rad: Floats = np.where(free, -np.inf, low)
        """(48,) lowest angle; -inf for a hinge without limits."""
        self.high_rad: Floats = np.where(free, np.inf, high)
        """(48,) highest angle; inf for a hinge without limits."""
        self._middle_rad: Floats = np.where(free, 0.0, 0.5 * (low + high))
        self._gimbals: Ints = np.array(
            [QPOS_OF_DOF[where] for where in body.skeleton.dof_of_bone if are_gimbal(body.skeleton.axes[where])]
        )
        self._middle_hinges: Ints = np.ascontiguousarray(self._gimbals[:, 1])

    def clip(self, angles_rad: Floats) -> Floats:
        """The nearest angles (..., 48) within the limits."""
        out: Floats = np.minimum(np.maximum(angles_rad, self.low_rad), self.high_rad)
        return out

    def excess_rad(self, angles_rad: Floats) -> Floats:
        """(..., 48) distance of each angle from its limits; 0 within."""
        out: Floats = np.abs(angles_rad - self.clip(angles_rad))
        return out

    def past_gimbal(self, angles_rad: Floats) -> bool:
        """Whether a middle hinge of angles (48,) is beyond 90 deg, where `principal` may change them."""
        return _any_beyond(angles_rad, self._middle_hinges, 0.5 * np.pi)

    def principal(self, angles_rad: Floats) -> Floats:
        """The principal representation (..., 48) of the same rotations: the one that exceeds the limits least.

        Of two that do so equally, it is the one whose middle hinge is within 90 deg.
        """
        plain = self._wrapped(angles_rad)
        other = np.array(plain)
        other[..., self._gimbals] = equivalent_euler_angles(plain[..., self._gimbals])
        other = self._wrapped(other)
        beyond = np.abs(plain[..., self._gimbals[:, 1]]) > 0.5 * np.pi
        excess, other_excess = (
            np.sum(self.excess_rad(angles)[..., self._gimbals], axis=-1) for angles in (plain, other)
        )
        better = (other_excess < excess - 1e-9) | (beyond & (other_excess <= excess + 1e-9))
        plain[..., self._gimbals] = np.where(better[..., None], other[..., self._gimbals], plain[..., self._gimbals])
        return plain

    def normalise_motion(self, angles_rad: Floats) -> Floats:
        """Hinge angles (T, 48) of a motion in one representation: the one that is `principal` on most frames.

        Continuous angles stay continuous, and takes of one body agree with each other whatever their files start with.
        """
        out, principal = np.array(angles_rad, dtype=float), self.principal(angles_rad)
        for gimbal in self._gimbals:
            plain, other, limited = out[:, gimbal], equivalent_euler_angles(out[:, gimbal]), principal[:, gimbal]
            if 2 * np.count_nonzero(_angular_distance(limited - other) < _angular_distance(limited - plain)) > len(out):
                out[:, gimbal] = other
        out += _FULL_TURN_RAD * np.round(np.median(principal - out, axis=0) / _FULL_TURN_RAD)
        return out

    def between(self, qpos: Floats, other: Floats, share: float) -> Floats:
        """A configuration (55,) with hinges moved by a share of the way to another's (55,), through full turns."""
        return _between(qpos, other, share, self.high_rad)

    def _wrapped(self, angles_rad: Floats) -> Floats:
        """Angles with full turns added, so that each is within pi of the middle of its limits."""
        out: Floats = angles_rad - _FULL_TURN_RAD * np.round((angles_rad - self._middle_rad) / _FULL_TURN_RAD)
        return out


@compiled
def _any_beyond(angles_rad: Floats, hinges: Ints, limit_rad: float) -> bool:
    """Whether any of some hinges' angles (48,) is farther than a limit from 0."""
    beyond = False
    for hinge in hinges:
        beyond = beyond or abs(angles_rad[hinge]) > limit_rad
    return beyond


@compiled
def _unwrap_near(angles_rad: Floats, other_rad: Floats, high_rad: Floats) -> Floats:
    """Angles (48,) with full turns added to hinges without limits, to be nearest to others; `high_rad` (48,)."""
    out = angles_rad.copy()
    for i in range(len(out)):
        if np.isinf(high_rad[i]):
            out[i] += _FULL_TURN_RAD * np.rint((other_rad[i] - out[i]) / _FULL_TURN_RAD)
    return out


@compiled
def _between(qpos: Floats, other: Floats, share: float, high_rad: Floats) -> Floats:
    """`HingeLimits.between`, with the upper limits (48,)."""
    out, near = qpos.copy(), _unwrap_near(other[7:], qpos[7:], high_rad)
    for i in range(len(near)):
        out[7 + i] += share * (near[i] - out[7 + i])
    return out


def _angular_distance(difference_rad: Floats) -> Floats:
    """Sum (T,) of the absolute differences (T, 3) of angles, each wrapped to +-pi."""
    out: Floats = np.sum(np.abs(difference_rad - _FULL_TURN_RAD * np.round(difference_rad / _FULL_TURN_RAD)), axis=-1)
    return out
