"""Names, units and decimals of the numbers that the lab's pages show, by their keys."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from harness.core.number_format import Interval, format_fixed


@dataclass(frozen=True)
class Quantity:
    """Name of a number and the unit that it is shown in."""

    label: str
    unit: str = ""
    """Unit, as it stands behind the number; "" without one."""
    factor: float = 1.0
    """Number in this unit over that in SI units."""

    @property
    def title(self) -> str:
        """The name with its unit, for the head of a column or an axis."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label

    def of(self, number: Interval) -> Interval:
        """A number in SI units in the unit of the quantity."""
        return number.scaled(self.factor, self.unit)

    def bare(self, number: Interval) -> Interval:
        """A number in the unit of the quantity, which the head of a column or a row names."""
        return number.scaled(self.factor)

    def exact(self, value: float) -> str:
        """A number that is known exactly, with its unit, in at most four significant digits."""
        rounded = float(f"{self.factor * value:.4g}")
        return Interval(rounded, rounded, rounded, unit=self.unit).number


_MM, _DEG, _MS, _PERCENT = ("mm", 1e3), ("deg", math.degrees(1.0)), ("ms", 1e3), ("%", 100.0)
_NAMES: Mapping[str, Quantity] = {
    "components.white.position_m": Quantity("white noise of the position", *_MM),
    "components.white.orientation_rad": Quantity("white noise of the orientation", *_DEG),
    "components.drift.position_m": Quantity("drift of the position", *_MM),
    "components.drift.pitch_roll_rad": Quantity("drift of pitch and roll", *_DEG),
    "components.drift.yaw_rad": Quantity("drift of yaw", *_DEG),
    "components.drift.correlation_s": Quantity("correlation time of the drift", "s"),
    "components.excursion.onsets_per_min": Quantity("rate of excursions", "/min"),
    "components.excursion.size_m": Quantity("mean size of an excursion", *_MM),
    "components.excursion.size_m.0": Quantity("smallest excursion", *_MM),
    "components.excursion.size_m.1": Quantity("largest excursion", *_MM),
    "components.excursion.stay_s": Quantity("mean duration of an excursion", "s"),
    "components.excursion.stay_s.0": Quantity("shortest excursion", "s"),
    "components.excursion.stay_s.1": Quantity("longest excursion", "s"),
    "components.excursion.ramp_s": Quantity("rise of an excursion", "s"),
    "components.echo.share": Quantity("share of echoes", *_PERCENT),
    "components.echo.burst_records": Quantity("mean length of an echo burst", "records"),
    "components.echo.burst_records.0": Quantity("shortest echo burst", "records"),
    "components.echo.burst_records.1": Quantity("longest echo burst", "records"),
    "components.echo.size_m": Quantity("mean size of an echo", *_MM),
    "components.echo.size_m.0": Quantity("smallest echo", *_MM),
    "components.echo.size_m.1": Quantity("largest echo", *_MM),
    "components.dropout.share": Quantity("share of lost readings", *_PERCENT),
    "components.dropout.gap_s": Quantity("mean length of a gap", "s"),
    "components.dropout.gap_s.0": Quantity("shortest gap", "s"),
    "components.dropout.gap_s.1": Quantity("longest gap", "s"),
    "components.dropout.coast_s": Quantity("falling quality before a gap", "s"),
    "components.dropout.tilt_rad": Quantity("tilt error before a gap", *_DEG),
    "components.speed.ahead_s": Quantity("positions ahead of orientations", *_MS),
    "components.session.scale": Quantity("scale error", *_PERCENT),
    "components.session.station_offset_m": Quantity("offset of a station in its housing", *_MM),
    "components.clock.drift_ppm": Quantity("error of the clock's rate", "ppm"),
    "components.clock.offset_s": Quantity("clock at the start", "s"),
    "timing.rate_hz": Quantity("rate of a station", "Hz"),
    "timing.jitter_s": Quantity("jitter of the stamps", *_MS),
    "timing.lost_share": Quantity("share of lost records", *_PERCENT),
    "timing.duplicate_share": Quantity("share of duplicate records", *_PERCENT),
    "timing.delay_s": Quantity("mean delay of records on the line", *_MS),
    "timing.stamp_resolution_s": Quantity("resolution of the stamps", *_MS),
    "timing.clock_age_s": Quantity("clock at the set-up", "s"),
    "time_offset_orientation_s": Quantity("time offset by orientation", *_MS),
    "time_offset_position_s": Quantity("time offset by position", *_MS),
    "scale": Quantity("scale error", *_PERCENT),
    "heading_rad": Quantity("heading error", *_DEG),
    "latency_s": Quantity("latency", *_MS),
    "mount_turn_rad": Quantity("turn of the station against its mount", *_DEG),
    "mount_shift_m": Quantity("distance of the station from its mount", *_MM),
    "station.half_within_m": Quantity("half of the positions within", *_MM),
    "station.most_within_m": Quantity("95 % of the positions within", *_MM),
    "station.half_within_rad": Quantity("half of the orientations within", *_DEG),
    "station.most_within_rad": Quantity("95 % of the orientations within", *_DEG),
    "station.white_m": Quantity("white noise", *_MM),
    "station.slow_m": Quantity("drift", *_MM),
    "station.slope_m_min": Quantity("drift of the mean", "mm/min", 1e3),
    "station.excursions_per_min": Quantity("excursions", "/min"),
    "station.echo_share": Quantity("echoes", *_PERCENT),
    "station.gap_share": Quantity("lost readings", *_PERCENT),
    "station.rate_hz": Quantity("rate", "Hz"),
    "station.jitter_s": Quantity("jitter", *_MS),
    "station.lost_share": Quantity("lost records", *_PERCENT),
    "station.duplicate_share": Quantity("duplicates", *_PERCENT),
}
_SUFFIXES: tuple[tuple[str, str, float], ...] = (
    ("_m_min", "mm/min", 1e3),
    ("_rad", *_DEG),
    ("_ppm", "ppm", 1.0),
    ("share", *_PERCENT),
    ("_per_min", "/min", 1.0),
    ("_hz", "Hz", 1.0),
    ("_s", "s", 1.0),
    ("_m", *_MM),
)
"""Ends of keys that have no name here, with their unit."""


def format_range(values: Iterable[float], decimals: int = 2) -> str:
    """The smallest and the largest of several values, "2.1 to 3.0"; one number where they are written alike."""
    found = list(values)
    return " to ".join(dict.fromkeys(format_fixed(end, decimals) for end in (min(found), max(found))))


def find_quantity(key: str) -> Quantity:
    """The name and unit of a key; an unknown key is its own name, with the unit that its end states."""
    if key in _NAMES:
        return _NAMES[key]
    stem = re.sub(r"\.\d+$", "", key)
    return next((Quantity(key, unit, factor) for end, unit, factor in _SUFFIXES if stem.endswith(end)), Quantity(key))
