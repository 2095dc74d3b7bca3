"""Times from files, checked before an array is made of their span: its length, and whether they can be seconds."""

import math

import numpy as np

from harness.core.arrays import Floats
from harness.errors import BadInput

MOST_STEPS = 20_000_000
"""Most places of a grid of times [choice]: 46 hours at 120 Hz, 160 MB for each column."""
_LONGEST_STEP_S = 1.0
"""Longest usual step of a recorded motion [s]; a longer one is in another unit."""
_DAY_S = 86_400.0
_UNITS = {"milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9}
_USUAL_S = 0.5
"""Longest step in seconds with which a unit is named [s]: motion at 2 Hz."""


def count_steps(span_s: float, step_s: float, what: str) -> int:
    """Number of whole steps in a span of time; BadInput for more than `MOST_STEPS`. `what` begins the message."""
    steps = span_s / step_s
    if not steps <= MOST_STEPS:
        raise BadInput(
            f"{what}: {span_s:.4g} s in steps of {step_s:.4g} s, more than {MOST_STEPS:,} of them.",
            "Likely cause: times in another unit than seconds, one stray time, or a wrong rate.",
        )
    return int(steps)


def require_seconds(time_s: Floats, what: str) -> None:
    """BadInput unless times (N,) in rising order can be those of a motion in seconds, with the likely cause."""
    steps_s = np.diff(time_s)
    if not len(steps_s):
        return
    middle_s, longest = float(np.median(steps_s)), int(np.argmax(steps_s))
    if middle_s > _LONGEST_STEP_S:
        unit = next((name for name, size_s in _UNITS.items() if middle_s * size_s <= _USUAL_S), "another unit")
        raise BadInput(
            f"{what} has a pose every {middle_s:.4g} s. Likely cause: its times are in {unit} instead of seconds.",
            "Give its times in seconds.",
        )
    if steps_s[longest] > _DAY_S:
        raise BadInput(
            f"Times of {what[0].lower()}{what[1:]} jump from {time_s[longest]:.10g} to {time_s[longest + 1]:.10g} s "
            f"after pose {longest + 1} of {len(time_s)}. Likely cause: a stray time, such as a 0 before Unix times.",
            "Remove that row.",
        )


def require_rate(rate_hz: float, frames: int, what: str) -> None:
    """BadInput unless a motion of so many frames at this rate lasts a day at most."""
    if not (0.0 < rate_hz <= 1e5 and math.isfinite(rate_hz) and (frames - 1) / rate_hz <= _DAY_S):
        raise BadInput(
            f"{what}: {frames} frames at {rate_hz:g} Hz.",
            "A motion has at most 100,000 frames a second and lasts a day at most: correct its frame rate.",
        )
