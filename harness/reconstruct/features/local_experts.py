"""Local experts: Gaussians of the posture, given features of the readings and the history, from tabulated moments.

Two experts judge a frame. The first knows features z of the readings and the last poses: the leading directions of a
reduced-rank regression of the posture. The second knows features u of the last poses alone: their leading principal
axes. The tables of an expert are made once for the mounts of a calibration (`moment_table`).

Features of a frame carry errors: last poses are estimates, readings are noisy, and missing readings are imputed. The
covariance of these errors enters the regression of the first expert (`moment_table.condition`). That of the second has
a ridge instead, which was better on validation clips (docs/notes/tuning.md).
"""

from typing import NamedTuple

import numpy as np

from harness.core.arrays import Bools, Floats, Ints, Singles
from harness.reconstruct.database.frames import Windows
from harness.reconstruct.features.moment_table import MomentTable, tabulate_moments
from harness.reconstruct.features.reduced_rank_regression import ReducedRankRegression
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE

HISTORY_AXES = 20
"""Number of principal axes of the history."""
_CACHED_MAPS = 64
"""Largest number of combinations of missing readings whose maps are cached."""
_CHUNK = 2048
"""Number of windows that are processed at a time."""
_POSE_ERROR_RAD = float(np.deg2rad(2.0))
"""Standard deviation of the error of an estimated pose, equal for the poses of a window [rad; m for the height]."""


class FeatureMap(NamedTuple):
    """Map from predictors (P,), of which some are known, to features, and the covariance of the features' errors."""

    matrix: Floats
    """(P, F) map; rows of unknown predictors are 0."""
    origin: Floats
    """(F,) image of the predictors' mean."""
    fixed: Floats
    """(F, F) covariance of the errors by the window's poses and by imputation."""
    position: Floats
    """(F, F) covariance of the errors for positions with a standard deviation of 1 m."""
    orientation: Floats
    """(F, F) covariance of the errors for orientations with a standard deviation of 1 rad."""
    readings: Floats
    """(2S, F, F) covariance of the errors for each row of the readings with a standard deviation of 1 m or 1 rad."""

    def error_covariance(self, position_m: float, orientation_rad: float, variance: Floats) -> Floats:
        """(F, F) covariance of the features' errors, for readings with these standard deviations [m], [rad].

        `variance` (2S,) is that of predicted rows [m^2; rad^2].
        """
        out: Floats = self.fixed + position_m**2 * self.position + orientation_rad**2 * self.orientation
        for row in np.flatnonzero(variance):
            out += variance[row] * self.readings[row]
        return out


class LocalExperts:
    """Moment tables of both experts, for the mounts of a calibration."""

    def __init__(self, regression: ReducedRankRegression) -> None:
        self.regression = regression
        windows = regression.windows
        self._known, self._maps = np.ones(regression.size, bool), dict[bytes, FeatureMap]()
        self._directions = regression.directions(self._known)
        length = windows.size
        self.history_axes: Floats = np.linalg.eigh(regression.scatter[:length, :length])[1][:, ::-1][:, :HISTORY_AXES]
        """(D, H) principal axes of the windows."""
        self.history_axes = np.ascontiguousarray(self.history_axes)
        self.history_origin: Floats = regression.mean[:length] @ self.history_axes
        """(H,) image of their mean."""
        postures = _Postures(windows)
        self.table: MomentTable = tabulate_moments(self._reading_features(), postures)
        """Moments of z and the posture."""
        self.history_table: MomentTable = tabulate_moments(self._history_features(), postures)
        """Moments of u and the posture."""
        windows.database.release_memory()

    def _reading_features(self) -> Singles:
        """(W, F) features z of all windows."""
        regression, windows = self.regression, self.regression.windows
        out, done = np.empty((len(windows), self._directions.shape[1]), np.float32), 0
        for predictors, _ in regression.training_data(windows, np.arange(len(windows))):
            out[done : done + len(predictors)] = (predictors - regression.mean) @ self._directions
            done += len(predictors)
        windows.database.release_memory()
        return out

    def _history_features(self) -> Singles:
        """(W, H) features u of all windows."""
        windows, weight = self.regression.windows, self.regression.options.window_weight
        out = np.empty((len(windows), self.history_axes.shape[1]), np.float32)
        for start in range(0, len(windows), _CHUNK):
            some = slice(start, start + _CHUNK)
            out[some] = (weight * windows.gather(some)) @ self.history_axes - self.history_origin
        windows.database.release_memory()
        return out

    def feature_map(self, measured: Bools, history: bool) -> FeatureMap:
        """The map to z from the readings that are `measured` (2 S,), and from the window if there is a `history`."""
        mask = np.append(measured, history).tobytes()
        out = self._maps.get(mask)
        if out is None:
            if len(self._maps) >= _CACHED_MAPS:
                self._maps.clear()
            known = self.regression.columns(measured, history)
            out = self._maps[mask] = self._map(self._directions) if known.all() else self._imputed_map(known)
        return out

    def _imputed_map(self, known: Bools) -> FeatureMap:
        """The map from the known predictors (P,): others are replaced by their regression."""
        regression = self.regression
        imputation = regression.imputation_map(known, self._known)
        matrix = np.zeros_like(self._directions)
        matrix[known] = imputation @ self._directions
        out = self._map(matrix)
        unknown = ~known
        cross = regression.scatter[np.ix_(known, unknown)]
        rest = regression.scatter[np.ix_(unknown, unknown)] - cross.T @ imputation[:, unknown]
        along = self._directions[unknown]
        return out._replace(fixed=out.fixed + along.T @ rest @ along)

    def _map(self, matrix: Floats) -> FeatureMap:
        regression, window = self.regression, self.regression.windows
        poses = window.length
        posture = np.zeros((POSTURE_SIZE, matrix.shape[1]))
        for age in range(poses):
            start = (POSTURE_SIZE + 3) * age
            posture += regression.options.window_weight * matrix[start : start + POSTURE_SIZE]
        readings = matrix[window.size :].reshape(regression.count, 9, -1)
        places, axes = (np.einsum("sif,sig->sfg", rows, rows) for rows in (readings[:, :3], readings[:, 3:]))
        lever = regression.options.lever_m
        return FeatureMap(
            np.ascontiguousarray(matrix),
            regression.mean @ matrix,
            _POSE_ERROR_RAD**2 * posture.T @ posture,
            places.sum(axis=0),
            lever**2 * axes.sum(axis=0),
            np.concatenate([places, lever**2 * axes]),
        )


class _Postures:
    """Postures after each of W windows, read when they are used (`moment_table.Targets`)."""

    def __init__(self, windows: Windows) -> None:
        self._windows, self._read = windows, 0

    def __getitem__(self, rows: Ints, /) -> Singles:
        out = self._windows.successors(rows)[:, :POSTURE_SIZE]
        self._read += len(rows)
        if self._read >= _CHUNK:
            self._windows.database.release_memory()
            self._read = 0
        return out
