"""The run of a trained method over the frames of a take, with the time of each step."""

import operator
import time
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from harness.core.arrays import Floats, Ints, immutable
from harness.core.calibration import Calibration
from harness.core.estimate import Origin, Status, check_sigma, session_lag
from harness.experiment.reference_workload import FRAMES_PER_TIMING, ReferenceWorkload
from harness.reconstruct.contract import Reconstructor
from harness.stream.frame import TrackerFrame

QPOS_SIZE = 55
"""Size of a configuration of the body."""
HINGES = QPOS_SIZE - 7
"""Number of hinge angles in a configuration."""


class MethodAnswers(NamedTuple):
    """The answers of a session at F steps, and the times of the steps."""

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
    lag: Ints
    """(F,) number of frames between the frame that each estimate answers and that of its step; see `session_lag`."""
    angle_sigma_rad: Floats | None = None
    """(F, 48) standard deviations of the hinge angles [rad]; None from a method that gives none."""

    def by_frame(self) -> tuple["MethodAnswers", int]:
        """The answers to frames in place of steps, (F - L,), and the lag L of the session [frames].

        Row n has the pose, status, origin and standard deviations that answer the n-th frame, and the times of the
        step that received it. The last L frames have no row.
        """
        lag = session_lag(self.lag)
        kept = len(self.lag) - lag
        sigma_rad = None if self.angle_sigma_rad is None else self.angle_sigma_rad[lag:]
        times = {name: getattr(self, name)[:kept] for name in ("step_ms", "step_cpu_ms", "reference_cpu_ms")}
        answers = {name: getattr(self, name)[lag:] for name in ("qpos", "status", "origin", "lag")}
        return MethodAnswers(**answers, **times, angle_sigma_rad=sigma_rad), lag

    def at(self, rows: Ints) -> "MethodAnswers":
        """The answers in these rows."""
        return MethodAnswers(*(None if column is None else column[rows] for column in self))


def run_method(reconstructor: Reconstructor, calibration: Calibration, frames: Sequence[TrackerFrame]) -> MethodAnswers:
    """Run a reconstructor over frames. It never sees the truth, and each answer is copied before the next step.

    Reference work follows every `FRAMES_PER_TIMING` steps, and its time is NaN elsewhere. It evicts the method's data
    from the processor's caches, so the step after it is not timed (NaN). ValueError for a pose of another size, for a
    lag that changes after the first frames, and for standard deviations that are impossible or missing in some frames.
    """
    session, work = reconstructor.begin(calibration), ReferenceWorkload()
    qpos, status, origin, lags = np.empty((len(frames), QPOS_SIZE)), [], [], []
    sigma_rad: list[Floats] = []
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
        lag, sigma = lag_and_sigma(estimate)
        lags.append(lag)
        if sigma is not None:
            sigma_rad.append(sigma)
        reference_ms.append(work.cpu_ms() if index % FRAMES_PER_TIMING == FRAMES_PER_TIMING - 1 else np.nan)
    times_ms = np.array([step_ms, cpu_ms, reference_ms])
    times_ms[:2, FRAMES_PER_TIMING::FRAMES_PER_TIMING] = np.nan
    session_lag(lags)
    if len(sigma_rad) not in (0, len(frames)):
        raise ValueError(f"the method gave standard deviations in {len(sigma_rad)} of {len(frames)} frames")
    step, cpu, reference = map(immutable, times_ms)
    return MethodAnswers(
        immutable(qpos),
        immutable(status, np.int64),
        immutable(origin, np.int64),
        step,
        cpu,
        reference,
        lag=immutable(lags, np.int64),
        angle_sigma_rad=immutable(sigma_rad) if sigma_rad else None,
    )


def lag_and_sigma(estimate: Any) -> tuple[int, Floats | None]:
    """Lag [frames] and a copy of the standard deviations (48,) [rad] of an estimate, or None.

    ValueError for standard deviations of another size, or not finite and positive. A method may answer with an object
    of its own, which need not have either.
    """
    given, lag = getattr(estimate, "angle_sigma_rad", None), operator.index(getattr(estimate, "lag", 0))
    if given is None:
        return lag, None
    sigma_rad = np.array(given, dtype=np.float64)
    if sigma_rad.shape != (HINGES,):
        raise ValueError(f"the method gave standard deviations of shape {sigma_rad.shape}, expected ({HINGES},)")
    check_sigma(sigma_rad)
    return lag, sigma_rad
