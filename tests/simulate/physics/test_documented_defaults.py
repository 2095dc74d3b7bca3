"""The table of docs/is900.md 16.8 has every key of `[physics]` with its present default."""

import dataclasses
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from harness.core.fields import NONE
from harness.simulate.physics.settings import Physics

_PAGE = Path(__file__).parents[3] / "docs" / "is900.md"
_ROW = re.compile(r"^\| `([a-z_.]+)` \| `(.+?)` \|([^|]*)\|([^|]*)\|$", re.MULTILINE)
_CHAPTER = _PAGE.read_text(encoding="utf-8").partition("### 16.8")[2].partition("### 16.9")[0]
ROWS = {key: (default, unit.strip(), source.strip()) for key, default, unit, source in _ROW.findall(_CHAPTER)}


def defaults(settings: Any, before: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted key and value of each field, down to those that are no settings themselves."""
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        if dataclasses.is_dataclass(value):
            yield from defaults(value, f"{before}{field.name}.")
        else:
            yield before + field.name, value


DEFAULTS = dict(defaults(Physics()))


def test_the_table_has_every_key_once_in_the_order_of_the_code() -> None:
    assert [key for key, *_ in _ROW.findall(_CHAPTER)] == list(DEFAULTS)


@pytest.mark.parametrize("key", DEFAULTS)
def test_a_default_is_that_of_the_code(key: str) -> None:
    written = tomllib.loads(f"value = {ROWS[key][0]}")["value"]
    if isinstance(DEFAULTS[key], float):
        assert written == pytest.approx(DEFAULTS[key], rel=2e-4, abs=0.0)  # four digits
    else:
        assert written == _as_toml(DEFAULTS[key])


def test_every_default_says_where_it_is_from() -> None:
    assert [key for key, (_, _, source) in ROWS.items() if not source] == []


@pytest.mark.parametrize(
    ("ending", "unit"), [("_m", "m"), ("_s", "s"), ("_ms", "ms"), ("_hz", "Hz"), ("_rad", "rad"), ("_deg", "deg")]
)
def test_units_are_those_of_the_names(ending: str, unit: str) -> None:
    named = {key: row[1] for key, row in ROWS.items() if key.endswith(ending) and not key.endswith(("_m_s", "per_m"))}
    assert named
    assert set(named.values()) == {unit}


def _as_toml(value: Any) -> Any:
    if value is None:
        return NONE
    return [_as_toml(each) for each in value] if isinstance(value, tuple) else value
