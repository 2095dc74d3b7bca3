"""Lag of the estimates, and time of the steps."""

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.score.angles import wrap_difference

LONGEST_LAG_S = 0.5
_FEWEST_FRAMES = 20


def lag_ms(truth_rad: Floats, estimate_rad: Floats, frame_index: Ints, rate_hz: float) -> float:
    """Shift in time that minimises the mean joint-angle error; positive where the estimate is late [ms].

    `truth_rad` (E, D) has an even rate; `estimate_rad` (F, D) is at its frames `frame_index`. Shifts of up to 0.5 s in
    either direction are evaluated on the same estimates, in whole frames, then refined by a parabola through the three
    errors around the minimum. NaN where it is undefined: too few frames, no motion, or the minimum at the end of the
    range.
    """
    reach = int(np.floor(LONGEST_LAG_S * rate_hz))
    inside = (frame_index >= reach) & (frame_index < len(truth_rad) - reach)
    if inside.sum() < _FEWEST_FRAMES or reach < 1:
        return float("nan")
    estimate, at = estimate_rad[inside], frame_index[inside]
    shifts = np.arange(-reach, reach + 1)
    error = np.array([np.abs(wrap_difference(estimate - truth_rad[at - shift])).mean() for shift in shifts])
    if min(np.ptp(error), np.ptp(estimate, axis=0).max()) < 1e-9:
        return float("nan")
    best = int(np.argmin(error))
    if best in (0, len(shifts) - 1):
        return float("nan")
    before, least, after = error[best - 1 : best + 2]
    curvature = before - 2.0 * least + after
    share = 0.5 * (before - after) / curvature if least > 0.0 and curvature > 0.0 else 0.0
    return float(1e3 * (shifts[best] + share) / rate_hz)


def step_times_ms(step_ms: Floats) -> dict[str, float]:
    """Wall time of a step (batch of one): mean, p50, p95, p99 [ms] and frames per second (1 / mean); else NaN."""
    timed = step_ms[np.isfinite(step_ms)]
    if not len(timed):
        return dict.fromkeys(("step_mean_ms", "step_p50_ms", "step_p95_ms", "step_p99_ms", "fps"), float("nan"))
    p50, p95, p99 = np.percentile(timed, [50, 95, 99])
    mean = timed.mean()
    return {
        "step_mean_ms": float(mean),
        "step_p50_ms": float(p50),
        "step_p95_ms": float(p95),
        "step_p99_ms": float(p99),
        "fps": float(1e3 / mean) if mean > 0.0 else float("nan"),
    }


def step_relative(step_cpu_ms: Floats, reference_cpu_ms: Floats) -> float:
    """Median CPU time of a step relative to that of `experiment.methods.method_run`; NaN where either was not timed.

    CPU time is used because wall time on a busy machine does not measure the method: a step that is interrupted takes
    several times as long, while work as short as the reference is seldom interrupted.
    """
    steps, work = (times[np.isfinite(times)] for times in (step_cpu_ms, reference_cpu_ms))
    if not len(steps) or not len(work) or np.median(work) <= 0.0:  # the clock may be too coarse
        return float("nan")
    return float(np.median(steps) / np.median(work))
