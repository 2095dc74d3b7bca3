"""Options in brackets after a name: `best_match[matching=tree,gate.reach_m=0.5]`; `3|5` gives two names.

Values are those of TOML (numbers, true, "text", [lists]), or plain words. Dots name fields of nested records.
"""

import itertools
from typing import Any

from harness.core.parsing import parse_toml
from harness.errors import BadInput

_ADVICE = "Write it as NAME[OPTION=VALUE,OPTION=VALUE]."


def split_outside_brackets(text: str, at: str) -> list[str]:
    """Split a text at the character `at` outside brackets and quotes; BadInput if these do not match."""
    pieces = [""]
    for sign, level in zip(text, _bracket_depths(text), strict=True):
        if sign == at and level == 0:
            pieces.append("")
        else:
            pieces[-1] += sign
    return [piece.strip() for piece in pieces]


def expand_alternatives(text: str) -> list[str]:
    """Every name that a text with `|` between values stands for; the last option changes fastest."""
    names = [""]
    for part in _split_brackets(text):
        ways = [part]
        if part.startswith("["):
            options = [_expand_option(option) for option in split_outside_brackets(part[1:-1], ",")]
            ways = [f"[{','.join(chosen)}]" for chosen in itertools.product(*options)]
        names = [name + way for name in names for way in ways]
    return names


def parse_name(text: str) -> tuple[str, dict[str, Any]]:
    """Split `name[a=1,b.c=2]` into the name and {"a": 1, "b": {"c": 2}}; BadInput for another form."""
    name, *brackets = _split_brackets(text)
    if len(brackets) > 1 or name.startswith("["):
        raise BadInput(f"{text!r} is not a name with options.", _ADVICE)
    options: dict[str, Any] = {}
    for option in split_outside_brackets(brackets[0][1:-1], ",") if brackets else ():
        _add(options, option, text)
    return name, options


def _add(options: dict[str, Any], option: str, text: str) -> None:
    key, equals, value = (piece.strip() for piece in option.partition("="))
    *parents, last = key.split(".")
    if not equals or not value or not all((*parents, last)):
        raise BadInput(f"{text!r}: {option!r} is not an option with a value.", _ADVICE)
    for parent in parents:
        options = options.setdefault(parent, {})
        if not isinstance(options, dict):
            raise BadInput(f"{text!r} gives {parent} twice.", _ADVICE)
    if last in options:
        raise BadInput(f"{text!r} gives {key} twice.", _ADVICE)
    options[last] = _parse_value(value)


def _parse_value(text: str) -> Any:
    try:
        table = parse_toml(f"value = {text}")
    except ValueError:
        return text
    return table["value"] if set(table) == {"value"} else text


def _expand_option(option: str) -> list[str]:
    """Expand `a=1|2` to `a=1` and `a=2`."""
    key, equals, value = option.partition("=")
    return [key + equals + choice for choice in split_outside_brackets(value, "|")]


def _split_brackets(text: str) -> list[str]:
    """Cut a text before and after its outermost brackets; the list is never empty."""
    pairs = zip(text, _bracket_depths(text), strict=True)
    groups = ["".join(sign for sign, _ in group) for _, group in itertools.groupby(pairs, key=lambda p: p[1] > 0)]
    return groups or [""]


def _bracket_depths(text: str) -> list[int]:
    """Depth of each character in brackets or quotes, which count themselves; BadInput if they do not match."""
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
