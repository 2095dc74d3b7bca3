"""Ridge regression (`ridge`): linear maps from the readings to the heading and to the hinge angles.

A short method in numpy to copy and to change (docs/own_method.md). Every reading gives vectors: a position, and three
axes of the station's bone. A first map, in complex numbers, gives the performer's heading from the horizontal parts.
A second map gives the hinge angles from the vectors as seen from that heading, so neither place nor heading of the
performer matters. Each set of readings has maps of its own, so lost stations take no part. The root is fitted to the
readings afterwards.

Source: Hoerl and Kennard 1970 (ridge regression). The penalty is the variance that reading errors add to the inputs.

Options (fields of `Ridge`): `noise_m` 0.01 and `lever_m` 0.3, which were chosen before any result.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from harness.body import Body
from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Origin
from harness.core.motion import BodyMotion
from harness.core.ranges import Range
from harness.reconstruct.features.posture_statistics import mean_posture
from harness.reconstruct.features.virtual_trackers import VirtualTrackers
from harness.reconstruct.solver.ground_frame import ground_from_qpos
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.root_placement import place_root
from harness.reconstruct.solver.status_monitor import StatusMonitor
from harness.stream import TrackerFrame

_MOST_FRAMES = 5000
"""Largest number of example frames; of more, every n-th is kept."""


@dataclass(frozen=True)
class Ridge:
    """Options of ridge regression, a `Method`."""

    name: str = "ridge"
    summary: str = "ridge regression from readings to hinge angles: a short method to copy and to change"
    needs_examples: bool = True
    training_data = "examples"
    noise_m: Annotated[float, Range(1e-06, 10.0)] = 0.01
    """Error of a reading that the regression allows for, standard deviation [m]."""
    lever_m: Annotated[float, Range(1e-06, 100.0)] = 0.3
    """Length of a bone's axes: a rotation of one radian counts as this displacement [m]."""

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedRidge":
        """Choose the example frames; BadInput without examples."""
        mean_qpos = mean_posture(body, examples)
        qpos = np.concatenate([take.qpos for take in examples])
        return FittedRidge(self, body, mean_qpos, qpos[:: -(-len(qpos) // _MOST_FRAMES)])


@dataclass(frozen=True, eq=False)
class FittedRidge:
    """The chosen examples. The maps depend on the mounts and on the readings, so sessions learn them."""

    options: Ridge
    body: Body
    mean_qpos: Floats
    """(55,) T-pose root and mean hinge angles."""
    qpos: Floats
    """(N, 55) configurations of the examples."""

    def begin(self, calibration: Calibration) -> "RidgeSession":
        return RidgeSession(self, calibration)


class RidgeSession:
    """Applies the maps of the readings that a frame has."""

    def __init__(self, fitted: FittedRidge, calibration: Calibration) -> None:
        self._options, self._mean_qpos, self._estimate = fitted.options, fitted.mean_qpos, fitted.mean_qpos
        self._residuals, self._monitor = Residuals(fitted.body, calibration, Loss()), StatusMonitor()
        position_m, world_from_bone = VirtualTrackers(fitted.body, calibration).station_poses(fitted.qpos)
        along_x = rotations.about_z(-ground_from_qpos(fitted.qpos)[:, 2])[:, None]
        turned = rotations.rotate(along_x, position_m), rotations.multiply(along_x, world_from_bone)
        self._examples_m = self._vectors_m(*turned)
        self._angles = rotations.wrap_angle(fitted.qpos[:, 7:] - fitted.mean_qpos[7:])
        self._range = self._angles.min(axis=0), self._angles.max(axis=0)
        self._maps = dict[bytes, tuple[Any, Floats, Floats]]()

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_seen = self._monitor.update(frame)
        if any_seen:
            residuals = self._residuals
            residuals.read(frame)
            key = residuals.measured.tobytes()
            if key not in self._maps:
                self._maps[key] = self._learn(residuals.measured)
            heading, mean, weights = self._maps[key]
            vectors_m = self._vectors_m(residuals.target_m[None], residuals.world_from_target[None])
            qpos = self._mean_qpos.copy()
            inputs = inputs_of(*complex_parts(vectors_m, residuals.measured), heading) - mean
            qpos[7:] += np.clip(inputs[0] @ weights, *self._range)
            self._estimate = place_root(residuals, qpos)
        return Estimate(self._estimate, status, Origin.MODEL if any_seen else Origin.BRIDGED)

    def _vectors_m(self, position_m: Floats, world_from_bone: Floats) -> Floats:
        """(N, S, 4, 3) position of each station and three axes of its bone, of positions and orientations [m]."""
        axes = np.swapaxes(rotations.to_matrix(world_from_bone), 2, 3)
        return np.concatenate([position_m[:, :, None], self._options.lever_m * axes], axis=2)

    def _learn(self, measured: Bools) -> tuple[Any, Floats, Floats]:
        """The maps for these readings (2S,): weights (K,) of the heading, mean inputs (3K,), weights (3K, 48)."""
        across, height_m = complex_parts(self._examples_m, measured)
        heading = ridge_regression(across, np.ones(len(across)), self._options.noise_m)
        inputs = inputs_of(across, height_m, heading)
        mean = inputs.mean(axis=0)
        return heading, mean, ridge_regression(inputs - mean, self._angles, self._options.noise_m)


def complex_parts(vectors_m: Floats, measured: Bools) -> tuple[Any, Floats]:
    """(N, K) horizontal parts x + i y and heights of the measured vectors, places relative to their mean [m]."""
    places, turns = measured.reshape(2, -1)
    across, height_m = vectors_m[..., 0] + 1j * vectors_m[..., 1], vectors_m[..., 2]
    if places.any():
        across[..., 0] -= across[:, places, 0].mean(axis=1, keepdims=True)
    kept = np.stack([places, turns, turns, turns], axis=1)
    return across[:, kept], height_m[:, kept]


def inputs_of(across: Any, height_m: Floats, heading: Any) -> Floats:
    """(N, 3K) the vectors as seen from the heading that the weights `heading` (K,) give."""
    facing = across * np.exp(-1j * np.angle(across @ heading))[:, None]
    return np.concatenate([facing.real, facing.imag, height_m], axis=1)


def ridge_regression(x: Any, y: Floats, noise: float) -> Any:
    """Weights (K, ...) of least squares from x (N, K) to y (N, ...), for an error `noise` in each entry of x."""
    product = x.conj().T @ x
    return np.linalg.solve(product + len(x) * noise**2 * np.eye(len(product)), x.conj().T @ y)
