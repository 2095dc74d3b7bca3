"""Parsers of JSON and TOML that refuse what the standard parsers let through and other code chokes on.

These are integers beyond 64 bits, nesting without end, and single surrogates. Every fault is a ValueError whose text is
one line.
"""

import datetime
import json
import re
import tomllib
from typing import Any

MAX_DEPTH = 50
"""Deepest nesting that is accepted [choice]: the deepest that the harness writes has about ten levels."""
_MAX_DIGITS = 19
_MAX_DOTS = 100
"""Most dots in a key: the time that `tomllib` takes grows with their square."""


def parse_json(text: str) -> Any:
    """The value of a JSON text; ValueError with the place of the fault."""
    try:
        content = json.loads(text, parse_int=_parse_integer)
    except RecursionError as error:
        raise ValueError(f"it is nested more than {MAX_DEPTH} deep") from error
    _check_depth(content)
    if "\\u" in text:  # only there can single surrogates come from
        _check_encodable(json.dumps(content, ensure_ascii=False))
    return content


def parse_toml(text: str) -> dict[str, Any]:
    """The tables of a TOML text; ValueError with the place of the fault, as far as it is known."""
    for number, line in enumerate(text.split("\n"), start=1):
        if line.count(".") > _MAX_DOTS and max(part.count(".") for part in line.split(",")) > _MAX_DOTS:
            raise ValueError(f"more than {_MAX_DOTS} dots between two commas (at line {number})")
    try:
        content = tomllib.loads(text)
    except RecursionError as error:
        raise ValueError(f"it is nested more than {MAX_DEPTH} deep") from error
    except tomllib.TOMLDecodeError as error:
        raise ValueError(_one_line(error)) from error
    except ValueError as error:  # the digits of an integer
        raise ValueError(f"a value that cannot be read ({_one_line(error)})") from error
    _check_depth(content)
    _check_values(content, "")
    return content


def _parse_integer(digits: str) -> int:
    if len(digits) > _MAX_DIGITS + 1 or not _fits_64_bits(value := int(digits)):
        raise ValueError(f"the integer {digits[:12]}... of {len(digits)} characters does not fit into 64 bits")
    return value


def _fits_64_bits(value: int) -> bool:
    return -(2**63) <= value < 2**63


def _check_depth(content: Any) -> None:
    level = [content] if isinstance(content, dict | list) else []
    for _ in range(MAX_DEPTH):
        level = [
            child
            for node in level
            for child in (node.values() if isinstance(node, dict) else node)
            if isinstance(child, dict | list)
        ]
    if level:
        raise ValueError(f"it is nested more than {MAX_DEPTH} deep")


def _check_encodable(text: str) -> None:
    if surrogate := re.search("[\ud800-\udfff]", text):
        raise ValueError(f"the single surrogate \\u{ord(surrogate[0]):04x}, which is no character")


def _check_values(value: Any, where: str) -> None:
    """ValueError for integers beyond 64 bits and for dates, which no key of the harness has."""
    if isinstance(value, dict):
        for key, item in value.items():
            _check_values(item, f"{where}.{key[:40]}" if where else key[:40])
    elif isinstance(value, list):
        for item in value:
            _check_values(item, where)
    elif isinstance(value, int) and not _fits_64_bits(value):
        raise ValueError(f"{where} is an integer that does not fit into 64 bits")
    elif isinstance(value, datetime.date | datetime.time):
        raise ValueError(f"{where} is a date or a time")


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
