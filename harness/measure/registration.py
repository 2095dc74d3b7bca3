"""Registration of a capture with a reference: clocks, room, scale, heading error, and the mount of each station."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, freeze
from harness.core.number_format import CHI_QUANTILE, NORMAL_QUANTILE, Interval
from harness.errors import BadInput, NotComparable
from harness.measure.angular_speed import LEAST_OVERLAP_S, TimeOffset, coarse_offset
from harness.measure.conventions import (
    MOST_CLOCK_ERROR,
    MOST_PLACE_M,
    MOST_PLAIN_CLOCK_ERROR,
    require_clock,
    require_orientations,
    require_positions,
    require_same_hand,
    require_scale,
)
from harness.measure.gauss_markov import ErrorProcess
from harness.measure.handeye import PosePairs, solve_trimmed
from harness.measure.pose_series import MeasuredPoses, TruthPoses, TruthSpline, require_pairs
from harness.measure.reference_noise import correct_for_reference
from harness.measure.registration_fit import FittedRegistration, StationGrid, fit_registration
from harness.measure.registration_model import (
    AHEAD,
    CLOCK,
    HEADING,
    OFFSET,
    OWN,
    ROOM_ORIGIN,
    ROOM_TURN,
    SCALE,
    SHARED,
    RegistrationState,
)
from harness.measure.sampling import mean_period_s, own_places_s

LEAST_MATCHED = 0.95
"""Smallest share of the records due in the overlap that must have a pose, and the reference at their time."""
LEAST_CORRELATION = 0.65
"""Smallest correlation of angular speeds with which motion counts as the reference's."""
_OF_IT = "of it"
MOST_DEVIATION = {"m": 0.05, "rad": float(np.deg2rad(10.0)), "s": 0.05, _OF_IT: 0.1}
"""Largest standard deviation by unit; a parameter with a larger one is not observable."""
_PLAIN_DEVIATIONS = 3.0
"""Factor of `MOST_DEVIATION` for sources of unknown noise, whose deviations contain Student's t [choice]."""


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
        return _turns(self.body_from_station, nominal, self.covariance[:3, :3], self.blocks)

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
        deviation = np.sqrt(np.diag(slope @ self.room_covariance @ slope.T))
        x, y, z = (
            Interval.normal(float(value), float(one), self.blocks)
            for value, one in zip(self.tracker_origin_m + at_m, deviation, strict=True)
        )
        return x, y, z


def register_poses(
    stations: Mapping[str, MeasuredPoses],
    truths: Mapping[str, TruthPoses],
    *,
    pairs: Mapping[str, str] | None = None,
    least_overlap_s: float = LEAST_OVERLAP_S,
    least_matched: float = LEAST_MATCHED,
    truth_noise: Mapping[str, tuple[float, float]] | None = None,
    plain: bool = False,
) -> Registration:
    """Register stations with the reference motion of the bodies that carry them.

    `pairs` names the body of each station; by default stations and bodies with the same name. `truth_noise` holds the
    standard deviations of the positions [m] and rotations [rad] of bodies, which enter the intervals. `plain` is for
    sources of unknown noise (`registration_fit`), of which nothing says which axis is vertical: they have no heading
    error. BadInput without stamps, for another motion, and for other axes or units of the reference. NotComparable for
    little overlap, few matched records and motion about one axis; it names what is not observable.
    """
    named = dict(pairs) if pairs is not None else {name: name for name in stations if name in truths}
    require_pairs(stations, truths, named)
    splines = {station: TruthSpline(truths[body]) for station, body in named.items()}
    chosen = {station: stations[station] for station in named}
    require_stamps(chosen)
    period_s = mean_period_s([station.measured_s for station in chosen.values()])
    coarse = coarse_offset(chosen, splines, least_overlap_s)
    if not coarse.correlation >= LEAST_CORRELATION:
        raise BadInput(
            f"Angular speeds of capture and reference correlate by {coarse.correlation:.2f} at best.",
            "The motion is not the reference's, or stations are on other bodies than stated.",
        )
    grids, matched, overlap_s, middle_s = _make_grids(chosen, splines, period_s, coarse, least_matched)
    start = _start(grids, list(splines.values()), coarse.offset_s, middle_s)
    kept = (HEADING,) if plain else ()
    fit = fit_registration(list(grids.values()), list(splines.values()), start, kept, plain=plain)
    if truth_noise:
        noise = [truth_noise.get(body, (0.0, 0.0)) for body in named.values()]
        fit = correct_for_reference(
            fit, list(grids.values()), [truths[body] for body in named.values()], noise, kept, plain=plain
        )
    require_orientations([rest[grid.known, 3:] for rest, grid in zip(fit.residuals, grids.values(), strict=True)])
    factor = 1.0 + fit.state.scale
    places_m = {name: rest[used[:, 0], :3] for rest, used, name in zip(fit.residuals, fit.used, grids, strict=True)}
    extent_m = max(_extent_m(truths[body].position_m) for body in named.values())
    if extent_m > MOST_PLACE_M:
        known = np.sqrt(fit.covariance[HEADING, HEADING]) <= MOST_DEVIATION["rad"]
        require_positions(places_m, factor, fit.state.heading_rad if known else 0.0, extent_m if plain else 0.0)
    if np.sqrt(fit.covariance[SCALE, SCALE]) <= MOST_DEVIATION[_OF_IT] * abs(factor):
        require_scale(factor)  # first, because the limits below are in metres
    _require_observable(fit, list(named), _PLAIN_DEVIATIONS if plain else 1.0)
    most = MOST_PLAIN_CLOCK_ERROR if plain else MOST_CLOCK_ERROR
    require_clock(fit.state.clock_ratio, float(np.sqrt(fit.covariance[CLOCK, CLOCK])), most)
    return _result(named, grids, fit, coarse, overlap_s, matched)


def _extent_m(position_m: Floats) -> float:
    """RMS distance of positions (N, 3) from their mean [m]; rows of NaN do not count."""
    return float(np.sqrt(np.nansum(np.nanvar(position_m, axis=0))))


def require_stamps(stations: Mapping[str, MeasuredPoses]) -> None:
    """Raise BadInput unless the records of each station have times, two or more."""
    for name, station in stations.items():
        if len(station.measured_s) == 1:
            raise BadInput(f"Station {name!r} has one pose.", "Record for longer.")
        if np.isfinite(station.measured_s).sum() < 2:
            raise BadInput(
                f"Records of station {name!r} have no time stamps.",
                "Time offset and clock ratio are not observable without stamps. Switch them on in the device.",
            )


def _make_grids(
    stations: Mapping[str, MeasuredPoses],
    splines: Mapping[str, TruthSpline],
    period_s: float,
    coarse: TimeOffset,
    least_matched: float,
) -> tuple[dict[str, StationGrid], float, float, float]:
    """Grids of all stations, the share of matched records, the overlap [s] and its middle [s]."""
    begins, ends = [], []
    for name, station in stations.items():
        at_s = station.measured_s[np.isfinite(station.measured_s)] - coarse.offset_s
        begins += [float(at_s.min()), float(splines[name].time_s[0])]
        ends += [float(at_s.max()), float(splines[name].time_s[-1])]
    begin_s, end_s = max(begins), min(ends)
    step_s = own_places_s([station.measured_s[station.valid] for station in stations.values()], period_s)
    grids = {
        name: _make_grid(station, splines[name], step_s, coarse.offset_s, begin_s, end_s)
        for name, station in stations.items()
    }
    due = len(grids) * max((end_s - begin_s) / period_s, 1.0)
    matched = min(sum(int(grid.known.sum()) for grid in grids.values()) / due, 1.0)
    if matched < least_matched:
        raise NotComparable(
            f"{100.0 * matched:.1f} % of the records due in the overlap have a pose and a reference.",
            f"At least {100.0 * least_matched:g} % must match; look for gaps in both recordings, or accept fewer "
            "(--least-matched 0.6).",
        )
    return grids, matched, end_s - begin_s, 0.5 * (begin_s + end_s)


def _make_grid(
    station: MeasuredPoses, spline: TruthSpline, period_s: float, offset_s: float, begin_s: float, end_s: float
) -> StationGrid:
    margin_s = 2.0 * period_s  # the refined offset must not leave the reference
    at_s = station.measured_s - offset_s
    known = station.valid & np.isfinite(at_s) & (at_s >= begin_s + margin_s) & (at_s <= end_s - margin_s)
    known &= np.isfinite(station.position_m).all(axis=1) & np.isfinite(station.tracker_from_station).all(axis=1)
    rows = np.flatnonzero(known)
    rows = rows[spline.covers(at_s[rows] - margin_s) & spline.covers(at_s[rows] + margin_s)]
    count = int((end_s - begin_s) / period_s) + 2
    place = np.clip(np.round((at_s[rows] - begin_s) / period_s).astype(np.int64), 0, count - 1)
    measured_s = begin_s + offset_s + period_s * np.arange(count, dtype=np.float64)
    position_m, turn = np.zeros((count, 3)), np.tile(rotations.IDENTITY, (count, 1))
    filled = np.zeros(count, bool)
    measured_s[place], position_m[place], filled[place] = station.measured_s[rows], station.position_m[rows], True
    turn[place] = station.tracker_from_station[rows]
    return StationGrid(period_s, measured_s, position_m, turn, filled)


def _start(
    grids: Mapping[str, StationGrid], splines: list[TruthSpline], offset_s: float, middle_s: float
) -> RegistrationState:
    """Closed-form room and mounts at the coarse offset."""
    paired = []
    for grid, spline in zip(grids.values(), splines, strict=True):
        body_m, body = spline.poses(grid.measured_s[grid.known] - offset_s)
        paired.append(PosePairs(grid.position_m[grid.known], grid.turn[grid.known], body_m, body))
    require_same_hand([one.position_m for one in paired], [one.body_m for one in paired])
    return replace(solve_trimmed(paired, with_scale=False), reference_s=middle_s, offset_s=offset_s)


def _require_observable(fit: FittedRegistration, stations: list[str], factor: float) -> None:
    deviation = np.sqrt(np.diag(fit.covariance))
    checks = [
        ("the room's rotation", "rad", deviation[ROOM_TURN]),
        ("the tracker's origin", "m", deviation[ROOM_ORIGIN]),
        ("the scale", _OF_IT, deviation[[SCALE]] / max(abs(1.0 + fit.state.scale), 1e-9)),
        ("the heading error", "rad", deviation[[HEADING]]),
        ("the time offset of orientations", "s", deviation[[OFFSET]]),
        ("the time offset of positions", "s", deviation[[AHEAD]]),
    ]
    for s, name in enumerate(stations):
        own = deviation[SHARED + OWN * s : SHARED + OWN * (s + 1)]
        checks += [(f"the rotation of {name} on its body", "rad", own[:3])]
        checks += [(f"the position of {name} on its body", "m", own[3:])]
    for what, unit, values in checks:
        worst = float(np.max(values))
        if not worst <= factor * MOST_DEVIATION[unit]:
            raise NotComparable(
                f"Not observable from this motion: {what} (standard deviation {worst:.2g} {unit}).",
                "Turn every body about two axes and move through the room.",
            )


def _result(
    pairs: Mapping[str, str],
    grids: Mapping[str, StationGrid],
    fit: FittedRegistration,
    coarse: TimeOffset,
    overlap_s: float,
    matched: float,
) -> Registration:
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


def _turns(measured: Floats, nominal: Floats, covariance: Floats, blocks: int) -> tuple[Interval, Interval, Interval]:
    vector, deviation = _vector(measured, nominal), np.sqrt(np.diag(covariance))
    x, y, z = (Interval.normal(float(value), float(one), blocks) for value, one in zip(vector, deviation, strict=True))
    return x, y, z


def _length(vector: Floats, covariance: Floats, blocks: int) -> Interval:
    """Length of a vector (3,) with an interval for three errors: the quantile of chi with three degrees of freedom."""
    length = float(np.linalg.norm(vector))
    largest = float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
    along = vector / length if length > 0.0 else np.zeros(3)
    deviation = float(np.sqrt(along @ covariance @ along)) if length > 3.0 * largest else largest
    return Interval.normal(length, deviation * CHI_QUANTILE / NORMAL_QUANTILE, blocks, least=0.0)
