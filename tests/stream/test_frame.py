"""Frames that are split from arrays are those that are made one by one."""

from typing import Any

import numpy as np
import pytest

from harness.errors import ShapeError
from harness.stream.frame import TrackerFrame, split_frames

FIELDS = TrackerFrame.__slots__[1:]


@pytest.fixture
def columns(rng: np.random.Generator) -> list[np.ndarray[Any, Any]]:
    """Arrays of the fields for 5 frames of 3 stations, some of them not contiguous."""
    position_m, quaternion = np.swapaxes(rng.normal(size=(3, 5, 3)), 0, 1), rng.normal(size=(5, 3, 4))
    valid, suspect = rng.random((2, 5, 3)) < 0.5
    return [rng.random((5, 3)), position_m, quaternion, valid, ~valid, rng.random((5, 3)).astype(np.float32), suspect]


def test_split_frames_are_those_made_one_by_one(columns: list[np.ndarray[Any, Any]]) -> None:
    times_s = [0.1 * n for n in range(5)]
    for n, frame in enumerate(split_frames(times_s, *columns)):
        expected = TrackerFrame(times_s[n], *(column[n] for column in columns))
        assert frame.received_s == expected.received_s
        for name in FIELDS:
            array, wanted = getattr(frame, name), getattr(expected, name)
            assert (array.dtype, array.shape, array.tobytes()) == (wanted.dtype, wanted.shape, wanted.tobytes())


def test_no_frame_leads_to_another_or_can_be_written(columns: list[np.ndarray[Any, Any]]) -> None:
    for frame in split_frames([0.0] * 5, *columns):
        for name in FIELDS:
            array = getattr(frame, name)
            assert array.base == array.tobytes()  # the memory behind the array holds nothing else
            with pytest.raises(ValueError, match="WRITEABLE"):
                array.flags.writeable = True


def test_no_frames_come_of_empty_arrays(columns: list[np.ndarray[Any, Any]]) -> None:
    assert split_frames([], *(column[:0] for column in columns)) == []


@pytest.mark.parametrize("field", range(7))
def test_arrays_that_disagree_are_refused(field: int, columns: list[np.ndarray[Any, Any]]) -> None:
    columns[field] = columns[field][:, :2]
    with pytest.raises(ShapeError):
        split_frames([0.0] * 5, *columns)


def test_arrays_of_another_number_of_frames_are_refused(columns: list[np.ndarray[Any, Any]]) -> None:
    with pytest.raises(ValueError, match="zip"):
        split_frames([0.0] * 4, *columns)
