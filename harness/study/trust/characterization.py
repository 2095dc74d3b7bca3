"""Characterisation of a unit: its profile as a unit file, and its departures from what is expected."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.number_format import Interval
from harness.core.progress import ProgressCallback
from harness.measure.departures import Departure
from harness.measure.profile import UnitProfile, measure_profile
from harness.measure.unit_file import UnitFile
from harness.measure.unit_report import UnitReport, unit_report
from harness.results.digests import file_digest
from harness.stream.recording.recording import EXPECTED_FILE
from harness.study.trust.expected_values import (
    UNIFORM_KEYS,
    check_departures,
    flatten_components,
    nest_components,
    preset_components,
    preset_values,
    unit_values,
)

REFERENCE_NEEDED = "A reference is needed: `harness validate`."
DEFAULT_KEPT = {
    "components.session.scale": REFERENCE_NEEDED,
    "components.session.station_offset_m": REFERENCE_NEEDED,
    "components.excursion.ramp_s": "Excursions do not show it well enough.",
    "components.clock.offset_s": "The driver sets the clock to zero.",
}
"""Keys that no capture shows -> why they keep the default."""
CHECKED_TIMING = ("timing.lost_share", "timing.duplicate_share", "timing.stamp_resolution_s", "timing.clock_age_s")
STATION_CHECKS = ("components.dropout.share", "components.echo.share", "components.white.position_m")
"""Parameters that are also checked for each station."""


@dataclass(frozen=True, eq=False)
class Characterization:
    """What was found out about a unit."""

    profile: UnitProfile
    unit: UnitFile
    checks: tuple[Departure, ...]
    expected_from: str
    """Origin of the expected numbers: the preset, or the name of an earlier unit."""

    @property
    def named(self) -> tuple[Departure, ...]:
        """The departures that are significant after the correction."""
        return tuple(check for check in self.checks if check.is_named)

    @property
    def report(self) -> UnitReport:
        """All that the unit's page shows."""
        defaults = {key: number.value for key, number in preset_values().items()}
        return unit_report(self.profile, self.unit, self.checks, self.expected_from, defaults)


def characterize_capture(
    path: Path,
    *,
    name: str = "",
    expected: UnitFile | None = None,
    rigid: tuple[str, str] | None = None,
    progress: ProgressCallback = lambda step, done, planned: None,
) -> Characterization:
    """Measure a unit from a capture, and compare it with the preset `default` or with an earlier unit file.

    `name` is that of the unit; by default the capture's. BadFile and BadInput as `measure.profile.measure_profile`.
    """
    profile = measure_profile(path, rigid=rigid, progress=progress)
    unit = make_unit_file(profile, name or path.stem, path)
    known = preset_values() if expected is None else unit_values(expected)
    checks = check_departures(measured_numbers(profile), expected_numbers(profile, known))
    return Characterization(profile, unit, tuple(checks), expected.name if expected else "the preset default")


def make_unit_file(profile: UnitProfile, name: str, path: Path) -> UnitFile:
    """The unit file of a profile: measured values in their places, the preset's where nothing was measured."""
    components = preset_components()
    defaults = dict(flatten_components(components))
    measured = {key: number for key, number in profile.parameters.items() if key in defaults}
    values = {key: number.value for key, number in measured.items() if number.is_measured}
    reasons = {key: number.reason for key, number in measured.items() if not number.is_measured}
    return UnitFile(
        name,
        nest_components(_in_order(values), components),
        {"rate_hz": profile.rate_hz, "items": list(profile.items)},
        {key: number for key, number in {**measured, **_means(profile)}.items() if number.is_measured},
        {**reasons, **{key: reason for key, reason in DEFAULT_KEPT.items() if key in defaults}},
        capture=_describe_capture(profile, path),
    )


def measured_numbers(profile: UnitProfile) -> dict[tuple[str, str], Interval]:
    """Everything that is checked: (key, station) -> number; of a uniform distribution its mean, not its ends."""
    parameters = {key: one for key, one in profile.parameters.items() if not key[-1].isdecimal()}
    numbers = {(key, ""): one for key, one in {**parameters, **_means(profile)}.items()}
    numbers |= {(key, ""): profile.timing.all_stations[key] for key in CHECKED_TIMING}
    for station in profile.stations:
        own = {**profile.noise.by_station.get(station, {}), **profile.episodes.by_station.get(station, {})}
        numbers |= {(key, station): own[key] for key in STATION_CHECKS if key in own}
    return numbers


def expected_numbers(profile: UnitProfile, known: Mapping[str, Interval]) -> dict[tuple[str, str], Interval]:
    """What is expected of the measured numbers: the known ones, and of the line that no record is lost or repeated."""
    line = dict.fromkeys(("timing.lost_share", "timing.duplicate_share", "timing.clock_age_s"), 0.0)
    resolution = profile.timing.all_stations["timing.stamp_resolution_s"]
    if resolution.value > 2.0 * profile.timing.expected_resolution_s:  # else it is as fine as the format allows
        line["timing.stamp_resolution_s"] = profile.timing.expected_resolution_s
    numbers = {**known, **{key: Interval.normal(value, 0.0) for key, value in line.items()}}
    return {(key, ""): number for key, number in numbers.items()}


def _means(profile: UnitProfile) -> dict[str, Interval]:
    return {key: profile.episodes.means[key] for key in UNIFORM_KEYS if key in profile.episodes.means}


def _in_order(values: Mapping[str, float]) -> dict[str, float]:
    """The values; the ends of a distribution in rising order, and not below zero."""
    out = dict(values)
    for key in UNIFORM_KEYS:
        ends = [f"{key}.{i}" for i in (0, 1) if f"{key}.{i}" in out]
        out |= dict(zip(ends, sorted(max(out[end], 0.0) for end in ends), strict=True))
    return out


def _describe_capture(profile: UnitProfile, path: Path) -> dict[str, Any]:
    stretches = {one.name or "unmarked": round(one.duration_s, 3) for one in profile.stretches}
    return {
        "file": path.name,
        "digest": file_digest(path, EXPECTED_FILE, ""),
        "stations": list(profile.stations),
        "seconds": stretches,
        "rest_s": round(float(np.sum([one.duration_s for one in profile.rest])), 3),
        "damage": list(profile.damage),
    }
