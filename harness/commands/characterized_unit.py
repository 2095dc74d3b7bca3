"""The report on a characterised unit, from what its capture showed."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from harness.core.interval import Interval
from harness.measure.allan import AllanDeviation, expected_allan, measure_allan, pool_allan
from harness.measure.episode_fit import SeriesEpisodes
from harness.measure.gauss_markov import NOISE_KEYS
from harness.measure.mean_drift import drift_speed, mean_drift
from harness.measure.recording_time import events_for_precision
from harness.measure.spectrum import measure_spectrum, pool_spectra
from harness.measure.spread import rest_spread
from harness.measure.static_series import StaticSeries
from harness.report.lab.unit_content import (
    CaptureSummary,
    DensityCurve,
    DepartureCheck,
    DeviationCurve,
    EpisodeMark,
    ParameterRow,
    QualityClass,
    RecordingAdvice,
    StationFigures,
    StretchSummary,
    UnitReport,
)
from harness.study.trust.characterization import PRECISION, Characterization
from harness.study.trust.expected_values import preset_values

_RATE = "components.excursion.onsets_per_min"
_STATION_KEYS = {
    "white_m": "components.white.position_m",
    "slow_m": "components.drift.position_m",
    "excursions_per_min": _RATE,
    "echo_share": "components.echo.share",
    "gap_share": "components.dropout.share",
    "rate_hz": "timing.rate_hz",
    "jitter_s": "timing.jitter_s",
    "lost_share": "timing.lost_share",
    "duplicate_share": "timing.duplicate_share",
}
"""Name of a figure of a station -> key of the number."""
_LONGEST_TAU_S = 300.0
"""Longest averaging time of the model's Allan deviation [s]."""


def unit_report(found: Characterization, path: Path, command: str, out: Path | None) -> UnitReport:
    """The report on a unit whose capture is at `path`, and whose unit file is at `out`."""
    profile = found.profile
    defaults = {key: number.value for key, number in preset_values().items()}
    parameters = {**profile.parameters, **profile.episodes.means}
    return UnitReport(
        name=found.unit.name,
        command=command,
        capture=CaptureSummary(
            path.name,
            sum(one.duration_s for one in profile.stretches),
            profile.stations,
            profile.rate_hz,
            tuple(StretchSummary(one.name, one.duration_s, one.records) for one in profile.stretches),
            profile.damage,
        ),
        expected_from=found.expected_from,
        parameters=(
            *(ParameterRow(key, number, defaults.get(key)) for key, number in parameters.items()),
            *(
                ParameterRow(key, Interval.missing(reason), defaults.get(key))
                for key, reason in found.unit.not_measured.items()
                if key not in parameters
            ),
        ),
        timing=tuple(
            ParameterRow(key, number, None)
            for key, number in profile.timing.all_stations.items()
            if key.startswith("timing.")
        ),
        checks=tuple(DepartureCheck(check.departure, check.p_holm) for check in found.checks),
        stations=tuple(StationFigures(station, _figures(found, station)) for station in profile.stations),
        allan_position=_allan(profile.episodes.found, "position_m"),
        allan_orientation=_allan(profile.episodes.found, "rotation_rad"),
        allan_position_model=_allan_model(profile.noise.all_stations, profile.rate_hz, 0, (1, 1, 1)),
        allan_orientation_model=_allan_model(profile.noise.all_stations, profile.rate_hz, 2, (3, 3, 4)),
        spectra=_spectra(profile.rest),
        episodes=_episodes(found),
        quality=tuple(
            QualityClass(one.above, one.to, one.share, one.median_m, one.quantile95_m) for one in profile.quality
        ),
        advice=_advice(found),
        rigid_pairs=(profile.rigid,) if profile.rigid else (),
        unit_file="" if out is None else out.name,
        notes=profile.limits,
    )


def _figures(found: Characterization, station: str) -> dict[str, Interval]:
    profile = found.profile
    known = {
        **profile.noise.by_station.get(station, {}),
        **profile.episodes.by_station.get(station, {}),
        **profile.timing.by_station.get(station, {}),
    }
    rest = [one for one in profile.rest if one.station == station]
    figures = {name: known[key] for name, key in _STATION_KEYS.items() if key in known}
    return {
        "spread_m": rest_spread(rest, "position_m"),
        "spread_rad": rest_spread(rest, "rotation_rad"),
        "slope_m_min": _slope_m_min(found, station),
        **figures,
    }


def _slope_m_min(found: Characterization, station: str) -> Interval:
    """Speed at which the mean of the position moves while the station rests [m/min]."""
    own = [one for one in found.profile.episodes.found if one.series.station == station]
    velocity = mean_drift(
        [one.series for one in own], [one.disturbed for one in own], found.profile.noise, "position_m"
    )
    speed = drift_speed(velocity)
    if not speed.is_measured:
        return speed
    return Interval(60.0 * speed.value, 60.0 * speed.low, 60.0 * speed.high, speed.count)


def _spectra(rest: tuple[StaticSeries, ...]) -> tuple[DensityCurve, ...]:
    curves = []
    for station in dict.fromkeys(one.station for one in rest):
        pooled = pool_spectra([measure_spectrum(one.position_m, one.rate_hz) for one in rest if one.station == station])
        curves.append(DensityCurve(station, pooled.frequency_hz, pooled.density_m2_hz))
    return tuple(curves)


def _allan(found: tuple[SeriesEpisodes, ...], name: str) -> tuple[DeviationCurve, ...]:
    """Allan deviation of each station over the readings that no episode displaces."""
    curves = []
    for station in dict.fromkeys(one.series.station for one in found):
        pooled: AllanDeviation = pool_allan(
            [
                measure_allan(getattr(one.series, name), one.series.valid & ~one.disturbed, one.series.rate_hz)
                for one in found
                if one.series.station == station
            ]
        )
        known = pooled.pairs > 0
        low, high = pooled.interval[known].T
        curves.append(DeviationCurve(station, pooled.tau_s[known], pooled.deviation[known], low, high))
    return tuple(curve for curve in curves if len(curve.tau_s))


def _allan_model(
    noise: Mapping[str, Interval], rate_hz: float, white: int, drifts: tuple[int, int, int]
) -> DeviationCurve | None:
    """Allan deviation of the fitted noise on one axis, the mean square of three; rows are those of `NOISE_KEYS`."""
    values = [noise[key] for key in NOISE_KEYS]
    used = [values[row] for row in (white, *drifts, -1)]
    if not all(one.is_measured for one in used):
        return None
    tau_s = np.exp2(np.arange(int(np.log2(_LONGEST_TAU_S * rate_hz)) + 1, dtype=np.float64)) / rate_hz
    square = np.mean(
        [expected_allan(tau_s, rate_hz, used[0].value, one.value, used[-1].value) ** 2 for one in used[1:-1]], axis=0
    )
    unknown = np.full(len(tau_s), np.nan)
    return DeviationCurve("fitted noise", tau_s, np.sqrt(square), unknown, unknown)


def _episodes(found: Characterization) -> tuple[EpisodeMark, ...]:
    """All episodes at rest, by the time since the first rest began."""
    profile = found.profile
    marks = []
    begin_s = min(one.begin_s for one in profile.rest)
    for one in profile.episodes.found:
        since_s, rate_hz, station = one.series.begin_s - begin_s, one.series.rate_hz, one.series.station
        for event in one.excursions:
            start_s = max(since_s + event.begin_s, 0.0)
            marks.append(EpisodeMark(station, "excursion", start_s, event.stay_s, event.size_m))
        for first, end, size_m in zip(one.echoes.begin, one.echoes.end, one.echoes.size_m, strict=True):
            marks.append(
                EpisodeMark(station, "echo", since_s + first / rate_hz, (end - first) / rate_hz, float(size_m))
            )
        for first, end in zip(one.gaps.begin, one.gaps.end, strict=True):
            marks.append(EpisodeMark(station, "gap", since_s + first / rate_hz, (end - first) / rate_hz))
    return tuple(marks)


def _advice(found: Characterization) -> tuple[RecordingAdvice, ...]:
    """How long to record for the rate of excursions to 20 %."""
    profile = found.profile
    rate = profile.parameters[_RATE]
    if not rate.is_measured:
        return ()
    minutes = sum(one.duration_s for one in profile.rest) / 60.0 / len(profile.stations)
    needed = events_for_precision(PRECISION)
    return (RecordingAdvice(_RATE, PRECISION, rate.count, needed, minutes, found.needed_minutes),)
