"""The one interface: what a tracker reports, whatever the source.

Simulator, recording and serial port all yield these frames, and methods see nothing else. Units are SI. Quaternions are
(w, x, y, z). `a_from_b` maps coordinates of b to a.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

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


class TrackerStream(Protocol):
    """Interface of a source of frames.

    Times strictly increase. Stations and their order never change. A silent station is an invalid row, never a repeated
    one. A frame closes when the station number does not increase, or after 1.5 periods. Closing the stream ends the
    iteration without an exception.
    """

    @property
    def stations(self) -> tuple[str, ...]:
        """Names of the S stations, in the order of the rows of a frame."""
        ...

    def __iter__(self) -> Iterator[TrackerFrame]: ...
    def close(self) -> None:
        """Release the source and end the iteration."""
        ...
