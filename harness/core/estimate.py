"""The estimate that a reconstructor returns at one step: a pose, its uncertainty, and the frame that it answers."""

import operator
import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Any, TypeVar

import numpy as np

from harness.core.arrays import Bools, Floats, Ints, freeze

LOST_AFTER_S = 0.5
"""Time without enough readings after which an estimate is LOST, and without any after which a station is [s]."""
LOST_AFTER_ADVICE = f"Leave it out: an estimate is LOST after {LOST_AFTER_S:g} s."
"""For `RENAMED_KEYS` of methods, where it was an option."""
QPOS_SIZE = 55
"""Size of a configuration of the body."""
HINGE_COUNT = QPOS_SIZE - 7
"""Number of hinge angles in it."""
MAX_POSE_VALUE, MIN_QUATERNION = 1e6, 1e-6
"""Values of poses [m, rad] from the first on, and sums of a quaternion's absolute values up to the second, are no
pose [choice]."""
MIN_SIGMA_RAD = float(np.finfo(np.float32).tiny)
"""Smallest standard deviation: single precision, as results store it, holds no smaller one in full [rad]."""
SIGMA_FREEDOM = 3
"""Degrees of freedom of Student's t that errors of hinge angles have about a stated standard deviation [choice]. Tails
of postures of other performers are heavier than a normal distribution's."""
HALF_WIDTH_95 = 2.6589
"""Half width of the stated 95 % region, in stated standard deviations: the ratio of the quantiles 0.975 and 0.8413 of
Student's t with `SIGMA_FREEDOM` degrees of freedom."""
_ROOT_QUATERNION = slice(3, 7)
_Choice = TypeVar("_Choice", bound=IntEnum)


class Status(IntEnum):
    """How much an estimate depends on present readings."""

    SOLVED = 0
    HELD = 1
    """There were too few readings; the pose is extrapolated from earlier ones."""
    LOST = 2
    """For more than `LOST_AFTER_S` fewer than half of the configured stations had readings."""


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

    Every answer of a method becomes one (`as_estimate`), so that what follows can rely on it. NaN, infinity and a
    quaternion of zeros mean that there is no pose; the frame is not scored.

    Raises ShapeError for another size than (55,) and for another number of standard deviations than hinges. Raises
    TypeError for values that are no real numbers. Raises ValueError for a pose of impossible values
    (`find_impossible_pose`), an unknown status or origin, a standard deviation that is not positive or out of range,
    and a negative lag.
    """

    qpos: Floats
    """(55,) root position [m], root quaternion (w, x, y, z), 48 hinge angles [rad]."""
    status: Status
    origin: Origin = Origin.MODEL
    """Part of the method that computed the pose. Tables print the share of frames that are not from the model."""
    angle_sigma_rad: Floats | None = None
    """(48,) standard deviation of the error of each hinge angle [rad], in the order of `qpos`; None where a method
    gives none. All estimates of a session have it, or none has. It is the half width that holds 68.3 % of the errors;
    `HALF_WIDTH_95` times as much holds 95 %."""
    lag: int = 0
    """Number of received frames between the frame that the estimate answers and that of the step. Pose, status and
    standard deviations are those of the answered frame. See `reconstruct.contract.Session`."""

    def __post_init__(self) -> None:
        _refuse_other_kinds(self.qpos, "pose")
        freeze(self, qpos=(QPOS_SIZE,))
        size = np.abs(self.qpos)
        if not (size.max() < MAX_POSE_VALUE and size[_ROOT_QUATERNION].sum() > MIN_QUATERNION) and (
            fault := find_impossible_pose(self.qpos[None])
        ):
            raise ValueError(f"the method answered with {fault}")
        object.__setattr__(self, "status", _member(Status, self.status))
        object.__setattr__(self, "origin", _member(Origin, self.origin))
        object.__setattr__(self, "lag", operator.index(self.lag))
        if self.lag < 0:
            raise ValueError(f"a lag of {self.lag} frames; an estimate answers a frame that was received")
        if self.angle_sigma_rad is not None:
            _refuse_other_kinds(self.angle_sigma_rad, "standard deviation")
            freeze(self, angle_sigma_rad=(len(self.qpos) - 7,))
            check_sigma(self.angle_sigma_rad)


def as_estimate(answer: Any) -> Estimate:
    """A copy of what a method answered, which may be an object of its own; see `Estimate` for what is refused.

    AttributeError when it has no `qpos` or no `status`.
    """
    optional = {name: getattr(answer, name) for name in ("origin", "angle_sigma_rad", "lag") if hasattr(answer, name)}
    return Estimate(answer.qpos, answer.status, **optional)


def has_pose(qpos: Floats) -> Bools:
    """(F,) whether configurations (F, 55) are poses: finite, with a quaternion other than zero."""
    out: Bools = np.isfinite(qpos).all(axis=1) & (qpos[:, _ROOT_QUATERNION] != 0.0).any(axis=1)
    return out


def find_impossible_pose(qpos: Floats) -> str:
    """What no pose among configurations (F, 55) can have, such as an angle of 1e17 rad; "" if there is nothing.

    Rows without a pose (`has_pose`) count as possible.
    """
    poses = qpos[has_pose(qpos)]
    large = np.argwhere(np.abs(poses) >= MAX_POSE_VALUE)
    if len(large):
        row, column = large[0]
        return f"{poses[row, column]:g} at place {column} of a pose; values [m, rad] must be below {MAX_POSE_VALUE:g}"
    small = poses[np.abs(poses[:, _ROOT_QUATERNION]).sum(axis=1) <= MIN_QUATERNION]
    return f"a root quaternion of {small[0, _ROOT_QUATERNION]}, which is none" if len(small) else ""


def _member(choices: type[_Choice], value: Any) -> _Choice:
    """The member with a value; ValueError for another value, and for a member of another enumeration."""
    if isinstance(value, bool) or (isinstance(value, Enum) and not isinstance(value, choices)):
        raise ValueError(f"{value!r} is no {choices.__name__}")
    return choices(value)


def _refuse_other_kinds(values: Any, name: str) -> None:
    """TypeError unless values are integers or floats."""
    if (kind := np.asanyarray(values).dtype).kind not in "fiu":
        raise TypeError(f"the method answered with a {name} of type {kind}, expected real numbers")


def check_sigma(angle_sigma_rad: Floats) -> None:
    """ValueError unless standard deviations (..., 48) [rad] are positive and in range; it names the first hinge."""
    wrong = np.argwhere(~((angle_sigma_rad >= MIN_SIGMA_RAD) & (angle_sigma_rad < MAX_POSE_VALUE)))  # NaN is neither
    if len(wrong):
        found = f"the standard deviation of hinge {wrong[0][-1]} is {angle_sigma_rad[tuple(wrong[0])]:g} rad"
        raise ValueError(f"{found}; it must be above 0, at least {MIN_SIGMA_RAD:.3g}, and below {MAX_POSE_VALUE:g}")


def mean_region_deg(angle_sigma_rad: Floats) -> Floats:
    """Half width of the stated 95 % region [deg], mean over hinges, of standard deviations (..., 48) [rad]."""
    out: Floats = np.rad2deg(HALF_WIDTH_95 * np.mean(angle_sigma_rad, axis=-1))
    return out


def answer_lag(answer: Any) -> int:
    """Lag of what a method answered [frames], which may be an object of its own; 0 where it has none."""
    return int(getattr(answer, "lag", 0))


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
