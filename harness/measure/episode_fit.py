"""Parameters of echoes, excursions and gaps from stations at rest, each with its interval.

The rate of excursions is corrected by injection and recovery: excursions of known number are added to what is left of
the capture without its own ones, and the same detector counts them. Some are missed, and near ones are confused.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.number_format import NORMAL_QUANTILE, Interval
from harness.core.seeds import generator
from harness.measure.episode_distributions import episode_share, fit_length, fit_uniform
from harness.measure.excursions import (
    RAMP_S,
    ExcursionDetector,
    ExcursionEvent,
    Innovations,
)
from harness.measure.gaps_and_echoes import (
    EchoBursts,
    Gaps,
    echo_limit_m,
    find_echoes,
    find_gaps_at_rest,
    leaked_tilt_rad,
)
from harness.measure.gauss_markov import ErrorProcess
from harness.measure.static_series import StaticSeries

EXCURSION_RATE = "components.excursion.onsets_per_min"
_INJECTED = 200
"""Least number of excursions that are injected, if the capture has any."""
_MOST_ROUNDS = 3
_APART_S = 1.5
"""Time to the nearest other excursion from which on size and duration of an excursion are certain [s]."""
_BEFORE_S, _AFTER_S = 0.2, 0.6
"""Samples around an excursion that the noise fit leaves out [s]."""
_NONE_SEEN = 3.689
"""Upper end of the 95 % interval of the expected number of events of which none was seen (Garwood 1936)."""
_STRAYS = 0.003
"""Share of episodes that are expected to be confused with others although they seem alone."""
_ECHO_ERROR_M = 0.001
"""Error of the size of an echo [m]: that of the undisturbed place between the readings around it."""
_STAY_ERROR_S = 0.012
"""Error of the duration of an excursion [s]; seen on simulated captures with seeds that no table judges."""


@dataclass(frozen=True, eq=False)
class SeriesEpisodes:
    """What was found in one series."""

    series: StaticSeries
    echoes: EchoBursts
    gaps: Gaps
    excursions: tuple[ExcursionEvent, ...]
    disturbed: Bools
    """(N,) samples that show more than noise and drift."""


@dataclass(frozen=True, eq=False)
class EpisodeFit:
    """Episodes of all series, and the parameters behind them."""

    parameters: Mapping[str, Interval]
    """Dotted key of a scenario -> number."""
    means: Mapping[str, Interval]
    """Key without an index -> mean of a distribution of which the parameters are the ends."""
    by_station: Mapping[str, Mapping[str, Interval]]
    """Station -> rate of excursions, share of echoes and share of losses, by the same keys."""
    found: tuple[SeriesEpisodes, ...]


def find_disturbances(
    series: Sequence[StaticSeries], noise: ErrorProcess
) -> tuple[list[SeriesEpisodes], list[Innovations]]:
    """Find the episodes of each series among noise of this size, and what the search for excursions leaves."""
    limit_m = echo_limit_m(noise.white, noise.drift, noise.correlation_s)
    detectors = {one.rate_hz: ExcursionDetector(one.rate_hz, noise) for one in series}
    out, residuals = [], []
    for one in series:
        echoes, gaps = find_echoes(one, limit_m), find_gaps_at_rest(one)
        left_out = echoes.mask(len(one)) | gaps.coasting
        detector = detectors[one.rate_hz]
        events, residual = detector.search(detector.innovations(one, left_out), one.station)
        disturbed = left_out | gaps.lost
        for event in events:
            first = int((event.begin_s - _BEFORE_S) * one.rate_hz)
            last = int((event.begin_s + event.stay_s + RAMP_S + _AFTER_S) * one.rate_hz)
            disturbed[max(first, 0) : max(last, 0)] = True
        out.append(SeriesEpisodes(one, echoes, gaps, tuple(events), disturbed))
        residuals.append(residual)
    return out, residuals


def fit_episodes(series: Sequence[StaticSeries], noise: ErrorProcess) -> EpisodeFit:
    """Find the episodes of stations at rest and fit their parameters."""
    found, residuals = find_disturbances(series, noise)
    parameters, means = _fit_echoes(found)
    gap_parameters, gap_means = _fit_gaps(found, noise)
    excursion_parameters, excursion_means = _fit_excursions(found, residuals, noise)
    burst, gap = (_longest(found, name) for name in ("echoes", "gaps"))
    by_station = {}
    for station in dict.fromkeys(one.series.station for one in found):
        own = [one for one in found if one.series.station == station]
        by_station[station] = {
            EXCURSION_RATE: _station_rate(own, excursion_parameters[EXCURSION_RATE], found),
            "components.echo.share": _echo_share(own, burst),
            "components.dropout.share": _lost_share(own, gap),
        }
    return EpisodeFit(
        {**excursion_parameters, **parameters, **gap_parameters},
        {**excursion_means, **means, **gap_means},
        by_station,
        tuple(found),
    )


def _longest(found: Sequence[SeriesEpisodes], name: str) -> float:
    """Length of the longest episode of all stations, in samples; 1 without any."""
    lengths = np.concatenate([getattr(one, name).end - getattr(one, name).begin for one in found])
    return float(lengths.max(initial=1))


def _fit_echoes(found: Sequence[SeriesEpisodes]) -> tuple[dict[str, Interval], dict[str, Interval]]:
    lengths = np.concatenate([(one.echoes.end - one.echoes.begin)[one.echoes.whole] for one in found])
    sizes_m = np.concatenate([one.echoes.size_m[one.echoes.whole] for one in found])
    low, high, mean_m = fit_uniform(sizes_m, _ECHO_ERROR_M, strays=_STRAYS)
    fewest, most, mean_records = _integer_ends(lengths)
    parameters = {
        "components.echo.share": _echo_share(found),
        "components.echo.burst_records.0": fewest,
        "components.echo.burst_records.1": most,
        "components.echo.size_m.0": low,
        "components.echo.size_m.1": high,
    }
    return parameters, {"components.echo.burst_records": mean_records, "components.echo.size_m": mean_m}


def _integer_ends(values: Floats) -> tuple[Interval, Interval, Interval]:
    """Ends and mean of a uniform distribution of whole numbers: the extremes, and what they leave possible."""
    count = len(values)
    if count < 10:
        missing = Interval.missing(f"There are {count} whole bursts, of at least 10.")
        return missing, missing, missing
    low, high = int(values.min()), int(values.max())
    slack = 0
    while ((high - low + 1) / (high - low + 2 + slack)) ** count > 0.05:
        slack += 1
    mean = Interval.normal(float(values.mean()), float(values.std(ddof=1)) / np.sqrt(count), count)
    return Interval(low, max(low - slack, 1), low, count), Interval(high, high, high + slack, count), mean


def _echo_share(found: Sequence[SeriesEpisodes], longest: float = 1.0) -> Interval:
    """Share of valid readings that are echoes; a burst may have the length `longest`."""
    lengths = np.concatenate([one.echoes.end - one.echoes.begin for one in found]).astype(float)
    valid = sum(int(one.series.valid.sum()) for one in found)
    return episode_share(lengths, valid, longest)


def _lost_share(found: Sequence[SeriesEpisodes], longest: float = 1.0) -> Interval:
    """Share of samples that are lost; a gap may have the length `longest`."""
    lengths = np.concatenate([one.gaps.end - one.gaps.begin for one in found]).astype(float)
    return episode_share(lengths, sum(len(one.series) for one in found), longest)


def _fit_gaps(found: Sequence[SeriesEpisodes], noise: ErrorProcess) -> tuple[dict[str, Interval], dict[str, Interval]]:
    durations_s = np.concatenate(
        [((one.gaps.end - one.gaps.begin) / one.series.rate_hz)[one.gaps.whole] for one in found]
    )
    period_s = 1.0 / found[0].series.rate_hz if found else 0.0
    low, high, mean_s = fit_uniform(durations_s, period_s / np.sqrt(6.0))  # both ends fall between two samples
    coasts_s = np.concatenate([one.gaps.coast_s for one in found])
    coast_s = _typical(coasts_s[np.isfinite(coasts_s)])
    parameters = {
        "components.dropout.share": _lost_share(found),
        "components.dropout.gap_s.0": low,
        "components.dropout.gap_s.1": high,
        "components.dropout.coast_s": coast_s,
        "components.dropout.tilt_rad": _fit_tilt(found, coast_s, noise),
    }
    return parameters, {"components.dropout.gap_s": mean_s}


def _typical(values: Floats) -> Interval:
    """Median of values that are equal but for rounding, with a margin for it."""
    if len(values) < 5:
        return Interval.missing(f"There are {len(values)} losses with falling quality before, of at least 5.")
    middle = float(np.median(values))
    spread = 1.2533 * float(np.median(np.abs(values - middle))) / 0.6745 / np.sqrt(len(values))
    return Interval.normal(middle, spread + 1e-4 * middle, len(values))


def _fit_tilt(found: Sequence[SeriesEpisodes], coast_s: Interval, noise: ErrorProcess) -> Interval:
    """Tilt error while coasting: the size of the displacements, beyond that of noise."""
    if not coast_s.is_measured:
        return Interval.missing(coast_s.reason)
    tilts, deviation = [], 0.0
    for one in found:
        others = one.echoes.mask(len(one.series))
        for event in one.excursions:
            rows = slice(
                max(int((event.begin_s - 0.3) * one.series.rate_hz), 0),
                max(int((event.begin_s + event.stay_s + 0.6) * one.series.rate_hz), 0),
            )
            others[rows] = True
        fitted = noise.white, noise.drift, noise.correlation_s
        coasted = one.gaps.begin[np.isfinite(one.gaps.coast_s)]  # a station that is covered at once does not coast
        own, deviation = leaked_tilt_rad(one.series, coasted, coast_s.value, others, fitted)
        tilts.append(own)
    return fit_length(np.linalg.norm(np.concatenate(tilts), axis=1), deviation)


def _fit_excursions(
    found: Sequence[SeriesEpisodes], residuals: Sequence[Innovations], noise: ErrorProcess
) -> tuple[dict[str, Interval], dict[str, Interval]]:
    alone = [event for one in found for event in _isolated(one.excursions)]
    sizes_m = np.array([event.size_m for event in alone])
    stays_s = np.array([event.stay_s for event in alone if event.is_timed])
    errors_m = np.array([event.size_m / np.sqrt(event.score) for event in alone])
    smallest, largest, mean_m = fit_uniform(sizes_m, float(np.median(errors_m)) if len(alone) else 0.0, strays=_STRAYS)
    shortest, longest, mean_s = fit_uniform(stays_s, _STAY_ERROR_S, strays=_STRAYS)
    ends_m = (smallest.value, largest.value) if smallest.is_measured else (0.005, 0.03)
    ends_s = (shortest.value, longest.value) if shortest.is_measured else (1.0, 5.0)
    parameters = {
        EXCURSION_RATE: _fit_rate(found, residuals, noise, ends_m, ends_s),
        "components.excursion.size_m.0": smallest,
        "components.excursion.size_m.1": largest,
        "components.excursion.stay_s.0": shortest,
        "components.excursion.stay_s.1": longest,
    }
    return parameters, {"components.excursion.size_m": mean_m, "components.excursion.stay_s": mean_s}


def _isolated(events: Sequence[ExcursionEvent]) -> list[ExcursionEvent]:
    """Whole excursions without another one near."""
    out = []
    for event in events:
        end_s = event.begin_s + event.stay_s
        near = any(
            other is not event
            and other.begin_s < end_s + _APART_S
            and other.begin_s + other.stay_s > event.begin_s - _APART_S
            for other in events
        )
        if event.is_whole and not near:
            out.append(event)
    return out


def _fit_rate(
    found: Sequence[SeriesEpisodes],
    residuals: Sequence[Innovations],
    noise: ErrorProcess,
    ends_m: tuple[float, float],
    ends_s: tuple[float, float],
) -> Interval:
    """Onsets per minute of a station, corrected by injection and recovery."""
    minutes = sum(one.series.duration_s for one in found) / 60.0
    detected = sum(len(_counted(one.excursions)) for one in found)
    if not detected:
        return Interval(0.0, 0.0, _NONE_SEEN / minutes, 0)
    recovery, relative, dispersion = _recover(found, residuals, noise, detected / minutes, ends_m, ends_s)
    rate_per_min = detected / minutes / recovery
    spread = float(np.sqrt(dispersion / detected + relative**2))
    low, high = (rate_per_min * float(np.exp(sign * NORMAL_QUANTILE * spread)) for sign in (-1.0, 1.0))
    return Interval(rate_per_min, low, high, detected)


def _counted(events: Sequence[ExcursionEvent]) -> list[ExcursionEvent]:
    """Excursions that begin within the series."""
    return [event for event in events if event.begin_s > 0.3]


def _recover(
    found: Sequence[SeriesEpisodes],
    residuals: Sequence[Innovations],
    noise: ErrorProcess,
    rate_per_min: float,
    ends_m: tuple[float, float],
    ends_s: tuple[float, float],
) -> tuple[float, float, float]:
    """Detected over injected excursions, the relative error of that ratio, and the dispersion of counts.

    The dispersion is the variance of a count over its mean: 1 for a Poisson process that is counted without confusion.
    """
    injected: list[int] = []
    recovered: list[int] = []
    rounds = 0
    while rounds < 1 or (rounds < _MOST_ROUNDS and sum(injected) < _INJECTED):
        for number, (one, residual) in enumerate(zip(found, residuals, strict=True)):
            rng = generator(0, "injected excursions", rounds, number)
            detector = ExcursionDetector(one.series.rate_hz, noise)
            displacement_m, onsets = _draw_displacement(rng, one.series, rate_per_min, ends_m, ends_s)
            again, _ = detector.search(detector.displaced(residual, displacement_m), "")
            injected.append(onsets)
            recovered.append(len(_counted(again)))
        rounds += 1
    given, seen = np.array(injected, float), np.array(recovered, float)
    if not seen.sum():
        return 1.0, 1.0, 1.0
    ratio = float(seen.sum() / given.sum())
    count = len(given)
    relative = float(np.sqrt(np.sum((seen - ratio * given) ** 2) * count / max(count - 1, 1)) / seen.sum())
    extra = float(np.sum((seen - ratio * given) ** 2) / max(seen.sum(), 1.0))
    return ratio, relative, ratio + extra


def _draw_displacement(
    rng: np.random.Generator,
    series: StaticSeries,
    rate_per_min: float,
    ends_m: tuple[float, float],
    ends_s: tuple[float, float],
) -> tuple[Floats, int]:
    """Displacement (N, 3) of excursions of this rate, size and duration, and the number of those that begin in it."""
    duration_s = series.duration_s
    onsets_s = []
    begin_s = -ends_s[1]
    while (begin_s := begin_s + rng.exponential(60.0 / rate_per_min)) < duration_s:
        onsets_s.append(begin_s)
    time_s = np.arange(len(series)) / series.rate_hz
    out = np.zeros((len(series), 3))
    for begin_s in onsets_s:
        stay_s, size_m, direction = rng.uniform(*ends_s), rng.uniform(*ends_m), rng.normal(size=3)
        since_s = time_s - begin_s
        share = np.clip(np.minimum(since_s, stay_s + RAMP_S - since_s) / RAMP_S, 0.0, 1.0)
        out += share[:, None] * (size_m * direction / np.linalg.norm(direction))
    size_m = np.linalg.norm(out, axis=1, keepdims=True)
    largest_m = max(ends_m[1], 1e-9)
    return out * (largest_m / np.maximum(size_m, largest_m)), sum(begin_s > 0.3 for begin_s in onsets_s)


def _station_rate(own: Sequence[SeriesEpisodes], rate: Interval, found: Sequence[SeriesEpisodes]) -> Interval:
    """Rate of one station: its count, with the correction of all stations and the interval of its count."""
    from scipy import special

    minutes = sum(one.series.duration_s for one in own) / 60.0
    detected = sum(len(_counted(one.excursions)) for one in own)
    everyone = sum(len(_counted(one.excursions)) for one in found)
    total = sum(one.series.duration_s for one in found) / 60.0
    correction = rate.value * total / everyone if everyone else 1.0
    low = float(special.gammaincinv(detected, 0.025)) if detected else 0.0
    high = float(special.gammaincinv(detected + 1, 0.975))
    factor = correction / minutes
    return Interval(factor * detected, factor * low, factor * high, detected)
