"""Conversion of takes into a motion database, take by take: only one take at a time is held in double precision."""

from collections.abc import Callable, Iterable, Iterator, Sized
from pathlib import Path

import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Singles
from harness.core.motion import BodyMotion
from harness.core.workers import run_in_workers
from harness.errors import BadInput
from harness.reconstruct.database.frames import BuildProgress, MotionFrames, TakeSegment
from harness.reconstruct.database.storage import MemoryWriter, open_writer
from harness.reconstruct.solver.ground_frame import ground_from_qpos, posture_from_qpos, relative_ground
from harness.reconstruct.solver.hinge_limits import HingeLimits

BuiltSegment = tuple[TakeSegment, float, Singles, Singles]
"""A segment that starts at row 0, its rate [Hz], postures and steps."""


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
