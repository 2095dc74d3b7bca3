"""Timed poses of rigid bodies, as another program wrote them.

A pose log has no period and no even rate: samples come when the source wrote them. It has a clock of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.core.arrays import Bools, Floats, freeze
from harness.errors import BadInput, UnknownName

_NORM_TOLERANCE = 1e-6
COUNTED = "counted at"
"""Words in the clock of a log whose source has no times, before the rate that somebody stated."""


@dataclass(frozen=True, slots=True)
class FileFinding:
    """What was concluded about a file, and why."""

    subject: str
    """What the finding is about, such as "quaternion order"."""
    value: str
    """The conclusion, such as "x, y, z, w"."""
    reason: str
    """The evidence for it, one clause."""
    assumed: bool = False
    """Whether the file shows no evidence, so that the value is an assumption."""

    def __str__(self) -> str:
        return f"{self.subject}: {self.value} ({'assumed: ' if self.assumed else ''}{self.reason})"


@dataclass(frozen=True, slots=True, eq=False)
class BodyPoses:
    """The N poses of one rigid body, N at least 1. Raises ShapeError or BadInput for arrays that are no such poses."""

    name: str
    times_s: Floats
    """(N,) time of each pose since the first time of the log [s]; strictly increasing, not evenly spaced."""
    positions_m: Floats
    """(N, 3) origin of the body in the world of the log [m]; finite."""
    quaternions: Floats
    """(N, 4) rotation world_from_body, unit quaternions (w, x, y, z); q and -q are the same, and signs may change."""

    def __post_init__(self) -> None:
        freeze(self, times_s=("N",), positions_m=("N", 3), quaternions=("N", 4))
        finite = all(np.isfinite(values).all() for values in (self.times_s, self.positions_m, self.quaternions))
        if not len(self.times_s) or not finite:
            raise BadInput(f"Body {self.name!r}: no poses, or numbers that are not finite.", "Leave such rows out.")
        if (np.diff(self.times_s) <= 0.0).any():
            raise BadInput(f"Body {self.name!r}: times that do not increase.", "Sort the poses and leave doubles out.")
        if (np.abs(np.linalg.norm(self.quaternions, axis=1) - 1.0) > _NORM_TOLERANCE).any():
            raise BadInput(f"Body {self.name!r}: quaternions with another norm than 1.", "Normalise them.")

    @property
    def repeats(self) -> Bools:
        """(N,) whether a pose has exactly the numbers of the one before: the source had no new one."""
        poses = np.concatenate([self.positions_m, self.quaternions], axis=1)
        return np.append(False, (np.diff(poses, axis=0) == 0.0).all(axis=1))


@dataclass(frozen=True, slots=True)
class PoseLog:
    """Poses of one or more bodies in one world and on one clock; the least time of its bodies is 0."""

    bodies: tuple[BodyPoses, ...]
    source: str
    """Where the poses come from, such as a file's name."""
    findings: tuple[FileFinding, ...] = ()
    """What was concluded about the source, in the order in which it was concluded."""
    clock: str = "seconds from an unknown start"
    """What the times count, in words."""
    start_unix_s: float | None = None
    """Unix time of time 0 [s]; None where the source does not tell."""
    start_s: float = 0.0
    """The source's own time of time 0 [s]; by it, files of one clock are related."""

    def __post_init__(self) -> None:
        if not self.bodies or len(set(self.names)) < len(self.bodies):
            raise BadInput(f"{self.source}: no bodies, or two of one name.", "Give each body a name of its own.")
        if min(body.times_s[0] for body in self.bodies) != 0.0:
            raise BadInput(f"{self.source}: the first time is not 0.", "Subtract it from all times.")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies."""
        return tuple(body.name for body in self.bodies)

    @property
    def is_counted(self) -> bool:
        """Whether the source has no times: the samples were counted at a stated rate, which nothing measures."""
        return COUNTED in self.clock

    @property
    def duration_s(self) -> float:
        """Time of the last pose [s]."""
        return max(float(body.times_s[-1]) for body in self.bodies)

    def body(self, name: str) -> BodyPoses:
        """The poses of a body. Raises UnknownName."""
        for body in self.bodies:
            if body.name == name:
                return body
        raise UnknownName("body", name, self.names)

    def select(self, names: Sequence[str]) -> "PoseLog":
        """The log of some bodies, whose first pose is at time 0. Raises UnknownName."""
        bodies = [self.body(name) for name in names]
        begin_s = min(float(body.times_s[0]) for body in bodies)
        shifted = tuple(replace(body, times_s=body.times_s - begin_s) for body in bodies)
        start_s = None if self.start_unix_s is None else self.start_unix_s + begin_s
        return replace(self, bodies=shifted, start_unix_s=start_s, start_s=self.start_s + begin_s)
