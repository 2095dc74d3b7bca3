"""The one interface: what a tracker reports, whatever the source.

Simulator, recording and serial port all yield these frames, and methods see nothing else. Units are SI. Quaternions are
(w, x, y, z). `a_from_b` maps coordinates of b to a.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Bools, Floats, freeze


@dataclass(frozen=True, slots=True, eq=False)
class TrackerFrame:
    """One round of S stations as the receiver saw it. Raises ShapeError if the arrays disagree about S."""

    received_s: float
    """Host monotonic clock when the frame was complete [s]."""
    measured_s: Floats
    """(S,) device time of each station's measurement, unwrapped [s]; NaN where no record arrived."""
    position_m: Floats
    """(S, 3) station origin in the tracker frame [m]; NaN where not valid."""
    tracker_from_station: Floats
    """(S, 4) unit quaternion; NaN where not valid."""
    position_valid: Bools
    """(S,) False where no usable position arrived: the station is lost or reports orientation only."""
    orientation_valid: Bools
    """(S,) False where no usable orientation arrived."""
    quality: Floats
    """(S,) tracking quality, 0 (lost) to 1 (best), from item 40."""
    suspect: Bools
    """(S,) True where station order, time or plausibility suggests a damaged record."""

    def __post_init__(self) -> None:
        stations = len(self.measured_s)
        freeze(self, measured_s=(stations,), position_m=(stations, 3), tracker_from_station=(stations, 4))
        freeze(self, quality=(stations,))
        freeze(self, bool, position_valid=(stations,), orientation_valid=(stations,), suspect=(stations,))


def split_frames(
    received_s: Sequence[float],
    measured_s: Floats,
    position_m: Floats,
    tracker_from_station: Floats,
    position_valid: Bools,
    orientation_valid: Bools,
    quality: Floats,
    suspect: Bools,
) -> list[TrackerFrame]:
    """The F frames of arrays (F, ...) of the fields of `TrackerFrame`, in a tenth of the time of F calls of it.

    Every frame has memory of its own, so that none leads to a later one. Raises ShapeError if the arrays disagree
    about the stations, and ValueError if they disagree about F.
    """
    if not len(received_s):
        return []
    arrays = (measured_s, position_m, tracker_from_station, position_valid, orientation_valid, quality, suspect)
    first = TrackerFrame(received_s[0], *(array[0] for array in arrays))  # checks the shapes and converts
    columns = [_split_rows(array, getattr(first, name)) for name, array in zip(_ARRAYS, arrays, strict=True)]
    frames = []
    for time_s, *row in zip(received_s, *columns, strict=True):
        frame = object.__new__(TrackerFrame)
        _SET_RECEIVED(frame, time_s)
        for set_field, values in zip(_SET_ARRAYS, row, strict=True):
            set_field(frame, values)
        frames.append(frame)
    return frames


_ARRAYS = tuple(TrackerFrame.__slots__[1:])
_SET_RECEIVED, *_SET_ARRAYS = (getattr(TrackerFrame, name).__set__ for name in TrackerFrame.__slots__)
"""Setters of the fields that bypass the frozen class."""


def _split_rows(array: NDArray[Any], first: NDArray[Any]) -> list[NDArray[Any]]:
    """The rows of an array as immutable arrays like `first`, each over `bytes` of its own (see `core.arrays`)."""
    data, size = np.asarray(array, first.dtype, order="C").tobytes(), first.nbytes
    shape, kind = first.shape, first.dtype
    return [np.ndarray(shape, kind, data[at : at + size]) for at in range(0, len(data), size)]


class TrackerStream(Protocol):
    """Interface of a source of frames.

    Times strictly increase. Stations and their order never change. A silent station is an invalid row, never a repeated
    one. A frame of a device closes when the station number does not increase, or after 1.5 periods. A pose log has no
    period: its frames hold the poses of one time. Closing the stream ends the iteration without an exception.
    """

    @property
    def stations(self) -> tuple[str, ...]:
        """Names of the S stations, in the order of the rows of a frame."""
        ...

    def __iter__(self) -> Iterator[TrackerFrame]: ...
    def close(self) -> None:
        """Release the source and end the iteration."""
        ...
