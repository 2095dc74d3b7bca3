"""Statements on one pair of real streams: `validate` beside the estimators of others on the same poses."""

import math
from dataclasses import dataclass

import numpy as np

from harness.bench.foreign import references
from harness.bench.foreign.references import HandEye
from harness.bench.foreign.streams import StreamPair
from harness.bench.limits import hold_to_limit, state_verdict
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.number_format import Interval, format_fixed
from harness.errors import BadInput
from harness.measure import (
    MeasuredPoses,
    PosePairs,
    TruthPoses,
    TruthSpline,
    measure_allan,
    most_likely_hand_eye,
)
from harness.results.findings import BenchmarkStatement
from harness.stream.recording import open_poses
from harness.study.trust.logged_poses import readings_of_poses, truth_of_log
from harness.study.trust.validation import Validation, ValidationOptions, validate_capture

LEAST_MATCHED = 0.6
MOST_OFFSET_MS = 2.0
AGREE_MM, AGREE_DEG = 2.0, 0.3
"""Largest distance of OpenCV's solutions from their median with which they agree."""
MOST_ALLAN = 0.05
_ALLAN_HZ, _ALLAN_TAUS = 10.0, 16.0


@dataclass(frozen=True, eq=False)
class ComparedPair:
    """A validated pair, and the poses that its registration used."""

    name: str
    found: Validation
    station: MeasuredPoses
    truth: TruthPoses


def validate_pair(pair: StreamPair) -> ComparedPair:
    """Validate a pair as `harness validate --least-matched 0.6` does. Raises BadInput that says why it cannot."""
    capture = readings_of_poses(open_poses([pair.capture]))
    truth = truth_of_log(open_poses([pair.truth]).log, capture.stations)
    found = validate_capture(capture, truth, options=ValidationOptions(LEAST_MATCHED))
    station, body = next(iter(found.poses)), next(iter(found.bodies))
    return ComparedPair(pair.name, found, found.poses[station], found.bodies[body])


def pair_statements(pair: StreamPair) -> list[BenchmarkStatement]:
    """All rows of a pair; a pair that is refused has one row with the reason."""
    try:
        compared = validate_pair(pair)
    except BadInput as refused:
        return [state_verdict(f"{pair.name}: refused", "", refused.what, None)]
    return [
        *_offset(compared),
        *_mount(compared),
        *_spread(compared),
        *_clock(compared),
        *_allan(compared),
        *_shares(compared),
    ]


def _offset(pair: ComparedPair) -> list[BenchmarkStatement]:
    found = pair.found.registration.values["time_offset_orientation_s"]
    grid_s = references.search_offset(pair.station, pair.truth, found.value)
    text = f"{pair.name}: offset, from that of the grid search"
    about = f"{found.scaled(1e3, 'ms')}; {format_fixed(1e3 * grid_s, 2)} ms"
    return [hold_to_limit(text, 1e3 * abs(found.value - grid_s), "ms", most=MOST_OFFSET_MS, reference=about)]


def _mount(pair: ComparedPair) -> list[BenchmarkStatement]:
    """The mount with the scale fixed to 1 beside OpenCV's, on the same evenly spaced pairs of poses.

    The residual is the geometric mean of the RMS of positions and of orientations, which the likeliest solution makes
    least where nobody knows the size of both errors.
    """
    pairs = _keyframes(pair)
    station = references.pose_matrices(pairs.position_m, pairs.tracker_from_station)
    body = references.pose_matrices(pairs.body_m, pairs.world_from_body)
    state = most_likely_hand_eye([pairs])
    origin_m = -rotations.rotate(state.tracker_from_world, state.tracker_origin_m)
    ours = HandEye(
        references.pose_matrices(state.mount_m, state.body_from_station)[0],
        references.pose_matrices(origin_m[None], state.tracker_from_world[None])[0],
    )
    theirs = references.opencv_solutions(station, body)
    centre = _median(list(theirs.values()))
    apart = [_distance(one.mount, centre) for one in theirs.values()]
    apart_mm, apart_deg = max(place for place, _ in apart), max(turn for _, turn in apart)
    mine_mm, mine_deg = _distance(ours.mount, centre)
    about = f"{len(theirs)} solvers within {apart_mm:.1f} mm, {apart_deg:.2f} deg"
    if apart_mm <= AGREE_MM and apart_deg <= AGREE_DEG:
        met = mine_mm <= AGREE_MM and mine_deg <= AGREE_DEG
        target = f"<= {AGREE_MM:g} mm, {AGREE_DEG:g} deg"
        text = f"{pair.name}: mount, from OpenCV's median"
        return [state_verdict(text, target, f"{mine_mm:.2f} mm, {mine_deg:.3f} deg", met, about)]
    left = {name: references.hand_eye_residuals(station, body, one) for name, one in theirs.items()}
    best = min(left, key=lambda name: math.prod(left[name]))
    (place_m, turn_rad), (other_m, other_rad) = references.hand_eye_residuals(station, body, ours), left[best]
    figures = f"{1e3 * place_m:.2f} mm {math.degrees(turn_rad):.3f} deg"
    about += f"; {best} {1e3 * other_m:.2f} mm {math.degrees(other_rad):.3f} deg, ours {figures}"
    ratio = math.sqrt(place_m * turn_rad / (other_m * other_rad))
    text = f"{pair.name}: mount, residual / OpenCV's least"
    return [hold_to_limit(text, ratio, "x", most=1.0, reference=about)]


def _keyframes(pair: ComparedPair) -> PosePairs:
    """Evenly spaced pairs of poses of the records that the registration used."""
    registration = pair.found.registration
    errors = next(iter(registration.errors.values()))
    used_s = errors.truth_s[errors.valid & errors.used.all(axis=1)]
    truth_s = registration.state.truth_time_s(pair.station.measured_s)
    near = np.abs(used_s[np.clip(np.searchsorted(used_s, truth_s - 1e-4), 0, len(used_s) - 1)] - truth_s) < 1e-3
    rows = np.flatnonzero(near & pair.station.valid)
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, references.KEYFRAMES).astype(int))]
    body_m, body = TruthSpline(pair.truth).poses(truth_s[rows])
    return PosePairs(pair.station.position_m[rows], pair.station.tracker_from_station[rows], body_m, body)


def _median(solutions: list[HandEye]) -> Floats:
    """(4, 4) median position and mean rotation of mounts, without the farthest rotations."""
    mounts = np.array([one.mount for one in solutions])
    quaternions = rotations.from_matrix(mounts[:, :3, :3])
    angles = rotations.angle_between_rad(quaternions[:, None], quaternions[None])
    middle = quaternions[int(np.argmin(np.sum(angles, axis=1)))]
    out: Floats = references.pose_matrices(np.median(mounts[:, :3, 3], axis=0)[None], middle[None])[0]
    return out


def _distance(mount: Floats, other: Floats) -> tuple[float, float]:
    """Distance [mm] and angle [deg] of two mounts (4, 4)."""
    first, second = rotations.from_matrix(mount[:3, :3]), rotations.from_matrix(other[:3, :3])
    apart_m = float(np.linalg.norm(mount[:3, 3] - other[:3, 3]))
    return 1e3 * apart_m, math.degrees(float(rotations.angle_between_rad(first, second)))


def _spread(pair: ComparedPair) -> list[BenchmarkStatement]:
    """Scale and spread beside those of evo's alignment of the same positions."""
    registration = pair.found.registration
    errors = next(iter(registration.errors.values()))
    used, state = errors.valid & errors.used[:, 0], registration.state
    spline = TruthSpline(pair.truth)
    body_m, body = spline.poses(errors.truth_s[used])
    velocity = spline.motion(errors.truth_s[used])[2]
    expected_m = body_m + state.ahead_s * velocity + rotations.rotate(body, state.mount_m[0])
    modelled_m = (1.0 + state.scale) * rotations.rotate(state.tracker_from_world, expected_m - state.tracker_origin_m)
    scale, rms_m = references.evo_alignment(modelled_m + errors.position_m[used], expected_m)
    turn_rad = errors.rotation_rad[errors.valid & errors.used[:, 1]]
    own_mm = 1e3 * float(np.sqrt(np.mean(np.sum(errors.position_m[used] ** 2, axis=1))))
    own_deg = math.degrees(float(np.sqrt(np.mean(np.sum(turn_rad**2, axis=1)))))
    share = 100.0 * used.sum() / errors.valid.sum()
    spread = f"{own_mm:.1f} mm, {own_deg:.2f} deg, of {share:.1f} % of the positions"
    return [
        _figure(
            f"{pair.name}: scale error",
            registration.values["scale"].scaled(100.0, "%"),
            f"evo {format_fixed(1e2 * scale, 2)} %",
        ),
        state_verdict(
            f"{pair.name}: spread (RMS)", "", spread, None, f"evo {1e3 * rms_m:.1f} mm", value=own_mm, unit="mm"
        ),
    ]


def _figure(text: str, number: Interval, reference: str = "") -> BenchmarkStatement:
    return state_verdict(text, "", str(number), None, reference, value=number.value, unit=number.unit)


def _clock(pair: ComparedPair) -> list[BenchmarkStatement]:
    rate = pair.found.registration.values["clock_ratio_ppm"]
    return [_figure(f"{pair.name}: error of the clock's rate", rate.scaled(1.0, "ppm"))]


def _allan(pair: ComparedPair) -> list[BenchmarkStatement]:
    """Allan deviation of the errors of the position, of the longest stretch without a gap, linearly resampled."""
    errors = next(iter(pair.found.registration.errors.values()))
    time_s, values = errors.truth_s[errors.valid], errors.position_m[errors.valid]
    edges = np.flatnonzero(np.diff(time_s) > 0.5) + 1
    longest = max(np.split(np.arange(len(time_s)), edges), key=lambda rows: time_s[rows[-1]] - time_s[rows[0]])
    grid_s = np.arange(time_s[longest[0]], time_s[longest[-1]], 1.0 / _ALLAN_HZ)
    even = np.stack([np.interp(grid_s, time_s[longest], values[longest, axis]) for axis in range(3)], axis=1)
    found = measure_allan(
        even, np.ones(len(even), bool), _ALLAN_HZ, longest_s=min(len(even) / _ALLAN_HZ / 4.0, _ALLAN_TAUS)
    )
    known = found.pairs > 0
    others = references.allantools_deviation(even, _ALLAN_HZ, found.tau_s[known])
    worst = float(np.max(np.abs(found.deviation[known] / others - 1.0)))
    tau_s, at = found.tau_s[known], int(np.argmin(np.abs(found.tau_s[known] - 1.0)))
    text = f"{pair.name}: Allan deviation, from allantools"
    figures = f"{1e3 * found.deviation[known][at]:.3g} and {1e3 * others[at]:.3g} mm at {tau_s[at]:.2g} s"
    about = f"{figures}, {_ALLAN_HZ:g} Hz"
    return [hold_to_limit(text, round(100.0 * worst, 6), "%", most=100.0 * MOST_ALLAN, reference=about)]


def _shares(pair: ComparedPair) -> list[BenchmarkStatement]:
    registration = pair.found.registration
    place, turn = next(iter(registration.explained.values()))
    return [
        state_verdict(
            f"{pair.name}: variance explained", "",
            f"{format_fixed(1e2 * place, 2)} % of positions, {format_fixed(1e2 * turn, 2)} % of orientations", None,
            f"matched {100.0 * registration.matched:.1f} %, correlation {registration.correlation:.3f}", value=place,
        )
    ]  # fmt: skip
