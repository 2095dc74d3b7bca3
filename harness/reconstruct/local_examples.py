"""What trackers would have read in every frame of a database, and the frames in which they read most like now.

Features are those of Kim et al. 2012, eq. 2: position, velocity and orientation of each station, times the square roots
of their weights, so that squared Euclidean distances are eq. 2's. They are seen from an anchor (`viewpoint`).
Columns: 3 S positions, 4 S orientations, 3 S velocities.
"""

from dataclasses import dataclass

import numpy as np

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Floats, Ints, Singles
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.reconstruct.database import MotionDatabase
from harness.reconstruct.database.ground import seen_from
from harness.reconstruct.examples import Worn
from harness.reconstruct.index import choose
from harness.reconstruct.index.choose import AUTO, FEW
from harness.reconstruct.index.masked import nearest_known
from harness.reconstruct.viewpoint import View, anchor_of, twist_rad

_CHUNK = 512
"""Frames whose kinematics are worked out at a time: double precision and rotations take fifty times their features."""


@dataclass(frozen=True)
class Weights:
    """Of eq. 2, for metres, metres per second and unit quaternions."""

    position: float = 0.6
    velocity: float = 0.2
    orientation: float = 0.2


class LocalExamples:
    """N frames of examples with S stations worn as a calibration says."""

    def __init__(self, body: Body, database: MotionDatabase, worn: Calibration, weights: Weights, index: str) -> None:
        self.count, self.anchor = len(worn.stations), anchor_of(worn.bones)
        self.scale: Floats = np.sqrt(
            np.repeat([weights.position, weights.orientation, weights.velocity], np.multiply([3, 4, 3], self.count))
        )
        """(10 S,)"""
        self.features: Singles = np.empty((len(database), 10 * self.count), np.float32)
        self.root: Singles = np.empty((len(database), 3), np.float32)
        """(N, 3) the root's ground frame as seen from the anchor: forward, left [m], turn [rad]."""
        self._database, self._trackers = database, Worn(body, worn)
        self._posture: Singles = np.asarray(database.posture)
        for run in database.runs:
            for start in range(run.start, run.stop, _CHUNK):
                self._fill(max(start - 1, run.start), start, min(start + _CHUNK, run.stop))
        first = self._quaternions(slice(0, 1))
        self._hemisphere: Floats = first[0].astype(float)
        """(S, 4) quaternions are taken with the sign that is nearer to it."""
        for start in range(0, len(database), _CHUNK):
            near = self._quaternions(slice(start, start + _CHUNK))
            near *= np.copysign(1.0, np.vecdot(near, first))[..., None]
        database.let_go()
        self._index = choose(_quickest(len(database)) if index == AUTO else index, self)

    def query(self, position_m: Floats, turned: Floats, velocity_m_s: Floats, view: View) -> Floats:
        """The features (10 S,) of positions (S, 3), bone orientations (S, 4) and velocities (S, 3) in the world."""
        return _features(position_m, turned, velocity_m_s, view, self._hemisphere, self.scale)

    def nearest(self, query: Floats, trust: Floats, count: int) -> Ints:
        """Rows of the frames nearest to a query (10 S,) whose columns count as much as `trust` (10 S,), 0 to 1."""
        asked = query.astype(np.float32)
        if trust.min() == 1.0:
            return self._index.nearest(asked, count)[0]
        return nearest_known(self._index, self, asked, trust.astype(np.float32), count)[0]

    def __len__(self) -> int:
        return len(self.features)

    @property
    def size(self) -> int:
        """Columns, 10 S."""
        return 10 * self.count

    def gather(self, rows: Ints | slice) -> Singles:
        """(K, 10 S) of some rows."""
        return self.features[rows]

    def inputs(self, rows: Ints, query: Floats, trust: Floats) -> tuple[Floats, Floats]:
        """What is learnt from: positions and orientations of some rows (m, n) and of the query (n,), n <= 7 S."""
        count = 7 * self.count
        return _trusted(self.features, rows, query[:count], trust[:count])

    def poses(self, rows: Ints) -> Floats:
        """(K, 55) what is learnt: posture (52), and the root's ground frame seen from the anchor (3)."""
        return _side_by_side(self._posture, self.root, rows)

    def _quaternions(self, rows: slice) -> Singles:
        return self.features[rows, 3 * self.count : 7 * self.count].reshape(-1, self.count, 4)

    def _fill(self, first: int, start: int, stop: int) -> None:
        """Rows from start to stop; `first` is the frame before, or start where a run begins."""
        count, rows = self.count, slice(first, stop)
        begins = first == start
        at_m, turned = self._trackers.at(self._database.qpos(rows, np.zeros(3)))
        # where the stations were a frame before, seen from the ground frame of this one
        back = seen_from(self._database.step[rows].astype(float)[1:], np.zeros(3))[:, None]
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
        out = self.features[start:stop]
        out[:, : 3 * count] = rotations.rotate(level, at_m - flat).reshape(len(out), -1)
        out[:, 3 * count : 7 * count] = rotations.multiply(level, turned).reshape(len(out), -1)
        out[:, 7 * count :] = rotations.rotate(level, velocity).reshape(len(out), -1)
        out *= self.scale
        self.root[start:stop] = seen_from(anchor, np.zeros(3))


def _quickest(count: int) -> str:
    """Never the kd-tree of the paper, which in 10 S dimensions looks at most vectors when none is near."""
    return "flat" if count <= FEW else "inverted_file"


@compiled
def _features(
    position_m: Floats, turned: Floats, velocity_m_s: Floats, view: View, hemisphere: Floats, scale: Floats
) -> Floats:
    """`LocalExamples.query`."""
    count = len(position_m)
    out = np.empty(10 * count)
    cosine, sine = np.cos(view.yaw_rad), np.sin(view.yaw_rad)
    c, s = np.cos(0.5 * view.yaw_rad), np.sin(0.5 * view.yaw_rad)
    for k in range(count):
        at, turn, gone = out[3 * k : 3 * k + 3], out[3 * count + 4 * k :], out[7 * count + 3 * k :]
        x, y = position_m[k, 0] - view.x_m, position_m[k, 1] - view.y_m
        at[0], at[1], at[2] = cosine * x + sine * y, cosine * y - sine * x, position_m[k, 2]
        x, y = velocity_m_s[k, 0], velocity_m_s[k, 1]
        gone[0], gone[1], gone[2] = cosine * x + sine * y, cosine * y - sine * x, velocity_m_s[k, 2]
        q, like = turned[k], 0.0
        turn[0], turn[1] = c * q[0] + s * q[3], c * q[1] + s * q[2]  # about_z(-yaw) q
        turn[2], turn[3] = c * q[2] - s * q[1], c * q[3] - s * q[0]
        for i in range(4):
            like += turn[i] * hemisphere[k, i]
        for i in range(4):
            turn[i] = np.copysign(1.0, like) * turn[i]
    return out * scale


@compiled
def _trusted(features: Singles, rows: Ints, query: Floats, trust: Floats) -> tuple[Floats, Floats]:
    """The first n columns of some rows (m, n) and of the query (n,), each times the root of its trust (n,)."""
    root = np.sqrt(trust)
    values = np.empty((len(rows), len(query)))
    for i in range(len(rows)):
        for k in range(len(query)):
            values[i, k] = features[rows[i], k] * root[k]
    return values, query * root


@compiled
def _side_by_side(first: Singles, second: Singles, rows: Ints) -> Floats:
    """Some rows of two tables (N, a), (N, b), as one (K, a + b)."""
    width = first.shape[1]
    out = np.empty((len(rows), width + second.shape[1]))
    for i in range(len(rows)):
        for k in range(width):
            out[i, k] = first[rows[i], k]
        for k in range(second.shape[1]):
            out[i, width + k] = second[rows[i], k]
    return out
