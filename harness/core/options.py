"""Options written after a name: `best_match[matching=tree,gate.reach_m=0.5]`; `3|5` stands for one after the other.

Values are TOML's (numbers, true, "text", [lists]) and plain words; dots lead into records inside records.
"""

import itertools
import tomllib
from typing import Any

from harness.errors import BadInput

_ADVICE = "Write it as NAME[OPTION=VALUE,OPTION=VALUE]."


def split_outside_brackets(text: str, at: str) -> list[str]:
    """The pieces of a text between the signs `at` that stand outside brackets and quotes; BadInput if those are odd."""
    pieces = [""]
    for sign, level in zip(text, _bracket_depths(text), strict=True):
        if sign == at and level == 0:
            pieces.append("")
        else:
            pieces[-1] += sign
    return [piece.strip() for piece in pieces]


def expand_alternatives(text: str) -> list[str]:
    """Every name that a text with `|` between values stands for, the last option changing fastest."""
    names = [""]
    for part in _split_brackets(text):
        ways = [part]
        if part.startswith("["):
            options = [_expand_option(option) for option in split_outside_brackets(part[1:-1], ",")]
            ways = [f"[{','.join(chosen)}]" for chosen in itertools.product(*options)]
        names = [name + way for name in names for way in ways]
    return names


def parse_name(text: str) -> tuple[str, dict[str, Any]]:
    """`name[a=1,b.c=2]` as the name and {"a": 1, "b": {"c": 2}}; BadInput when it is not written so."""
    name, *brackets = _split_brackets(text)
    if len(brackets) > 1 or name.startswith("["):
        raise BadInput(f"{text!r} is no name with options.", _ADVICE)
    found: dict[str, Any] = {}
    for option in split_outside_brackets(brackets[0][1:-1], ",") if brackets else ():
        _add(found, option, text)
    return name, found


def _add(found: dict[str, Any], option: str, text: str) -> None:
    key, equals, value = (piece.strip() for piece in option.partition("="))
    *into, last = key.split(".")
    if not equals or not value or not all((*into, last)):
        raise BadInput(f"{text!r}: {option!r} is no option with a value.", _ADVICE)
    for step in into:
        found = found.setdefault(step, {})
        if not isinstance(found, dict):
            raise BadInput(f"{text!r} gives {step} twice.", _ADVICE)
    if last in found:
        raise BadInput(f"{text!r} gives {key} twice.", _ADVICE)
    found[last] = _value(value)


def _value(text: str) -> Any:
    try:
        found = tomllib.loads(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text
    return found["value"] if set(found) == {"value"} else text


def _expand_option(option: str) -> list[str]:
    """`a=1|2` as `a=1` and `a=2`."""
    key, equals, value = option.partition("=")
    return [key + equals + one for one in split_outside_brackets(value, "|")]


def _split_brackets(text: str) -> list[str]:
    """A text cut before and after its outermost brackets; never empty."""
    pairs = zip(text, _bracket_depths(text), strict=True)
    groups = ["".join(sign for sign, _ in group) for _, group in itertools.groupby(pairs, key=lambda p: p[1] > 0)]
    return groups or [""]


def _bracket_depths(text: str) -> list[int]:
    """How deep in brackets or quotes each sign stands, those themselves included; BadInput if they do not match."""
    levels, depth, quote = [], 0, ""
    for sign in text:
        opens = not quote and sign == "["
        closes = not quote and sign == "]"
        quoted = bool(quote) or sign in "\"'"
        depth += opens
        levels.append(depth + quoted)
        depth -= closes
        if quoted:
            quote = "" if quote == sign else quote or sign
        if depth < 0:
            break
    if depth or quote:
        raise BadInput(f"{text!r}: its brackets or quotes do not match.", _ADVICE)
    return levels
