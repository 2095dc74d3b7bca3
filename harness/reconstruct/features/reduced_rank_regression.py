"""Reduced-rank regression of postures on history and readings; its leading directions are search features.

Predictors of a frame are the window of the last m estimates (Liu et al. 2011, eq. 6 and 8) and the readings of the
trackers (docs/notes/ideas.md G3). A ridge regression over the whole database maps them to the posture of the frame. The
leading directions of its predictions are the features z, in which neighbours are searched and on which local models
regress. So D_w of eq. 6 is learnt instead of the identity: what does not predict the posture does not count.

Readings are relative to the anchor frame: along the heading of the station on the trunk or, where its orientation is
not measured, along a heading that is estimated from the positions. (A heading taken from the last estimate would feed
its error back.) Missing readings are replaced by their regression on the other predictors. For a linear map this equals
training without them.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.linalg import solve

from harness.body import Body
from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints, Singles
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.core.ranges import Range
from harness.reconstruct.database.frames import Windows
from harness.reconstruct.features.virtual_trackers import VirtualTrackers
from harness.reconstruct.index.protocol import Index, Neighbours
from harness.reconstruct.index.selection import make_index
from harness.reconstruct.solver.ground_frame import (
    MIN_HEADING_EXPLAINED,
    POSTURE_SIZE,
    AnchorFrame,
    HeadingEstimator,
    anchor_of,
    features_from_readings,
    twist_rad,
)

_CHUNK = 256
"""Number of windows that are processed at a time."""
_ORIGIN: Floats = np.zeros(3)
"""Ground frame at the origin, heading along x."""
_CACHED_MAPS = 64
"""Largest number of combinations of missing readings whose maps are cached."""
_TRAINING_WINDOWS = 20_000
"""Largest number of windows in the training set; more are thinned evenly."""


@dataclass(frozen=True)
class ReducedRankOptions:
    """Options of the reduced-rank regression."""

    window_weight: Annotated[float, Range(0.0, 1e6)] = 0.3
    """Factor of the window's columns [rad, m] against readings in metres."""
    lever_m: Annotated[float, Range(1e-06, 100.0)] = 0.3
    """Displacement that counts as much as a rotation of one radian [m]."""
    directions: Annotated[int, Range(1, 10_000)] = 40
    """Number of features z."""
    ridge: Annotated[float, Range(0.0, 1e6)] = 1e-5
    """Ridge of the regression, as a share of the predictors' total variance."""


class ReducedRankRegression:
    """Linear regression of the posture of each frame of a database on its predictors, for given mounts.

    Predictors are the window before the frame (D), then each station's position (3) and two axes of its bone (6).
    """

    def __init__(
        self,
        body: Body,
        windows: Windows,
        calibration: Calibration,
        options: ReducedRankOptions,
        heading: HeadingEstimator | None = None,
    ) -> None:
        """Train on the windows; `heading` estimates the heading, None takes it from the anchor's orientation."""
        self.options, self.heading = options, heading
        self.count, self.anchor = len(calibration.stations), anchor_of(calibration.bones)
        self.windows, self._trackers = windows, VirtualTrackers(body, calibration)
        self.size = windows.size + 9 * self.count
        self._body, self._calibration, self._by_readings = body, calibration, dict[bytes, ReducedRankRegression]()
        self._searches: dict[bytes, ReducedRankSearch] = {}
        rows = self._training_rows()
        self.mean, self._mean_after = np.zeros(self.size), np.zeros(POSTURE_SIZE)
        for predictors, after in self.training_data(windows, rows):
            self.mean += predictors.sum(axis=0) / len(rows)
            self._mean_after += after.sum(axis=0) / len(rows)
        self.scatter: Floats = np.zeros((self.size, self.size))
        """(D + 9 S, D + 9 S) covariance of the predictors."""
        self._cross_covariance = np.zeros((self.size, POSTURE_SIZE))
        for predictors, after in self.training_data(windows, rows):
            centred = predictors - self.mean
            self.scatter += centred.T @ centred / len(rows)
            self._cross_covariance += centred.T @ (after - self._mean_after) / len(rows)
        windows.database.release_memory()
        self.ridge = options.ridge * float(np.trace(self.scatter)) + 1e-12

    def _training_rows(self) -> Ints:
        """Rows of the training windows: all, or an evenly spaced selection."""
        count = len(self.windows)
        if count <= _TRAINING_WINDOWS:
            return np.arange(count)
        return np.linspace(0, count - 1, _TRAINING_WINDOWS).astype(np.int64)

    def with_usual_heading(self, usual: Bools) -> "ReducedRankRegression":
        """The regression for sessions with these `usual` readings (2 S,) of positions, then orientations.

        If the anchor has positions but no orientations, its heading is estimated from the positions, if they suffice.
        """
        places = usual[: self.count]
        if usual[self.count + self.anchor] or not places[self.anchor]:
            return self
        mask = places.tobytes()
        if mask not in self._by_readings:
            at_m = [at_m for _, at_m, _ in self._station_poses(self.windows, self._training_rows())]
            heading = HeadingEstimator.fit(np.concatenate(at_m), self.anchor, places)
            usable = heading.explained > MIN_HEADING_EXPLAINED
            regression = (
                ReducedRankRegression(self._body, self.windows, self._calibration, self.options, heading)
                if usable
                else self
            )
            self._by_readings[mask] = regression
        return self._by_readings[mask]

    def search(self, usual: Bools, index: str, neighbours: int) -> "ReducedRankSearch":
        """The search for sessions that usually know these columns (D + 9 S,); cached."""
        mask = usual.tobytes()
        if mask not in self._searches:
            self._searches[mask] = ReducedRankSearch(self, usual, index, neighbours)
        return self._searches[mask]

    def training_data(self, windows: Windows, rows: Ints) -> Iterator[tuple[Floats, Floats]]:
        """Predictors (K, D + 9 S) of some windows and the postures (K, 52) that follow, chunk by chunk."""
        for some, at_m, orientation in self._station_poses(windows, rows):
            after = windows.successors(some)[:, :POSTURE_SIZE].astype(float)
            facing = twist_rad(orientation[:, self.anchor]) if self.heading is None else self.heading.heading_rad(at_m)
            to_anchor = rotations.about_z(-facing)[:, None]
            place = rotations.rotate(to_anchor, at_m - at_m[:, self.anchor, None] * [1.0, 1.0, 0.0])
            axes = self.options.lever_m * rotations.to_matrix(rotations.multiply(to_anchor, orientation))[..., :2]
            window = self.options.window_weight * windows.gather(some)
            read = np.concatenate([place, axes.reshape(*place.shape[:2], 6)], axis=2)
            yield np.concatenate([window, read.reshape(len(some), -1)], axis=1), after

    def _station_poses(self, windows: Windows, rows: Ints) -> Iterator[tuple[Ints, Floats, Floats]]:
        """Rows (K,), station positions (K, S, 3) and orientations (K, S, 4), roots heading along x, chunk by chunk."""
        for start in range(0, len(rows), _CHUNK):
            some = rows[start : start + _CHUNK]
            yield some, *self._trackers.station_poses(windows.database.qpos(windows.frames[some] + 1, _ORIGIN))

    def predictors(self, window: Singles, position_m: Floats, orientation: Floats, view: AnchorFrame) -> Floats:
        """Predictors (D + 9 S,) of a window (D,) and of readings (S, 3), (S, 4) in the world, in an anchor frame."""
        return _join_predictors(
            window, self.options.window_weight, position_m, orientation, np.array(view), self.options.lever_m
        )

    def columns(self, measured: Bools, history: bool = True) -> Bools:
        """(D + 9 S,) columns that are known when these readings (2 S,) of positions, then orientations, are.

        `history` is whether the window is known.
        """
        window = np.full(self.windows.size, history)
        places, turns = measured[: self.count], measured[self.count :]
        return np.concatenate([window, np.repeat(np.stack([places, turns], axis=1), [3, 6], axis=1).reshape(-1)])

    def directions(self, columns: Bools) -> Floats:
        """(C, 40) map from C known columns to the leading directions of the predicted posture."""
        scatter = self.scatter[np.ix_(columns, columns)]
        damped = scatter + self.ridge * np.eye(len(scatter))
        to_posture = solve(damped, self._cross_covariance[columns], assume_a="pos")
        _, vector = np.linalg.eigh(to_posture.T @ scatter @ to_posture)
        out: Floats = to_posture @ vector[:, ::-1][:, : self.options.directions]
        return out

    def imputation_map(self, columns: Bools, targets: Bools) -> Floats:
        """(C, W) map from C known columns to W target columns: the column itself, or its regression."""
        damped = self.scatter[np.ix_(columns, columns)] + self.ridge * np.eye(int(columns.sum()))
        out: Floats = solve(damped, self.scatter[np.ix_(columns, targets)], assume_a="pos")
        out[:, columns[targets]] = np.eye(len(out))[:, targets[columns]]
        return out


@dataclass(frozen=True, eq=False)
class ReducedRankVectors:
    """Search `Vectors`: features z of windows, computed on demand."""

    regression: ReducedRankRegression
    windows: Windows
    usual: Bools
    """(D + 9 S,) predictors that are usually known."""
    directions: Floats
    """(C, 40) map from them to z."""

    def __len__(self) -> int:
        return len(self.windows)

    @property
    def size(self) -> int:
        return int(self.directions.shape[1])

    @property
    def consecutive(self) -> Bools:
        return self.windows.consecutive

    def gather(self, rows: Ints | slice) -> Singles:
        selected, start = np.arange(len(self))[rows], 0
        out: Singles = np.empty((len(selected), self.size), np.float32)
        for predictors, _ in self.regression.training_data(self.windows, selected):
            out[start : start + len(predictors)] = (predictors - self.regression.mean)[:, self.usual] @ self.directions
            start += len(predictors)
        self.windows.database.release_memory()
        return out


class ReducedRankSearch:
    """Search among N windows in the features z."""

    def __init__(self, regression: ReducedRankRegression, usual: Bools, index: str, neighbours: int) -> None:
        """Index the windows, for sessions that usually know these columns (D + 9 S,)."""
        self.vectors = ReducedRankVectors(regression, regression.windows, usual, regression.directions(usual))
        self.index: Index = make_index(index, self.vectors, neighbours)
        self._maps: dict[bytes, tuple[Floats, Floats]] = {}

    def nearest(
        self, predictors: Floats, measured: Bools, count: int, lookup: Index | None = None, history: bool = True
    ) -> Neighbours:
        """Windows whose z is nearest to that of predictors (D + 9 S,), of which `measured` readings (2 S,) are known.

        `history` is whether the window is known, too.

        `lookup` is the session's search in `index`; without it the search has no state.

        The offsets are those of z, possibly along other orthonormal axes.
        """
        mask = measured.tobytes() + bytes([history])
        entry = self._maps.get(mask)
        if entry is None:
            if len(self._maps) >= _CACHED_MAPS:
                self._maps.clear()
            entry = self._maps[mask] = self._map(self.vectors.regression.columns(measured, history))
        to_z, mean = entry
        return (lookup or self.index).nearest_with_offsets((predictors @ to_z - mean).astype(np.float32), count)

    def _map(self, columns: Bools) -> tuple[Floats, Floats]:
        """(D + 9 S, 40) map from predictors to z that uses the known columns only, and (40,) the mean's image."""
        vectors, regression = self.vectors, self.vectors.regression
        to_z = np.zeros((regression.size, vectors.size))
        to_z[columns] = regression.imputation_map(columns, vectors.usual) @ vectors.directions
        return to_z, regression.mean @ to_z


@compiled
def _join_predictors(
    window: Singles, window_weight: float, position_m: Floats, orientation: Floats, ground: Floats, lever_m: float
) -> Floats:
    """(D + 9 S,) a weighted window (D,), and the features of readings (S, 3), (S, 4) relative to a ground frame."""
    read = features_from_readings(position_m, orientation, ground, lever_m)
    out = np.empty(len(window) + len(read))
    for i in range(len(window)):
        out[i] = np.float32(window_weight * window[i])
    for i in range(len(read)):
        out[len(window) + i] = read[i]
    return out
