"""Frames of a motion database, the segments of takes that they come from, and windows of the last m poses.

Windows are vectors for a search: E, "world invariance" (docs/papers.md). The window of frame k holds the poses k, k-1,
... k-m+1, newest first: the posture of k, then for every older pose its ground frame relative to that of k (forward,
left, turn) and its posture, in metres and radians. These 52 m + 3 (m - 1) numbers depend neither on position nor on
heading. Vectors are made on demand: only the numbers of frames are stored.

Methods use windows in two ways. One that needs the poses themselves (local PCA) takes `frames[rows]`. One that predicts
(Liu et al. 2011, A4: query q~_{t-1}.. q~_{t-m}, target y_k = q_{t_k}) asks for windows with a successor; its targets
are `successors(rows)`, the frames after, relative to the ground frame of the window's newest pose.
"""

import math
import mmap
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints, Singles
from harness.core.compiled import compiled
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE, qpos_from_postures

BuildProgress = Callable[[str, int, int], None]
"""Called with the name of the take that is done, the number of takes done, and their total (0 when unknown)."""


@dataclass(frozen=True)
class TakeSegment:
    """Consecutive frames of one take, their rows in the database, and their provenance."""

    take: str
    subject: str
    source: str
    behaviour: str
    start: int
    """First row of the database."""
    stop: int
    """The row after the last."""
    first_frame: int = 0
    """Number of the first row's frame within its take."""

    def __len__(self) -> int:
        return self.stop - self.start


@dataclass(frozen=True, eq=False)
class MotionFrames:
    """N frames in segments that follow each other; arrays may be memory-mapped and are never written to."""

    rate_hz: float
    posture: Singles
    """(N, 52) height [m], tilt (rotation vector) [rad], 48 hinges in the order of `qpos[7:]` [rad]."""
    step: Singles
    """(N, 3) forward, left [m] and turn [rad] since the frame before, in its ground frame; 0 where a segment begins."""
    segments: tuple[TakeSegment, ...]

    def __len__(self) -> int:
        return len(self.posture)

    def qpos(self, rows: Ints | slice, ground: Floats) -> Floats:
        """Configurations (K, 55) of some frames on one ground frame (3,), or on one for each (K, 3)."""
        return qpos_from_postures(self.posture[rows], ground)

    def release_memory(self) -> None:
        """Return the memory into which a map was read so far to the system; rows are read again when they are used."""
        for array in (self.posture, self.step):
            mapped = getattr(array, "_mmap", None)
            if mapped is not None and hasattr(mmap, "MADV_DONTNEED"):
                mapped.madvise(mmap.MADV_DONTNEED)


@dataclass(frozen=True, eq=False)
class Windows:
    """W windows of a database: `Vectors` for an index (`index.protocol`)."""

    database: MotionFrames
    length: int
    """m, the number of poses in a window."""
    frames: Ints
    """(W,) rows of the database with the newest pose of each window, ascending."""
    scale: Singles | None = None
    """(D,) factor on every vector: distances are those of eq. 6 with D_w = diag(scale^2); None for 1."""

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def size(self) -> int:
        """D, the length of a vector."""
        return (POSTURE_SIZE + 3) * self.length - 3

    def gather(self, rows: Ints | slice) -> Singles:
        """Vectors (K, D) of these windows."""
        newest, database = self.frames[rows], self.database
        out = np.empty((len(newest), self.size), np.float32)
        _fill_windows(database.posture.view(np.ndarray), database.step.view(np.ndarray), newest, out)
        if self.scale is not None:
            out *= self.scale
        return out

    @property
    def consecutive(self) -> Bools:
        """(W,) whether the next window ends one frame later in the same segment."""
        out = np.zeros(len(self), bool)
        out[:-1] = np.diff(self.frames) == 1
        ends = np.searchsorted(self.frames, [segment.stop for segment in self.database.segments])
        out[ends[ends > 0] - 1] = False
        return out

    def successors(self, rows: Ints | slice) -> Singles:
        """(K, 55) posture (52) and step (3) of the frame after each window; IndexError at the end of the database."""
        newest, database = self.frames[rows], self.database
        out = np.empty((len(newest), POSTURE_SIZE + 3), np.float32)
        if not _gather_successors(database.posture.view(np.ndarray), database.step.view(np.ndarray), newest, out):
            raise IndexError(
                "the last window of the database has no successor: ask for windows(..., with_successor=True)"
            )
        return out

    def query(self, qpos: Floats) -> Singles:
        """The vector (D,) of m configurations (m, 55), newest first, with hinges in the database's representation."""
        out = np.empty(self.size, np.float32)
        _fill_query(np.ascontiguousarray(qpos[: self.length]), out)
        return out if self.scale is None else out * self.scale

    def scaled(self, scale: Floats) -> "Windows":
        """A copy of the windows with every vector multiplied by `scale` (D,)."""
        return Windows(self.database, self.length, self.frames, np.asarray(scale, np.float32).reshape(self.size))


@compiled
def _fill_windows(posture: Singles, step: Singles, newest: Ints, out: Singles) -> None:
    """Fill in the vectors (K, D) of windows whose newest frames are `newest` (K,).

    Steps lead from each frame to the next one, in its ground frame. Going back in time, the heading is reduced by the
    step's turn first, and then the step is subtracted in the axes of the older frame.
    """
    for k in range(len(newest)):
        frame = newest[k]
        out[k, :POSTURE_SIZE] = posture[frame]
        x, y, yaw = 0.0, 0.0, 0.0  # the older ground frame, relative to the newest
        for age in range(1, (out.shape[1] + 3) // (POSTURE_SIZE + 3)):
            forward, left, turn = step[frame - age + 1]
            yaw -= np.float64(turn)
            cosine, sine = math.cos(yaw), math.sin(yaw)
            x -= cosine * forward - sine * left
            y -= sine * forward + cosine * left
            at = (POSTURE_SIZE + 3) * age
            out[k, at - 3], out[k, at - 2], out[k, at - 1] = x, y, yaw
            out[k, at : at + POSTURE_SIZE] = posture[frame - age]


@compiled
def _gather_successors(posture: Singles, step: Singles, newest: Ints, out: Singles) -> bool:
    """Fill in posture and step (K, 55) of the frames after `newest` (K,); False when one has no successor."""
    width = posture.shape[1]
    for k in range(len(newest)):
        frame, row = newest[k] + 1, out[k]
        if frame >= len(posture):
            return False
        for i in range(width):
            row[i] = posture[frame, i]
        for i in range(3):
            row[width + i] = step[frame, i]
    return True


@compiled
def _fill_query(qpos: Floats, out: Singles) -> None:
    """Fill in the vector (D,) of configurations (m, 55), newest first.

    It has `posture_from_qpos` of each, and `relative_ground` of their `ground_from_qpos` for the older ones.
    """
    newest = 2.0 * math.atan2(qpos[0, 6], qpos[0, 3])
    cosine, sine = math.cos(newest), math.sin(newest)
    for age in range((len(out) + 3) // (POSTURE_SIZE + 3)):
        at = (POSTURE_SIZE + 3) * age
        w, x, y, z = qpos[age, 3], qpos[age, 4], qpos[age, 5], qpos[age, 6]
        if age:
            turn = 2.0 * math.atan2(z, w) - newest
            east, north = qpos[age, 0] - qpos[0, 0], qpos[age, 1] - qpos[0, 1]
            out[at - 3] = cosine * east + sine * north
            out[at - 2] = cosine * north - sine * east
            out[at - 1] = turn - 2.0 * math.pi * round(turn / (2.0 * math.pi))
        level, lean = math.hypot(w, z), math.hypot(x, y)
        along = 2.0 * math.atan2(lean, level) / max(level * lean, 1e-30)
        out[at] = qpos[age, 2]
        out[at + 1], out[at + 2], out[at + 3] = along * (x * w + y * z), along * (y * w - x * z), 0.0
        out[at + 4 : at + POSTURE_SIZE] = qpos[age, 7:]
