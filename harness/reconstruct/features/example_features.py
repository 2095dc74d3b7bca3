"""What trackers would have read in every frame of a database, and the frames in which they read most like now.

Features are those of Kim et al. 2012, eq. 2: position, velocity and orientation of each station, times the square roots
of their weights, so that squared Euclidean distances are eq. 2's. They are seen from an anchor (`viewpoint`).
Columns: 3 S positions, 4 S orientations, 3 S velocities.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Floats, Ints, Singles
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.reconstruct.database import MotionDatabase
from harness.reconstruct.features.anchor_frame import anchor_of, twist_rad
from harness.reconstruct.features.virtual_trackers import VirtualTrackers
from harness.reconstruct.index import make_index
from harness.reconstruct.index.partial_search import nearest_partial
from harness.reconstruct.index.selection import AUTO, KD_TREE_MAX_NEIGHBOURS
from harness.reconstruct.solver.ground_frame import relative_ground

Codes = NDArray[np.int16]
_POSITION_STEP_M, _QUATERNION_STEP, _VELOCITY_STEP_M_S, _MAX_CODE = 2e-4, 1.0 / 32_000, 1e-3, 32_767
"""Features are kept as whole steps of so much, which is finer than trackers are: up to 6.5 m and 32 m/s."""
_CHUNK = 512
"""Frames whose kinematics are worked out at a time: double precision and rotations take fifty times their features."""


@dataclass(frozen=True)
class FeatureWeights:
    """Of eq. 2, for metres, metres per second and unit quaternions."""

    position: float = 0.6
    velocity: float = 0.2
    orientation: float = 0.2


class ExampleFeatures:
    """N frames of examples with S stations worn as a calibration says."""

    def __init__(
        self, body: Body, database: MotionDatabase, worn: Calibration, weights: FeatureWeights, index: str, wanted: int
    ) -> None:
        """For queries of so many `wanted` neighbours."""
        self.count, self.anchor = len(worn.stations), anchor_of(worn.bones)
        self.scale: Floats = np.sqrt(
            np.repeat([weights.position, weights.orientation, weights.velocity], np.multiply([3, 4, 3], self.count))
        )
        """(10 S,)"""
        units = np.repeat([_POSITION_STEP_M, _QUATERNION_STEP, _VELOCITY_STEP_M_S], np.multiply([3, 4, 3], self.count))
        self._units: Singles = units.astype(np.float32)
        self._step: Singles = (units * self.scale).astype(np.float32)
        self._codes: Codes = np.empty((len(database), 10 * self.count), np.int16)
        """(N, 10 S) features in steps."""
        self.root: Singles = np.empty((len(database), 3), np.float32)
        """(N, 3) the root's ground frame as seen from the anchor: forward, left [m], turn [rad]."""
        self.hemisphere: Floats = np.zeros((self.count, 4))
        """(S, 4) quaternions are taken with the sign that is nearer to it: to the first frame's."""
        self._database, self._trackers = database, VirtualTrackers(body, worn)
        self._posture: Singles = np.asarray(database.posture)
        for run in database.segments:
            for start in range(run.start, run.stop, _CHUNK):
                self._fill(max(start - 1, run.start), start, min(start + _CHUNK, run.stop))
        database.release_memory()
        self._index = make_index(_default_index(len(database)) if index == AUTO else index, self, wanted)

    def nearest(self, query: Floats, trust: Floats, count: int) -> Ints:
        """Rows of the frames nearest to a query (10 S,) whose columns count as much as `trust` (10 S,), 0 to 1."""
        asked = query.astype(np.float32)
        if trust.min() == 1.0:
            return self._index.nearest(asked, count)[0]
        return nearest_partial(self._index, self, asked, trust.astype(np.float32), count)[0]

    def __len__(self) -> int:
        return len(self._codes)

    @property
    def size(self) -> int:
        """Columns, 10 S."""
        return 10 * self.count

    def gather(self, rows: Ints | slice) -> Singles:
        """(K, 10 S) of some rows."""
        out: Singles = self._codes[rows] * self._step
        return out

    def regression_data(self, rows: Ints, others: Ints, query: Floats, trust: Floats) -> tuple[Floats, Floats, Floats]:
        """What is learnt of some rows and others, none of them twice: inputs (m, n), the query (n,), outputs (m, 55).

        Inputs are positions and orientations, n <= 7 S; outputs are posture (52), and the root's ground frame seen from
        the anchor (3).
        """
        weight = np.sqrt(trust[: 7 * self.count])
        return _regression_data(self._codes, self._step, self._posture, self.root, rows, others, query, weight)

    def _fill(self, first: int, start: int, stop: int) -> None:
        """Rows from start to stop; `first` is the frame before, or start where a run begins."""
        count, rows = self.count, slice(first, stop)
        begins = first == start
        at_m, turned = self._trackers.station_poses(self._database.qpos(rows, np.zeros(3)))
        # where the stations were a frame before, seen from the ground frame of this one
        back = relative_ground(self._database.step[rows].astype(float)[1:], np.zeros(3))[:, None]
        before = rotations.rotate(rotations.about_z(back[..., 2]), at_m[:-1])
        before[..., :2] += back[..., :2]
        velocity = np.diff(at_m, axis=0, prepend=at_m[:1])
        velocity[1:] = (at_m[1:] - before) * self._database.rate_hz
        if begins and len(velocity) > 1:
            velocity[0] = velocity[1]
        kept = slice(start - first, stop - first)
        at_m, turned, velocity = at_m[kept], turned[kept], velocity[kept]
        anchor = np.concatenate([at_m[:, self.anchor, :2], twist_rad(turned[:, self.anchor])[:, None]], axis=1)
        level, flat = rotations.about_z(-anchor[:, None, 2]), anchor[:, None] * [1.0, 1.0, 0.0]
        out = np.empty((stop - start, 10 * count))
        out[:, : 3 * count] = rotations.rotate(level, at_m - flat).reshape(len(out), -1)
        seen = rotations.multiply(level, turned)
        if start == 0:
            self.hemisphere = seen[0]
        seen *= np.copysign(1.0, np.vecdot(seen, self.hemisphere))[..., None]
        out[:, 3 * count : 7 * count] = seen.reshape(len(out), -1)
        out[:, 7 * count :] = rotations.rotate(level, velocity).reshape(len(out), -1)
        self._codes[start:stop] = np.clip(np.rint(out / self._units), -_MAX_CODE, _MAX_CODE)
        self.root[start:stop] = relative_ground(anchor, np.zeros(3))


def _default_index(count: int) -> str:
    """Never the kd-tree of the paper, which in 10 S dimensions looks at most vectors when none is near."""
    return "flat" if count <= KD_TREE_MAX_NEIGHBOURS else "inverted_file"


@compiled
def _regression_data(
    codes: Codes,
    step: Singles,
    posture: Singles,
    root: Singles,
    rows: Ints,
    others: Ints,
    query: Floats,
    weight: Floats,
) -> tuple[Floats, Floats, Floats]:
    """`ExampleFeatures.pairs`, with the first n columns of inputs times a weight (n,)."""
    every = np.empty(len(rows) + len(others), np.int64)
    count = 0
    for row in rows:
        every[count] = row
        count += 1
    for row in others:
        if not (rows == row).any():
            every[count] = row
            count += 1
    size, width = len(weight), posture.shape[1]
    inputs, outputs = np.empty((count, size)), np.empty((count, width + root.shape[1]))
    for i in range(count):
        for k in range(size):
            inputs[i, k] = codes[every[i], k] * step[k] * weight[k]
        for k in range(width):
            outputs[i, k] = posture[every[i], k]
        for k in range(root.shape[1]):
            outputs[i, width + k] = root[every[i], k]
    return inputs, query[:size] * weight, outputs
