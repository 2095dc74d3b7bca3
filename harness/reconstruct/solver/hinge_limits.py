"""Hinge angles in the representation that the joint limits speak of.

An angle means the same 2 pi later, and three perpendicular hinges also know the twin (a + pi, pi - b, c + pi).
Motion files wander through all of them; the limits hold for one (`core.humanoid24`). Hinges that may turn all the
way round have no limits here. Angles are in the order of `qpos[7:]`.
"""

import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Floats, Ints
from harness.core.hinges import are_gimbal, equivalent_euler_angles
from harness.core.humanoid24 import QPOS_OF_DOF

_UNLIMITED_RANGE_RAD = np.deg2rad(350.0)
_FULL_TURN_RAD = 2.0 * np.pi


class HingeLimits:
    """The limits of one body's 48 hinges."""

    def __init__(self, body: Body, keep: bool = True) -> None:
        """With `keep` off no hinge has limits."""
        low, high = body.limits_rad[QPOS_OF_DOF].T
        free = (high - low >= _UNLIMITED_RANGE_RAD) | (not keep)
        self.low_rad: Floats = np.where(free, -np.inf, low)
        """(48,) lowest angle; -inf for a hinge that may turn all the way round."""
        self.high_rad: Floats = np.where(free, np.inf, high)
        self._middle_rad: Floats = np.where(free, 0.0, 0.5 * (low + high))
        self._gimbals: Ints = np.array(
            [QPOS_OF_DOF[where] for where in body.skeleton.dof_of_bone if are_gimbal(body.skeleton.axes[where])]
        )

    def clip(self, angles_rad: Floats) -> Floats:
        """The nearest angles (..., 48) within the limits."""
        out: Floats = np.minimum(np.maximum(angles_rad, self.low_rad), self.high_rad)
        return out

    def excess_rad(self, angles_rad: Floats) -> Floats:
        """(..., 48) how far each angle lies outside."""
        out: Floats = np.abs(angles_rad - self.clip(angles_rad))
        return out

    def past_gimbal(self, angles_rad: Floats) -> bool:
        """Whether a middle hinge of angles (48,) stands beyond 90 deg, where the twin may be the lawful one."""
        return bool(np.any(np.abs(angles_rad[self._gimbals[:, 1]]) > 0.5 * np.pi))

    def principal(self, angles_rad: Floats) -> Floats:
        """The same rotations (..., 48) as deep within the limits as any representation of them gets.

        Twins that are equally lawful are told apart by the middle hinge, which stays within 90 deg.
        """
        plain = self._wrapped(angles_rad)
        other = np.array(plain)
        other[..., self._gimbals] = equivalent_euler_angles(plain[..., self._gimbals])
        other = self._wrapped(other)
        beyond = np.abs(plain[..., self._gimbals[:, 1]]) > 0.5 * np.pi
        outside, outside_twin = (
            np.sum(self.excess_rad(angles)[..., self._gimbals], axis=-1) for angles in (plain, other)
        )
        better = (outside_twin < outside - 1e-9) | (beyond & (outside_twin <= outside + 1e-9))
        plain[..., self._gimbals] = np.where(better[..., None], other[..., self._gimbals], plain[..., self._gimbals])
        return plain

    def normalise_motion(self, angles_rad: Floats) -> Floats:
        """The same motion (T, 48), changed as a whole to the representation that is `principal` on most frames.

        What is continuous stays so, and takes of one body agree with each other, whatever their files began with.
        """
        out, principal = np.array(angles_rad, dtype=float), self.principal(angles_rad)
        for gimbal in self._gimbals:
            plain, other, lawful = out[:, gimbal], equivalent_euler_angles(out[:, gimbal]), principal[:, gimbal]
            if 2 * np.count_nonzero(_angular_distance(lawful - other) < _angular_distance(lawful - plain)) > len(out):
                out[:, gimbal] = other
        out += _FULL_TURN_RAD * np.round(np.median(principal - out, axis=0) / _FULL_TURN_RAD)
        return out

    def unwrap_near(self, angles_rad: Floats, other_rad: Floats) -> Floats:
        """`angles_rad` with every hinge that has no limits turned as near to the other as whole turns bring it."""
        turns = np.where(np.isinf(self.high_rad), np.round((other_rad - angles_rad) / _FULL_TURN_RAD), 0.0)
        out: Floats = angles_rad + _FULL_TURN_RAD * turns
        return out

    def mean(self, angles_rad: Floats) -> Floats:
        """(48,) mean of angles (T, 48) as directions, in principal form and within the limits."""
        principal = self.principal(angles_rad)
        mean = np.arctan2(np.mean(np.sin(principal), axis=0), np.mean(np.cos(principal), axis=0))
        return self.clip(self._wrapped(mean))

    def _wrapped(self, angles_rad: Floats) -> Floats:
        """Whole turns added until every angle is within pi of the middle of its limits."""
        out: Floats = angles_rad - _FULL_TURN_RAD * np.round((angles_rad - self._middle_rad) / _FULL_TURN_RAD)
        return out


def _angular_distance(difference_rad: Floats) -> Floats:
    """Size (T,) of differences (T, 3) of angles, each taken the short way round."""
    out: Floats = np.sum(np.abs(difference_rad - _FULL_TURN_RAD * np.round(difference_rad / _FULL_TURN_RAD)), axis=-1)
    return out
