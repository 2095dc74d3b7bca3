"""Frozen dataclasses built from mappings, such as TOML tables, and checked against their annotations."""

import dataclasses
import json
import math
import types
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from harness.core.ranges import constraints_of
from harness.errors import HarnessError, RenamedKey, UnknownName, shorten

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T = TypeVar("T", bound="DataclassInstance")

NONE = "none"
"""The word for None where a value may be None: TOML has no null."""


def build(kind: type[T], content: Any, where: str) -> T:
    """Build a dataclass from a mapping by its annotations.

    `where` names the place in messages. `kind.STORED_NAMES` has keys of earlier versions -> fields. Raises UnknownName
    and RenamedKey for keys, TypeError for values, and ValueError for numbers outside the range of their field
    (`core.ranges`).
    """
    if not isinstance(content, Mapping):
        raise _wrong_type(dict, content, where)
    stored: Mapping[str, str] = getattr(kind, "STORED_NAMES", {})
    content = {stored.get(key, key): value for key, value in content.items()}
    hints = get_type_hints(kind, include_extras=True)
    fields = {f.name: f for f in dataclasses.fields(kind) if f.init}
    _refuse_unknown_keys(kind, content, fields, where)
    missing = [
        f.name
        for f in fields.values()
        if f.name not in content and f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING
    ]
    if missing:
        raise TypeError(f"{where}: missing {', '.join(missing)}")
    return kind(**{key: convert(hints[key], value, f"{where}.{key}") for key, value in content.items()})


def replace_fields(instance: T, content: Mapping[str, Any], where: str, infinite: bool = False) -> T:
    """A copy of a dataclass with some fields replaced, checked as by `build`.

    Mappings change nested records and tables field by field. `infinite` allows infinite numbers, where no range forbids
    them.
    """
    hints = get_type_hints(type(instance), include_extras=True)
    fields = [f.name for f in dataclasses.fields(instance) if f.init]
    _refuse_unknown_keys(type(instance), content, fields, where)
    values: dict[str, Any] = {}
    for key, value in content.items():
        now = getattr(instance, key)
        if dataclasses.is_dataclass(now) and not isinstance(now, type) and isinstance(value, Mapping):
            values[key] = replace_fields(now, value, f"{where}.{key}", infinite)
        elif isinstance(now, Mapping) and isinstance(value, Mapping):
            values[key] = {**now, **dict(_replace_entries(now, value, hints[key], f"{where}.{key}", infinite))}
        elif infinite and isinstance(value, float) and math.isinf(value) and _may_be_infinite(hints[key], value):
            values[key] = value
        else:
            values[key] = convert(hints[key], value, f"{where}.{key}")
    return dataclasses.replace(instance, **values)


def _refuse_unknown_keys(kind: type, content: Mapping[str, Any], fields: Iterable[str], where: str) -> None:
    """Raises RenamedKey for a key of `kind.RENAMED_KEYS` (old name -> new name or advice), UnknownName for others."""
    renamed: Mapping[str, str] = getattr(kind, "RENAMED_KEYS", {})
    for key in content:
        if key in renamed:
            raise RenamedKey(where, key, renamed[key])
        if key not in fields:
            raise UnknownName(f"key in {where}", str(key), fields)


def _replace_entries(
    now: Mapping[str, Any], content: Mapping[str, Any], hint: Any, where: str, infinite: bool
) -> Iterator[tuple[str, Any]]:
    """The entries that `content` changes or adds; nested records and tables keep the fields it does not name."""
    kind = (get_args(hint) or (Any, Any))[1]
    for key, value in content.items():
        old = now.get(key)
        if isinstance(value, Mapping) and dataclasses.is_dataclass(old) and not isinstance(old, type):
            yield key, replace_fields(old, value, f"{where}.{key}", infinite)
        elif isinstance(value, Mapping) and isinstance(old, Mapping):
            yield key, {**old, **dict(_replace_entries(old, value, Any, f"{where}.{key}", infinite))}
        else:
            yield key, convert(kind, value, f"{where}.{key}")


def convert(hint: Any, value: Any, where: str) -> Any:
    """Convert a value to the type of an annotation; TypeError and ValueError name the place and what was expected."""
    origin, args = get_origin(hint), get_args(hint)
    if hint is Any:
        return value
    if origin is Annotated:
        return _require(hint, convert(args[0], value, where), where)
    if origin in (Union, types.UnionType):
        return _convert_union(args, value, where)
    if origin is Literal:
        if value not in args:
            raise UnknownName(where, str(value), [str(a) for a in args])
        return value
    if origin is tuple:
        if not isinstance(value, list):
            raise _wrong_type(hint, value, where)
        if args[-1] is not Ellipsis and len(args) != len(value):
            raise TypeError(f"{where}: expected {len(args)} values, found {len(value)}")
        kinds = [args[0]] * len(value) if args[-1] is Ellipsis else args
        pairs = enumerate(zip(kinds, value, strict=True))
        return tuple(convert(kind, item, f"{where}[{i}]") for i, (kind, item) in pairs)
    if origin is dict:
        if not isinstance(value, Mapping):
            raise _wrong_type(hint, value, where)
        return {
            convert(args[0], str(key), where): convert(args[1], item, f"{where}.{shorten(key, 60)}")
            for key, item in value.items()
        }
    if dataclasses.is_dataclass(hint):
        return build(cast("type[DataclassInstance]", hint), value, where)
    if hint is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, hint) or (isinstance(value, bool) and hint is not bool):
        raise _wrong_type(hint, value, where)
    if isinstance(value, float) and not math.isfinite(value):
        raise TypeError(f"{where}: expected a finite number, found {value}")
    return value


def _require(hint: Any, value: Any, where: str) -> Any:
    """The value, if it obeys the rules of an annotation; ValueError."""
    for rule in constraints_of(hint):
        if not rule.accepts(value):
            raise ValueError(f"{where} = {shorten(repr(value), 60)} must be {rule}")
    return value


def _may_be_infinite(hint: Any, value: float) -> bool:
    kind = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    return kind is float and all(rule.accepts(value) for rule in constraints_of(hint))


def check_entries(content: Any, hints: Mapping[str, Any], where: str) -> None:
    """TypeError unless a mapping has every entry of `hints`, with a value that fits its annotation; others may follow.

    UnknownName for a value that is none of the choices.
    """
    if not isinstance(content, Mapping):
        raise _wrong_type(dict, content, where)
    for name, hint in hints.items():
        if name not in content:
            raise TypeError(f"{where}: no {name}")
        convert(hint, content[name], f"{where}.{name}")


def _wrong_type(hint: Any, found: Any, where: str) -> TypeError:
    """The error "scenario.methods: expected a list of texts, such as ["ik"], found 'ik'"."""
    kind, _, example = _describe_type(hint, found)
    such = f", such as {example}" if example else ""
    return TypeError(f"{where}: expected {kind}{such}, found {shorten(repr(found), 60)}")


_SCALARS = {
    bool: ("true or false", "booleans", ""),
    int: ("a whole number", "whole numbers", "3"),
    float: ("a number", "numbers", "0.5"),
    str: ("a text", "texts", '"walking"'),
}


def _describe_type(hint: Any, found: Any) -> tuple[str, str, str]:
    """What values an annotation allows, in the singular and in the plural, and an example made of what was found."""
    origin, args = get_origin(hint), [arg for arg in get_args(hint) if arg is not type(None)]
    if origin in (Annotated, Union, types.UnionType):
        return _describe_type(args[0], found)
    if origin is tuple:
        _, kinds, example = _describe_type(args[0], found)
        number = 1 if args[-1] is Ellipsis else len(args)
        text = f"of {kinds if args[-1] is Ellipsis else f'{number} {kinds}'}"
        return f"a list {text}", f"lists {text}", f"[{', '.join([example] * number)}]"
    if type(found) is hint:
        return *_SCALARS[hint][:2], json.dumps(found, ensure_ascii=False)
    return _SCALARS.get(hint, ("a table", "tables", ""))


def _convert_union(kinds: tuple[Any, ...], value: Any, where: str) -> Any:
    if type(None) in kinds and value in (None, NONE):
        return None
    errors: list[Exception] = []
    for kind in kinds:
        if kind is not type(None):
            try:
                return convert(kind, value, where)
            except (TypeError, ValueError, HarnessError) as error:
                errors.append(error)
    raise errors[0]
