"""The motion database: poses at one rate, without position and heading, in float32, each with its provenance.

A pose is a posture (height, tilt, hinges) on a ground frame (x, y, yaw) under the root. Of the ground frame only the
step since the frame before is stored (`solver.ground_frame`), so a database does not change when the room is rotated or
shifted. Hinge angles are continuous through each take, in the representation that most of its frames share with the
joint limits (`HingeLimits.normalise_motion`). So takes agree with each other and with the answers of a solver.
"""

from collections.abc import Callable, Iterable, Iterator, Sized
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.body import Body
from harness.core.arrays import Singles
from harness.core.motion import BodyMotion
from harness.core.workers import run_in_workers
from harness.errors import BadInput
from harness.reconstruct.database.frames import BuildProgress, MotionFrames, TakeSegment, Windows
from harness.reconstruct.database.storage import MemoryWriter, open_database, open_writer, save_database
from harness.reconstruct.solver.ground_frame import ground_from_qpos, posture_from_qpos, relative_ground
from harness.reconstruct.solver.hinge_limits import HingeLimits

BuiltSegment = tuple[TakeSegment, float, Singles, Singles]
"""A segment that starts at row 0, its rate [Hz], postures and steps."""


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


def build_database(
    body: Body,
    takes: Iterable[BodyMotion | Callable[[], BodyMotion]],
    *,
    workers: int,
    progress: BuildProgress | None,
    folder: Path | None,
) -> MotionFrames:
    """The frames of takes, in their order; see `MotionDatabase.build`."""
    planned = len(takes) if isinstance(takes, Sized) else 0
    with MemoryWriter() if folder is None else open_writer(folder) as writer:
        for done, (segment, rate_hz, posture, step) in enumerate(_convert_takes(body, takes, workers), start=1):
            writer.add(segment, rate_hz, posture, step)
            if progress is not None:
                progress(segment.take, done, planned)
        if not writer.segments:
            raise BadInput(
                "A motion database is built from takes, and there are none.", "Name examples in the scenario."
            )
    return writer.result()


def _convert_takes(
    body: Body, takes: Iterable[BodyMotion | Callable[[], BodyMotion]], workers: int
) -> Iterator[BuiltSegment]:
    """The takes converted, in their order, whichever worker is done first."""
    if workers <= 1:
        limits = HingeLimits(body)
        for take in takes:
            yield convert_take(limits, take)
        return
    waiting: dict[int, BuiltSegment] = {}
    due = 0
    for number, result in run_in_workers(_convert_in_worker, [(body, take) for take in takes], workers):
        waiting[number] = result.result()
        while due in waiting:
            yield waiting.pop(due)
            due += 1


def _convert_in_worker(body: Body, take: BodyMotion | Callable[[], BodyMotion]) -> BuiltSegment:
    return convert_take(HingeLimits(body), take)


def convert_take(limits: HingeLimits, take: BodyMotion | Callable[[], BodyMotion]) -> BuiltSegment:
    """One take, or the take that a function makes, in the database's form; BadInput when it has no frames."""
    if not isinstance(take, BodyMotion):
        take = take()
    if not len(take):
        raise BadInput(f"{take.name} has no frames.", "Leave it out of the examples.")
    qpos = np.array(take.qpos)
    qpos[:, 7:] = limits.normalise_motion(qpos[:, 7:])
    ground = ground_from_qpos(qpos)
    step = np.zeros((len(qpos), 3), np.float32)
    step[1:] = relative_ground(ground[:-1], ground[1:])
    segment = TakeSegment(take.name, take.subject, take.source, take.behaviour, 0, len(qpos))
    return segment, take.rate_hz, posture_from_qpos(qpos).astype(np.float32), step
