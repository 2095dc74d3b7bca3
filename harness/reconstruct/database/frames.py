"""The frames of a motion database and the segments of takes that they come from."""

import mmap
from collections.abc import Callable
from dataclasses import dataclass

from harness.core.arrays import Floats, Ints, Singles
from harness.reconstruct.solver.ground_frame import qpos_from_postures

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
