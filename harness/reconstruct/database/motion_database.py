"""The motion database: poses at one rate, without place and heading, in float32, each with its provenance.

A pose is a posture (height, tilt, hinges) on a ground frame (x, y, yaw) under the root; of the ground frame only the
step since the frame before is kept (`ground`). So the room may be turned and shifted, and the database stays the same.
Hinge angles run on through each take, in the representation that most of its frames share with the joint limits
(`HingeLimits.course`); so takes agree with each other and with what a solver within those limits answers.
"""

import mmap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Floats, Ints, Singles
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.reconstruct.database.windows import Windows
from harness.reconstruct.solver.ground_frame import qpos_from_postures

BuildProgress = Callable[[str, int, int], None]
"""Called with the take done last, how many are done and how many there are (0 when nobody knows)."""


@dataclass(frozen=True)
class TakeSegment:
    """Consecutive frames of one take, and where they come from."""

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
class MotionDatabase:
    """N frames in runs that follow each other; arrays may be memory-mapped and are never written to."""

    rate_hz: float
    posture: Singles
    """(N, 52) height [m], tilt (rotation vector) [rad], 48 hinges in the order of `qpos[7:]` [rad]."""
    step: Singles
    """(N, 3) forward, left [m] and turn [rad] since the frame before, in its ground frame; 0 where a run begins."""
    runs: tuple[TakeSegment, ...]

    @classmethod
    def build(
        cls,
        body: Body,
        takes: Iterable[BodyMotion | Callable[[], BodyMotion]],
        *,
        workers: int = 1,
        progress: BuildProgress | None = None,
        folder: Path | None = None,
    ) -> "MotionDatabase":
        """Of takes on this body, all at one rate; BadInput when there is none, or rates differ.

        A take may also be a function that makes it, picklable, which one of `workers` processes then calls. With a
        `folder` (which must not exist) frames are written there as they come and the result is memory-mapped, as
        `save_database` and `open` would do.
        """
        from harness.reconstruct.database.builder import build_database

        return build_database(body, takes, workers=workers, progress=progress, folder=folder)

    def __len__(self) -> int:
        return len(self.posture)

    def windows(self, length: int, *, followed: bool = False) -> Windows:
        """Those of `length` poses within one run, and with one more frame after them when they are to be `followed`."""
        if length < 1:
            raise BadInput(f"Windows of {length} poses.", "Take one or more.")
        ends = [np.arange(run.start + length - 1, run.stop - followed, dtype=np.int64) for run in self.runs]
        return Windows(self, length, np.concatenate([np.zeros(0, np.int64), *ends]))

    def qpos(self, rows: Ints | slice, ground: Floats) -> Floats:
        """Configurations (K, 55) of some frames, stood on a ground frame (3,), or on one for each (K, 3)."""
        return qpos_from_postures(self.posture[rows], ground)

    def without(self, take: str, frames: range | None = None) -> "MotionDatabase":
        """A copy that lacks a take, or those of its frames; what remains of it falls into runs of their own.

        BadInput when nothing would be left.
        """
        kept: list[TakeSegment] = []
        for run in self.runs:
            if run.take != take:
                kept.append(run)
                continue
            if frames is None:
                continue
            first = run.start - run.first_frame
            cuts = (run.start, first + frames.start), (first + frames.stop, run.stop)
            for start, stop in cuts:
                start, stop = max(start, run.start), min(stop, run.stop)
                if start < stop:
                    kept.append(_relocated(run, start, stop, start - first))
        if not kept:
            raise BadInput(f"The database has no frames but those of {take}.", "Add takes of other clips.")
        rows = [slice(run.start, run.stop) for run in kept]
        ends = np.cumsum([0, *map(len, kept)])
        runs = tuple(
            _relocated(run, int(a), int(b), run.first_frame)
            for run, a, b in zip(kept, ends[:-1], ends[1:], strict=True)
        )
        step = np.concatenate([self.step[where] for where in rows])
        step[ends[:-1]] = 0.0
        return MotionDatabase(self.rate_hz, np.concatenate([self.posture[where] for where in rows]), step, runs)

    def segment_of(self, row: int) -> TakeSegment:
        """Where a frame comes from."""
        starts: Sequence[int] = [run.start for run in self.runs]
        return self.runs[int(np.searchsorted(starts, row, side="right")) - 1]

    def release_memory(self) -> None:
        """Give back the memory into which a map was read so far; what is asked for again is read again."""
        for array in (self.posture, self.step):
            mapped = getattr(array, "_mmap", None)
            if mapped is not None and hasattr(mmap, "MADV_DONTNEED"):
                mapped.madvise(mmap.MADV_DONTNEED)

    def save(self, folder: Path) -> None:
        """Write it to a folder that does not exist yet; BadFile when it does. Whole or not at all."""
        from harness.reconstruct.database.storage import save_database

        save_database(self, folder)

    @staticmethod
    def open(folder: Path) -> "MotionDatabase":
        """A folder that `save_database` wrote, memory-mapped; BadFile says what is wrong with any other."""
        from harness.reconstruct.database.storage import open_database

        return open_database(folder)


def _relocated(run: TakeSegment, start: int, stop: int, first_frame: int) -> TakeSegment:
    return TakeSegment(run.take, run.subject, run.source, run.behaviour, start, stop, first_frame)
