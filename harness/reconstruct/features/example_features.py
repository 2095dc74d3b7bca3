"""Features of unique_rows frame of a database for given mounts, and the search for the frames nearest to a query.

Features are those of Kim et al. 2012, eq. 2: position, velocity and orientation of each station, times the square roots
of their weights, so that squared Euclidean distances are those of eq. 2. They are relative to an anchor frame
(`solver.ground_frame`). Columns: 3 S positions, 4 S orientations, 3 S velocities.
"""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.body import Body
from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints, Singles
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.core.ranges import Range
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.virtual_trackers import VirtualTrackers
from harness.reconstruct.index.exact import nearest_exact, nearest_partial
from harness.reconstruct.index.protocol import Lookup
from harness.reconstruct.index.selection import AUTO_INDEX, KD_TREE_MAX_NEIGHBOURS, make_index
from harness.reconstruct.solver.ground_frame import AnchorFrame, anchor_of, relative_ground, twist_rad

Codes = NDArray[np.int16]
_POSITION_STEP_M, _QUATERNION_STEP, _VELOCITY_STEP_M_S, _MAX_CODE = 2e-4, 1.0 / 32_000, 1e-3, 32_767
"""Quantisation steps and largest code of stored features: finer than trackers; up to 6.5 m and 32 m/s."""
_CHUNK = 512
"""Number of frames whose kinematics are computed at a time; they take fifty times the memory of their features."""


@dataclass(frozen=True)
class FeatureWeights:
    """Weights of eq. 2 of Kim et al. 2012."""

    position: Annotated[float, Range(0.0, 1e6)] = 0.6
    """Weight of positions [1/m^2]."""
    velocity: Annotated[float, Range(0.0, 1e6)] = 0.2
    """Weight of velocities [s^2/m^2]."""
    orientation: Annotated[float, Range(0.0, 1e6)] = 0.2
    """Weight of unit quaternions."""


class Query(NamedTuple):
    """The features of a frame's readings."""

    view: AnchorFrame
    """The anchor frame to which they are relative."""
    features: Floats
    """(10 S,) features; values that were not measured are filled in."""
    confidence: Floats
    """(10 S,) confidence in each, from 0 (not measured) to 1."""
    filled: bool
    """Whether an estimate supplied all missing values. If not, they must not propose neighbours."""


class ExampleFeatures:
    """Features of N example frames for the S stations of a calibration."""

    def __init__(
        self,
        body: Body,
        database: MotionDatabase,
        calibration: Calibration,
        weights: FeatureWeights,
        index: str,
        neighbours: int,
    ) -> None:
        """Compute the features and build the index, for queries of `neighbours` neighbours."""
        self.count, self.anchor = len(calibration.stations), anchor_of(calibration.bones)
        self.scale: Floats = np.sqrt(
            np.repeat([weights.position, weights.orientation, weights.velocity], np.multiply([3, 4, 3], self.count))
        )
        """(10 S,) square roots of the columns' weights."""
        units = np.repeat([_POSITION_STEP_M, _QUATERNION_STEP, _VELOCITY_STEP_M_S], np.multiply([3, 4, 3], self.count))
        self._units: Singles = units.astype(np.float32)
        self._step: Singles = (units * self.scale).astype(np.float32)
        self._codes: Codes = np.empty((len(database), 10 * self.count), np.int16)
        """(N, 10 S) features in quantisation steps."""
        self.root: Singles = np.empty((len(database), 3), np.float32)
        """(N, 3) the root's ground frame relative to the anchor frame: forward, left [m], rotation [rad]."""
        self.hemisphere: Floats = np.zeros((self.count, 4))
        """(S, 4) first frame's orientations; the sign of unique_rows quaternion is the one nearer to it."""
        self._database, self._trackers = database, VirtualTrackers(body, calibration)
        self._posture: Singles = np.asarray(database.posture)
        for run in database.segments:
            for start in range(run.start, run.stop, _CHUNK):
                self._fill(max(start - 1, run.start), start, min(start + _CHUNK, run.stop))
        database.release_memory()
        self.index = make_index(_default_index(len(database)) if index == AUTO_INDEX else index, self, neighbours)

    def nearest(self, query: Query, count: int, lookup: Lookup) -> Ints:
        """Rows of the `count` frames nearest to a query, with its confidences as weights.

        `lookup` is the session's search in `index`.
        """
        features, weight = query.features.astype(np.float32), query.confidence.astype(np.float32)
        if weight.min() == 1.0:
            return lookup.nearest(features, count)[0]
        if not query.filled:
            return nearest_exact(self, features, weight, count)[0]
        return nearest_partial(lookup, self, features, weight, count)[0]

    @property
    def consecutive(self) -> Bools:
        """(N,) whether the next frame is of the same take."""
        out = np.ones(len(self), bool)
        out[[segment.stop - 1 for segment in self._database.segments]] = False
        return out

    def __len__(self) -> int:
        return len(self._codes)

    @property
    def size(self) -> int:
        """Number of columns, 10 S."""
        return 10 * self.count

    def gather(self, rows: Ints | slice) -> Singles:
        """(K, 10 S) features of some rows."""
        out: Singles = self._codes[rows] * self._step
        return out

    def regression_data(
        self, rows: Ints, more_rows: Ints, query: Floats, confidence: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Training pairs of two sets of rows without duplicates: inputs (m, n), the query (n,), outputs (m, 55).

        Inputs are positions and orientations, n = 7 S. Outputs are the posture (52) and the root's ground frame
        relative to the anchor frame (3).
        """
        weight = np.sqrt(confidence[: 7 * self.count])
        return _regression_data(self._codes, self._step, self._posture, self.root, rows, more_rows, query, weight)

    def _fill(self, first: int, start: int, stop: int) -> None:
        """Compute the features of rows from start to stop; `first` is the frame before, or start in a new take."""
        count, rows = self.count, slice(first, stop)
        is_first = first == start
        at_m, turned = self._trackers.station_poses(self._database.qpos(rows, np.zeros(3)))
        # stations of the frame before, relative to the ground frame of this one
        to_last = relative_ground(self._database.step[rows].astype(float)[1:], np.zeros(3))[:, None]
        before = rotations.rotate(rotations.about_z(to_last[..., 2]), at_m[:-1])
        before[..., :2] += to_last[..., :2]
        velocity = np.diff(at_m, axis=0, prepend=at_m[:1])
        velocity[1:] = (at_m[1:] - before) * self._database.rate_hz
        if is_first and len(velocity) > 1:
            velocity[0] = velocity[1]
        new_rows = slice(start - first, stop - first)
        at_m, turned, velocity = at_m[new_rows], turned[new_rows], velocity[new_rows]
        anchor = np.concatenate([at_m[:, self.anchor, :2], twist_rad(turned[:, self.anchor])[:, None]], axis=1)
        level, flat = rotations.about_z(-anchor[:, None, 2]), anchor[:, None] * [1.0, 1.0, 0.0]
        out = np.empty((stop - start, 10 * count))
        out[:, : 3 * count] = rotations.rotate(level, at_m - flat).reshape(len(out), -1)
        orientation = rotations.multiply(level, turned)
        if start == 0:
            self.hemisphere = orientation[0]
        orientation *= np.copysign(1.0, np.vecdot(orientation, self.hemisphere))[..., None]
        out[:, 3 * count : 7 * count] = orientation.reshape(len(out), -1)
        out[:, 7 * count :] = rotations.rotate(level, velocity).reshape(len(out), -1)
        self._codes[start:stop] = np.clip(np.rint(out / self._units), -_MAX_CODE, _MAX_CODE)
        self.root[start:stop] = relative_ground(anchor, np.zeros(3))


def _default_index(count: int) -> str:
    """Name of the default index: not the paper's kd-tree, which visits most vectors in 10 S dimensions."""
    return "flat" if count <= KD_TREE_MAX_NEIGHBOURS else "inverted_file"


@compiled
def _regression_data(
    codes: Codes,
    step: Singles,
    posture: Singles,
    root: Singles,
    rows: Ints,
    more_rows: Ints,
    query: Floats,
    weight: Floats,
) -> tuple[Floats, Floats, Floats]:
    """`ExampleFeatures.regression_data`, with the first n columns of the inputs multiplied by weights (n,)."""
    unique_rows = np.empty(len(rows) + len(more_rows), np.int64)
    count = 0
    for row in rows:
        unique_rows[count] = row
        count += 1
    for row in more_rows:
        if not (rows == row).any():
            unique_rows[count] = row
            count += 1
    size, width = len(weight), posture.shape[1]
    inputs, outputs = np.empty((count, size)), np.empty((count, width + root.shape[1]))
    for i in range(count):
        for k in range(size):
            inputs[i, k] = codes[unique_rows[i], k] * step[k] * weight[k]
        for k in range(width):
            outputs[i, k] = posture[unique_rows[i], k]
        for k in range(root.shape[1]):
            outputs[i, width + k] = root[unique_rows[i], k]
    return inputs, query[:size] * weight, outputs
