"""The text of a state: the same in another process, another one for another state, and refused where there is none."""

import functools
import os
import re
import subprocess
import sys
import threading
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from decimal import Decimal
from enum import Enum
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from harness.core.object_state import describe_state
from harness.errors import BadInput


class Plain:
    """It has no `__repr__`: its own names its address."""

    def __init__(self, **attributes: Any) -> None:
        self.__dict__.update(attributes)

    def gain(self) -> float:
        return 1.0


class Slots:
    __slots__ = ("a", "b")

    def __init__(self, a: Any, b: Any) -> None:
        self.a, self.b = a, b


@dataclass(frozen=True)
class Options:
    width: float = 1.0
    hidden: int = field(default=1, repr=False)
    inner: Any = None


class Colour(Enum):
    RED = 1
    BLUE = 2


class Lazy(Plain):
    @functools.cached_property
    def table(self) -> object:
        return object()


def power(x: float, exponent: int = 2) -> float:
    return float(x**exponent)


def scaled_by(factor: float) -> Callable[[float], float]:
    return lambda x: factor * x


@numba.njit
def doubled(x: float) -> float:
    return 2.0 * x


@numba.njit
def tripled(x: float) -> float:
    return 3.0 * x


CHANGES: dict[str, Callable[[], tuple[Any, Any]]] = {
    "an attribute": lambda: (Plain(a=1.0), Plain(a=2.0)),
    "a new attribute": lambda: (Plain(a=1.0), Plain(a=1.0, b=None)),
    "an attribute in a list": lambda: (Plain(a=[Plain(b=1)]), Plain(a=[Plain(b=2)])),
    "slots": lambda: (Slots(1, 2), Slots(1, 3)),
    "a field that repr leaves out": lambda: (Options(hidden=1), Options(hidden=2)),
    "a record in a record": lambda: (Options(inner=Options(2.0)), Options(inner=Options(3.0))),
    "a set": lambda: ({"a", "b", "c"}, {"a", "b", "d"}),
    "a type of set": lambda: ({"a"}, frozenset({"a"})),
    "a value of a dict": lambda: ({"a": 1, "b": [1]}, {"a": 1, "b": [2]}),
    "an order that counts": lambda: (OrderedDict(a=1, b=2), OrderedDict(b=2, a=1)),
    "an array": lambda: (np.arange(2000.0), np.arange(2000.0) + 1e-9),
    "a shape": lambda: (np.zeros((2, 3)), np.zeros((3, 2))),
    "a type of numbers": lambda: (np.zeros(3, np.float32), np.zeros(3, np.int32)),
    "a mask": lambda: (np.ma.array([1.0, 2.0], mask=[False, True]), np.ma.array([1.0, 2.0], mask=[True, False])),
    "a scalar": lambda: (np.float32(1.5), np.float64(1.5)),
    "True for 1": lambda: (True, 1),
    "an enumeration": lambda: (Colour.RED, Colour.BLUE),
    "a path": lambda: (Path("a/b"), Path("a/c")),
    "a function": lambda: (power, scaled_by),
    "a lambda": lambda: (lambda x: x + 1, lambda x: x + 2),
    "what a function captures": lambda: (scaled_by(2.0), scaled_by(3.0)),
    "arguments of a function": lambda: (functools.partial(power, exponent=2), functools.partial(power, exponent=3)),
    "arguments of a cached function": lambda: (functools.cache(scaled_by(2.0)), functools.cache(scaled_by(3.0))),
    "a method of an object": lambda: (Plain(a=1).gain, Plain(a=2).gain),
    "a compiled function": lambda: (doubled, tripled),
    "a function of numpy": lambda: (np.tanh, np.sinh),
    "a random generator": lambda: (np.random.default_rng(1), np.random.default_rng(2)),
    "a deque": lambda: (deque([1, 2]), deque([2, 1])),
    "a decimal": lambda: (Decimal("1.0"), Decimal("1.00")),
    "a pattern": lambda: (re.compile("a" * 300 + "b"), re.compile("a" * 300 + "c")),
    "an array of objects": lambda: (np.array([{"a": 1}], object), np.array([{"a": 2}], object)),
    "a class": lambda: (Plain, Slots),
    "the end of a long text": lambda: ("a" * 5000 + "b", "a" * 5000 + "c"),
}


@pytest.mark.parametrize("make", CHANGES.values(), ids=CHANGES)
def test_another_state_has_another_text(make: Callable[[], tuple[Any, Any]]) -> None:
    one, other = make()
    assert describe_state(one, "x") != describe_state(other, "x")
    assert describe_state(one, "x") == describe_state(make()[0], "x")


def print_texts() -> None:
    """What another process prints."""
    for make in CHANGES.values():
        print(ascii(describe_state(make()[0], "x")))


@pytest.mark.long
def test_the_text_is_that_of_another_process() -> None:
    """Hashes of texts, hence the order of sets, and addresses differ between processes."""
    code = "from tests.core.test_object_state import print_texts; print_texts()"
    texts = []
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
        texts.append(done.stdout.splitlines())
    assert texts[0] == texts[1] == [ascii(describe_state(make()[0], "x")) for make in CHANGES.values()]
    assert not any("0x" in text for text in texts[0])


def test_an_object_may_contain_itself() -> None:
    loop = Plain(a=1)
    loop.__dict__["me"] = [loop]
    assert describe_state(loop, "x").endswith("Plain(a=1, me=list(<0>))")


def test_what_was_computed_from_the_state_does_not_count() -> None:
    lazy = Lazy(a=1)
    before = describe_state(lazy, "x")
    assert lazy.table is not None
    assert describe_state(lazy, "x") == before


def test_equal_parts_need_not_be_the_same_object() -> None:
    part = Plain(a=1)
    assert describe_state([part, part], "x") == describe_state([Plain(a=1), Plain(a=1)], "x")


def test_long_texts_are_cut() -> None:
    assert len(describe_state(list(range(100_000)), "x")) < 2100


@pytest.mark.parametrize(
    ("value", "place"),
    [
        (Plain(lock=threading.Lock()), r"mine\.lock is a _thread\.lock"),
        (Plain(a=[1, {"b": (i for i in range(3))}]), r"mine\.a\[1\]\['b'\] is a .*generator"),
        (Options(inner=memoryview(b"a")), r"mine\.inner is a .*memoryview"),
    ],
)
def test_a_part_without_a_state_is_named(value: Any, place: str) -> None:
    with pytest.raises(BadInput, match=place):
        describe_state(value, "mine")


def test_a_repr_of_ones_own_serves_where_there_is_no_state() -> None:
    class Handle(Plain):
        def __reduce_ex__(self, protocol: Any) -> Any:
            raise TypeError("a handle")

        def __repr__(self) -> str:
            return f"Handle({vars(self)['a']})"

    assert describe_state(Handle(a=1), "x") != describe_state(Handle(a=2), "x")
