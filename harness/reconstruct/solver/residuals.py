"""Residuals between a pose and the readings of one frame, as the solvers weigh them.

Each station has two: the vector from the modelled to the measured position, and the rotation vector from the modelled
to the measured orientation, both along world axes (docs/papers.md A5, E). A residual's norm e enters the cost either
squared, e^2 / 2 sd^2, or through the Lorentzian of Liu et al. 2011, eq. 12, with a scale sL of its own:
rho(e) = sL^2/sd^2 log(1 + e^2 / 2 sL^2). That is the square for small e, and gives little weight to large ones.
"""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from harness.body import Body, Kinematics
from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.core.calibration import Calibration
from harness.core.compiled import specialise
from harness.core.ranges import Range
from harness.errors import ShapeError
from harness.reconstruct.solver.kinematic_tree import build_tree, new_state
from harness.reconstruct.solver.normal_equations import (
    MeasurementModel,
    Readings,
    StationTargets,
    evaluate,
    update_targets,
)
from harness.stream import TrackerFrame

_SCALE_VARIANCES = 8.0
"""Multiple of the variance of a predicted row that is added to 2 sL^2 [choice]."""


@dataclass(frozen=True)
class Loss:
    """The noise model of readings and the robust loss."""

    position_sigma_m: Annotated[float, Range(1e-06, 10.0)] = 0.003
    """Standard deviation of measured positions [m]."""
    orientation_sigma_rad: Annotated[float, Range(1e-06, 10.0)] = math.radians(0.5)
    """Standard deviation of measured orientations [rad]."""
    robust: bool = True
    """Lorentzian instead of squared residuals."""
    position_scale_m: Annotated[float, Range(1e-06, 10.0)] = 0.03
    """The Lorentzian's scale for positions [m]."""
    orientation_scale_rad: Annotated[float, Range(1e-06, 10.0)] = math.radians(8.0)
    """The Lorentzian's scale for orientations [rad]."""
    quality: bool = True
    """Weigh every reading by its station's quality, 0 to 1: a standard deviation of sigma / sqrt(quality)."""
    suspect_weight: Annotated[float, Range(0.0, 1.0)] = 0.1
    """Further factor on the precision of a suspect reading: 1 treats it like any other, 0 leaves it out."""


class Residuals:
    """Residuals of S stations on one body, for one session: `read` a frame, then `evaluate` configurations.

    Rows are the S positions, then the S orientations; a row that was not measured has no weight. All results are
    written into arrays made once, which the compiled loops share.
    """

    def __init__(self, body: Body, calibration: Calibration, loss: Loss) -> None:
        count = len(calibration.stations)
        self.kinematics = Kinematics(body)
        self.bones = [body.skeleton.index(bone) for bone in calibration.bones]
        self.mount_m, self.bone_from_station = calibration.mount_m, calibration.bone_from_station
        self.measured: Bools = np.zeros(2 * count, bool)
        """(2S,) which rows the last frame measured."""
        self.confidence: Floats = np.zeros(2 * count)
        """(2S,) weight of each row by quality and suspicion: 1 full; 0 where not measured."""
        self.variance: Floats = np.zeros(2 * count)
        """(2S,) variance of the rows that were predicted instead of measured [m^2; rad^2]; 0 of the others."""
        self.target_m: Floats = np.zeros((count, 3))
        """(S, 3) measured station positions in the world [m]; 0 where not measured."""
        self.world_from_target: Floats = np.tile(rotations.IDENTITY, (count, 1))
        """(S, 4) measured orientation of the bones that carry the stations; identity where not measured."""
        self.scale: Floats = np.repeat([loss.position_scale_m, loss.orientation_scale_rad], count)
        """(2S,) the Lorentzian's scale of each row [m; rad]."""
        self.tree = build_tree(body, self.bones, self.mount_m)
        self.targets = StationTargets(self.target_m, self.world_from_target, *np.zeros((2, 2 * count)))
        self.state = new_state(self.tree)
        self.error: Floats = self.state.error
        """(2S, 3) measured minus modelled [m; rad]; undefined in rows that were not measured."""
        self.station_m: Floats = self.state.station_m
        """(S, 3) modelled station positions in the world [m]."""

        self._qpos, self._identity = np.zeros(body.model.nq), np.tile(rotations.IDENTITY, (count, 1))
        self._twice_scale_squared = 2.0 * self.scale**2 if loss.robust else np.full(2 * count, np.inf)
        self._measurement = MeasurementModel(
            world_from_tracker=rotations.to_matrix(calibration.world_from_tracker),
            origin_m=np.array(calibration.tracker_origin_m),
            bone_from_reading=_left_multiplication(calibration.world_from_tracker)
            @ _right_multiplication(rotations.inverse(calibration.bone_from_station)),
            precision=np.repeat([loss.position_sigma_m**-2, loss.orientation_sigma_rad**-2], count),
            twice_scale_squared=self._twice_scale_squared.copy(),
            by_quality=loss.quality,
            suspect_weight=loss.suspect_weight,
        )
        zeros, never = np.zeros(count), np.zeros(count, bool)
        empty = TrackerFrame(0.0, zeros, np.zeros((count, 3)), np.zeros((count, 4)), never, never, zeros, never)
        self._update_targets = specialise(
            *(update_targets, self._measurement, self.targets, _readings_of(empty)), *(self.measured, self.confidence)
        )
        self._evaluate = specialise(evaluate, self.tree, self.targets, self.state, self._qpos)

    @property
    def distance(self) -> Floats:
        """(2S,) norms of `error` [m; rad]."""
        out: Floats = np.sqrt(self.state.squared)
        return out

    def read(self, frame: TrackerFrame) -> None:
        """Take the valid readings of a frame as targets; ShapeError when it has other stations than the calibration."""
        if len(frame.position_m) != len(self.bones):
            raise ShapeError(
                "TrackerFrame", "position_m", frame.position_m.shape, f"({len(self.bones)}, 3), as calibrated"
            )
        self.measured = np.empty(2 * len(self.bones), bool)
        self.variance[:] = 0.0
        self._update_targets(self._measurement, self.targets, _readings_of(frame), self.measured, self.confidence)

    def completed(self, qpos: Floats) -> tuple[Floats, Floats]:
        """Positions (S, 3) [m] and bone orientations (S, 4) of the frame; missing ones are those of a pose (55,)."""
        self.kinematics.set(qpos)
        at_m, turned = self.kinematics.station_poses(self.bones, self.mount_m, self._identity)
        has_position, has_orientation = self.measured.reshape(2, -1, 1)
        return np.where(has_position, self.target_m, at_m), np.where(has_orientation, self.world_from_target, turned)

    def set_sigma(self, position_m: float, orientation_rad: float) -> None:
        """Set the standard deviations of readings [m], [rad], from the next frame on."""
        count = len(self.bones)
        self._measurement.precision[:count], self._measurement.precision[count:] = position_m**-2, orientation_rad**-2

    def set_position_scale(self, scale_m: float) -> None:
        """Set the Lorentzian's scale of positions [m], from the next frame on. Plain squares become a Lorentzian."""
        self._measurement.twice_scale_squared[: len(self.bones)] = 2.0 * scale_m**2

    def leave_out(self, rows: Bools) -> None:
        """Treat these rows (2S,) of the frame as not measured."""
        self.measured = self.measured & ~rows
        self.confidence[rows] = self.targets.precision[rows] = 0.0

    def add_predictions(self, predicted: Bools, variance: Floats) -> None:
        """Treat predicted rows (2S,), whose targets have a variance (2S,), as measured with it."""
        self.measured = self.measured | predicted
        self.variance[:] = np.where(predicted, variance, 0.0)
        self.confidence[predicted] = 1.0
        self.targets.precision[predicted] = 1.0 / (1.0 / self._measurement.precision + self.variance)[predicted]
        self.targets.twice_scale_squared[:] += _SCALE_VARIANCES * self.variance

    def count_sure(self, sigma_m: float) -> int:
        """Number of stations with a measured reading, or a position predicted within a standard deviation [m]."""
        count = len(self.bones)
        fresh = self.fresh
        sure = self.measured[:count] & (self.variance[:count] < sigma_m**2)
        return int(np.count_nonzero(fresh[:count] | fresh[count:] | sure))

    @property
    def fresh(self) -> Bools:
        """(2S,) which rows the frame itself measured."""
        out: Bools = self.measured & (self.variance == 0.0)
        return out

    def widen(self, factor: float) -> None:
        """Multiply the loss's own scales by `factor` until the next frame is read, to solve from a distant start.

        A factor of 1 restores the scales that are set.
        """
        if factor == 1.0:
            self.targets.twice_scale_squared[:] = self._measurement.twice_scale_squared
        else:
            np.multiply(self._twice_scale_squared, factor * factor, out=self.targets.twice_scale_squared)
        self.targets.twice_scale_squared[:] += _SCALE_VARIANCES * self.variance

    def evaluate(self, qpos: Floats) -> float:
        """The data cost of a configuration (55,), a negative log likelihood; updates `error` and `distance`."""
        self._qpos[:] = qpos
        return self._evaluate(self.tree, self.targets, self.state, self._qpos)


def _readings_of(frame: TrackerFrame) -> Readings:
    """The fields of a frame that `update_targets` takes, in its order."""
    valid = frame.position_valid, frame.orientation_valid
    return frame.position_m, frame.tracker_from_station, *valid, frame.quality, frame.suspect


def _left_multiplication(q: Floats) -> Floats:
    """(..., 4, 4) matrix of p -> q p."""
    return np.stack([rotations.multiply(q, unit) for unit in np.eye(4)], axis=-1)


def _right_multiplication(q: Floats) -> Floats:
    """(..., 4, 4) matrix of p -> p q."""
    return np.stack([rotations.multiply(unit, q) for unit in np.eye(4)], axis=-1)
