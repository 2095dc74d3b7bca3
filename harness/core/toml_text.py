"""Text of TOML files. Floats keep every digit."""

import string
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

_BARE_KEY_CHARACTERS = frozenset(string.ascii_letters + string.digits + "_-")
"""Characters of a TOML key without quotes."""


def toml_table_lines(name: str, content: Mapping[str, Any]) -> Iterator[str]:
    """Lines of a TOML table; plain values come before inner tables, as TOML requires."""
    yield f"[{name}]"
    for key, value in content.items():
        if not isinstance(value, Mapping):
            yield f"{format_toml_key(key)} = {format_toml_value(value)}"
    for key, value in content.items():
        if isinstance(value, Mapping):
            yield ""
            yield from toml_table_lines(f"{name}.{format_toml_key(key)}", value)


def format_toml_key(name: str) -> str:
    """A TOML key, quoted where it must be."""
    return name if name and set(name) <= _BARE_KEY_CHARACTERS else format_toml_value(name)


def format_toml_value(value: Any) -> str:
    """A TOML value; floats keep every digit. TypeError for types that TOML does not have."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(float(value))  # the repr of numpy floats names their type
    if isinstance(value, int):
        return str(value)
    if isinstance(value, str):
        return f'"{"".join(map(_character, value))}"'
    if isinstance(value, Sequence):
        return f"[{', '.join(map(format_toml_value, value))}]"
    raise TypeError(f"{value!r} cannot be written")


def _character(character: str) -> str:
    if character in '"\\':
        return f"\\{character}"
    return f"\\u{ord(character):04x}" if ord(character) < 0x20 or ord(character) == 0x7F else character
