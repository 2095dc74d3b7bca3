"""The estimate that a reconstructor returns at one step: a pose, its uncertainty, and the frame that it answers."""

import operator
import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from harness.core.arrays import Floats, Ints, freeze


class Status(IntEnum):
    """How much an estimate depends on present readings."""

    SOLVED = 0
    HELD = 1
    """There were too few readings; the pose is extrapolated from earlier ones."""
    LOST = 2
    """For more than 0.5 s fewer than half of the configured stations had readings."""


class Origin(IntEnum):
    """Which part of a method computed an estimate."""

    MODEL = 0
    """The method's own model, from readings of this frame."""
    FALLBACK = 1
    """A simpler solution instead of the model, such as inverse kinematics while there is no history yet."""
    BRIDGED = 2
    """No reading of this frame: the last pose again, or an extrapolation."""


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """One pose of the body, its status and its origin, in the form that is posed, rendered, exported and scored.

    Raises ShapeError for a pose that is no vector and for another number of standard deviations than hinges. Raises
    ValueError for an unknown status or origin, a standard deviation that is not finite and positive, and a negative
    lag.
    """

    qpos: Floats
    """(55,) root position [m], root quaternion (w, x, y, z), 48 hinge angles [rad]."""
    status: Status
    origin: Origin = Origin.MODEL
    """Part of the method that computed the pose. Tables print the share of frames that are not from the model."""
    angle_sigma_rad: Floats | None = None
    """(48,) standard deviation of the error of each hinge angle [rad], in the order of `qpos`; None where a method
    gives none. All estimates of a session have it, or none has."""
    lag: int = 0
    """Number of received frames between the frame that the estimate answers and that of the step. Pose, status and
    standard deviations are those of the answered frame. See `reconstruct.contract.Session`."""

    def __post_init__(self) -> None:
        freeze(self, qpos=("Q",))
        object.__setattr__(self, "status", Status(self.status))
        object.__setattr__(self, "origin", Origin(self.origin))
        object.__setattr__(self, "lag", operator.index(self.lag))
        if self.lag < 0:
            raise ValueError(f"a lag of {self.lag} frames; an estimate answers a frame that was received")
        if self.angle_sigma_rad is not None:
            freeze(self, angle_sigma_rad=(len(self.qpos) - 7,))
            check_sigma(self.angle_sigma_rad)


def check_sigma(angle_sigma_rad: Floats) -> None:
    """ValueError unless standard deviations (..., 48) [rad] are finite and positive; it names the first hinge."""
    if not (angle_sigma_rad.min(initial=1.0) > 0.0 and angle_sigma_rad.max(initial=0.0) < np.inf):  # NaN fails both
        wrong = np.argwhere(~(np.isfinite(angle_sigma_rad) & (angle_sigma_rad > 0.0)))
        value = angle_sigma_rad[tuple(wrong[0])]
        raise ValueError(f"the standard deviation of hinge {wrong[0][-1]} is {value:g} rad; it must be above 0")


def session_lag(lags: Sequence[int] | Ints) -> int:
    """The lag L of a session [frames] from the lags (F,) of all its estimates; 0 without estimates.

    ValueError unless the n-th estimate has the lag min(n, L), as `reconstruct.contract.Session` requires.
    """
    found = np.asarray(lags, dtype=np.int64)
    lag = int(found[-1]) if len(found) else 0
    expected = np.minimum(np.arange(len(found)), lag)
    wrong = np.flatnonzero(found != expected)
    if len(wrong):
        n = int(wrong[0])
        raise ValueError(
            f"the lag at step {n} is {found[n]} frames and at the last step {lag}; it must be {expected[n]}"
        )
    return lag


def name_with_lag(name: str, lag: int) -> str:
    """Name of a method in tables, with its lag [frames] unless the name already states it, as in `m[lag=2]`."""
    stated = re.search(rf"\blag={lag}\b", name)
    return name if lag == 0 or stated else f"{name} (lag {lag})"
