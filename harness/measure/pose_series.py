"""Poses over time: what a station reports, and the reference motion of the body that carries it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints, freeze
from harness.core.motion import require_seconds
from harness.errors import BadInput

_LONGEST_STEP = 4.0
"""Longest step of a reference that is interpolated, in median steps; a longer one is a gap."""
_FARTHEST_M = 1e9
"""Largest coordinate of a reference [m]; that of an orbit is smaller."""
_SHORTEST_STEP_S = 0.02
"""Steps up to this length are never a gap [s]."""


@dataclass(frozen=True, eq=False)
class MeasuredPoses:
    """N records of one station, in the order of time."""

    measured_s: Floats
    """(N,) time of each measurement by the device's clock [s]; NaN without a stamp."""
    position_m: Floats
    """(N, 3) position in the tracker's frame [m]; NaN where not valid."""
    tracker_from_station: Floats
    """(N, 4) unit quaternions; NaN where not valid."""
    valid: Bools
    """(N,) whether a pose was measured that nothing speaks against."""

    def __post_init__(self) -> None:
        freeze(self, measured_s=("N",))
        count = len(self.measured_s)
        freeze(self, position_m=(count, 3), tracker_from_station=(count, 4))
        freeze(self, np.bool_, valid=(count,))

    def rising_rows(self) -> Ints:
        """Rows of the valid records whose stamps rise."""
        rows = np.flatnonzero(self.valid & np.isfinite(self.measured_s))
        at_s = self.measured_s[rows]
        out: Ints = rows[at_s > np.maximum.accumulate(np.append(-np.inf, at_s))[:-1]]
        return out

    def orientations(self) -> "TruthSpline":
        """Orientations over time, of the valid records whose stamps rise; BadInput with fewer than four of them."""
        rows = self.rising_rows()
        if len(rows) < 4:
            raise BadInput("No pose has a time.", "Send time stamps with the records.")
        turn = self.tracker_from_station[rows]
        return TruthSpline(TruthPoses(self.measured_s[rows], np.zeros((len(rows), 3)), turn))


@dataclass(frozen=True, eq=False)
class TruthPoses:
    """M reference poses of one body, in the order of time; NaN where the reference has none."""

    time_s: Floats
    """(M,) time by the reference's clock [s]; rises."""
    position_m: Floats
    """(M, 3) position of the body's origin in the world [m]."""
    world_from_body: Floats
    """(M, 4) unit quaternions."""

    def __post_init__(self) -> None:
        freeze(self, time_s=("M",))
        freeze(self, position_m=(len(self.time_s), 3), world_from_body=(len(self.time_s), 4))
        if not np.all(np.diff(self.time_s) > 0.0):
            raise BadInput("Times of the reference do not rise.", "Sort its poses by time.")
        require_seconds(self.time_s, "The reference")
        if np.any(np.abs(self.position_m) > _FARTHEST_M):
            raise BadInput(
                f"A position of the reference is farther than {_FARTHEST_M:g} m.", "Give metres; repair that row."
            )


class TruthSpline:
    """A reference between its poses: cubic splines of positions and of quaternions, which are then normalised.

    BadInput with fewer than four poses.
    """

    def __init__(self, truth: TruthPoses) -> None:
        from scipy.interpolate import CubicSpline

        known = np.isfinite(truth.position_m).all(axis=1) & np.isfinite(truth.world_from_body).all(axis=1)
        if known.sum() < 4:
            raise BadInput(f"The reference has {known.sum()} pose(s) of a body.", "It needs at least four.")
        self.time_s: Floats = truth.time_s[known]
        step_s = np.diff(self.time_s)
        self._gap: Bools = step_s > max(_LONGEST_STEP * float(np.median(step_s)), _SHORTEST_STEP_S)
        values = np.concatenate([truth.position_m[known], rotations.continuous(truth.world_from_body[known])], axis=1)
        self._spline = CubicSpline(self.time_s, values)
        self._slope = self._spline.derivative()

    def covers(self, time_s: Floats) -> Bools:
        """(N,) whether the reference has poses around each time."""
        piece = np.clip(np.searchsorted(self.time_s, time_s, side="right") - 1, 0, len(self._gap) - 1)
        inside = (time_s >= self.time_s[0]) & (time_s <= self.time_s[-1])
        out: Bools = inside & ~self._gap[piece]
        return out

    def poses(self, time_s: Floats) -> tuple[Floats, Floats]:
        """Positions (N, 3) [m] and `world_from_body` (N, 4)."""
        values = self._spline(time_s)
        quaternion = values[:, 3:]
        return values[:, :3], quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)

    def motion(self, time_s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Positions [m], `world_from_body` (N, 4), velocities [m/s] and angular velocities in the body's axes [rad/s].

        All but the quaternions are (N, 3), in the world's axes.
        """
        values, slopes = self._spline(time_s), self._slope(time_s)
        length = np.linalg.norm(values[:, 3:], axis=1, keepdims=True)
        turn = values[:, 3:] / length
        # The slope along the quaternion changes its length only; conj(q) q' has it in the scalar part.
        omega = 2.0 * rotations.multiply(rotations.inverse(turn), slopes[:, 3:])[:, 1:] / length
        return values[:, :3], turn, slopes[:, :3], omega


def require_pairs(
    stations: Mapping[str, MeasuredPoses], truths: Mapping[str, TruthPoses], pairs: Mapping[str, str]
) -> None:
    """Raise BadInput unless each pair names a station and a body."""
    for station, body in pairs.items():
        if station not in stations:
            raise BadInput(f"The capture has no station {station!r}.", f"It has {', '.join(stations)}.")
        if body not in truths:
            raise BadInput(f"The reference has no body {body!r}.", f"It has {', '.join(truths)}.")
    if not pairs:
        raise BadInput("No station has a body in the reference.", "Name the body of each station.")
