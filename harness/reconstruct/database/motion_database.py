"""The motion database: poses at one rate, without position and heading, in float32, each with its provenance.

A pose is a posture (height, tilt, hinges) on a ground frame (x, y, yaw) under the root. Of the ground frame only the
step since the frame before is stored (`solver.ground_frame`), so a database does not change when the room is rotated or
shifted. Hinge angles are continuous through each take, in the representation that most of its frames share with the
joint limits (`HingeLimits.normalise_motion`). So takes agree with each other and with the answers of a solver.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.body.humanoid import Body
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.reconstruct.database.builder import build_database
from harness.reconstruct.database.frames import BuildProgress, MotionFrames, TakeSegment
from harness.reconstruct.database.storage import open_database, save_database
from harness.reconstruct.database.windows import Windows


@dataclass(frozen=True, eq=False)
class MotionDatabase(MotionFrames):
    """N frames in segments that follow each other; arrays may be memory-mapped and are never written to."""

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
        """A database of takes on this body, all at one rate; BadInput without takes, or when their rates differ.

        A take may also be a picklable function that makes it, which one of `workers` processes then calls. With a
        `folder` (which must not exist) frames are written there as they come and the result is memory-mapped, as after
        `save` and `open`.
        """
        return cls._of(build_database(body, takes, workers=workers, progress=progress, folder=folder))

    @classmethod
    def open(cls, folder: Path) -> "MotionDatabase":
        """The memory-mapped database of a folder that `save` wrote; BadFile says what is wrong with any other."""
        return cls._of(open_database(folder))

    @classmethod
    def _of(cls, frames: MotionFrames) -> "MotionDatabase":
        return cls(frames.rate_hz, frames.posture, frames.step, frames.segments)

    def save(self, folder: Path) -> None:
        """Write the database to a folder that does not exist yet, completely or not at all; BadFile when it exists."""
        save_database(self, folder)

    def windows(self, length: int, *, with_successor: bool = False) -> Windows:
        """All windows of `length` poses within a segment; `with_successor` only those that have a frame after them."""
        if length < 1:
            raise BadInput(f"A window of {length} poses is not possible.", "Use a length of 1 or more.")
        ends = [np.arange(s.start + length - 1, s.stop - with_successor, dtype=np.int64) for s in self.segments]
        return Windows(self, length, np.concatenate([np.zeros(0, np.int64), *ends]))

    def without(self, take: str, frames: range | None = None) -> "MotionDatabase":
        """A copy without a take, or without these frames of it; what remains of the take becomes separate segments.

        BadInput when nothing would be left.
        """
        kept: list[TakeSegment] = []
        for segment in self.segments:
            if segment.take != take:
                kept.append(segment)
                continue
            if frames is None:
                continue
            first = segment.start - segment.first_frame  # row of the take's frame 0
            for start, stop in ((segment.start, first + frames.start), (first + frames.stop, segment.stop)):
                start, stop = max(start, segment.start), min(stop, segment.stop)
                if start < stop:
                    kept.append(replace(segment, start=start, stop=stop, first_frame=start - first))
        if not kept:
            raise BadInput(f"The database has no frames but those of {take}.", "Add takes of other clips.")
        rows = [slice(segment.start, segment.stop) for segment in kept]
        ends = np.cumsum([0, *map(len, kept)]).tolist()
        segments = tuple(replace(s, start=a, stop=b) for s, a, b in zip(kept, ends[:-1], ends[1:], strict=True))
        step = np.concatenate([self.step[where] for where in rows])
        step[ends[:-1]] = 0.0
        return MotionDatabase(self.rate_hz, np.concatenate([self.posture[where] for where in rows]), step, segments)
