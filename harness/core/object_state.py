"""Text of an object's state: the same in every process for the same state, and another one for another state.

It names types, attributes and values, never an address in memory. Attributes come from the protocol by which Python
copies objects; nothing is restored from it.
"""

import copyreg
import functools
import hashlib
import re
import types
from collections.abc import Mapping, Set
from enum import Enum
from functools import cached_property
from pathlib import PurePath
from typing import Any

import numpy as np

from harness.errors import BadInput

_MAX_TEXT = 2000
"""Longer texts are cut, and end with their hash [choice]."""
_ADDRESS = re.compile(r"\bat 0x[0-9a-fA-F]+")
_PLAIN = (type(None), bool, int, float, complex, str, bytes, type(Ellipsis), type(NotImplemented))


def describe_state(value: object, name: str) -> str:
    """Text of a value that is called `name`; BadInput, which names the attribute, for one without a stable state."""
    text = _StateText().describe(value, name)
    if len(text) <= _MAX_TEXT:
        return text
    return f"{text[:_MAX_TEXT]}... {hashlib.blake2b(text.encode(), digest_size=16).hexdigest()}"


class _StateText:
    """One description; objects inside themselves are named by their number in it."""

    def __init__(self) -> None:
        self._numbers: dict[int, int] = {}
        self._kept: list[object] = []
        """Described objects, which stay alive so that no other gets their number."""

    def describe(self, value: Any, where: str) -> str:
        """Text of a value at a place such as `mine.gains[2]`."""
        if type(value) in _PLAIN:
            return repr(value)
        if isinstance(value, type | types.ModuleType | np.ufunc):
            return _name(value)
        if isinstance(value, Enum):
            return f"{_name(type(value))}.{value.name}"
        if isinstance(value, PurePath):
            return f"{type(value).__name__}({value.as_posix()!r})"
        if id(value) in self._numbers:
            return f"<{self._numbers[id(value)]}>"
        self._numbers[id(value)] = len(self._numbers)
        self._kept.append(value)
        text = self._describe_parts(value, where)
        del self._numbers[id(value)]  # the same object twice, but not in itself, is like two equal ones
        return text

    def _describe_parts(self, value: Any, where: str) -> str:
        kind = type(value)
        if kind in (list, tuple):
            return f"{kind.__name__}({self._items(value, where)})"
        if kind in (set, frozenset) or isinstance(value, Set):
            return f"{_name(kind)}({', '.join(sorted(self.describe(item, where) for item in value))})"
        if kind in (dict, types.MappingProxyType):
            return f"{kind.__name__}({self._pairs(value, where)})"
        if (isinstance(value, np.generic) or kind in (np.ndarray, np.memmap)) and not value.dtype.hasobject:
            return _array_text(np.asarray(value), kind)
        if isinstance(function := getattr(value, "py_func", value), types.FunctionType):  # compiled by numba, or plain
            return self._function(function, where)
        if isinstance(value, functools._lru_cache_wrapper):
            return f"cached {self.describe(value.__wrapped__, where)}"
        if isinstance(value, types.BuiltinFunctionType | types.MethodType):
            function, owner = getattr(value, "__func__", None), value.__self__
            bound = "" if isinstance(owner, types.ModuleType) else f" of {self.describe(owner, where)}"
            return (self.describe(function, where) if function else _name(value)) + bound
        if isinstance(value, types.CodeType):
            constants = self.describe(value.co_consts, where)
            return f"{value.co_name}({value.co_code.hex()}, {value.co_names}, {value.co_varnames}, {constants})"
        return self._object(value, where)

    def _items(self, values: Any, where: str) -> str:
        return ", ".join(self.describe(item, f"{where}[{number}]") for number, item in enumerate(values))

    def _pairs(self, values: Mapping[Any, Any], where: str) -> str:
        keys = [(self.describe(key, where), key) for key in values]
        return ", ".join(
            f"{text}: {self.describe(values[key], f'{where}[{key!r}]')}"
            for text, key in sorted(keys, key=lambda k: k[0])
        )

    def _function(self, value: types.FunctionType, where: str) -> str:
        closure = [cell.cell_contents for cell in value.__closure__ or ()]
        parts = (value.__code__, value.__defaults__, value.__kwdefaults__, closure, vars(value))
        return f"{_name(value)}({', '.join(self.describe(part, where) for part in parts)})"

    def _object(self, value: Any, where: str) -> str:
        """An object by the function, the arguments and the attributes from which a copy would be made."""
        kind = type(value)
        try:
            reduce = copyreg.dispatch_table.get(kind)
            reduced = reduce(value) if reduce else value.__reduce_ex__(4)
        except Exception as error:  # locks, open files and other handles; code from outside may raise anything
            text = repr(value)
            if _ADDRESS.search(text):
                raise _unstable(value, where) from error
            return f"{_name(kind)}({text})"
        if isinstance(reduced, str):
            return f"{kind.__module__}.{reduced}"
        make, arguments, state, items, pairs = (*reduced, None, None, None)[:5]
        parts = [] if arguments == (kind,) else [self._items(arguments, where)]
        if isinstance(state, tuple) and len(state) == 2 and isinstance(state[1], dict):  # with __slots__
            state = {**(state[0] or {}), **state[1]}
        if isinstance(state, dict):
            computed = {
                name for base in kind.__mro__ for name, v in vars(base).items() if isinstance(v, cached_property)
            }
            names = sorted(name for name in state if name not in computed)
            parts += [f"{name}={self.describe(state[name], f'{where}.{name}')}" for name in names]
        elif state is not None:
            parts.append(self.describe(state, where))
        parts += [self._items(items, where)] if items is not None else []
        parts += [self._items(pairs, where)] if pairs is not None else []  # in their order
        made = "" if getattr(make, "__name__", "").startswith("__newobj") else f" by {self.describe(make, where)}"
        return f"{_name(kind)}({', '.join(parts)}){made}"


def _array_text(array: Any, kind: type) -> str:
    state = hashlib.blake2b(digest_size=16)
    state.update(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)
    values = array.tolist() if array.size <= 1 else state.hexdigest()
    return f"{kind.__name__}({array.dtype.descr if array.dtype.names else array.dtype.str}, {array.shape}, {values})"


def _name(value: Any) -> str:
    """Module and name of a class, a function or a module."""
    name = getattr(value, "__qualname__", getattr(value, "__name__", type(value).__name__))
    owner = getattr(value, "__self__", None)
    module = getattr(value, "__module__", None) or (owner.__name__ if isinstance(owner, types.ModuleType) else "")
    return f"{module}.{name}" if module else str(name)


def _unstable(value: object, where: str) -> BadInput:
    return BadInput(
        f"{where} is a {_name(type(value))}, which has no state that a later process can find again.",
        "Make it in `fit`, leave it out of the copied state (`__getstate__`), or give its class a `__repr__`.",
    )
