"""Making a database take by take: no more than one take is ever held in double precision."""

from collections.abc import Callable, Iterable, Iterator, Sized
from pathlib import Path

import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Singles
from harness.core.motion import Take
from harness.core.workers import call_each
from harness.errors import BadInput
from harness.reconstruct.database.motion_database import MotionDatabase, Progress, Run
from harness.reconstruct.database.storage import Kept, writing
from harness.reconstruct.solver.ground_frame import ground_of, posture_of, seen_from
from harness.reconstruct.solver.hinge_limits import HingeLimits

Part = tuple[Run, float, Singles, Singles]
"""A run on its own, its rate [Hz], postures and steps."""


def build(
    body: Body,
    takes: Iterable[Take | Callable[[], Take]],
    *,
    workers: int,
    progress: Progress | None,
    folder: Path | None,
) -> MotionDatabase:
    """`MotionDatabase.build`."""
    planned = len(takes) if isinstance(takes, Sized) else 0
    with Kept() if folder is None else writing(folder) as writer:
        for done, (run, rate_hz, posture, step) in enumerate(_parts(body, takes, workers), start=1):
            writer.add(run, rate_hz, posture, step)
            if progress is not None:
                progress(run.take, done, planned)
        if not writer.runs:
            raise BadInput("A motion database is built of takes, and there are none.", "Name examples in the scenario.")
    return writer.result()


def _parts(body: Body, takes: Iterable[Take | Callable[[], Take]], workers: int) -> Iterator[Part]:
    if workers <= 1:
        limits = HingeLimits(body)
        for take in takes:
            yield part_of(limits, take)
        return
    early: dict[int, Part] = {}
    due = 0
    for which, done in call_each(_made, [(body, take) for take in takes], workers):
        early[which] = done.result()
        while due in early:
            yield early.pop(due)
            due += 1


def _made(body: Body, take: Take | Callable[[], Take]) -> Part:
    return part_of(HingeLimits(body), take)


def part_of(limits: HingeLimits, take: Take | Callable[[], Take]) -> Part:
    """One take in the database's form."""
    if not isinstance(take, Take):
        take = take()
    if not len(take):
        raise BadInput(f"{take.name} has no frames.", "Leave it out of the examples.")
    qpos = np.array(take.qpos)
    qpos[:, 7:] = limits.course(qpos[:, 7:])
    ground = ground_of(qpos)
    step = np.zeros((len(qpos), 3), np.float32)
    step[1:] = seen_from(ground[:-1], ground[1:])
    run = Run(take.name, take.subject, take.source, take.behaviour, 0, len(qpos))
    return run, take.rate_hz, posture_of(qpos).astype(np.float32), step
