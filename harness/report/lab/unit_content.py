"""What the page of `harness characterize` shows: one unit's numbers, curves, episodes and departures, in SI units."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from harness.compare.significance import SIGNIFICANCE
from harness.core.arrays import Floats, freeze
from harness.core.interval import Interval
from harness.errors import BadInput
from harness.measure.departures import Departure
from harness.measure.rigid_pair import RigidPair

EPISODE_KINDS = ("excursion", "echo", "gap", "coast")
"""Kinds of episodes: a displacement of seconds, a burst of outliers, a loss, falling quality before a loss."""


@dataclass(frozen=True)
class StretchSummary:
    """A named part of a capture."""

    name: str
    """Name of its mark; "" without a mark."""
    duration_s: float
    records: int
    """Number of records of all stations."""
    begin_s: float = float("nan")
    """Time since the start of the capture [s]; NaN: not known."""


@dataclass(frozen=True)
class CaptureSummary:
    """The capture that was read."""

    name: str
    """Name of its file, without folders."""
    duration_s: float
    stations: tuple[str, ...]
    rate_hz: float
    """Nominal rate of each station [Hz]."""
    stretches: tuple[StretchSummary, ...] = ()
    damage: tuple[str, ...] = ()
    """What was lost of the capture, a sentence each; empty for an intact one."""


@dataclass(frozen=True)
class ParameterRow:
    """One parameter of the error model, of the clock or of the tracker."""

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


@dataclass(frozen=True)
class DepartureCheck:
    """A measured number beside the expected one, with its p-value after the correction for all checks."""

    departure: Departure
    p_holm: float
    """p-value corrected for the number of checks (Holm 1979)."""
    text: str = ""
    """The departure in words; "" lets the page write it from the key and the two numbers."""

    @property
    def is_named(self) -> bool:
        """Whether the number differs from the expected one at the 5 % level over all checks."""
        return self.p_holm <= SIGNIFICANCE


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
class QualityClass:
    """The readings whose quality lies in one class."""

    above: float
    """Lower end of the class, not included; the class of lost readings has 0 at both ends."""
    to: float
    """Upper end, included."""
    share: float
    """Share of all readings."""
    median_m: float
    """Median distance from the station's resting place [m]; NaN without a reading."""
    quantile95_m: float
    """95 % quantile of it [m]."""


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
    "spread_m",
    "spread_rad",
    "white_m",
    "slow_m",
    "slope_m_min",
    "excursions_per_min",
    "excursion_size_m",
    "excursion_stay_s",
    "echo_share",
    "gap_share",
    "rate_hz",
    "jitter_s",
    "lost_share",
    "duplicate_share",
)
"""Names of the figures of a station.

Spread is the standard deviation of the position at rest (3-D) and of the orientation. White and slow are its two parts
on each axis: white noise and first-order Gauss-Markov noise. Slope is the drift of the mean. A size or stay is the mean
over the excursions. Gaps are readings of quality 0; lost records never came.
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
    command: str
    """The command line that made it."""
    capture: CaptureSummary
    expected_from: str
    """Origin of the expected numbers: "the preset default", or the name of an earlier unit file."""
    parameters: tuple[ParameterRow, ...]
    """Parameters of the error model."""
    timing: tuple[ParameterRow, ...]
    """Numbers of clock, stamps and records: keys as "timing.rate_hz", and those of a scenario's tracker."""
    checks: tuple[DepartureCheck, ...]
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
    spectrum_model: DensityCurve | None = None
    episodes: tuple[EpisodeMark, ...] = ()
    quality: tuple[QualityClass, ...] = ()
    """Classes of quality, rising; the first one holds the lost readings."""
    advice: tuple[RecordingAdvice, ...] = ()
    rigid_pairs: tuple[RigidPair, ...] = ()
    """Pairs of stations on one bar; empty without any."""
    unit_file: str = ""
    """Name of the unit file that was written; "" without one."""
    notes: tuple[str, ...] = ()
    """What cannot be told from this capture and what to know about it, a sentence each."""

    @property
    def departures(self) -> tuple[DepartureCheck, ...]:
        """The checks that are named, in their order."""
        return tuple(check for check in self.checks if check.is_named)
