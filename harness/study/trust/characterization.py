"""Characterization of a unit: its profile as a unit file, and its departures from what is expected.

A noise preset or an earlier unit file holds the expected numbers.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.compare import holm
from harness.core.fields import replace_fields
from harness.core.number_format import Interval
from harness.core.progress import ProgressCallback
from harness.errors import BadInput
from harness.measure import Bar, SurveyComparison, UnitFile, UnitProfile, measure_log_profile, measure_profile
from harness.measure.reports import Departure, UnitReport, compare_with_expected, make_unit_report
from harness.results.files import file_digest
from harness.simulate import noise_preset
from harness.stream.recording import EXPECTED_FILE, CaptureReader, PoseRecording

UNIFORM_KEYS = (
    "components.excursion.size_m",
    "components.excursion.stay_s",
    "components.echo.burst_records",
    "components.echo.size_m",
    "components.dropout.gap_s",
)
"""Keys of two numbers that are the ends of a uniform distribution. Its mean is checked, which is known better."""
EXPECTED_PRESET = "default"


def preset_components() -> dict[str, Any]:
    """The components of the preset `default` as tables of TOML; components that it lacks are left out."""
    return {
        name: {key: list(value) if isinstance(value, tuple) else value for key, value in table.items()}
        for name, table in asdict(noise_preset(EXPECTED_PRESET)).items()
        if table
    }


def preset_values() -> dict[str, Interval]:
    """Dotted key -> number of the preset `default`, known exactly; of a uniform distribution also its mean."""
    return _with_means({key: Interval.normal(value, 0.0) for key, value in flatten_components(preset_components())})


def unit_values(unit: UnitFile) -> dict[str, Interval]:
    """Dotted key -> number that an earlier unit file measured, with its interval; of a uniform distribution its mean.

    Keys that the file did not measure are left out. BadInput for values that no scenario would accept.
    """
    try:
        replace_fields(noise_preset(EXPECTED_PRESET), unit.components, "components")
    except (TypeError, ValueError) as error:
        raise BadInput(f"{error}.", "Use a unit file that `harness characterize` wrote.") from error
    return _with_means(dict(unit.measured))


def flatten_components(components: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    """Dotted keys and values of the numbers in tables of components, such as "components.echo.size_m.0"."""
    for name, table in components.items():
        for key, value in table.items():
            values = value if isinstance(value, Sequence) and not isinstance(value, str) else None
            if values is not None:
                yield from (
                    (f"components.{name}.{key}.{i}", float(v))
                    for i, v in enumerate(values)
                    if isinstance(v, int | float)
                )
            elif isinstance(value, int | float) and not isinstance(value, bool):
                yield f"components.{name}.{key}", float(value)


def nest_components(values: Mapping[str, float], base: Mapping[str, Any]) -> dict[str, Any]:
    """The tables `base` with the numbers of dotted keys in their places; whole numbers stay whole."""
    out: dict[str, Any] = {
        name: {key: list(value) if isinstance(value, list | tuple) else value for key, value in table.items()}
        for name, table in base.items()
    }
    for dotted, value in values.items():
        _, name, key, *index = dotted.split(".")
        before = out[name][key]
        if index:
            whole = isinstance(before[int(index[0])], int)
            before[int(index[0])] = round(value) if whole else float(value)
        else:
            out[name][key] = round(value) if isinstance(before, int) else float(value)
    return out


def _with_means(values: dict[str, Interval]) -> dict[str, Interval]:
    """The numbers, and for each pair of ends of a uniform distribution its mean under the key without an index.

    A mean that is there already stays: it was measured itself.
    """
    for key in UNIFORM_KEYS:
        ends = [values.get(f"{key}.{i}") for i in (0, 1)]
        if key not in values and ends[0] is not None and ends[1] is not None:
            middle = 0.5 * (ends[0].value + ends[1].value)
            values[key] = Interval.normal(middle, 0.0)
    return values


def check_departures(
    measured: Mapping[tuple[str, str], Interval], expected: Mapping[tuple[str, str], Interval]
) -> list[Departure]:
    """Compare every number that was measured and is expected; both map (key, station) to a number.

    A station's number whose own expectation is missing is compared with that of all stations (station ""). The result
    is in the order of `measured`, with p-values that Holm's correction over all checks has raised.
    """
    checks = []
    for (key, station), number in measured.items():
        reference = expected.get((key, station), expected.get((key, "")))
        if number.is_measured and reference is not None and reference.is_measured:
            checks.append(compare_with_expected(key, station, number, reference))
    return correct_departures(checks)


def correct_departures(checks: Sequence[Departure]) -> list[Departure]:
    """The checks with their p-values corrected for their number."""
    corrected = holm([check.p for check in checks])
    return [replace(check, p_holm=p) for check, p in zip(checks, corrected, strict=True)]


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
    survey: SurveyComparison | None = None
    """Rests against surveyed points; None without any."""

    @property
    def named(self) -> tuple[Departure, ...]:
        """The departures that are significant after the correction."""
        return tuple(check for check in self.checks if check.is_named)

    @property
    def report(self) -> UnitReport:
        """All that the unit's page shows."""
        defaults = {key: number.value for key, number in preset_values().items()} if self.profile.items else {}
        return make_unit_report(self.profile, self.unit, self.checks, self.expected_from, defaults, self.survey)


def characterize_capture(
    reader: CaptureReader,
    *,
    expected: UnitFile | None = None,
    bar: Bar | None = None,
    progress: ProgressCallback = lambda step, done, planned: None,
) -> Characterization:
    """Measure a unit from a capture, and compare it with the preset `default` or with an earlier unit file.

    The unit has the name of the capture. BadFile and BadInput as `measure.profile.measure_profile`.
    """
    profile = measure_profile(reader, bar=bar, progress=progress)
    known = preset_values() if expected is None else unit_values(expected)
    return _compare(profile, reader.path, known, expected.name if expected else "the preset default")


def characterize_log(
    recording: PoseRecording,
    *,
    expected: UnitFile | None = None,
    bar: Bar | None = None,
    progress: ProgressCallback = lambda step, done, planned: None,
) -> Characterization:
    """Measure the source of a file of poses, and compare it with an earlier unit file, but with no preset."""
    profile = replace(
        measure_log_profile(recording.log, recording.marks, bar=bar, progress=progress), damage=recording.damage
    )
    known = {} if expected is None else unit_values(expected)
    return _compare(profile, recording.path, known, expected.name if expected else "")


def _compare(profile: UnitProfile, path: Path, known: Mapping[str, Interval], name: str) -> Characterization:
    unit = make_unit_file(profile, path)
    checks = check_departures(measured_numbers(profile), expected_numbers(profile, known))
    return Characterization(profile, unit, tuple(checks), name)


def make_unit_file(profile: UnitProfile, path: Path) -> UnitFile:
    """The unit file of a profile: measured values in their places, the preset's where nothing was measured."""
    components = preset_components()
    defaults = dict(flatten_components(components))
    measured = {key: number for key, number in profile.parameters.items() if key in defaults}
    values = {key: number.value for key, number in measured.items() if number.is_measured}
    reasons = {key: number.reason for key, number in measured.items() if not number.is_measured}
    return UnitFile(
        path.stem,
        nest_components(_in_order(values), components),
        {"rate_hz": profile.rate_hz} | ({"items": list(profile.items)} if profile.items else {}),
        {key: number for key, number in {**measured, **_means(profile)}.items() if number.is_measured},
        {**reasons, **{key: reason for key, reason in DEFAULT_KEPT.items() if key in defaults and profile.items}},
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
    """What is expected of the measured numbers: the known ones, and of a line that no record is lost or repeated."""
    if not profile.items:  # a file of poses came over no line
        return {(key, ""): number for key, number in known.items()}
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
