"""What the page of `harness validate` shows: how a capture lies against its reference, in SI units."""

from dataclasses import dataclass

from harness.core.arrays import Floats, freeze
from harness.core.interval import Interval
from harness.report.lab.unit_content import CaptureSummary, DepartureCheck

ROOM = "room"
"""Name of the pose of the tracker's frame in the reference's; other poses are mounts of stations."""


@dataclass(frozen=True, eq=False)
class EstimatedPose:
    """A pose that the registration estimated: the room, or the mount of a station on its body."""

    name: str
    """`ROOM`, or the station."""
    body: str
    """Body of the reference that carries the station; "" for the room."""
    position_m: tuple[Interval, Interval, Interval]
    """Coordinates with their intervals [m]."""
    rotation: Floats
    """(4,) unit quaternion (w, x, y, z)."""
    angle_rad: float
    """Half width of the 95 % interval of the orientation, about its least certain axis [rad]."""

    def __post_init__(self) -> None:
        freeze(self, rotation=(4,))


@dataclass(frozen=True)
class RegistrationNumber:
    """A number of the registration, such as a time offset."""

    key: str
    """Name such as "time_offset_orientation_s"."""
    measured: Interval
    station: str = ""
    """Station that it is of; "" is all together."""


@dataclass(frozen=True)
class StationAccuracy:
    """Errors of one station against the reference, after the registration."""

    station: str
    position_rms_m: Interval
    position_median_m: Interval
    position_95_m: Interval
    """95 % quantile [m]."""
    orientation_rms_rad: Interval
    orientation_median_rad: Interval
    orientation_95_rad: Interval
    readings: int
    """Number of readings that were compared."""
    lost_share: float
    """Share of the readings without a position."""


@dataclass(frozen=True, eq=False)
class ResidualSeries:
    """Errors of one station over the capture."""

    station: str
    time_s: Floats
    """(N,) time since the start of the capture [s]."""
    position_m: Floats
    """(N,) size of the position's error [m]; NaN without a reading."""
    angle_rad: Floats
    """(N,) size of the orientation's error [rad]."""

    def __post_init__(self) -> None:
        freeze(self, time_s=("N",), position_m=("N",), angle_rad=("N",))


@dataclass(frozen=True)
class ReconstructionScore:
    """One metric of one method on the capture."""

    method: str
    metric: str
    value: float | None
    """Mean over the frames, in the metric's unit; None if it was not measured."""


@dataclass(frozen=True, eq=False)
class ValidationReport:
    """Everything that `harness validate` found out about a capture."""

    name: str
    """Name of the capture, or of the unit."""
    command: str
    """The command line that made it."""
    capture: CaptureSummary
    truth: str
    """The reference in words: its file or clip, kind and length."""
    matched_frames: int
    expected_frames: int
    expected_from: str
    """Origin of the expected numbers, such as "the preset default"."""
    numbers: tuple[RegistrationNumber, ...]
    """Time offsets, clock ratio, scale and heading errors."""
    poses: tuple[EstimatedPose, ...]
    """The room first, then the mount of each station."""
    accuracy: tuple[StationAccuracy, ...]
    checks: tuple[DepartureCheck, ...] = ()
    """All checks, in their order; those that are named are the departures."""
    residuals: tuple[ResidualSeries, ...] = ()
    scores: tuple[ReconstructionScore, ...] = ()
    exchanged: tuple[str, ...] = ()
    """Stations that are not where they are said to be, a sentence each."""
    notes: tuple[str, ...] = ()
    """What cannot be told from this capture and what to know about it, a sentence each."""

    @property
    def departures(self) -> tuple[DepartureCheck, ...]:
        """The checks that are named, in their order."""
        return tuple(check for check in self.checks if check.is_named)

    @property
    def matched_share(self) -> float:
        """Share of the expected frames that were matched; NaN without any."""
        return self.matched_frames / self.expected_frames if self.expected_frames else float("nan")
