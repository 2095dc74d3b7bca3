"""Someone who tries to hold a pose: where stations are then, and what their places tell of room, mounts and stance.

One linear Gaussian model about the pose: stations are elsewhere because the performer stands elsewhere and faces
another way (free), because every hinge misses the pose a little and the body leans, and because trackers sit a little
beside their nominal mounts. Room by generalised least squares; mounts and stance share the residual as their variances
say.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from harness.body.humanoid import Body
from harness.body.kinematics import Kinematics
from harness.body.mounts import Mount, locate_mount
from harness.core import rotations
from harness.core.arrays import Floats

POSE_ERROR_RAD = float(np.deg2rad(2.5))
"""How far each hinge, and the lean of the whole body, is off the pose, standard deviation [choice]: some six bones bear
a forearm, which then points 6 deg elsewhere."""
MOUNT_ALONG_SD_M, MOUNT_ACROSS_SD_M = 0.03, 0.015
"""How far trackers sit from their nominal mounts, standard deviation along the bone and on the two axes across it:
straps slide along a limb, flesh is known better [choice]."""
FREE_DOFS, _POSE_ERROR_DOFS = [0, 1, 2, 5], [3, 4, *range(6, 54)]
"""Directions of MuJoCo's velocities: root position and turn about the vertical; lean and hinges."""
_PRIOR_INFORMATION = 1e-6
"""Information that stands for knowing nothing (a kilometre, a thousand radians), where stations do not tell either."""


@dataclass(frozen=True, eq=False)
class HeldPoseFit:
    """How S measured places fit."""

    heading_rad: float
    """The turn about the vertical that takes measured axes into the world's."""
    origin_m: Floats
    """(3,) origin of the measured frame in the world [m]."""
    residual_m: Floats
    """(S, 3) from the nominal place to the measured one, world axes [m]."""
    chi_square: float
    """Squared residual in units of the model's spread; 3 S - 4 on average when the model holds."""


class HeldPoseModel:
    """S stations on a body that holds a pose (55,), upright."""

    def __init__(self, body: Body, mounts: Sequence[Mount], pose: Floats) -> None:
        kinematics = Kinematics(body)
        bones = [body.skeleton.index(mount.bone) for mount in mounts]
        placed = [locate_mount(body.skeleton, mount) for mount in mounts]
        self.mount_m = np.array([mount_m for mount_m, _ in placed])
        kinematics.set(pose)
        self.place_m, _ = kinematics.station_poses(bones, self.mount_m, np.array([turn for _, turn in placed]))
        """(S, 3) of the stations in the world."""
        self.world_from_bone: Floats = kinematics.bone_poses()[1][bones]
        """(S, 4)"""
        linear, angular = np.zeros((2, len(mounts), 3, kinematics.nv))
        kinematics.jacobians(bones, self.place_m, linear, angular)
        self._root_m = np.array(pose[:3])
        self._free: Floats = linear[:, :, FREE_DOFS].reshape(-1, len(FREE_DOFS))
        missed = linear[:, :, _POSE_ERROR_DOFS].reshape(-1, len(_POSE_ERROR_DOFS))
        self._turned: Floats = POSE_ERROR_RAD**2 * angular[:, :, _POSE_ERROR_DOFS] @ missed.T
        """(S, 3, 3 S) covariance of how the bones are turned and where the stations are."""
        bone_m = body.skeleton.bone_m[bones] / body.skeleton.length_m[bones][:, None]
        along = rotations.rotate(self.world_from_bone, bone_m)
        blocks = (
            MOUNT_ACROSS_SD_M**2 * np.eye(3)
            + (MOUNT_ALONG_SD_M**2 - MOUNT_ACROSS_SD_M**2) * along[:, :, None] * along[:, None]
        )
        self._beside: Floats = block_diag(*blocks)
        self._precision = _inverse(POSE_ERROR_RAD**2 * missed @ missed.T + self._beside)
        self._room = _inverse(self._free.T @ self._precision @ self._free + _PRIOR_INFORMATION * np.eye(len(FREE_DOFS)))
        """(4, 4) covariance of where the performer stands and faces, given the stations."""

    @property
    def heading_sd_rad(self) -> float:
        """How well these stations tell which way the performer faces, standard deviation [rad]."""
        return float(np.sqrt(self._room[3, 3]))

    def fit(self, measured_m: Floats) -> HeldPoseFit:
        """Of places (S, 3) measured in a frame whose z axis is up."""
        heading_rad = _heading_between_rad(measured_m, self.place_m)
        shift_m = np.mean(self.place_m - rotations.rotate(rotations.about_z(heading_rad), measured_m), axis=0)
        for _ in range(20):
            residual = self._residual(measured_m, heading_rad, shift_m)
            step = self._room @ self._free.T @ self._precision @ residual
            # The body would have to turn by so much about its root: the frame turns back by it.
            back = rotations.about_z(-step[3])
            shift_m = rotations.rotate(back, shift_m - self._root_m - step[:3]) + self._root_m
            heading_rad -= float(step[3])
            if np.abs(step).max() < 1e-10:
                break
        residual = self._residual(measured_m, heading_rad, shift_m)
        return HeldPoseFit(
            heading_rad=float(np.angle(np.exp(1j * heading_rad))),
            origin_m=shift_m,
            residual_m=residual.reshape(-1, 3),
            chi_square=float(residual @ self._precision @ residual),
        )

    def decompose_residual(self, residual_m: Floats) -> tuple[Floats, Floats]:
        """Of residuals (S, 3): how far each tracker sits beside its mount (S, 3) [m], and how far its bone is turned
        from the pose (S, 3), a rotation vector [rad]; in world axes."""
        white = self._precision @ residual_m.ravel()
        return (self._beside @ white).reshape(-1, 3), self._turned @ white

    def _residual(self, measured_m: Floats, heading_rad: float, shift_m: Floats) -> Floats:
        there_m = rotations.rotate(rotations.about_z(heading_rad), measured_m) + shift_m
        out: Floats = (there_m - self.place_m).ravel()
        return out


def _heading_between_rad(from_m: Floats, to_m: Floats) -> float:
    """The turn about the vertical that takes points (S, 3) nearest to others, each about its mean."""
    a, b = ((points - points.mean(axis=0))[:, :2] @ [1.0, 1.0j] for points in (from_m, to_m))
    return float(np.angle(np.vdot(a, b)))


def _inverse(matrix: Floats) -> Floats:
    out: Floats = np.asarray(np.linalg.inv(matrix), dtype=float)
    return out
