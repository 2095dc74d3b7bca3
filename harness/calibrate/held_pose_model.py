"""Linear Gaussian model of where stations are while a performer holds a pose.

A station's position differs from its nominal one for three reasons: the performer stands elsewhere and faces another
way (free parameters), hinges and lean miss the pose (Gaussian), and trackers sit beside their nominal mounts
(Gaussian). The room's frame is found by generalised least squares. The residual is then split between mounts and pose
errors in proportion to their variances.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from harness.body import Body, Kinematics, Mount, locate_mounts
from harness.core import rotations
from harness.core.arrays import Floats

POSE_ERROR_RAD = float(np.deg2rad(2.5))
"""Error of each hinge, and of the lean of the whole body, standard deviation [rad] [choice]. Over the six bones that
carry a forearm it adds up to 6 deg."""
MOUNT_ALONG_SD_M, MOUNT_ACROSS_SD_M = 0.03, 0.015
"""Distance of trackers from their nominal mounts, standard deviation along the bone and on the two axes across it [m]:
straps slide along a limb, and its thickness is known better [choice]."""
FREE_DOFS, _POSE_ERROR_DOFS = [0, 1, 2, 5], [3, 4, *range(6, 54)]
"""Indices of MuJoCo velocities: root position and rotation about the vertical; lean and hinges."""
_PRIOR_INFORMATION = 1e-6
"""Information of an uninformative prior (a kilometre, a thousand radians), which keeps the system regular."""


@dataclass(frozen=True, eq=False)
class HeldPoseFit:
    """Fit of S measured positions to a held pose."""

    heading_rad: float
    """Rotation about the vertical from the measured axes to the world's [rad]."""
    origin_m: Floats
    """(3,) origin of the measured frame in the world [m]."""
    residual_m: Floats
    """(S, 3) measured minus nominal position, world axes [m]."""
    chi_square: float
    """Squared Mahalanobis residual; 3 S - 4 on average when the model holds."""


class HeldPoseModel:
    """S stations on a body that holds an upright pose (55,)."""

    def __init__(self, body: Body, mounts: Sequence[Mount], pose: Floats) -> None:
        kinematics = Kinematics(body)
        bones, self.mount_m, turn = locate_mounts(body.skeleton, mounts)
        kinematics.set(pose)
        self.place_m, _ = kinematics.station_poses(bones, self.mount_m, turn)
        """(S, 3) nominal positions of the stations in the world [m]."""
        self.world_from_bone: Floats = kinematics.bone_poses()[1][bones]
        """(S, 4) orientations of the bones that carry the stations."""
        linear, angular = np.zeros((2, len(mounts), 3, kinematics.nv))
        kinematics.jacobians(bones, self.place_m, linear, angular)
        self._root_m = np.array(pose[:3])
        self._free: Floats = linear[:, :, FREE_DOFS].reshape(-1, len(FREE_DOFS))
        pose_jacobian = linear[:, :, _POSE_ERROR_DOFS].reshape(-1, len(_POSE_ERROR_DOFS))
        self._rotation_covariance: Floats = POSE_ERROR_RAD**2 * angular[:, :, _POSE_ERROR_DOFS] @ pose_jacobian.T
        """(S, 3, 3 S) covariance between bone rotations and station positions."""
        bone_m = body.skeleton.bone_m[bones] / body.skeleton.length_m[bones][:, None]
        along = rotations.rotate(self.world_from_bone, bone_m)
        blocks = (
            MOUNT_ACROSS_SD_M**2 * np.eye(3)
            + (MOUNT_ALONG_SD_M**2 - MOUNT_ACROSS_SD_M**2) * along[:, :, None] * along[:, None]
        )
        self._mount_covariance: Floats = block_diag(*blocks)
        self._precision = _inverse(POSE_ERROR_RAD**2 * pose_jacobian @ pose_jacobian.T + self._mount_covariance)
        self._room = _inverse(self._free.T @ self._precision @ self._free + _PRIOR_INFORMATION * np.eye(len(FREE_DOFS)))
        """(4, 4) covariance of the performer's position and heading, given the stations."""

    @property
    def heading_sd_rad(self) -> float:
        """Standard deviation of the performer's heading as these stations determine it [rad]."""
        return float(np.sqrt(self._room[3, 3]))

    def fit(self, measured_m: Floats) -> HeldPoseFit:
        """Fit positions (S, 3) measured in a frame whose z axis is up [m]."""
        heading_rad = heading_between_rad(measured_m, self.place_m)
        shift_m = np.mean(self.place_m - rotations.rotate(rotations.about_z(heading_rad), measured_m), axis=0)
        for _ in range(20):
            residual = self._residual(measured_m, heading_rad, shift_m)
            step = self._room @ self._free.T @ self._precision @ residual
            # The step rotates the body about its root; the measured frame rotates back by the same angle.
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
        """Expected mount offsets (S, 3) [m] and bone rotations (S, 3) [rad] given residuals (S, 3); world axes."""
        white = self._precision @ residual_m.ravel()
        return (self._mount_covariance @ white).reshape(-1, 3), self._rotation_covariance @ white

    def _residual(self, measured_m: Floats, heading_rad: float, shift_m: Floats) -> Floats:
        there_m = rotations.rotate(rotations.about_z(heading_rad), measured_m) + shift_m
        out: Floats = (there_m - self.place_m).ravel()
        return out


def heading_between_rad(from_m: Floats, to_m: Floats) -> float:
    """Rotation about the vertical that fits points (S, 3) to others best, each about its mean [rad]."""
    a, b = ((points - points.mean(axis=0))[:, :2] @ [1.0, 1.0j] for points in (from_m, to_m))
    return float(np.angle(np.vdot(a, b)))


def _inverse(matrix: Floats) -> Floats:
    out: Floats = np.asarray(np.linalg.inv(matrix), dtype=float)
    return out
