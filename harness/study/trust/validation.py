"""Validation of a capture against a reference: registration, accuracy, latency, and departures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import Interval, format_fixed
from harness.core.progress import ProgressCallback
from harness.errors import BadInput, NotComparable
from harness.experiment import Evaluation, evaluate_each, registered_take
from harness.measure import (
    MeasuredPoses,
    Registration,
    StationResiduals,
    TruthPoses,
    UnitFile,
    identify_stations,
    register_poses,
    require_stamps,
    same_directions,
)
from harness.measure.reports import (
    CaptureSummary,
    Departure,
    StationAccuracy,
    ValidationReport,
    compare_with_expected,
    error_quantiles,
    estimated_poses,
    residual_series,
)
from harness.stream.polhemus.codec import BITS_PER_BYTE, WireFormat, record_size
from harness.stream.recording import StationReadings
from harness.study.trust.capture_readings import CaptureReadings, measured_poses
from harness.study.trust.characterization import correct_departures, preset_components, preset_values
from harness.study.trust.logged_poses import describe_doubts
from harness.study.trust.truth_motion import TruthMotion

SCORED_METRICS = ("joint_angle_mean_deg", "mpjpe_mm", "root_position_mm", "jitter_m_s3")
"""Errors of methods that a validated capture states."""
SESSION_KEYS = ("scale", "heading_rad", "latency_s")
"""Numbers that hold for a session of the device; a unit file keeps them in [session]."""
_DEFAULT_LATENCY_S, _DEFAULT_BAUD = 0.004, 115200
"""Latency and baud rate of the simulated tracker (`simulate.link.TrackerConfig`)."""
_MOST_LEFT_OUT = 0.15
"""Share of a station's readings that excursions and echoes are left out for at most [choice]."""
_NO_HOST_CLOCK = "reference not on the host's clock"


_NO_VERTICAL = "nothing says which axis of a pose log is vertical"


@dataclass(frozen=True)
class ValidationOptions:
    """What a user allows and knows about a capture and its reference."""

    least_matched: float = 0.95
    """Smallest share of the records due that must have a reference."""
    truth_noise: tuple[float, float] | None = None
    """Standard deviations of the reference's positions [m] and rotations [rad] on each axis; None where unknown."""


@dataclass(frozen=True, eq=False)
class Validation:
    """What a reference shows of a capture."""

    capture: CaptureReadings
    truth: TruthMotion
    poses: Mapping[str, MeasuredPoses]
    """Station -> the poses that were registered, inverted where the capture holds body-from-world poses."""
    bodies: Mapping[str, TruthPoses]
    """Body -> its reference, likewise."""
    registration: Registration
    exchanged: Mapping[str, str]
    """Station -> body that carries it, where that is not the stated one."""
    report: ValidationReport
    """All that the page of the capture shows."""

    @property
    def named(self) -> tuple[Departure, ...]:
        """The departures that are significant after the correction."""
        return tuple(check for check in self.report.checks if check.is_named)


def validate_capture(
    capture: CaptureReadings,
    truth: TruthMotion,
    *,
    expected: UnitFile | None = None,
    options: ValidationOptions = ValidationOptions(),
    progress: ProgressCallback = lambda step, done, planned: None,
) -> Validation:
    """Register a capture with its reference and compare the result with the preset or an earlier unit file.

    BadInput and NotComparable as `register_poses`, and for a station that the reference does not carry.
    """
    readings, wire = capture.readings, capture.wire
    poses, unseen = _comparable_poses(capture, truth)
    progress("registration", 1, 3)
    bodies: Mapping[str, TruthPoses] = truth.bodies
    directions: tuple[str, ...] = ()
    try:
        if wire is None and truth.log:
            named = {station: truth.body_of[station] for station in poses}
            poses, bodies, directions = same_directions(poses, truth.bodies, named)
        pairs, exchanged = _identify(poses, replace(truth, bodies=bodies))
        registration = register_poses(
            poses,
            bodies,
            pairs=pairs,
            least_matched=options.least_matched,
            plain=wire is None,
            truth_noise=dict.fromkeys(bodies, options.truth_noise) if options.truth_noise else truth.noise,
        )
    except BadInput as error:
        raise type(error)(error.what, error.advice + describe_doubts(capture.log, truth.log)) from error
    progress("accuracy", 2, 3)
    numbers = {
        "time_offset_orientation_s": registration.values["time_offset_orientation_s"],
        "time_offset_position_s": registration.values["time_offset_position_s"],
        "components.speed.ahead_s": registration.values["position_ahead_s"],
        "components.clock.drift_ppm": registration.values["clock_ratio_ppm"],
        "scale": registration.values["scale"],
        "heading_rad": registration.values["heading_rad"] if wire else Interval.missing(_NO_VERTICAL),
        "latency_s": _latency_s(readings, registration, truth),
    }
    accuracy = {}
    for station, errors in registration.errors.items():
        accuracy[station] = StationAccuracy(
            error_quantiles(errors.position_m, errors.valid, errors.period_s),
            error_quantiles(errors.rotation_rad, errors.valid, errors.period_s),
            int(errors.valid.sum()),
            float(np.mean(readings[station].quality == 0.0)),
        )
    checks = _checks(numbers, registration, truth, pairs, expected, wire)
    due = round(registration.overlap_s * capture.rate_hz)
    progress("", 3, 3)
    report = ValidationReport(
        name=capture.path.stem,
        capture=CaptureSummary(
            capture.path.name, capture.duration_s, capture.stations, capture.rate_hz, damage=capture.damage
        ),
        truth=truth.title,
        matched_frames=round(registration.matched * due),
        expected_frames=due,
        expected_from=expected.name if expected else "the preset default",
        numbers=numbers,
        poses=estimated_poses(registration),
        accuracy=accuracy,
        checks=tuple(correct_departures(checks)),
        residuals=residual_series(registration),
        exchanged=tuple(
            f"{station} is on {body}, not on {truth.body_of[station]}: stations are exchanged."
            for station, body in exchanged.items()
        ),
        notes=(
            *capture.left_out,
            *unseen,
            *directions,
            *_describe_clocks(capture, truth, registration),
            *(describe_explained(registration) if wire is None else ()),
            *describe_left_out(registration.errors),
            *_describe_rival(registration),
            *truth.notes,
            "Errors are those after the registration: constant errors of room and mounts are in its numbers.",
        ),
    )
    return Validation(capture, truth, poses, bodies, registration, exchanged, report)


def _describe_rival(registration: Registration) -> tuple[str, ...]:
    """A sentence on another time offset that fits the angular speeds as well."""
    if registration.rival_s is None:
        return ()
    return (
        f"The motion repeats: a time offset of {format_fixed(registration.rival_s, 2)} s fits the angular speeds as "
        "well. That with the longest overlap was taken.",
    )


def _comparable_poses(capture: CaptureReadings, truth: TruthMotion) -> tuple[dict[str, MeasuredPoses], tuple[str, ...]]:
    """The poses of the stations that the reference carries, and a sentence on those that were never seen.

    BadInput for stations without a body or without time stamps; NotComparable without a pose.
    """
    poses = {station: measured_poses(one) for station, one in capture.readings.items() if station in truth.body_of}
    absent = ", ".join(station for station in capture.readings if station not in poses)
    if not poses:
        raise BadInput(
            f"No station of {capture.path.name} is in the reference.",
            f"The capture has {', '.join(capture.readings)}; the reference carries {', '.join(truth.body_of)}.",
        )
    require_stamps(poses)
    seen = {station: one for station, one in poses.items() if one.valid.any()}
    if not seen:
        raise NotComparable(f"No station of {capture.path.name} has a pose.", "Record positions and orientations.")
    unseen = ", ".join(station for station in poses if station not in seen)
    notes = [f"{unseen}: no pose in the whole capture; left out."] if unseen else []
    notes += [f"{absent}: no such body in the reference; left out."] if absent else []
    return seen, tuple(notes)


def _describe_clocks(capture: CaptureReadings, truth: TruthMotion, registration: Registration) -> tuple[str, ...]:
    """The offset between Unix times, where both logs have them."""
    start_s, other_s = capture.note.get("start_unix_s"), truth.log and truth.log.start_unix_s
    if start_s is None or other_s is None:
        return ()
    offset_s = registration.values["time_offset_orientation_s"].value + start_s - other_s
    return (
        f"By their Unix times the capture is {format_fixed(1e3 * offset_s, 1, grouped=True)} ms late, by orientation.",
    )


def describe_explained(registration: Registration) -> tuple[str, ...]:
    """A sentence for each station on the share of its motion that the registration explains."""
    return tuple(
        f"{station}: room, mount, scale and clocks explain {format_fixed(1e2 * place, 2)} % of the variance of the "
        f"positions and {format_fixed(1e2 * turn, 2)} % of that of the orientations."
        for station, (place, turn) in registration.explained.items()
    )


def describe_left_out(errors: Mapping[str, StationResiduals]) -> tuple[str, ...]:
    """A sentence for each station of which the registration left out more readings than a tracker's errors explain."""
    shares = {station: 1.0 - one.used[one.valid].mean(axis=0) for station, one in errors.items() if one.valid.any()}
    return tuple(
        f"{station}: {100.0 * place:.0f} % of the positions and {100.0 * turn:.0f} % of the orientations lie far from "
        "the others and were left out. Likely causes: long excursions, or a reference that stood still or lost frames."
        for station, (place, turn) in shares.items()
        if max(place, turn) > _MOST_LEFT_OUT
    )


def evaluate_registered(
    found: Validation,
    methods: Sequence[str],
    progress: ProgressCallback = lambda step, done, planned: None,
) -> list[Evaluation]:
    """Evaluate methods on the frames of the capture with the registered room and mounts, on the performer's body.

    BadInput where the reference has no performer or no frame is inside it; else as `evaluate_each`.
    """
    capture, playback = found.capture, found.truth.playback
    if playback is None:
        raise BadInput(f"{found.truth.title} has no performer.", "Methods are scored on a clip.")
    take = registered_take(capture.frames(), found.registration, playback, capture.rate_hz, found.truth.loop_s)
    return evaluate_each(methods, take, metrics=SCORED_METRICS, progress=progress)


def session_unit(found: Validation, base: UnitFile | None, name: str) -> UnitFile:
    """A unit file that also holds what the reference showed: speed error, and the session's scale and latency."""
    wire = found.capture.wire
    tracker = {"rate_hz": found.capture.rate_hz} | ({"items": list(wire.items)} if wire else {})
    start = base or UnitFile(name, preset_components(), tracker)
    components = {key: dict(table) for key, table in start.components.items()}
    measured, not_measured = dict(start.measured), dict(start.not_measured)
    for key in ("components.speed.ahead_s", "components.clock.drift_ppm"):
        number = found.report.numbers[key]
        if number.is_measured and not (key in measured and "clock" in key):  # a longer capture knows the clock better
            _, component, field = key.split(".")
            components[component][field] = number.value
            measured[key] = number
            not_measured.pop(key, None)
    session = {key: found.report.numbers[key] for key in SESSION_KEYS}
    return replace(
        start,
        components=components,
        measured=measured,
        not_measured=not_measured,
        session={key: one for key, one in session.items() if one.is_measured},
    )


def _identify(poses: Mapping[str, MeasuredPoses], truth: TruthMotion) -> tuple[dict[str, str], dict[str, str]]:
    """The body of each station, and those that are not the stated ones."""
    stated = {station: truth.body_of[station] for station in poses}
    found = identify_stations(poses, truth.bodies, stated)
    return found, {station: body for station, body in found.items() if body != stated[station]}


def _latency_s(readings: Mapping[str, StationReadings], registration: Registration, truth: TruthMotion) -> Interval:
    """Median time from the sample to the reception of its record."""
    if not truth.host_clock:
        return Interval.missing(_NO_HOST_CLOCK)
    delays = []
    for station in registration.mounts:
        known = np.isfinite(readings[station].measured_s)
        at_s = registration.state.truth_time_s(readings[station].measured_s[known])
        delays.append(readings[station].received_s[known] - at_s)
    middle = float(np.median(np.concatenate(delays)))
    offset = registration.values["time_offset_orientation_s"]
    half = 0.5 * (offset.high - offset.low)
    return Interval(middle, middle - half, middle + half, offset.count)


def _checks(
    numbers: Mapping[str, Interval],
    registration: Registration,
    truth: TruthMotion,
    pairs: Mapping[str, str],
    expected: UnitFile | None,
    wire: WireFormat | None,
) -> list[Departure]:
    if truth.is_tracker or (wire is None and expected is None):
        return []
    preset = preset_components()
    record_s = record_size(wire.items) * BITS_PER_BYTE / _DEFAULT_BAUD if wire else 0.0
    of_preset = {
        "components.speed.ahead_s": preset_values()["components.speed.ahead_s"],
        "components.clock.drift_ppm": preset_values()["components.clock.drift_ppm"],
        "scale": Interval.normal(0.0, preset["session"]["scale"]),
        "heading_rad": Interval.normal(0.0, 0.0),
        "latency_s": Interval.normal(_DEFAULT_LATENCY_S + record_s, 0.0),
    }
    known = of_preset if wire else {}
    if expected is not None:
        known |= {key: one for key, one in {**expected.measured, **expected.session}.items() if key in of_preset}
    checks = [
        compare_with_expected(key, "", numbers[key], one) for key, one in known.items() if numbers[key].is_measured
    ]
    for station in registration.mounts:
        if station in truth.nominal and pairs[station] == truth.body_of[station]:
            checks += _mount_checks(registration, truth, station, preset["session"]["station_offset_m"])
    return checks


def _mount_checks(registration: Registration, truth: TruthMotion, station: str, offset_m: float) -> list[Departure]:
    """Rotation and displacement of a station from its nominal mount, by chi-square with three degrees of freedom."""
    mount, nominal = registration.mounts[station], truth.nominal[station]
    exact = Interval(0.0, 0.0, 0.0)
    vector = np.array([one.value for one in mount.turn_from(nominal.body_from_station)])
    moved_m = mount.position_m - nominal.position_m
    spread = mount.covariance[3:, 3:] + offset_m**2 * np.eye(3)  # the origin in the housing is known to a millimetre
    return [
        Departure(
            "mount_turn_rad", station, mount.angle_from(nominal.body_from_station), exact,
            _chi_square_p(vector, mount.covariance[:3, :3]),
        ),
        Departure(
            "mount_shift_m", station, mount.distance_from(nominal.position_m), exact,
            _chi_square_p(moved_m, spread),
        ),
    ]  # fmt: skip


def _chi_square_p(vector: Floats, covariance: Floats) -> float:
    from scipy import special

    return float(special.chdtrc(3.0, float(vector @ np.linalg.solve(covariance, vector))))
