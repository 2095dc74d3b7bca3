"""Profile of a unit: what a capture shows without a reference, each number with its interval.

Stations at rest show noise, drift, excursions, echoes and losses; every part of a capture shows the timing of the line;
two stations on one bar show errors in motion. Errors at rest are differences from the station's median pose, so that
constant errors do not show.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.number_format import Interval
from harness.core.progress import ProgressCallback
from harness.errors import BadFile, BadInput
from harness.measure.episode_fit import EXCURSION_RATE, EpisodeFit, find_disturbances, fit_episodes
from harness.measure.gauss_markov import NOISE_KEYS, ErrorProcess
from harness.measure.noise_fit import NoiseFit, fit_noise, start_values
from harness.measure.rigid_pair import RigidPair, measure_rigid_pair
from harness.measure.static_series import StaticSeries, find_rest, static_series
from harness.measure.surveyed_points import RestPlace
from harness.measure.timing import TimingAccumulator, TimingMeasurement
from harness.stream.recording import CaptureReader, StationReadings

STATIC_CORRELATIONS = 10.0
"""Least length of a rest, in correlation times of the drift."""
REST_STRETCHES = ("", "static")
"""Stretches in which rates of errors are measured; a station that is covered on purpose is left out."""
MOST_REST_SAMPLES = 1_300_000
"""Samples at rest that are analysed: 30 minutes of six stations at 120 Hz. It bounds the memory."""
_COVERED = "covered"
"""Stretch in which stations are covered by a hand."""
QUALITY_EDGES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Edges of the classes of quality."""
_CAPTURE = "a capture with stations at rest"


@dataclass(frozen=True)
class StretchLength:
    """A part of a capture."""

    name: str
    """Name of its mark; "" without one."""
    duration_s: float
    records: int


@dataclass(frozen=True)
class Bar:
    """Two stations on one rigid bar."""

    stations: tuple[str, str]
    stated_m: tuple[float, float] | None = None
    """Length that somebody measured, and its standard uncertainty [m]; None where nobody did."""


@dataclass(frozen=True)
class QualityClass:
    """Errors at rest of the readings in one class of quality."""

    above: float
    to: float
    """Ends of the class; the upper one belongs to it."""
    share: float
    """Share of all readings."""
    median_m: float
    quantile95_m: float
    """Median and 95 % quantile of the distance from the resting place [m]; NaN without a reading."""


@dataclass(frozen=True, eq=False)
class UnitProfile:
    """What a capture shows of a unit."""

    stations: tuple[str, ...]
    rate_hz: float
    """Nominal rate of each station [Hz]."""
    items: tuple[int, ...]
    """Output list of the stations."""
    note: Mapping[str, Any]
    stretches: tuple[StretchLength, ...]
    damage: tuple[str, ...]
    garbage_bytes: int
    timing: TimingMeasurement
    noise: NoiseFit
    episodes: EpisodeFit
    quality: tuple[QualityClass, ...]
    rigid: RigidPair | None
    places: tuple[RestPlace, ...]
    """Where stations rested, in the order in which it was found."""
    limits: tuple[str, ...]
    """What this capture cannot show, a sentence each."""

    @property
    def rest(self) -> tuple[StaticSeries, ...]:
        """The stations at rest that were analysed."""
        return tuple(one.series for one in self.episodes.found)

    @property
    def even_rate_hz(self) -> float:
        """Rate of the readings at rest [Hz]: the nominal one, or that to which an uneven source was resampled."""
        return self.rest[0].rate_hz if self.rest else self.rate_hz

    @property
    def parameters(self) -> dict[str, Interval]:
        """Dotted key of a scenario -> number."""
        speed = self.rigid.ahead_s if self.rigid else Interval.missing("Two stations on a bar show it: --rigid A,B.")
        return {
            **self.noise.all_stations,
            **self.episodes.parameters,
            "components.clock.drift_ppm": self.timing.all_stations["components.clock.drift_ppm"],
            "components.speed.ahead_s": speed,
        }


def measure_profile(
    reader: CaptureReader,
    *,
    bar: Bar | None = None,
    progress: ProgressCallback = lambda step, done, planned: None,
) -> UnitProfile:
    """Measure a unit from a capture.

    BadFile for a capture without a rest of at least ten correlation times, unless it has a moving bar. BadInput for a
    station of `bar` that is not in it.
    """
    require_pair(bar, reader.wire.stations)
    collected, timing = CollectedReadings(reader.wire.rate_hz, bar), TimingAccumulator(reader.wire.rate_hz)
    garbage_bytes = 0
    for number, block in enumerate(reader.blocks()):
        progress("reading", number, number + 1)
        timing.add(block)
        garbage_bytes += block.garbage_bytes
        collected.add(block.stretch, block.stations)
    if not collected.rest and bar is None:
        advice = "Let all stations lie still for a minute or more, in sight of the emitters."
        raise BadFile(reader.path, "no stretch in which a station rests", _CAPTURE, advice)
    noise, episodes = (
        fit_rest(collected.rest, progress) if collected.rest else without_rest("No station rests for 10 s.")
    )
    correlation = noise.all_stations["components.drift.correlation_s"]
    longest_s = max((one.duration_s for one in collected.rest), default=0.0)
    if correlation.is_measured and longest_s < STATIC_CORRELATIONS * correlation.value:
        found = f"a rest of {longest_s:.3g} s, with errors that are correlated over {correlation.value:.3g} s"
        expected = f"a rest of {STATIC_CORRELATIONS * correlation.value:.3g} s or more"
        raise BadFile(reader.path, found, expected, "Let the stations lie still for longer.")
    return UnitProfile(
        reader.wire.stations,
        reader.wire.rate_hz,
        reader.wire.items,
        reader.note,
        collected.stretches(),
        tuple(reader.damage),
        garbage_bytes,
        timing.measure(),
        noise,
        episodes,
        _quality_errors(collected.rest + collected.covered),
        collected.rigid_pair(),
        tuple(collected.places),
        collected.limits(),
    )


def require_pair(bar: Bar | None, stations: tuple[str, ...]) -> None:
    """Raise BadInput unless a bar has two of the stations."""
    names = bar.stations if bar else ()
    for name in names:
        if name not in stations:
            raise BadInput(f"No station {name!r} in the capture.", f"It has {', '.join(stations)}.")
    if names and names[0] == names[1]:
        raise BadInput(f"--rigid names {names[0]} twice.", "Name the two stations on the bar.")


def without_rest(reason: str) -> tuple[NoiseFit, EpisodeFit]:
    """Noise and episodes that were not measured, and why."""
    missing = Interval.missing(reason)
    return NoiseFit(dict.fromkeys(NOISE_KEYS, missing), {}), EpisodeFit({EXCURSION_RATE: missing}, {}, {}, ())


class CollectedReadings:
    """What is kept of the readings of a capture while they come: stations at rest, and a moving bar."""

    def __init__(self, rate_hz: float, bar: Bar | None) -> None:
        self._rate_hz, self._bar = rate_hz, bar
        self.rest: list[StaticSeries] = []
        self.covered: list[StaticSeries] = []
        self.places: list[RestPlace] = []
        self._samples = 0
        self._left_out_s = 0.0
        self._moved = 0
        self._stretches: dict[str, list[float]] = {}
        self._motion: list[tuple[StationReadings, StationReadings]] = []

    def add(self, stretch: str, stations: Mapping[str, StationReadings]) -> None:
        """Add readings of a stretch of this name, whose records come at the rate."""
        times_s = [readings.received_s for readings in stations.values() if len(readings)]
        duration_s = max(float(t[-1]) for t in times_s) - min(float(t[0]) for t in times_s) if times_s else 0.0
        self.add_length(stretch, duration_s, sum(map(len, stations.values())))
        if not stations:
            return
        for station, readings in stations.items():
            self.add_rest(stretch, station, readings, self._rate_hz)
        self.add_motion(stretch, stations)

    def add_length(self, stretch: str, duration_s: float, records: int) -> None:
        """Count the time and the records of a stretch."""
        length = self._stretches.setdefault(stretch, [0.0, 0.0])
        length[0] += duration_s
        length[1] += records

    def add_rest(self, stretch: str, station: str, readings: StationReadings, rate_hz: float) -> None:
        """Keep the rests of a station whose records come at an even rate."""
        if stretch not in (*REST_STRETCHES, _COVERED):
            return
        for rest in find_rest(readings, rate_hz).tolist():
            kept = self.covered if stretch == _COVERED else self.rest
            self._keep(kept, static_series(readings, (rest[0], rest[1]), rate_hz, station))
            self.places.append(_rest_place(station, readings, slice(rest[0], rest[1])))

    def add_motion(self, stretch: str, stations: Mapping[str, StationReadings]) -> None:
        """Keep the two stations on a bar; their records need no even rate."""
        if self._bar and stretch not in ("static", _COVERED) and self._moved < MOST_REST_SAMPLES:
            self._moved += sum(map(len, stations.values()))
            first, second = self._bar.stations
            self._motion.append((stations[first], stations[second]))

    def _keep(self, kept: list[StaticSeries], series: StaticSeries) -> None:
        if series.valid.sum() < 2.0 * series.rate_hz:
            return
        if self._samples + len(series) > MOST_REST_SAMPLES:
            self._left_out_s += series.duration_s
            return
        self._samples += len(series)
        kept.append(series)

    def stretches(self) -> tuple[StretchLength, ...]:
        return tuple(StretchLength(name, one[0], int(one[1])) for name, one in self._stretches.items())

    def rigid_pair(self) -> RigidPair | None:
        if self._bar is None:
            return None
        columns = []
        for number in (0, 1):
            readings = [pair[number] for pair in self._motion]
            names = ("measured_s", "position_m", "tracker_from_station", "suspect")
            time_s, place, turn, suspect = (
                np.concatenate([getattr(one, name) for one in readings]) if readings else np.zeros(0) for name in names
            )
            sound = np.isfinite(time_s)
            if readings:
                sound &= np.isfinite(place[:, 0]) & np.isfinite(turn[:, 0]) & ~suspect.astype(bool)
                sound &= np.diff(time_s, prepend=-np.inf) > 0.0
            columns.append((time_s[sound], place[sound], turn[sound]))
        first, second = columns
        return measure_rigid_pair(
            self._bar.stations,
            (first[0], second[0]),
            (first[1], second[1]),
            (first[2], second[2]),
            self._bar.stated_m,
        )

    def limits(self) -> tuple[str, ...]:
        if not self._left_out_s:
            return ()
        return (
            f"Errors at rest are those of the first {self._samples:,} samples; {self._left_out_s / 60.0:.0f} station "
            "minutes after them show the timing only.",
        )


def _rest_place(station: str, readings: StationReadings, rows: slice) -> RestPlace:
    place_m = readings.position_m[rows][np.isfinite(readings.position_m[rows, 0])]
    begin_s = float(readings.received_s[rows][0])
    return RestPlace(station, begin_s, np.median(place_m, axis=0), np.std(place_m, axis=0), len(place_m))


def fit_rest(rest: list[StaticSeries], progress: ProgressCallback) -> tuple[NoiseFit, EpisodeFit]:
    """Noise and episodes of stations at rest, in turn: each is found better once the other is known."""
    progress("finding episodes", 0, 3)
    nothing: list[Bools] = [np.zeros(len(one), bool) for one in rest]
    start = np.exp(start_values(rest, nothing))
    found, _ = find_disturbances(rest, ErrorProcess(float(start[0]), float(start[1]), float(start[5])))
    progress("fitting the noise", 1, 3)
    noise = fit_noise(rest, [one.disturbed for one in found], by_station=False)
    progress("fitting the episodes", 2, 3)
    episodes = fit_episodes(rest, _excursion_noise(noise, start))
    final = fit_noise(rest, [one.disturbed for one in episodes.found])
    progress("", 3, 3)
    return final, episodes


def _excursion_noise(noise: NoiseFit, start: Floats) -> ErrorProcess:
    """The fitted noise of the position; rough values stand in for what the fit could not tell or found to be 0."""
    keys = ("components.white.position_m", "components.drift.position_m", "components.drift.correlation_s")
    fitted = [noise.all_stations[key] for key in keys]
    rough = (start[0], start[1], start[5])
    return ErrorProcess(
        *(one.value if one.value > 0.0 else float(value) for one, value in zip(fitted, rough, strict=True))
    )


def _quality_errors(series: list[StaticSeries]) -> tuple[QualityClass, ...]:
    """Distance from the resting place, by classes of quality; the first class holds the lost readings."""
    if not series:
        return ()
    quality = np.concatenate([one.quality for one in series])
    away_m = np.concatenate([np.linalg.norm(one.position_m, axis=1) for one in series])
    came = np.isfinite(quality)
    total = max(int(came.sum()), 1)
    classes = [(0.0, 0.0, came & (quality == 0.0))]
    for above, to in pairwise(QUALITY_EDGES):
        classes.append((above, to, came & (quality > above) & (quality <= to)))
    out = []
    for above, to, inside in classes:
        known = away_m[inside & np.isfinite(away_m)]
        middle, high = np.quantile(known, [0.5, 0.95]).tolist() if len(known) else (np.nan, np.nan)
        out.append(QualityClass(above, to, float(inside.sum()) / total, middle, high))
    return tuple(out)
