"""Motion as recorded or generated, on the actor's skeleton (`Clip`), and on the MuJoCo body (`BodyMotion`).

Times from files are checked before an array is made of their span: its length, and whether they can be seconds.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from harness.core.arrays import Floats, freeze
from harness.core.skeleton import Skeleton
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


@dataclass(frozen=True, eq=False)
class Clip:
    """T frames of motion on the skeleton of its recording; world axes x forward, y left, z up."""

    name: str
    """Subject and trial, such as "13_17"; copies of a clip in other formats have the same name."""
    subject: str
    source: str
    """Origin, such as "cmu", "built-in performer" or the name of a folder."""
    behaviour: str
    """What the performer does, such as walking or table_tennis; "" if unknown."""
    skeleton: Skeleton
    rate_hz: float
    root_m: Floats
    """(T, 3) root position [m]."""
    world_from_root: Floats
    """(T, 4) unit quaternion (w, x, y, z)."""
    angles_rad: Floats
    """(T, D) hinge angles in the order of the skeleton [rad]."""
    notes: tuple[str, ...] = field(default=())
    """Remarks for users of the clip, such as glitches and inferred facts."""

    def __post_init__(self) -> None:
        freeze(self, root_m=("T", 3), world_from_root=("T", 4))
        freeze(self, angles_rad=(len(self.root_m), len(self.skeleton.axes)))
        require_rate(self.rate_hz, len(self), self.name)

    def __len__(self) -> int:
        return len(self.root_m)

    @property
    def duration_s(self) -> float:
        return (len(self) - 1) / self.rate_hz


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """T MuJoCo configurations of the body at an even rate. Methods learn from such motions."""

    name: str
    subject: str
    source: str
    behaviour: str
    rate_hz: float
    qpos: Floats
    """(T, 55) root position [m], root quaternion (w, x, y, z), 48 hinge angles [rad]."""

    def __post_init__(self) -> None:
        freeze(self, qpos=("T", "Q"))

    def __len__(self) -> int:
        return len(self.qpos)

    @property
    def duration_s(self) -> float:
        """Time from the first frame to the last one [s]."""
        return (len(self) - 1) / self.rate_hz
