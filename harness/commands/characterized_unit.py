"""The report on a characterised unit, from what its capture showed."""

from pathlib import Path

import numpy as np

from harness.measure.allan import expected_allan, measure_allan, pool_allan
from harness.measure.measured import Measured
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
_TILT = "components.drift.pitch_roll_rad"
_ORIENTATION_DRIFTS = (_TILT, _TILT, "components.drift.yaw_rad")
"""Drift of the orientation about each axis."""
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
                ParameterRow(key, Measured.missing(reason), defaults.get(key))
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
        allan_position=_allan(found, "position_m"),
        allan_orientation=_allan(found, "rotation_rad"),
        allan_position_model=_allan_model(found, "components.white.position_m", "components.drift.position_m"),
        allan_orientation_model=_allan_model(found, "components.white.orientation_rad", *_ORIENTATION_DRIFTS),
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


def _figures(found: Characterization, station: str) -> dict[str, Measured]:
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
        **figures,
    }


def _allan(found: Characterization, name: str) -> tuple[DeviationCurve, ...]:
    """Allan deviation of each station on one axis, without its episodes."""
    curves = []
    for station in found.profile.stations:
        own = [one for one in found.profile.episodes.found if one.series.station == station]
        longest_s = min(max((one.series.duration_s for one in own), default=0.0) / 4.0, 300.0)
        parts = [
            measure_allan(
                getattr(one.series, name), one.series.valid & ~one.disturbed, one.series.rate_hz, longest_s=longest_s
            )
            for one in own
            if one.series.duration_s >= 2.0 * longest_s > 0.0
        ]
        if parts:
            pooled = pool_allan(parts)
            low, high = pooled.interval.T
            curves.append(DeviationCurve(station, pooled.tau_s, pooled.deviation, low, high))
    return tuple(curves)


def _allan_model(found: Characterization, white: str, *drifts: str) -> DeviationCurve | None:
    """Allan deviation of the fitted noise, the mean over the three axes; None where a number was not measured."""
    parameters = found.profile.parameters
    numbers = [parameters[key] for key in (white, "components.drift.correlation_s", *drifts)]
    if not all(number.is_measured for number in numbers):
        return None
    rate_hz = found.profile.rate_hz
    tau_s = np.exp2(np.arange(int(np.log2(100.0 * rate_hz)) + 1, dtype=np.float64)) / rate_hz
    noise, correlation_s, *sizes = (number.value for number in numbers)
    axes = [expected_allan(tau_s, rate_hz, noise, size, correlation_s) ** 2 for size in sizes]
    unknown = np.full(len(tau_s), np.nan)
    return DeviationCurve("fitted noise and drift", tau_s, np.sqrt(np.mean(axes, axis=0)), unknown, unknown)


def _spectra(rest: tuple[StaticSeries, ...]) -> tuple[DensityCurve, ...]:
    curves = []
    for station in dict.fromkeys(one.station for one in rest):
        pooled = pool_spectra([measure_spectrum(one.position_m, one.rate_hz) for one in rest if one.station == station])
        curves.append(DensityCurve(station, pooled.frequency_hz, pooled.density_m2_hz))
    return tuple(curves)


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
