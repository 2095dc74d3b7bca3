"""Arrays of frozen records cannot be made writable again."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.core.arrays import find_runs, freeze, immutable
from harness.errors import ShapeError


@dataclass(frozen=True)
class Readings:
    position_m: Any
    valid: Any

    def __post_init__(self) -> None:
        freeze(self, position_m=("S", 3))
        freeze(self, bool, valid=(len(self.position_m),))


def test_a_record_does_not_change_with_the_arrays_that_it_was_made_from() -> None:
    given = np.ones((2, 3))
    record = Readings(given, [True, False])
    given[:] = 7.0
    np.testing.assert_array_equal(record.position_m, np.ones((2, 3)))
    assert record.valid.dtype == bool


@pytest.mark.parametrize("shape", [(), (0, 3), (4,), (5, 2, 3)])
def test_no_view_and_no_base_of_an_immutable_array_can_be_written(shape: tuple[int, ...]) -> None:
    array = immutable(np.ones(shape))
    assert array.shape == shape
    for view in (array, array[...], array.reshape(-1), array.view(np.uint8) if shape else array):
        with pytest.raises(ValueError, match="WRITEABLE"):
            view.setflags(write=True)
        with pytest.raises(ValueError, match=r"WRITEABLE|read-only"):
            view.flags.writeable = True
        with pytest.raises(ValueError, match="read-only"):
            view[...] = 0
    assert isinstance(array.base, bytes)


def test_an_immutable_array_is_not_copied_again() -> None:
    array = immutable(np.arange(6.0).reshape(2, 3))
    assert immutable(array) is array
    assert Readings(array, [True, True]).position_m is array
    part = immutable(array[:, 1:])
    np.testing.assert_array_equal(part, [[1.0, 2.0], [4.0, 5.0]])
    assert part is not array


def test_a_read_only_view_of_other_memory_is_copied() -> None:
    memory = np.ones(3)
    view = memory.view()
    view.setflags(write=False)
    array = immutable(view)
    memory[:] = 0.0
    np.testing.assert_array_equal(array, np.ones(3))


def test_integers_and_other_layouts_become_the_type_that_is_asked_for() -> None:
    array = immutable(np.asfortranarray(np.arange(6).reshape(2, 3)))
    assert array.dtype == np.float64
    np.testing.assert_array_equal(array, [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
    np.testing.assert_array_equal(immutable(np.array([1.5, 2.5], ">f8")), [1.5, 2.5])


def test_another_shape_is_refused() -> None:
    with pytest.raises(ShapeError):
        Readings(np.ones((2, 4)), [True, True])


@pytest.mark.parametrize(
    ("values", "error"),
    [
        (np.ones(3) + 1j, TypeError),
        (np.array([1.0, None]), TypeError),
        (["1.0", "2.0"], TypeError),
        (np.ma.array([1.0, 2.0], mask=[False, True]), TypeError),
        (np.array(["2026-01-01"], "datetime64[D]"), TypeError),
        (np.array([np.longdouble("1e4000")]), ValueError),
    ],
)
def test_floats_are_made_of_numbers_alone(values: Any, error: type[Exception]) -> None:
    with pytest.raises(error):
        immutable(values)


def test_numbers_of_other_precision_are_converted() -> None:
    for values in (np.array([0.5, np.inf], np.float32), np.array([0.5, np.inf], np.longdouble), [0.5, np.inf]):
        np.testing.assert_array_equal(immutable(values), [0.5, np.inf])
    assert immutable([]).dtype == np.float64


@given(st.lists(st.booleans(), max_size=40))
def test_runs_are_those_of_a_plain_loop(condition: list[bool]) -> None:
    expected: list[list[int]] = []
    for n, holds in enumerate(condition):
        if holds and expected and expected[-1][1] == n:
            expected[-1][1] += 1
        elif holds:
            expected.append([n, n + 1])
    found = find_runs(np.array(condition, dtype=bool))
    assert found.shape == (len(expected), 2)
    assert found.tolist() == expected
