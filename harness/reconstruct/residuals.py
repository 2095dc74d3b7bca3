"""What separates a pose from the readings of one frame, as the solvers weigh it.

One residual per tracker and kind: the vector from the modelled to the measured position, and the rotation vector
from the modelled to the measured orientation, both along world axes (docs/methods.md A5, E). Its norm e enters either
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
    quality: bool = True
    """Weigh every reading by its station's quality, 0 to 1: a standard deviation of sigma / sqrt(quality)."""
    suspect_weight: float = 0.1
    """What a suspect reading counts beside that; 1 takes it for any other, 0 leaves it out."""


class Residuals:
    """Residuals of S stations on one body, for one session: `read` a frame, `place` poses, ask for slopes.

    Rows are the S positions, then the S orientations; a row that was not measured counts nothing. Everything is
    written into arrays made once, for calls cost more than numbers here.
    """

    def __init__(self, body: Body, calibration: Calibration, loss: Loss) -> None:
        count = len(calibration.stations)
        self.kinematics = Kinematics(body)
        self.bones = [body.skeleton.index(bone) for bone in calibration.bones]
        self.mount_m, self.bone_from_station = calibration.mount_m, calibration.bone_from_station
        self.measured: Bools = np.zeros(2 * count, bool)
        """(2S,) which rows the last frame measured."""
        self.trust: Floats = np.zeros(2 * count)
        """(2S,) how much each row counts, by quality and suspicion: 1 fully; 0 where not measured."""
        self.target_m: Floats = np.zeros((count, 3))
        """(S, 3) measured station positions in the world [m]; 0 where not measured."""
        self.world_from_target: Floats = np.tile(rotations.IDENTITY, (count, 1))
        """(S, 4) measured orientation of the bones that carry the stations; identity where not measured."""
        self.error: Floats = np.zeros((2 * count, 3))
        """(2S, 3) measured minus modelled [m; rad]; means nothing in rows that were not measured."""
        self.station_m: Floats = np.zeros((count, 3))
        """(S, 3) modelled station positions in the world [m]."""
        self.scale: Floats = np.repeat([loss.position_scale_m, loss.orientation_scale_rad], count)
        """(2S,) where each row's Lorentzian starts to let go [m; rad]."""

        self._world_from_tracker = rotations.to_matrix(calibration.world_from_tracker)
        self._origin_m = calibration.tracker_origin_m
        station_from_bone = rotations.inverse(calibration.bone_from_station)
        self._to_bone = _left(calibration.world_from_tracker) @ _right(station_from_bone)

        data = self.kinematics.data
        self._bodies = body.bone_body_ids[self.bones]
        self._body_m, self._body_turned, self._body_quaternion = (
            data.xpos,
            data.xmat.reshape(-1, 3, 3),
            data.xquat[:, :, None],
        )
        self._mount_m = np.array(calibration.mount_m)[:, :, None]
        self._turned = np.zeros((count, 3, 3))
        self._turn_from_model = np.zeros((count, 4, 4))
        self._quaternion, self._turn = np.zeros((count, 4, 1)), np.zeros((count, 4, 1))
        self._turn_vector, self._turn_cosine = self._turn[:, 1:, 0], self._turn[:, 0, 0]
        self._position_error, self._turn_error = self.error[:count], self.error[count:]

        self._robust, self._by_quality, self._suspect_weight = loss.robust, loss.quality, loss.suspect_weight
        self._said_trust = np.ones((2, count))
        self._own_precision = np.repeat([loss.position_sigma_m**-2, loss.orientation_sigma_rad**-2], count)
        self._precision, self._weight, self._root_weight = np.zeros((3, 2 * count))
        self._squared, self._twice_scale_squared = np.zeros(2 * count), 2.0 * self.scale**2
        self._softness = np.zeros(2 * count)
        nv = self.kinematics.nv
        self._jacobian, self._weighted = np.zeros((2, 2 * count, 3, nv))
        self._rows, self._columns = self._weighted.reshape(-1, nv), self._weighted.reshape(-1, nv).T
        self._points = list(self.station_m), list(self._jacobian[:count]), list(self._jacobian[count:])
        self._skew, self._share = np.zeros((2 * count, 3, 3)), np.repeat([1.0, 0.5], count)

    @property
    def distance(self) -> Floats:
        """(2S,) norms of `error` [m; rad]."""
        out: Floats = np.sqrt(self._squared)
        return out

    def read(self, frame: TrackerFrame) -> None:
        """Take up the valid readings of a frame."""
        count = len(self.bones)
        self.measured = np.concatenate([frame.position_valid, frame.orientation_valid])
        target_m = frame.position_m @ self._world_from_tracker.T + self._origin_m
        turned = (self._to_bone @ frame.tracker_from_station[:, :, None])[:, :, 0]
        if not self.measured.all():
            target_m = np.where(self.measured[:count, None], target_m, 0.0)
            turned = np.where(self.measured[count:, None], turned, rotations.IDENTITY)
        self.target_m, self.world_from_target = target_m, turned
        self._turn_from_model = (turned @ _TIMES_CONJUGATE).reshape(count, 4, 4)
        self._said_trust[:] = frame.quality if self._by_quality else 1.0
        if frame.suspect.any():
            self._said_trust[:, frame.suspect] *= self._suspect_weight
        self._weigh()

    def leave_out(self, rows: Bools) -> None:
        """Treat these rows (2S,) of the frame as not measured."""
        self.measured = self.measured & ~rows
        self._weigh()

    def _weigh(self) -> None:
        np.multiply(self._said_trust.reshape(-1), self.measured, out=self.trust)
        np.multiply(self._own_precision, self.trust, out=self._precision)
        np.copyto(self._weight, self._precision)
        np.sqrt(self._weight, out=self._root_weight)
        self.widen(1.0)

    def widen(self, factor: float) -> None:
        """Let the Lorentzian reach `factor` times farther, until the next frame: for solving from far away."""
        self._twice_scale_squared = 2.0 * (factor * self.scale) ** 2
        self._softness = 0.5 * self._precision * self._twice_scale_squared

    def place(self, qpos: Floats) -> float:
        """The data cost of a configuration (55,), a negative log likelihood; updates `error` and `distance`."""
        bodies, station_m = self._bodies, self.station_m
        self.kinematics.set(qpos)
        self._body_turned.take(bodies, 0, self._turned, "clip")
        self._body_m.take(bodies, 0, station_m, "clip")
        self._body_quaternion.take(bodies, 0, self._quaternion, "clip")
        station_m += np.matmul(self._turned, self._mount_m)[:, :, 0]
        np.subtract(self.target_m, station_m, out=self._position_error)
        np.matmul(self._turn_from_model, self._quaternion, out=self._turn)
        _rotation_vector(self._turn_vector, self._turn_cosine, out=self._turn_error)
        np.vecdot(self.error, self.error, out=self._squared)
        if not self._robust:
            return 0.5 * float(self._precision @ self._squared)
        ratio = self._squared / self._twice_scale_squared
        cost = float(self._softness @ np.log1p(ratio))
        ratio += 1.0
        np.divide(self._precision, ratio, out=self._weight)
        np.sqrt(self._weight, out=self._root_weight)
        return cost

    def normal_equations(self, hessian: Floats) -> Floats:
        """Where `place` left the body: fills `hessian` (54, 54) with Gauss and Newton's, returns the descent (54,).

        The descent, minus the cost's gradient, is exact; the matrix holds the Lorentzian's weights as they are.
        """
        self.kinematics.jacobians(self.bones, *self._points)
        np.multiply(self._jacobian, self._root_weight[:, None, None], out=self._weighted)
        np.matmul(self._columns, self._rows, out=hessian)
        descent: Floats = (self.error * self._root_weight[:, None]).reshape(-1) @ self._rows
        return descent

    def add_curvature(self, hessian: Floats) -> None:
        """After `normal_equations`: adds to the lower triangle what Gauss and Newton leave out.

        A hinge i turns the slope J_j of everything beyond it: the derivative of J_j by q_i is a_i x J_j where j lies
        beyond i, half of it between axes of orientations. Trackers pin a pose so stiffly against so weak a prior that
        this term outweighs the prior as soon as residuals reach 1 mm.
        """
        count, nv = len(self.bones), self.kinematics.nv
        pull = self.error * (self._weight * self._share)[:, None]
        self._skew[:, _SKEW_ROWS, _SKEW_COLUMNS] = (pull[:, :, None] * _SKEW_SIGNS).reshape(-1, 6)
        turned = self._skew @ self._jacobian
        beyond = (turned[:count] + turned[count:]).reshape(-1, nv)
        curvature = beyond.T @ self._jacobian[count:].reshape(-1, nv)
        curvature[3:6, 3:6] = 0.5 * (curvature[3:6, 3:6] + curvature[3:6, 3:6].T)
        hessian += curvature


def _rotation_vector(vector: Floats, cosine: Floats, out: Floats) -> None:
    """`rotations.log` of quaternions in two parts, (S, 3) and (S,), for the inner loop."""
    sine = np.sqrt(np.vecdot(vector, vector))
    sine += 1e-12
    factor = np.arctan2(sine, np.abs(cosine))
    factor /= sine
    factor *= np.copysign(2.0, cosine)
    np.multiply(vector, factor[:, None], out=out)


def _left(q: Floats) -> Floats:
    """(..., 4, 4) matrix of p -> q p."""
    return np.stack([rotations.multiply(q, unit) for unit in np.eye(4)], axis=-1)


def _right(q: Floats) -> Floats:
    """(..., 4, 4) matrix of p -> p q."""
    return np.stack([rotations.multiply(unit, q) for unit in np.eye(4)], axis=-1)


_SKEW_ROWS, _SKEW_COLUMNS = np.array([[2, 1, 0, 2, 1, 0], [1, 2, 2, 0, 0, 1]])
_SKEW_SIGNS: Floats = np.array([1.0, -1.0])
_TIMES_CONJUGATE: Floats = np.array([_left(unit) * [1.0, -1.0, -1.0, -1.0] for unit in np.eye(4)]).reshape(4, 16)
"""Makes of a quaternion q the matrix of p -> q p*."""
