"""The report on a unit: its numbers, curves, episodes and departures in SI units, computed from its profile."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.core.arrays import Floats, freeze
from harness.core.number_format import Interval
from harness.errors import BadInput
from harness.measure.episode_distributions import events_for_precision, recording_minutes
from harness.measure.episode_fit import EXCURSION_RATE, SeriesEpisodes
from harness.measure.gauss_markov import NOISE_KEYS
from harness.measure.noise_spectra import (
    AllanDeviation,
    expected_allan,
    measure_allan,
    measure_spectrum,
    pool_allan,
    pool_spectra,
)
from harness.measure.profile import QualityClass, StretchLength, UnitProfile
from harness.measure.reports.departures import Departure
from harness.measure.rest_statistics import drift_speed, mean_drift, rest_distance
from harness.measure.rigid_pair import RigidPair
from harness.measure.static_series import StaticSeries
from harness.measure.surveyed_points import SurveyComparison
from harness.measure.unit_file import UnitFile

PRECISION = 0.2
"""Relative half width of the interval of a rate that is aimed at."""
_STATION_KEYS = {
    "white_m": "components.white.position_m",
    "slow_m": "components.drift.position_m",
    "excursions_per_min": EXCURSION_RATE,
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


EPISODE_KINDS = ("excursion", "echo", "gap")
"""Kinds of episodes: a displacement of seconds, a burst of outliers, a loss."""


@dataclass(frozen=True)
class CaptureSummary:
    """The capture that was read."""

    name: str
    """Name of its file, without folders."""
    duration_s: float
    stations: tuple[str, ...]
    rate_hz: float
    """Nominal rate of each station [Hz]."""
    stretches: tuple[StretchLength, ...] = ()
    damage: tuple[str, ...] = ()
    """What was lost of the capture, a sentence each; empty for an intact one."""


@dataclass(frozen=True)
class ParameterRow:
    """One parameter of the error model or of the clock."""

    key: str
    """Dotted key of a scenario, such as "components.white.position_m", or a name of the timing."""
    measured: Interval
    """The number; where it was not measured, its reason says why the unit file keeps the default."""
    default: float | None
    """Value of the preset, which the unit file keeps where nothing was measured; None without one."""

    @property
    def status(self) -> str:
        """ "measured" or "default"; "not measured" where there is no default either."""
        if self.measured.is_measured:
            return "measured"
        return "not measured" if self.default is None else "default"


@dataclass(frozen=True, eq=False)
class DeviationCurve:
    """Allan deviation against averaging time, with its 95 % interval."""

    station: str
    """Name of the station; of a model its label."""
    tau_s: Floats
    """(K,) averaging times, rising [s]."""
    deviation: Floats
    """(K,) Allan deviation, in metres or radians; NaN where it was not measured."""
    low: Floats
    """(K,) lower ends of the intervals; NaN for a model."""
    high: Floats
    """(K,) upper ends."""

    def __post_init__(self) -> None:
        freeze(self, tau_s=("K",), deviation=("K",), low=("K",), high=("K",))


@dataclass(frozen=True, eq=False)
class DensityCurve:
    """Power spectral density of the position at rest, summed over the axes."""

    station: str
    """Name of the station; of a model its label."""
    frequency_hz: Floats
    """(F,) frequencies, rising, without 0 [Hz]."""
    density_m2_hz: Floats
    """(F,) one-sided density [m^2/Hz]; NaN where it was not measured."""

    def __post_init__(self) -> None:
        freeze(self, frequency_hz=("F",), density_m2_hz=("F",))


@dataclass(frozen=True)
class EpisodeMark:
    """One episode on the time line."""

    station: str
    kind: str
    """One of `EPISODE_KINDS`."""
    begin_s: float
    """Time since the start of the capture [s]."""
    duration_s: float
    size_m: float = float("nan")
    """Displacement [m]; NaN for a gap."""

    def __post_init__(self) -> None:
        if self.kind not in EPISODE_KINDS:
            raise BadInput(f"An episode of kind {self.kind!r}.", f"Use one of {', '.join(EPISODE_KINDS)}.")


@dataclass(frozen=True)
class RecordingAdvice:
    """Length of a capture that shows one number with a wanted precision."""

    key: str
    """Key of the number, such as "components.excursion.onsets_per_min"."""
    precision: float
    """Relative half width of the wanted interval, such as 0.2."""
    events: int
    """Events that this capture has, over all stations."""
    needed_events: int
    minutes: float
    """Minutes of this capture in which such events were looked for."""
    needed_minutes: float
    """Minutes that give as many events at the measured rate; NaN without any event."""


STATION_FIGURES = (
    "half_within_m",
    "most_within_m",
    "half_within_rad",
    "most_within_rad",
    "white_m",
    "slow_m",
    "slope_m_min",
    "excursions_per_min",
    "echo_share",
    "gap_share",
    "rate_hz",
    "jitter_s",
    "lost_share",
    "duplicate_share",
)
"""Names of the figures of a station.

Spread is the standard deviation of the position at rest (3-D) and of the orientation. White and slow are its two parts
on each axis: white noise and first-order Gauss-Markov noise. Slope is the drift of the mean. Gaps are readings of
quality 0; lost records never came.
"""


@dataclass(frozen=True)
class StationFigures:
    """What was measured of one station."""

    station: str
    figures: Mapping[str, Interval] = field(default_factory=dict)
    """One of `STATION_FIGURES` -> number; a name that is left out was not looked for."""

    def __post_init__(self) -> None:
        unknown = sorted(set(self.figures) - set(STATION_FIGURES))
        if unknown:
            raise BadInput(f"A figure of a station called {unknown[0]!r}.", f"Known: {', '.join(STATION_FIGURES)}.")


@dataclass(frozen=True, eq=False)
class UnitReport:
    """Everything that `harness characterize` found out about a unit."""

    name: str
    """Name of the unit."""
    capture: CaptureSummary
    expected_from: str
    """Origin of the expected numbers: "the preset default", or the name of an earlier unit file."""
    parameters: tuple[ParameterRow, ...]
    """Parameters of the error model."""
    timing: tuple[ParameterRow, ...]
    """Numbers of clock, stamps and records: keys as "timing.rate_hz"."""
    checks: tuple[Departure, ...]
    """All checks, in their order; those that are named are the departures."""
    stations: tuple[StationFigures, ...]
    allan_position: tuple[DeviationCurve, ...] = ()
    """Allan deviation of the position at rest on one axis [m], a curve for each station."""
    allan_orientation: tuple[DeviationCurve, ...] = ()
    """Allan deviation of the orientation at rest about one axis [rad]."""
    allan_position_model: DeviationCurve | None = None
    """That of the fitted error model."""
    allan_orientation_model: DeviationCurve | None = None
    spectra: tuple[DensityCurve, ...] = ()
    """Spectrum of the position at rest, a curve for each station."""
    episodes: tuple[EpisodeMark, ...] = ()
    quality: tuple[QualityClass, ...] = ()
    """Classes of quality, rising; the first one holds the lost readings."""
    advice: tuple[RecordingAdvice, ...] = ()
    rigid_pairs: tuple[RigidPair, ...] = ()
    """Pairs of stations on one bar; empty without any."""
    survey: SurveyComparison | None = None
    """Rests against surveyed points."""
    notes: tuple[str, ...] = ()
    """What cannot be told from this capture and what to know about it, a sentence each."""


def make_unit_report(
    profile: UnitProfile,
    unit: UnitFile,
    checks: Sequence[Departure],
    expected_from: str,
    defaults: Mapping[str, float],
    survey: SurveyComparison | None = None,
) -> UnitReport:
    """The report on a profile whose unit file is `unit`; `defaults` are the preset's values of its keys."""
    parameters = {**profile.parameters, **profile.episodes.means}
    return UnitReport(
        name=unit.name,
        capture=CaptureSummary(
            str(unit.capture["file"]),
            sum(one.duration_s for one in profile.stretches),
            profile.stations,
            profile.rate_hz,
            profile.stretches,
            profile.damage,
        ),
        expected_from=expected_from,
        parameters=(
            *(ParameterRow(key, number, defaults.get(key)) for key, number in parameters.items()),
            *(
                ParameterRow(key, Interval.missing(reason), defaults.get(key))
                for key, reason in unit.not_measured.items()
                if key not in parameters
            ),
        ),
        timing=tuple(
            ParameterRow(key, number, None)
            for key, number in profile.timing.all_stations.items()
            if key.startswith("timing.")
        ),
        checks=tuple(checks),
        stations=tuple(StationFigures(station, _figures(profile, station)) for station in profile.stations),
        allan_position=_allan(profile.episodes.found, "position_m"),
        allan_orientation=_allan(profile.episodes.found, "rotation_rad"),
        allan_position_model=_allan_model(profile.noise.all_stations, profile.even_rate_hz, 0, (1, 1, 1)),
        allan_orientation_model=_allan_model(profile.noise.all_stations, profile.even_rate_hz, 2, (3, 3, 4)),
        spectra=_spectra(profile.rest),
        episodes=_episodes(profile),
        quality=profile.quality,
        advice=_advice(profile),
        rigid_pairs=(profile.rigid,) if profile.rigid else (),
        survey=survey,
        notes=profile.limits,
    )


def _figures(profile: UnitProfile, station: str) -> dict[str, Interval]:
    known = {
        **profile.noise.by_station.get(station, {}),
        **profile.episodes.by_station.get(station, {}),
        **profile.timing.by_station.get(station, {}),
    }
    rest = [one for one in profile.rest if one.station == station]
    figures = {name: known[key] for name, key in _STATION_KEYS.items() if key in known}
    return {
        "half_within_m": rest_distance(rest, "position_m", 0.5),
        "most_within_m": rest_distance(rest, "position_m", 0.95),
        "half_within_rad": rest_distance(rest, "rotation_rad", 0.5),
        "most_within_rad": rest_distance(rest, "rotation_rad", 0.95),
        "slope_m_min": _slope_m_min(profile, station),
        **figures,
    }


def _slope_m_min(profile: UnitProfile, station: str) -> Interval:
    """Speed at which the mean of the position moves while the station rests [m/min]."""
    own = [one for one in profile.episodes.found if one.series.station == station]
    velocity = mean_drift([one.series for one in own], [one.disturbed for one in own], profile.noise, "position_m")
    speed = drift_speed(velocity)
    if not speed.is_measured:
        return speed
    return Interval(60.0 * speed.value, 60.0 * speed.low, 60.0 * speed.high, speed.count)


def _spectra(rest: tuple[StaticSeries, ...]) -> tuple[DensityCurve, ...]:
    curves = []
    for station in dict.fromkeys(one.station for one in rest):
        pooled = pool_spectra([measure_spectrum(one.position_m, one.rate_hz) for one in rest if one.station == station])
        if pooled.segments:
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


def _episodes(profile: UnitProfile) -> tuple[EpisodeMark, ...]:
    """All episodes at rest, by the time since the first rest began."""
    marks = []
    begin_s = min((one.begin_s for one in profile.rest), default=0.0)
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


def _advice(profile: UnitProfile) -> tuple[RecordingAdvice, ...]:
    """How long to record for the rate of excursions to 20 %."""
    rate = profile.parameters[EXCURSION_RATE]
    if not rate.is_measured:
        return ()
    minutes = sum(one.duration_s for one in profile.rest) / 60.0 / len(profile.stations)
    needed = events_for_precision(PRECISION)
    needed_minutes = recording_minutes(PRECISION, rate.value, len(profile.stations)) if rate.value > 0.0 else math.nan
    return (RecordingAdvice(EXCURSION_RATE, PRECISION, rate.count, needed, minutes, needed_minutes),)
