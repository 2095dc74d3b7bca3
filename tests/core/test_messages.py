"""Messages between processes: what is written is read again, and anything else is refused."""

import io
import json
from collections.abc import Mapping

import numpy as np
import pytest

from harness.core.messages import MessageError, read_message, write_message

ARRAYS = {
    "poses": np.arange(12.0).reshape(3, 4),
    "counts": np.array([1, -2, 2**62]),
    "flags": np.array([[True], [False]]),
    "none": np.zeros((0, 3)),
    "odd": np.array([np.nan, np.inf, -0.0]),
}


def written(header: Mapping[str, object]) -> bytes:
    file = io.BytesIO()
    write_message(file, header, ARRAYS)
    return file.getvalue()


def message(content: object, tail: bytes = b"") -> bytes:
    text = json.dumps(content).encode()
    return len(text).to_bytes(8, "little") + text + tail


def test_a_message_is_read_as_it_was_written() -> None:
    header = {"name": "überall", "list": [1, 0.1, None], "state": {"key": 2**64 - 1}}
    found, arrays = read_message(io.BytesIO(written(header)))
    assert found == header
    assert set(arrays) == set(ARRAYS)
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(arrays[name], array)
        assert arrays[name].dtype == array.dtype
        with pytest.raises(ValueError, match="WRITEABLE"):
            arrays[name].setflags(write=True)


def test_a_message_that_was_cut_is_refused_wherever_it_ends() -> None:
    whole = written({"name": "x"})
    for size in range(len(whole)):
        with pytest.raises(MessageError):
            read_message(io.BytesIO(whole[:size]))


@pytest.mark.parametrize(
    "data",
    [
        b"\xff" * 64,
        (1 << 40).to_bytes(8, "little"),
        message([]),
        message({"header": {}}),
        message({"header": 3, "arrays": []}),
        message({"header": {}, "arrays": [["a", "<f8", [1 << 60]]]}),
        message({"header": {}, "arrays": [["a", "<f8", [-1]]]}),
        message({"header": {}, "arrays": [["a", "<f8", ["3"]]]}),
        message({"header": {}, "arrays": [["a", "<f8", [True]]]}, b"x" * 8),
        message({"header": {}, "arrays": [["a", "|O", [1]]]}, b"x" * 8),
        message({"header": {}, "arrays": [["a", [], [1]]]}, b"x" * 8),
        message({"header": {}, "arrays": [["a"]]}),
        len(b"[" * 5000).to_bytes(8, "little") + b"[" * 5000,
    ],
)
def test_anything_else_is_refused(data: bytes) -> None:
    with pytest.raises(MessageError):
        read_message(io.BytesIO(data), max_bytes=1 << 20)


def test_a_message_of_more_numbers_than_expected_is_refused_before_they_are_read() -> None:
    file = io.BytesIO(message({"header": {}, "arrays": [["a", "<f8", [100]]]}, b"x" * 800))
    with pytest.raises(MessageError, match="more numbers"):
        read_message(file, max_bytes=799)
    assert file.read() == b"x" * 800
