"""How late the estimate is, and how long each step took."""

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.score.angles import wrapped

LONGEST_LAG_S = 0.5
_FEWEST_FRAMES = 20
STEP_TIMES = ("step_mean_ms", "step_p50_ms", "step_p95_ms", "step_p99_ms", "fps", "step_relative")


def lag_ms(truth_rad: Floats, estimate_rad: Floats, frame_index: Ints, rate_hz: float) -> float:
    """Shift in time that minimises the mean joint-angle error; positive where the estimate is late [ms].

    `truth_rad` (E, D) at an even rate, `estimate_rad` (F, D) at its frames `frame_index`. Whole frames up to 0.5 s
    either way, all over the same estimates, refined by a parabola through the three errors about the least. NaN where
    it cannot be told: too few frames, no motion, or the least error at the end of the range.
    """
    reach = int(np.floor(LONGEST_LAG_S * rate_hz))
    inside = (frame_index >= reach) & (frame_index < len(truth_rad) - reach)
    if inside.sum() < _FEWEST_FRAMES or reach < 1:
        return float("nan")
    estimate, at = estimate_rad[inside], frame_index[inside]
    shifts = np.arange(-reach, reach + 1)
    error = np.array([np.abs(wrapped(estimate - truth_rad[at - shift])).mean() for shift in shifts])
    if min(np.ptp(error), np.ptp(estimate, axis=0).max()) < 1e-9:
        return float("nan")
    best = int(np.argmin(error))
    if best in (0, len(shifts) - 1):
        return float("nan")
    before, least, after = error[best - 1 : best + 2]
    bend = before - 2.0 * least + after
    share = 0.5 * (before - after) / bend if least > 0.0 and bend > 0.0 else 0.0
    return float(1e3 * (shifts[best] + share) / rate_hz)


def step_times_ms(step_ms: Floats, reference_ms: Floats | None = None) -> dict[str, float]:
    """Wall time of a step (batch of one): mean, p50, p95, p99, frames per second, and p50 relative to the work of
    `score.reference` where that was timed; NaN of none, and NaN where either was not timed."""
    known = step_ms[np.isfinite(step_ms)]
    if not len(known):
        return dict.fromkeys(STEP_TIMES, float("nan"))
    p50, p95, p99 = np.percentile(known, [50, 95, 99])
    mean = known.mean()
    reference = np.empty(0) if reference_ms is None else reference_ms[np.isfinite(reference_ms)]
    return {
        "step_mean_ms": float(mean),
        "step_p50_ms": float(p50),
        "step_p95_ms": float(p95),
        "step_p99_ms": float(p99),
        "fps": float(1e3 / mean) if mean > 0.0 else float("nan"),
        "step_relative": float(p50 / np.median(reference)) if len(reference) else float("nan"),
    }
