"""The run of a trained method over the frames of a take, with the time of each step."""

import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from harness.core.arrays import Floats, Ints, immutable
from harness.core.calibration import Calibration
from harness.core.estimate import Origin, Status
from harness.experiment.reference_workload import FRAMES_PER_TIMING, ReferenceWorkload
from harness.reconstruct.contract import Reconstructor
from harness.stream.frame import TrackerFrame

QPOS_SIZE = 55
"""Size of a configuration of the body."""


class MethodAnswers(NamedTuple):
    """The answers of a session to F frames, and the times of its steps."""

    qpos: Floats
    """(F, 55) estimates."""
    status: Ints
    """(F,) values of `core.estimate.Status`."""
    origin: Ints
    """(F,) values of `core.estimate.Origin`."""
    step_ms: Floats
    """(F,) wall time of each step [ms]."""
    step_cpu_ms: Floats
    """(F,) CPU time of each step [ms]."""
    reference_cpu_ms: Floats
    """(F,) CPU time of the reference work after each step [ms]."""


def run_method(reconstructor: Reconstructor, calibration: Calibration, frames: Sequence[TrackerFrame]) -> MethodAnswers:
    """Run a reconstructor over frames. It never sees the truth, and each answer is copied before the next step.

    Reference work follows every `FRAMES_PER_TIMING` steps, and its time is NaN elsewhere. It evicts the method's data
    from the processor's caches, so the step after it is not timed (NaN). ValueError for a pose of another size.
    """
    session, work = reconstructor.begin(calibration), ReferenceWorkload()
    qpos, status, origin = np.empty((len(frames), QPOS_SIZE)), [], []
    step_ms, cpu_ms, reference_ms = [], [], []
    for index, frame in enumerate(frames):
        start_cpu, start = time.process_time(), time.perf_counter()
        estimate = session.step(frame)
        step_ms.append(1e3 * (time.perf_counter() - start))
        cpu_ms.append(1e3 * (time.process_time() - start_cpu))
        pose = np.asarray(estimate.qpos, dtype=np.float64)
        if pose.shape != (QPOS_SIZE,):
            raise ValueError(f"the method answered with a pose of shape {pose.shape}, expected ({QPOS_SIZE},)")
        qpos[index] = pose
        status.append(int(Status(estimate.status)))
        origin.append(int(Origin(estimate.origin)))
        reference_ms.append(work.cpu_ms() if index % FRAMES_PER_TIMING == FRAMES_PER_TIMING - 1 else np.nan)
    times_ms = np.array([step_ms, cpu_ms, reference_ms])
    times_ms[:2, FRAMES_PER_TIMING::FRAMES_PER_TIMING] = np.nan
    whole = (immutable(qpos), immutable(status, np.int64), immutable(origin, np.int64))
    return MethodAnswers(*whole, *(immutable(row) for row in times_ms))
