"""Profile of a pose log: what the poses of another program show of their source without a reference."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.number_format import Interval
from harness.core.progress import ProgressCallback
from harness.errors import BadInput
from harness.measure.episode_fit import EpisodeFit
from harness.measure.gauss_markov import NOISE_KEYS
from harness.measure.log_series import PAUSE_S, EvenSeries, even_series, neighbour_noise
from harness.measure.noise_fit import NoiseFit
from harness.measure.profile import (
    STATIC_CORRELATIONS,
    Bar,
    CollectedReadings,
    UnitProfile,
    fit_rest,
    require_pair,
    without_rest,
)
from harness.measure.sampling import LOST_STEP, describe_sampling, mean_period_s
from harness.measure.timing import TIMING_KEYS, TimingMeasurement, count_share
from harness.stream import FEWEST_POSES, BodyPoses, PoseLog
from harness.stream.recording import StationReadings

_MOST_REPEATS = 0.5
"""Share of repeats from which on they show the resolution of a body at rest, and are kept [choice]."""
_NO_REST = "No body rests for 10 s."
_NO_MARKED_REST = "No body rests for 10 s in a stretch that is marked static, or not marked."
_NO_HOST = "A file of poses has no clock of a host."
_EVEN = "All steps are equal, and do not show it."


def measure_log_profile(
    log: PoseLog,
    marks: Sequence[tuple[float, str]] = (),
    *,
    bar: Bar | None = None,
    progress: ProgressCallback = lambda step, done, planned: None,
) -> UnitProfile:
    """Measure the source of a pose log, at rest or moving.

    Noise and episodes are those of rests, at an even rate. A moving body shows its timing, and a bound of its noise.
    `marks` are the times [s] at which stretches begin, and their names; rests count as in a device's capture.
    BadInput for bodies of `bar` that are not in it, and without a body of 20 poses.
    """
    require_pair(bar, log.names)
    bodies = [body for body in log.bodies if len(body.times_s) >= FEWEST_POSES]
    if not bodies:
        raise BadInput(f"{log.source} has no body with {FEWEST_POSES} poses.", "Record for longer.")
    repeats = {body.name: body.repeats for body in bodies}
    kept = {name: ~same if same.mean() < _MOST_REPEATS else np.ones(len(same), bool) for name, same in repeats.items()}
    series = {body.name: even_series(body, kept[body.name]) for body in bodies}
    counted = log.clock if log.is_counted else ""
    rate_hz = round(1.0 / mean_period_s([body.times_s for body in bodies]), 3)
    collected = CollectedReadings(rate_hz, bar)
    raw = {body.name: StationReadings.of_body(body).select(kept[body.name]) for body in bodies}
    begins_s = np.array([0.0, *(at_s for at_s, _ in marks)])
    ends_s = np.append(begins_s[1:], np.inf)
    for begin_s, end_s, stretch in zip(begins_s, ends_s, ["", *(name for _, name in marks)], strict=True):
        if records := sum(int(np.sum((b.times_s >= begin_s) & (b.times_s < end_s))) for b in bodies):
            collected.add_length(stretch, min(end_s, log.duration_s) - begin_s, records)
        collected.add_motion(stretch, {name: _between(one, begin_s, end_s) for name, one in raw.items()})
        for name, even in series.items():
            for part in even.parts:
                collected.add_rest(stretch, name, _between(part, begin_s, end_s), even.rate_hz)
    unseen = [body.name for body in log.bodies if body not in bodies]
    notes = [f"{name}: fewer than {FEWEST_POSES} poses, not measured." for name in unseen]
    for body in bodies:
        notes += _describe(body, kept[body.name], series[body.name], counted)
    noise, episodes = _fit(collected, _NO_MARKED_REST if marks else _NO_REST, notes, progress)
    return UnitProfile(
        tuple(body.name for body in bodies),
        rate_hz,
        (),
        {"source": "poses"},
        collected.stretches(),
        (),
        0,
        _timing(bodies, repeats, log.start_unix_s or 0.0, f"The source has no times: {counted}." if counted else ""),
        noise,
        episodes,
        (),
        collected.rigid_pair(),
        tuple(collected.places),
        (*notes, *collected.limits()),
    )


def _fit(
    collected: CollectedReadings, reason: str, notes: list[str], progress: ProgressCallback
) -> tuple[NoiseFit, EpisodeFit]:
    """Noise and episodes of the rests; missing without one for a reason, and where rests are too short."""
    if collected.rest:
        try:
            noise, episodes = fit_rest(collected.rest, progress)
        except BadInput as short:
            reason = short.what
        else:
            correlation = noise.all_stations["components.drift.correlation_s"]
            longest_s = max(one.duration_s for one in collected.rest)
            drifts = any(noise.all_stations[key].low > 0.0 for key in NOISE_KEYS if "drift" in key)
            if drifts and longest_s < STATIC_CORRELATIONS * correlation.value:
                notes.append(
                    f"Errors are correlated over {correlation.value:.3g} s; the longest rest of {longest_s:.3g} s is "
                    f"shorter than {STATIC_CORRELATIONS:g} times that: rest for longer."
                )
            return noise, episodes
    return without_rest(reason)


def _between(readings: StationReadings, begin_s: float, end_s: float) -> StationReadings:
    return readings.select((readings.measured_s >= begin_s) & (readings.measured_s < end_s))


def _describe(body: BodyPoses, kept: Bools, series: EvenSeries, counted: str) -> list[str]:
    """How the poses of a body come, what was left out for an even rate, and the scatter of neighbours."""
    out = [describe_sampling(body.name, body.times_s, counted)]
    if not kept.all():
        out.append(
            f"{body.name}: {100.0 * np.mean(~kept):.1f} % of the poses repeat the one before, and were left out."
        )
    if series.left_out > 0.0:
        out.append(
            f"{body.name}: noise at rest is that of the nearest poses at an even {series.rate_hz:.3g} Hz, without "
            f"{100.0 * series.left_out:.1f} % of the poses."
        )
    place_m, turn_rad = neighbour_noise(body, kept)
    if math.isfinite(place_m):
        out.append(
            f"{body.name}: from one pose to the next scatter is {1e3 * place_m:.3g} mm and "
            f"{math.degrees(turn_rad):.3g} deg on each axis, fast motion included."
        )
    return out


def _timing(bodies: list[BodyPoses], repeats: Mapping[str, Bools], start_s: float, untimed: str) -> TimingMeasurement:
    """The timing of the bodies, of each and together; `untimed` is the reason why times show nothing, or "".

    `start_s` is the file's time at time 0: near Unix times, 64-bit numbers are 0.2 us apart.
    """
    rounding_s = float(np.spacing(start_s + max(body.times_s[-1] for body in bodies)))
    by_station = {body.name: _numbers([body], repeats, rounding_s, untimed) for body in bodies}
    resolution_s = min(_resolution_s(body.times_s, rounding_s) for body in bodies)
    together = _numbers(bodies, repeats, rounding_s, untimed)
    even = together["timing.jitter_s"].value == 0.0
    together["timing.stamp_resolution_s"] = (
        Interval.missing(untimed or _EVEN)
        if untimed or even
        else Interval(resolution_s, resolution_s, resolution_s, len(bodies))
    )
    missing = Interval.missing(_NO_HOST)
    return TimingMeasurement({key: together.get(key, missing) for key in TIMING_KEYS}, by_station, resolution_s)


def _numbers(
    bodies: list[BodyPoses], repeats: Mapping[str, Bools], rounding_s: float, untimed: str
) -> dict[str, Interval]:
    """Rate of a body, standard deviation of its steps, lost and repeated poses, over bodies of one source."""
    steps = [step_s[step_s < PAUSE_S] for body in bodies for step_s in [np.diff(body.times_s)]]
    singles = [step_s[step_s < LOST_STEP * np.median(step_s)] for step_s in steps]
    due = [float(np.sum(all_s) / np.mean(one_s)) for all_s, one_s in zip(steps, singles, strict=True)]
    lost = sum(max(round(one) - len(step_s), 0) for one, step_s in zip(due, steps, strict=True))
    count = sum(map(len, singles))
    period_s = mean_period_s([body.times_s for body in bodies])
    twice = sum(int(repeats[body.name].sum()) for body in bodies)
    duplicates = count_share(twice, sum(len(body.times_s) for body in bodies))
    if untimed:
        timed = ("timing.rate_hz", "timing.jitter_s", "timing.lost_share")
        return {**dict.fromkeys(timed, Interval.missing(untimed)), "timing.duplicate_share": duplicates}
    jitter_s = float(np.sqrt(np.mean(np.concatenate([one - one.mean() for one in singles]) ** 2)))
    if jitter_s <= rounding_s:
        jitter_s = 0.0
    doubt = jitter_s / math.sqrt(count) / period_s
    return {
        "timing.rate_hz": Interval.normal(1.0 / period_s, doubt / period_s, count),
        "timing.jitter_s": Interval.normal(jitter_s, jitter_s / math.sqrt(2.0 * count), count, least=0.0),
        "timing.lost_share": count_share(lost, lost + sum(map(len, steps))),
        "timing.duplicate_share": duplicates,
    }


def _resolution_s(time_s: Floats, rounding_s: float) -> float:
    """The largest power of ten that divides every step of rising times (N,) [s], down to a nanosecond.

    `rounding_s` is the distance of the source's times as 64-bit numbers.
    """
    for digits in range(0, 9):
        ticks = np.diff(time_s) * 10.0**digits
        if np.abs(ticks - np.rint(ticks)).max() < 1e-3 + 2.0 * rounding_s * 10.0**digits:
            return float(10.0**-digits)
    return 1e-9
