"""What relates a capture to its reference: clocks, room, scale, heading error, and the mount of each station."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, freeze
from harness.core.number_format import CHI_QUANTILE, NORMAL_QUANTILE, Interval
from harness.measure.angular_speed import TimeOffset
from harness.measure.gauss_markov import ErrorProcess
from harness.measure.registration_fit import FittedRegistration
from harness.measure.registration_model import (
    AHEAD,
    CLOCK,
    HEADING,
    OFFSET,
    OWN,
    ROOM_ORIGIN,
    SCALE,
    SHARED,
    RegistrationState,
)
from harness.measure.station_grid import StationGrid


@dataclass(frozen=True, eq=False)
class MountFit:
    """Mount of one station on its body, as the device reports it."""

    station: str
    body: str
    position_m: Floats
    """(3,) origin of the station in the frame of its body [m]."""
    body_from_station: Floats
    """(4,) unit quaternion."""
    covariance: Floats
    """(6, 6) of a small rotation in the body's axes [rad], then of the position [m]."""
    blocks: int
    """Number of independent blocks of time."""

    def __post_init__(self) -> None:
        freeze(self, position_m=(3,), body_from_station=(4,), covariance=(6, 6))

    def position(self, axis: int) -> Interval:
        """Position on one axis of the body [m]."""
        return Interval.normal(
            float(self.position_m[axis]), float(np.sqrt(self.covariance[3 + axis, 3 + axis])), self.blocks
        )

    def turn_from(self, nominal: Floats) -> tuple[Interval, Interval, Interval]:
        """Rotation vector from a nominal orientation (4,) to the measured one, in the body's axes [rad]."""
        return _intervals(_vector(self.body_from_station, nominal), self.covariance[:3, :3], self.blocks)

    def angle_from(self, nominal: Floats) -> Interval:
        """Angle between a nominal orientation (4,) and the measured one [rad].

        The interval is 95 % for a vector of three errors, so that it contains zero in 95 % of exact mounts.
        """
        return _length(_vector(self.body_from_station, nominal), self.covariance[:3, :3], self.blocks)

    def distance_from(self, nominal_m: Floats) -> Interval:
        """Distance of the measured position from a nominal one (3,) [m]; the interval as for `angle_from`."""
        return _length(self.position_m - nominal_m, self.covariance[3:, 3:], self.blocks)


@dataclass(frozen=True, eq=False)
class StationResiduals:
    """What remains of N readings of a station after registration; a grid of its records in time."""

    period_s: float
    """Step of the grid [s]; more places than records where the records are uneven."""
    truth_s: Floats
    """(N,) time of the reference's clock, by the offset of orientation [s]."""
    position_m: Floats
    """(N, 3) reported minus modelled position, tracker's axes [m]."""
    rotation_rad: Floats
    """(N, 3) rotation vector from modelled to reported orientation, tracker's axes [rad]."""
    valid: Bools
    """(N,) whether there is a reading; the others are zero."""
    used: Bools
    """(N, 2) whether the registration used position and orientation."""
    noise: tuple[ErrorProcess, ErrorProcess, ErrorProcess]
    """White and Gauss-Markov noise of position [m], pitch and roll [rad], and yaw [rad]."""

    def __post_init__(self) -> None:
        freeze(self, truth_s=("N",))
        count = len(self.truth_s)
        freeze(self, position_m=(count, 3), rotation_rad=(count, 3))
        freeze(self, np.bool_, valid=(count,), used=(count, 2))


@dataclass(frozen=True, eq=False)
class Registration:
    """Everything that relates a capture to its reference, with 95 % intervals."""

    values: Mapping[str, Interval]
    """By key, all stations together:

    - `time_offset_orientation_s`, `time_offset_position_s`: device's clock minus reference's clock at `reference_s`, by
      which orientations and positions agree; a late stream has a positive one.
    - `position_ahead_s`: the first minus the second; `components.speed.ahead_s`.
    - `clock_ratio_ppm`: rate error of the device's clock, positive runs fast; `components.clock.drift_ppm`.
    - `scale`: relative error of positions about the tracker's origin.
    - `heading_rad`: orientations turned about the tracker's vertical, relative to positions.
    - `tracker_origin_m.0` to `.2`: origin of the tracker's frame in the world.
    """
    mounts: Mapping[str, MountFit]
    errors: Mapping[str, StationResiduals]
    explained: Mapping[str, tuple[float, float]]
    """Station -> shares of the variance of its positions and orientations that the model explains, up to 1."""
    world_from_tracker: Floats
    """(4,) unit quaternion."""
    tracker_origin_m: Floats
    """(3,) origin of the tracker's frame in the world [m]."""
    room_covariance: Floats
    """(6, 6) of a small rotation in the tracker's axes [rad], then of the origin in the world [m]."""
    state: RegistrationState
    """Estimates of all parameters, from which device times are mapped to those of the reference."""
    correlation: float
    """Correlation of angular speeds at the time offset."""
    rival_s: float | None
    """Another time offset at which they correlate as well, because the motion repeats [s]; None without one."""
    overlap_s: float
    """Time that capture and reference have in common [s]."""
    matched: float
    """Share of the records due in the overlap that have a pose and a reference."""
    blocks: int

    def __post_init__(self) -> None:
        freeze(self, world_from_tracker=(4,), tracker_origin_m=(3,), room_covariance=(6, 6))

    @property
    def reference_s(self) -> float:
        """Time of the reference's clock at which the offsets hold [s]: the middle of the overlap.

        For a source of unknown noise it is the time at which the offset is known best.
        """
        return self.state.reference_s

    def room_point(self, point_m: Floats) -> tuple[Interval, Interval, Interval]:
        """World coordinates of a point (3,) given in the tracker's frame, without the scale error [m]."""
        at_m = rotations.rotate(self.world_from_tracker, point_m)
        turn = rotations.to_matrix(self.world_from_tracker) @ rotations.cross_matrix(point_m)
        slope = np.concatenate([turn, np.eye(3)], axis=1)
        return _intervals(self.tracker_origin_m + at_m, slope @ self.room_covariance @ slope.T, self.blocks)


def make_registration(
    pairs: Mapping[str, str],
    grids: Mapping[str, StationGrid],
    fit: FittedRegistration,
    coarse: TimeOffset,
    overlap_s: float,
    matched: float,
) -> Registration:
    """The registration of the stations of `pairs` with their bodies that a fit found."""
    state, covariance, blocks = fit.state, fit.covariance, fit.blocks
    deviation = np.sqrt(np.diag(covariance))

    def measured(value: float, index: int, unit: float = 1.0) -> Interval:
        return Interval.normal(unit * value, unit * float(deviation[index]), blocks)

    both = [OFFSET, AHEAD]
    position_s = float(np.sqrt(np.array([1.0, -1.0]) @ covariance[np.ix_(both, both)] @ np.array([1.0, -1.0])))
    values = {
        "time_offset_orientation_s": measured(state.offset_s, OFFSET),
        "time_offset_position_s": Interval.normal(state.offset_s - state.ahead_s, position_s, blocks),
        "position_ahead_s": measured(state.ahead_s, AHEAD),
        "clock_ratio_ppm": measured(state.clock_ratio, CLOCK, 1e6),
        "scale": measured(state.scale, SCALE),
        "heading_rad": measured(state.heading_rad, HEADING),
        **{
            f"tracker_origin_m.{axis}": measured(float(state.tracker_origin_m[axis]), ROOM_ORIGIN.start + axis)
            for axis in range(3)
        },
    }
    mounts, errors, explained = {}, {}, {}
    for s, (station, body) in enumerate(pairs.items()):
        own = slice(SHARED + OWN * s, SHARED + OWN * (s + 1))
        mounts[station] = MountFit(
            station, body, state.mount_m[s], state.body_from_station[s], covariance[own, own], blocks
        )
        grid, residual = grids[station], fit.residuals[s]
        truth_s = state.truth_time_s(grid.measured_s)
        errors[station] = StationResiduals(
            grid.period_s, truth_s, residual[:, :3], residual[:, 3:], grid.known, fit.used[s], fit.noise[s]
        )
        explained[station] = _explained(grid, residual)
    room = slice(0, ROOM_ORIGIN.stop)
    return Registration(
        values, mounts, errors, explained, rotations.inverse(state.tracker_from_world), state.tracker_origin_m,
        covariance[room, room], state, coarse.correlation, coarse.rival_s, overlap_s, matched, blocks,
    )  # fmt: skip


def _explained(grid: StationGrid, residual: Floats) -> tuple[float, float]:
    """Shares of the variance of positions and orientations that are not in residuals (N, 6)."""
    place, turn, rest = grid.position_m[grid.known], grid.turn[grid.known], residual[grid.known]
    middle = rotations.inverse(rotations.mean_rotation(turn))
    parts = (place - place.mean(axis=0), rest[:, :3]), (rotations.log(rotations.multiply(turn, middle)), rest[:, 3:])
    first, second = (1.0 - float(np.sum(left**2) / max(np.sum(total**2), 1e-300)) for total, left in parts)
    return first, second


def _vector(measured: Floats, nominal: Floats) -> Floats:
    """Rotation vector (3,) of a left factor that takes the nominal rotation to the measured one [rad]."""
    return rotations.log(rotations.multiply(measured, rotations.inverse(nominal)))


def _intervals(vector: Floats, covariance: Floats, blocks: int) -> tuple[Interval, Interval, Interval]:
    """The numbers of a vector (3,) by themselves."""
    deviation = np.sqrt(np.diag(covariance))
    x, y, z = (Interval.normal(float(value), float(one), blocks) for value, one in zip(vector, deviation, strict=True))
    return x, y, z


def _length(vector: Floats, covariance: Floats, blocks: int) -> Interval:
    """Length of a vector (3,) with an interval for three errors: the quantile of chi with three degrees of freedom."""
    length = float(np.linalg.norm(vector))
    largest = float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
    along = vector / length if length > 0.0 else np.zeros(3)
    deviation = float(np.sqrt(along @ covariance @ along)) if length > 3.0 * largest else largest
    return Interval.normal(length, deviation * CHI_QUANTILE / NORMAL_QUANTILE, blocks, least=0.0)
