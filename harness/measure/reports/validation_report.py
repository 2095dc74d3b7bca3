"""The report on a validated capture: how it lies against its reference, in SI units."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, freeze
from harness.core.number_format import NORMAL_QUANTILE, Interval
from harness.core.seeds import generator
from harness.measure.registration import Registration
from harness.measure.reports.departures import Departure
from harness.measure.reports.unit_report import CaptureSummary

ROOM = "room"
"""Name of the pose of the tracker's frame in the reference's; other poses are mounts of stations."""


_BLOCK_S = 5.0
"""Length of the blocks that the bootstrap draws [s]: five correlation times of the drift."""
_FEWEST_BLOCKS = 5
_RESAMPLES = 400


@dataclass(frozen=True)
class ErrorQuantiles:
    """Root mean square, median and 95 % quantile of the size of an error."""

    rms: Interval
    median: Interval
    quantile95: Interval


@dataclass(frozen=True)
class StationAccuracy:
    """Errors of one station against the reference, after the registration."""

    position: ErrorQuantiles
    """Errors of the position [m]."""
    orientation: ErrorQuantiles
    """Errors of the orientation [rad]."""
    readings: int
    """Number of readings that were compared."""
    lost_share: float
    """Share of the readings without a position."""


@dataclass(frozen=True, eq=False)
class EstimatedPose:
    """A pose that the registration estimated: the room, or the mount of a station on its body."""

    name: str
    """`ROOM`, or the station."""
    body: str
    """Body of the reference that carries the station; "" for the room."""
    position_m: tuple[Interval, ...]
    """Three coordinates with their intervals [m]."""
    rotation: Floats
    """(4,) unit quaternion (w, x, y, z)."""
    angle_rad: float
    """Half width of the 95 % interval of the orientation, about its least certain axis [rad]."""

    def __post_init__(self) -> None:
        freeze(self, rotation=(4,))


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


@dataclass(frozen=True, eq=False)
class ValidationReport:
    """Everything that a reference shows of a capture."""

    name: str
    """Name of the capture, or of the unit."""
    capture: CaptureSummary
    truth: str
    """The reference in words: its file or clip, kind and length."""
    matched_frames: int
    expected_frames: int
    expected_from: str
    """Origin of the expected numbers, such as "the preset default"."""
    numbers: Mapping[str, Interval]
    """Time offsets, clock, scale, heading and latency, by key."""
    poses: tuple[EstimatedPose, ...]
    """The room first, then the mount of each station."""
    accuracy: Mapping[str, StationAccuracy]
    """Station -> its errors after the registration."""
    checks: tuple[Departure, ...] = ()
    """All checks, in their order; those that are named are the departures."""
    residuals: tuple[ResidualSeries, ...] = ()
    exchanged: tuple[str, ...] = ()
    """Stations that are not where they are said to be, a sentence each."""
    notes: tuple[str, ...] = ()
    """What cannot be told from this capture and what to know about it, a sentence each."""

    @property
    def matched_share(self) -> float:
        """Share of the expected frames that were matched; NaN without any."""
        return self.matched_frames / self.expected_frames if self.expected_frames else float("nan")


def estimated_poses(registration: Registration) -> tuple[EstimatedPose, ...]:
    """The room, then the mount of each station."""
    origin = tuple(registration.values[f"tracker_origin_m.{axis}"] for axis in range(3))
    room = registration.world_from_tracker, _half_width_rad(registration.room_covariance)
    mounts = [
        EstimatedPose(
            station,
            mount.body,
            tuple(mount.position(axis) for axis in range(3)),
            mount.body_from_station,
            _half_width_rad(mount.covariance),
        )
        for station, mount in registration.mounts.items()
    ]
    return (EstimatedPose(ROOM, "", origin, *room), *mounts)


def _half_width_rad(covariance: Floats) -> float:
    """Half width of a rotation, whose covariance is the first three rows of (6, 6) [rad]."""
    return NORMAL_QUANTILE * float(np.sqrt(np.linalg.eigvalsh(covariance[:3, :3])[-1]))


def residual_series(registration: Registration) -> tuple[ResidualSeries, ...]:
    """Sizes of the errors of each station over time."""
    out = []
    for station, errors in registration.errors.items():
        position_m, angle_rad = (
            np.where(errors.valid, np.linalg.norm(values, axis=1), np.nan)
            for values in (errors.position_m, errors.rotation_rad)
        )
        out.append(ResidualSeries(station, errors.truth_s - errors.truth_s[0], position_m, angle_rad))
    return tuple(out)


def error_quantiles(error: Floats, valid: Bools, period_s: float) -> ErrorQuantiles:
    """Summarise errors (N, 3) on a grid of `period_s`; `valid` (N,) are those that were measured.

    Intervals are percentiles of a bootstrap over blocks of five seconds (Kunsch 1989, Ann. Statist. 17).
    """
    size = np.linalg.norm(error, axis=1)
    length = max(round(_BLOCK_S / period_s), 1)
    blocks = [size[at : at + length][valid[at : at + length]] for at in range(0, len(size), length)]
    blocks = [block for block in blocks if len(block) >= valid.mean() * length / 2.0]
    if len(blocks) < _FEWEST_BLOCKS:
        missing = Interval.missing(f"{_FEWEST_BLOCKS * _BLOCK_S:g} s of readings are needed.")
        return ErrorQuantiles(missing, missing, missing)
    rng = generator(0, "error quantiles")
    draws = rng.integers(0, len(blocks), (_RESAMPLES, len(blocks)))
    resampled = np.array([_summary(np.concatenate([blocks[i] for i in draw])) for draw in draws])
    values, count = _summary(np.concatenate(blocks)), sum(map(len, blocks))
    low, high = np.quantile(resampled, [0.025, 0.975], axis=0)
    rms, median, large = (
        Interval(value, min(float(a), value), max(float(b), value), count)
        for value, a, b in zip(values, low, high, strict=True)
    )
    return ErrorQuantiles(rms, median, large)


def _summary(size: Floats) -> tuple[float, float, float]:
    median, large = np.quantile(size, [0.5, 0.95]).tolist()
    return float(np.sqrt(np.mean(size**2))), median, large
