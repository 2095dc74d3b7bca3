"""Numbers that a unit is expected to have, by a noise preset or an earlier unit file, and departures from them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

from harness.compare.significance import holm
from harness.core.fields import replace_fields
from harness.core.number_format import Interval
from harness.errors import BadInput
from harness.measure.departures import Departure, compare_with_expected
from harness.measure.unit_file import UnitFile
from harness.simulate.noise import noise_preset

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
