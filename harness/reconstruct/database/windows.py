"""Windows of the last m poses, as vectors for a search: E, "world invariance" (docs/methods.md).

The window of frame k holds the poses k, k-1, ... k-m+1, newest first: the posture of k, then for every older pose its
ground frame seen from that of k (forward, left, turn) and its posture; metres and radians. So a window is
52 m + 3 (m - 1) numbers that neither place nor heading changes. Vectors are made on demand: only the numbers of
frames are stored.

Two conventions meet here. A method that wants the poses themselves (local PCA) takes `frames[rows]`. One that predicts
(Liu et al. 2011, A4: query q~_{t-1}.. q~_{t-m}, target y_k = q_{t_k}) asks for windows that are `followed`, and
`successors(rows)` are its targets: the frames after, seen from the ground of the window's newest pose.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from harness.core.arrays import Bools, Floats, Ints, Singles
from harness.reconstruct.database.ground import POSTURE, ground_of, posture_of, seen_from

if TYPE_CHECKING:
    from harness.reconstruct.database.database import MotionDatabase


@dataclass(frozen=True, eq=False)
class Windows:
    """The windows of a database, W in number; a `Vectors` that an index can be made of."""

    database: "MotionDatabase"
    length: int
    """m, poses in a window."""
    frames: Ints
    """(W,) frame of the database that each window ends with, ascending."""
    scale: Singles | None = None
    """(D,) multiplies every vector: distances are those of eq. 6 with D_w = diag(scale^2); None is 1."""

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def size(self) -> int:
        """D, numbers in a vector."""
        return (POSTURE + 3) * self.length - 3

    def gather(self, rows: Ints | slice) -> Singles:
        """Vectors (K, D) of some windows."""
        newest, database = self.frames[rows], self.database
        out = np.empty((len(newest), self.size), np.float32)
        database.posture.take(newest, 0, out[:, :POSTURE])
        seen = np.zeros((len(newest), 3))
        for age in range(1, self.length):
            at = (POSTURE + 3) * age
            # the frame before, from k-age+1: the step backwards; then on to where that one is seen from k
            before = _backwards(database.step.take(newest - (age - 1), 0).astype(float))
            seen = before if age == 1 else _onwards(seen, before)
            out[:, at - 3 : at] = seen
            out[:, at : at + POSTURE] = database.posture.take(newest - age, 0)
        if self.scale is not None:
            out *= self.scale
        return out

    @property
    def follows(self) -> Bools:
        """(W,) whether the next window is that of the next frame of the same take."""
        out = np.zeros(len(self), bool)
        out[:-1] = np.diff(self.frames) == 1
        ends = np.searchsorted(self.frames, [run.stop for run in self.database.runs])
        out[ends[ends > 0] - 1] = False
        return out

    def successors(self, rows: Ints | slice) -> Singles:
        """(K, 55) posture (52) and step (3) of the frame after each window; only of `followed` windows."""
        after = self.frames[rows] + 1
        out = np.empty((len(after), POSTURE + 3), np.float32)
        self.database.posture.take(after, 0, out[:, :POSTURE])
        self.database.step.take(after, 0, out[:, POSTURE:])
        return out

    def query(self, qpos: Floats) -> Singles:
        """The vector (D,) of m configurations (m, 55), newest first, hinges in the database's representation."""
        ground, posture = ground_of(qpos), posture_of(qpos)
        out = np.empty((self.length, POSTURE + 3), np.float32)
        out[:, 3:] = posture
        out[1:, :3] = seen_from(ground[0], ground[1:])
        vector: Singles = out.reshape(-1)[3:]
        return vector if self.scale is None else vector * self.scale

    def scaled(self, scale: Floats) -> "Windows":
        """The same windows with every vector multiplied by `scale` (D,)."""
        return Windows(self.database, self.length, self.frames, np.asarray(scale, np.float32).reshape(self.size))


def _backwards(step: Floats) -> Floats:
    """(K, 3) where a step's start is seen from its end."""
    forward, left, turn = step[:, 0], step[:, 1], step[:, 2]
    cosine, sine = np.cos(turn), np.sin(turn)
    return np.stack([-cosine * forward - sine * left, sine * forward - cosine * left, -turn], axis=-1)


def _onwards(seen: Floats, step: Floats) -> Floats:
    """(K, 3) a step that starts where `seen` says."""
    cosine, sine = np.cos(seen[:, 2]), np.sin(seen[:, 2])
    forward, left = cosine * step[:, 0] - sine * step[:, 1], sine * step[:, 0] + cosine * step[:, 1]
    return seen + np.stack([forward, left, step[:, 2]], axis=-1)
