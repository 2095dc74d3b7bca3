"""Unit file: the errors, clock and tracker of one device as they were measured, in TOML.

A scenario names the file with the key `fitted`. The tables `[components]` and `[tracker]` hold the values that a
scenario takes over. `[measured]` holds value, interval and count of each measured key. `[not_measured]` says why a key
kept its default. `[session]` holds what a reference showed of the session, such as latency and scale.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from harness.core.fields import build
from harness.core.files import read_toml
from harness.core.output_file import write_output
from harness.core.toml_text import format_toml_value, toml_table_lines
from harness.errors import BadFile, HarnessError
from harness.measure.conventions import require_scale
from harness.measure.measured import Measured

UNIT_SCHEMA = 1
UNIT_FILE = "a unit file"
_ADVICE = "`harness characterize` writes one; docs/hil.md has the format."
_HEAD = """\
# Errors, clock and tracker of one device, written by `harness characterize`. A scenario names it: fitted = "FILE".
# Metres, radians, seconds; an entry of [measured] is value, low and high end of the 95 % interval, and count."""


@dataclass(frozen=True)
class UnitFile:
    """Content of a unit file."""

    name: str
    """Name of the unit in tables."""
    components: Mapping[str, Any]
    """Error components: name -> field -> value, as in a scenario."""
    tracker: Mapping[str, Any]
    """Fields of the scenario's table [tracker]."""
    measured: Mapping[str, Measured] = field(default_factory=dict)
    """Dotted key -> measured number; keys of lists end in an index, such as "components.echo.size_m.0"."""
    not_measured: Mapping[str, str] = field(default_factory=dict)
    """Dotted key -> reason why it kept its default."""
    session: Mapping[str, Measured] = field(default_factory=dict)
    """What a reference showed of the session: name -> measured number."""
    capture: Mapping[str, Any] = field(default_factory=dict)
    """Origin of the measurement: file, digest, duration and more; information for people."""


@dataclass(frozen=True)
class _UnitTables:
    """Tables of the TOML file."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {}

    schema: int
    kind: str
    name: str
    components: dict[str, Any]
    tracker: dict[str, Any]
    measured: dict[str, tuple[float, float, float, int]] = field(default_factory=dict)
    not_measured: dict[str, str] = field(default_factory=dict)
    session: dict[str, tuple[float, float, float, int]] = field(default_factory=dict)
    capture: dict[str, Any] = field(default_factory=dict)


def write_unit_file(path: Path, unit: UnitFile, *, force: bool = False) -> None:
    """Write a unit file atomically; BadFile when it exists without `force`, or cannot be written."""
    write_output(path, "\n".join(_lines(unit)) + "\n", UNIT_FILE, force=force)


def read_unit_file(path: Path | str) -> UnitFile:
    """Read a unit file; BadFile for anything else, unknown tables, numbers that contradict each other, and a session's
    scale that is no tracker's.

    The values of `components` and `tracker` are checked where a scenario takes them over.
    """
    path = Path(path)
    content = read_toml(path, UNIT_FILE, _ADVICE)
    if content.get("kind") != "unit":
        raise BadFile(path, f"kind {content.get('kind')!r}", 'a unit file with kind = "unit"', _ADVICE)
    if content.get("schema") != UNIT_SCHEMA:
        advice = "This version of the harness reads no other."
        raise BadFile(path, f"schema {content.get('schema')!r}", f"schema {UNIT_SCHEMA}", advice)
    try:
        tables = build(_UnitTables, content, "unit")
        for name, value in tables.components.items():
            if not isinstance(value, Mapping):
                raise TypeError(f"unit.components.{name}: expected a table, found {value!r}")
        measured, session = (
            {key: Measured(*numbers) for key, numbers in table.items()} for table in (tables.measured, tables.session)
        )
        if "scale" in session:
            require_scale(1.0 + session["scale"].value)
    except (TypeError, ValueError, HarnessError) as error:
        raise BadFile(path, str(error).rstrip("."), UNIT_FILE, _ADVICE) from error
    return UnitFile(
        tables.name, tables.components, tables.tracker, measured, tables.not_measured, session, tables.capture
    )


def unit_value(unit: UnitFile, key: str) -> float | None:
    """The value of a dotted key of [components] or [tracker]; None where it is not there or no number."""
    value: Any = {"components": unit.components, "tracker": unit.tracker}
    for part in key.split("."):
        if isinstance(value, Mapping):
            value = value.get(part)
        elif isinstance(value, Sequence) and not isinstance(value, str) and part.isdecimal() and int(part) < len(value):
            value = value[int(part)]
        else:
            return None
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _lines(unit: UnitFile) -> Iterator[str]:
    yield from (_HEAD, f"schema = {UNIT_SCHEMA}", 'kind = "unit"', f"name = {format_toml_value(unit.name)}", "")
    for name, component in unit.components.items():
        yield from (*toml_table_lines(f"components.{name}", component), "")
    yield from (*toml_table_lines("tracker", unit.tracker), "")
    yield from (*toml_table_lines("measured", _numbers(unit.measured)), "")
    yield from (*toml_table_lines("not_measured", unit.not_measured), "")
    if unit.session:
        yield "# What a reference showed of the session; scenarios do not take it over."
        yield from (*toml_table_lines("session", _numbers(unit.session)), "")
    yield "# Information for people; the harness does not read this table."
    yield from toml_table_lines("capture", unit.capture)


def _numbers(table: Mapping[str, Measured]) -> dict[str, list[float | int]]:
    """The entries that were measured and are finite: TOML files of this project hold no other numbers."""
    return {
        key: [one.value, one.low, one.high, one.count]
        for key, one in table.items()
        if one.is_measured and all(map(math.isfinite, (one.value, one.low, one.high)))
    }
