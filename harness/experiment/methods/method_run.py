"""The run of a trained method over the frames of a take, with the time of each step and of a reference workload.

A step takes longer on a slower or busier computer. So does the workload, which is timed between the steps of the same
cell; the ratio of the two is a method's cost. Half of it is a dense solve (the normal equations of 72 residuals and
54 unknowns), half is the overhead of small-array calls. It must not change: results in units of another reference are
not comparable. A change raises the version of the metric `step_relative`.
"""

import time
import traceback
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from harness.core.arrays import Floats, Ints, immutable
from harness.core.calibration import Calibration
from harness.core.estimate import QPOS_SIZE, Estimate, as_estimate, session_lag
from harness.core.fault_report import find_system_fault
from harness.core.seeds import generator
from harness.core.split import ExampleLeak
from harness.errors import HarnessError, was_interrupted
from harness.reconstruct import Reconstructor
from harness.stream import TrackerFrame

FRAMES_PER_TIMING = 8
"""Number of frames from one timing to the next. A cell of 8 s at 40 Hz has 40 timings, which take 3 % of the time of a
cell of the fastest method."""


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
        return self._replace(**answers, **times, angle_sigma_rad=sigma_rad), lag

    def at(self, rows: Ints) -> "MethodAnswers":
        """The answers in these rows."""
        return self._replace(**{n: column[rows] for n, column in self._asdict().items() if column is not None})


def run_method(reconstructor: Reconstructor, calibration: Calibration, frames: Sequence[TrackerFrame]) -> MethodAnswers:
    """Run a reconstructor over frames. It never sees the truth, and each answer is copied before the next step.

    Reference work follows every `FRAMES_PER_TIMING` steps, and its time is NaN elsewhere. It evicts the method's data
    from the processor's caches, so the step after it is not timed (NaN). For answers that are refused see
    `core.estimate.Estimate` and `stack_estimates`.
    """
    session, work = reconstructor.begin(calibration), ReferenceWorkload()
    estimates, step_ms, cpu_ms, reference_ms = [], [], [], []
    for index, frame in enumerate(frames):
        start_cpu, start = time.process_time(), time.perf_counter()
        answer = session.step(frame)
        step_ms.append(1e3 * (time.perf_counter() - start))
        cpu_ms.append(1e3 * (time.process_time() - start_cpu))
        estimates.append(as_estimate(answer))
        reference_ms.append(work.cpu_ms() if index % FRAMES_PER_TIMING == FRAMES_PER_TIMING - 1 else np.nan)
    times_ms = np.array([step_ms, cpu_ms, reference_ms])
    times_ms[:2, FRAMES_PER_TIMING::FRAMES_PER_TIMING] = np.nan
    return stack_estimates(estimates, times_ms)


def stack_estimates(estimates: Sequence[Estimate], times_ms: Floats) -> MethodAnswers:
    """The answers of a session from its F estimates and the times (3, F) of its steps, in the order of the fields.

    ValueError for a lag that changes after the first frames, and for standard deviations in some frames only.
    """
    sigma_rad = [estimate.angle_sigma_rad for estimate in estimates if estimate.angle_sigma_rad is not None]
    if len(sigma_rad) not in (0, len(estimates)):
        raise ValueError(f"the method gave standard deviations in {len(sigma_rad)} of {len(estimates)} frames")
    lags = [estimate.lag for estimate in estimates]
    session_lag(lags)
    step_ms, step_cpu_ms, reference_cpu_ms = map(immutable, times_ms)
    return MethodAnswers(
        immutable(np.array([estimate.qpos for estimate in estimates]).reshape(-1, QPOS_SIZE)),
        immutable([estimate.status for estimate in estimates], np.int64),
        immutable([estimate.origin for estimate in estimates], np.int64),
        step_ms,
        step_cpu_ms,
        reference_cpu_ms,
        lag=immutable(lags, np.int64),
        angle_sigma_rad=immutable(sigma_rad) if sigma_rad else None,
    )


NO_ANSWERS = stack_estimates([], np.zeros((3, 0)))
"""The answers of a method that failed."""


def describe_failure(error: BaseException) -> str:
    """Why a method has no result: the message of an error of the package, or the traceback of any other.

    For use where the error was caught. An error that is no fault of the method is raised again: examples that contain
    the test clip, Ctrl-C (KeyboardInterrupt), or a fault of the system that the code of the method has met.
    """
    if isinstance(error, ExampleLeak):
        raise error
    if was_interrupted(error):
        raise KeyboardInterrupt from error
    if fault := find_system_fault(error):
        raise fault from (None if fault is error else error)
    text = str(error) if isinstance(error, HarnessError) else "".join(traceback.format_exception(error))
    return text.encode(errors="backslashreplace").decode()  # a name of a file may be no Unicode


class ReferenceWorkload:
    """Work of 0.15 ms in numpy on one core of a shared 2-core x86 machine."""

    def __init__(self) -> None:
        rng = generator(0, "reference")
        self._slope, self._off = rng.normal(size=(72, 54)), rng.normal(size=72)
        self._damping = 0.1 * np.eye(54)
        self._turns, self._points = rng.normal(size=(24, 4)), rng.normal(size=(24, 3))
        self.work()  # excludes one-time initialisation from the timings

    def work(self) -> Floats:
        """Do the work; its result (54,) is always the same."""
        turns = self._turns / np.sqrt(np.sum(self._turns**2, axis=1, keepdims=True))
        apart = np.sqrt(np.sum((self._points[:, None] - self._points) ** 2, axis=2))
        weights = np.where(apart.mean(axis=1) > 2.0, 0.5, 1.0) * np.abs(turns[:, 0])
        weighed = self._slope * np.repeat(weights, 3)[:, None]
        step: Floats = np.linalg.solve(weighed.T @ self._slope + self._damping, weighed.T @ self._off)
        return step

    def cpu_ms(self) -> float:
        """CPU time of doing the work once [ms]."""
        start = time.process_time()
        self.work()
        return 1e3 * (time.process_time() - start)
