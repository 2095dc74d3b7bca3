"""Registration of the poses of a capture with those of a reference, and what speaks against it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from harness.core.arrays import Floats
from harness.errors import BadInput, NotComparable
from harness.measure.angular_speed import coarse_offset
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
from harness.measure.handeye import PosePairs, solve_trimmed
from harness.measure.pose_series import MeasuredPoses, TruthPoses, TruthSpline, require_pairs
from harness.measure.reference_noise import correct_for_reference
from harness.measure.registration import Registration, make_registration
from harness.measure.registration_fit import FittedRegistration, fit_registration
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
from harness.measure.sampling import mean_period_s
from harness.measure.station_grid import StationGrid, make_grids

LEAST_MATCHED = 0.95
"""Smallest share of the records due in the overlap that must have a pose, and the reference at their time."""
LEAST_CORRELATION = 0.65
"""Smallest correlation of angular speeds with which motion counts as the reference's."""
_OF_IT = "of it"
MOST_DEVIATION = {"m": 0.05, "rad": float(np.deg2rad(10.0)), "s": 0.05, _OF_IT: 0.1}
"""Largest standard deviation by unit; a parameter with a larger one is not observable."""
_PLAIN_DEVIATIONS = 3.0
"""Factor of `MOST_DEVIATION` for sources of unknown noise, whose deviations contain Student's t [choice]."""


def register_poses(
    stations: Mapping[str, MeasuredPoses],
    truths: Mapping[str, TruthPoses],
    *,
    pairs: Mapping[str, str] | None = None,
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
    coarse = coarse_offset(chosen, splines)
    if not coarse.correlation >= LEAST_CORRELATION:
        raise BadInput(
            f"Angular speeds of capture and reference correlate by {coarse.correlation:.2f} at best.",
            "The motion is not the reference's, or stations are on other bodies than stated.",
        )
    grids, matched, overlap_s, middle_s = make_grids(chosen, splines, period_s, coarse, least_matched)
    each = list(grids.values())
    start = _start(each, list(splines.values()), coarse.offset_s, middle_s)
    kept = (HEADING,) if plain else ()
    fit = fit_registration(each, list(splines.values()), start, kept, plain=plain)
    if truth_noise:
        noise = [truth_noise.get(body, (0.0, 0.0)) for body in named.values()]
        fit = correct_for_reference(fit, each, [truths[body] for body in named.values()], noise, kept, plain=plain)
    require_orientations([rest[grid.known, 3:] for rest, grid in zip(fit.residuals, each, strict=True)])
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
    return make_registration(named, grids, fit, coarse, overlap_s, matched)


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


def _start(
    grids: Sequence[StationGrid], splines: Sequence[TruthSpline], offset_s: float, middle_s: float
) -> RegistrationState:
    """Closed-form room and mounts at the coarse offset."""
    paired = []
    for grid, spline in zip(grids, splines, strict=True):
        body_m, body = spline.poses(grid.measured_s[grid.known] - offset_s)
        paired.append(PosePairs(grid.position_m[grid.known], grid.turn[grid.known], body_m, body))
    require_same_hand([one.position_m for one in paired], [one.body_m for one in paired])
    return replace(solve_trimmed(paired), reference_s=middle_s, offset_s=offset_s)


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
