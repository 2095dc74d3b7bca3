"""What separates a pose from the readings of one frame, as the solvers weigh it.

One residual per tracker and kind: the vector from the modelled to the measured position, and the rotation vector
from the modelled to the measured orientation, both along world axes (ALGORITHMS.md A5, E). Its norm e enters either
squared, e^2 / 2 sd^2, or through the Lorentzian of Liu et al. 2011, eq. 12, with a scale sL of its own:
rho(e) = sL^2/sd^2 log(1 + e^2 / 2 sL^2), which is the square for small e and lets go of large ones.
"""

import math
from dataclasses import dataclass

import numpy as np

from harness.body.humanoid import Body
from harness.body.kinematics import Kinematics
from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.core.calibration import Calibration
from harness.stream.frame import TrackerFrame


@dataclass(frozen=True)
class Loss:
    """How far readings are trusted."""

    position_sigma_m: float = 0.003
    """The tracker's own noise [m]."""
    orientation_sigma_rad: float = math.radians(0.5)
    robust: bool = True
    """Lorentzian instead of squared residuals."""
    position_scale_m: float = 0.03
    """Where the Lorentzian starts to let go [m]."""
    orientation_scale_rad: float = math.radians(8.0)


class Residuals:
    """Residuals of S stations on one body. Holds the last frame read and the last pose placed; one per session.

    Rows are the S positions, then the S orientations; a row that was not measured counts nothing.
    """

    def __init__(self, body: Body, calibration: Calibration, loss: Loss) -> None:
        count = len(calibration.stations)
        self.kinematics = Kinematics(body)
        self.bones = [body.skeleton.index(bone) for bone in calibration.bones]
        self.mount_m = calibration.mount_m
        self.bone_from_station = calibration.bone_from_station
        self.measured: Bools = np.zeros(2 * count, bool)
        """(2S,) which rows the last frame measured."""
        self.target_m: Floats = np.zeros((count, 3))
        """(S, 3) measured station positions in the world [m]; 0 where not measured."""
        self.world_from_target: Floats = np.tile(rotations.IDENTITY, (count, 1))
        """(S, 4) measured orientation of the bones that carry the stations; identity where not measured."""
        self.error: Floats = np.zeros((2 * count, 3))
        """(2S, 3) measured minus modelled [m; rad]; means nothing in rows that were not measured."""
        self.distance: Floats = np.zeros(2 * count)
        """(2S,) norms of `error` [m; rad]."""

        world_from_tracker = rotations.to_matrix(calibration.world_from_tracker)
        self._tracker_from_world, self._origin_m = world_from_tracker.T, calibration.tracker_origin_m
        station_from_bone = rotations.inverse(calibration.bone_from_station)
        self._to_bone = _left(calibration.world_from_tracker) @ _right(station_from_bone)
        self._bodies = body.bone_body_ids[self.bones]
        self._arm_m = np.ascontiguousarray(calibration.mount_m)[:, :, None]
        data = self.kinematics.data
        self._body_m, self._turned, self._quaternion = data.xpos, data.xmat.reshape(-1, 3, 3), data.xquat
        self._turn_from_model = np.zeros((count, 4, 4))

        self._robust = loss.robust
        self._precision_when_measured = np.repeat([loss.position_sigma_m**-2, loss.orientation_sigma_rad**-2], count)
        self.scale: Floats = np.repeat([loss.position_scale_m, loss.orientation_scale_rad], count)
        """(2S,) where each row's Lorentzian starts to let go [m; rad]."""
        self._precision = np.zeros(2 * count)
        self._twice_scale_squared = 2.0 * self.scale**2
        self._softness = np.zeros(2 * count)
        self._weight = np.zeros(2 * count)
        self._skew = np.zeros((2 * count, 3, 3))
        self._share = np.repeat([1.0, 0.5], count)
        self._jacobian = np.zeros((2 * count, 3, self.kinematics.nv))
        self._linear, self._angular = self._jacobian[:count], self._jacobian[count:]
        self._station_m = np.zeros((count, 3))

    def read(self, frame: TrackerFrame) -> None:
        """Take up the valid readings of a frame."""
        count = len(self.target_m)
        self.measured = np.concatenate([frame.position_valid, frame.orientation_valid])
        target_m = frame.position_m @ self._tracker_from_world + self._origin_m
        turned = (self._to_bone @ frame.tracker_from_station[:, :, None])[:, :, 0]
        if not self.measured.all():
            target_m = np.where(self.measured[:count, None], target_m, 0.0)
            turned = np.where(self.measured[count:, None], turned, rotations.IDENTITY)
        self.target_m, self.world_from_target = target_m, turned
        self._turn_from_model = (turned @ _TIMES_CONJUGATE).reshape(-1, 4, 4)
        self._precision = self._precision_when_measured * self.measured
        self.widen(1.0)

    def widen(self, factor: float) -> None:
        """Let the Lorentzian reach `factor` times farther, until the next frame: for solving from far away."""
        self._twice_scale_squared = 2.0 * (factor * self.scale) ** 2
        self._softness = 0.5 * self._precision * self._twice_scale_squared

    def place(self, qpos: Floats) -> float:
        """The data cost of a configuration (55,), a negative log likelihood; updates `error` and `distance`."""
        count = len(self._station_m)
        self.kinematics.set(qpos)
        arm_m = self._turned[self._bodies] @ self._arm_m
        np.add(self._body_m[self._bodies], arm_m[:, :, 0], out=self._station_m)
        error = self.error
        np.subtract(self.target_m, self._station_m, out=error[:count])
        turn = (self._turn_from_model @ self._quaternion[self._bodies][:, :, None])[:, :, 0]
        error[count:] = _rotation_vector(turn)
        squared = np.einsum("ij,ij->i", error, error)
        np.sqrt(squared, out=self.distance)
        if not self._robust:
            self._weight = self._precision
            return 0.5 * float(self._precision @ squared)
        ratio = squared / self._twice_scale_squared
        self._weight = self._precision / (1.0 + ratio)
        return float(self._softness @ np.log1p(ratio))

    def normal_equations(self) -> tuple[Floats, Floats]:
        """Where `place` left the body: A^T A (54, 54) of the weighted slopes, and the cost's descent (54,).

        The descent is exact; the matrix is Gauss and Newton's, with the Lorentzian's weights held.
        """
        self.kinematics.jacobians(self.bones, self._station_m, self._linear, self._angular)
        root_weight = np.sqrt(self._weight)
        rows = (self._jacobian * root_weight[:, None, None]).reshape(-1, self.kinematics.nv)
        hessian: Floats = rows.T @ rows
        descent: Floats = (self.error * root_weight[:, None]).reshape(-1) @ rows
        return hessian, descent

    def curvature(self) -> Floats:
        """After `normal_equations`: what Gauss and Newton leave out of the Hessian, lower triangle (54, 54).

        A hinge i turns the slope J_j of everything beyond it: the derivative of J_j by q_i is a_i x J_j where j lies
        beyond i, half of it between axes of orientations. Trackers pin a pose so stiffly against so weak a prior that
        this term outweighs the prior as soon as residuals reach 1 mm.
        """
        pull = self.error * (self._weight * self._share)[:, None]
        self._skew[:, _SKEW_ROWS, _SKEW_COLUMNS] = (pull[:, :, None] * _SKEW_SIGNS).reshape(-1, 6)
        turned = self._skew @ self._jacobian
        count = len(self._station_m)
        beyond = (turned[:count] + turned[count:]).reshape(-1, self.kinematics.nv)
        out: Floats = beyond.T @ self._angular.reshape(-1, self.kinematics.nv)
        out[3:6, 3:6] = 0.5 * (out[3:6, 3:6] + out[3:6, 3:6].T)
        return out


_SKEW_ROWS, _SKEW_COLUMNS = np.array([[2, 1, 0, 2, 1, 0], [1, 2, 2, 0, 0, 1]])
_SKEW_SIGNS: Floats = np.array([1.0, -1.0])


def _rotation_vector(turn: Floats) -> Floats:
    """`rotations.log` (S, 3) for the inner loop."""
    vector, cosine = turn[:, 1:], turn[:, 0]
    sine = np.sqrt(np.einsum("ij,ij->i", vector, vector)) + 1e-12
    angle = np.arctan2(sine, np.abs(cosine))
    out: Floats = vector * (np.copysign(2.0, cosine) * angle / sine)[:, None]
    return out


def _left(q: Floats) -> Floats:
    """(..., 4, 4) matrix of p -> q p."""
    return np.stack([rotations.multiply(q, unit) for unit in np.eye(4)], axis=-1)


def _right(q: Floats) -> Floats:
    """(..., 4, 4) matrix of p -> p q."""
    return np.stack([rotations.multiply(unit, q) for unit in np.eye(4)], axis=-1)


_TIMES_CONJUGATE: Floats = np.array([_left(unit) * [1.0, -1.0, -1.0, -1.0] for unit in np.eye(4)]).reshape(4, 16)
"""Makes of a quaternion q the matrix of p -> q p*."""
