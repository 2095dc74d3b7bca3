"""Unit file: the errors, clock and tracker of one device as they were measured, in TOML.

A scenario names the file with the key `fitted`. The tables `[components]` and `[tracker]` hold the values that a
scenario takes over. `[measured]` holds value, interval and count of each measured key. `[not_measured]` says why a key
kept its default. `[session]` holds what a reference showed of the session, such as latency and scale. The first line
is a digest of all others (`core.toml_file`).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from harness.core.fields import build
from harness.core.file_kind import check_toml_kind
from harness.core.files import write_output
from harness.core.number_format import Interval
from harness.core.toml_file import EARLIER_SCHEMA, SCHEMA, format_toml, insert_toml_digest, read_digested_toml
from harness.errors import BadFile, HarnessError
from harness.measure.conventions import require_scale

UNIT_FILE = "a unit file"
CUT_ADVICE = "Restore it from a copy, or measure the unit again."
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
    measured: Mapping[str, Interval] = field(default_factory=dict)
    """Dotted key -> measured number; keys of lists end in an index, such as "components.echo.size_m.0"."""
    not_measured: Mapping[str, str] = field(default_factory=dict)
    """Dotted key -> reason why it kept its default."""
    session: Mapping[str, Interval] = field(default_factory=dict)
    """What a reference showed of the session: name -> measured number."""
    capture: Mapping[str, Any] = field(default_factory=dict)
    """Origin of the measurement: file, digest, duration and more; information for people."""
    schema: int = SCHEMA
    """Schema of the file that it was read from."""
    caveat: str = ""
    """What cannot be verified of that file; "" if its digest fits."""


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
    write_output(path, insert_toml_digest(_text(unit)), UNIT_FILE, force=force)


def read_unit_file(path: Path | str) -> UnitFile:
    """Read a unit file.

    BadFile for anything else, for one that is cut, damaged or edited, unknown tables, contradicting numbers, and a
    session's scale that is no tracker's.
    The values of `components` and `tracker` are checked where a scenario takes them over.
    """
    path = Path(path)
    content, caveat = read_digested_toml(path, UNIT_FILE, _ADVICE)
    check_toml_kind(path, content, UNIT_FILE, _ADVICE, needs_kind="unit")
    try:
        tables = build(_UnitTables, content, "unit")
        for name, value in tables.components.items():
            if not isinstance(value, Mapping):
                raise TypeError(f"unit.components.{name}: expected a table, found {value!r}")
        measured, session = (
            {key: Interval(*numbers) for key, numbers in table.items()} for table in (tables.measured, tables.session)
        )
        if "scale" in session:
            require_scale(1.0 + session["scale"].value)
    except (TypeError, ValueError, HarnessError) as error:
        raise BadFile(path, str(error).rstrip("."), UNIT_FILE, _ADVICE) from error
    numbers = (measured, tables.not_measured, session, tables.capture)
    unit = UnitFile(tables.name, tables.components, tables.tracker, *numbers, tables.schema, caveat)
    if unit.schema == EARLIER_SCHEMA:
        _require_all(path, unit, content)
    return unit


def _require_all(path: Path, unit: UnitFile, content: Mapping[str, Any]) -> None:
    """BadFile when a file without a digest lacks what was always written: it was cut or lost lines.

    `experiment.scenarios.fitted_unit` also looks for every field of each component.
    """
    lost = [key for key in (*unit.measured, *unit.not_measured) if _find_value(unit, key) is None]
    lost += [f"tracker.{key}" for key in ("rate_hz", "items") if key not in unit.tracker]
    lost += [f"[{table}]" for table in ("measured", "not_measured", "capture") if table not in content]
    if lost:
        raise BadFile(path, f"damaged: no {lost[0]}", f"the whole of {UNIT_FILE}", CUT_ADVICE)


def _find_value(unit: UnitFile, key: str) -> Any:
    """The value of a dotted key of [components] or [tracker]; None where it is not there."""
    value: Any = {"components": unit.components, "tracker": unit.tracker}
    for part in key.split("."):
        if isinstance(value, Mapping):
            value = value.get(part)
        elif isinstance(value, Sequence) and not isinstance(value, str) and part.isdecimal() and int(part) < len(value):
            value = value[int(part)]
        else:
            return None
    return value


def _text(unit: UnitFile) -> str:
    tables = {
        "schema": SCHEMA,
        "kind": "unit",
        "name": unit.name,
        "components": unit.components,
        "tracker": unit.tracker,
        "measured": _numbers(unit.measured),
        "not_measured": unit.not_measured,
    }
    parts: list[tuple[str, dict[str, Any]]] = [(_HEAD, tables)]
    if unit.session:
        session = {"session": _numbers(unit.session)}
        parts.append(("# What a reference showed of the session; scenarios do not take it over.", session))
    parts.append(("# Information for people; the harness does not read this table.", {"capture": unit.capture}))
    return "\n".join(f"{comment}\n{format_toml(tables)}" for comment, tables in parts)


def _numbers(table: Mapping[str, Interval]) -> dict[str, list[float | int]]:
    """The entries that were measured and are finite: TOML files of this project hold no other numbers."""
    return {
        key: [one.value, one.low, one.high, one.count]
        for key, one in table.items()
        if one.is_measured and all(map(math.isfinite, (one.value, one.low, one.high)))
    }
