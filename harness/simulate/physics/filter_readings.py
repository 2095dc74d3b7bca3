"""What the device's filters report of stations, before clock and line."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats, Ints


@dataclass(eq=False)
class FilterMotion:
    """What prediction and enhancement need of S stations at E times; see `stream.codec.filter_samples`."""

    velocity_m_s: Floats
    """(E, S, 3) estimated velocity [m/s]."""
    turn_rad_s: Floats
    """(E, S, 3) estimated angular velocity [rad/s]."""
    enhanced_position_m: Floats
    """(2, E, S, 3) positions of the enhancement modes 1 and 2 [m]."""
    enhanced_tracker_from_station: Floats
    """(2, E, S, 4) unit quaternions of these modes."""


@dataclass(eq=False)
class FilterReadings:
    """What the device's filters report of S stations at E times, in the tracker's frame."""

    position_m: Floats
    """(E, S, 3) position of the station's origin [m]."""
    tracker_from_station: Floats
    """(E, S, 4) unit quaternions."""
    quality: Floats
    """(E, S) 0 lost to 1 best."""
    ranges_received: Ints
    """(E, S) ranges received in the last cycle, 0 to 12."""
    ranges_rejected: Ints
    """(E, S) ranges of these that the filter rejected."""
    hearing_share: Floats
    """(S,) share of the take's slots in which the station has heard three emitters or more within a turn, directly."""
    echo_share: Floats
    """(S,) share of the take's ranges that came from an echo."""
    motion: FilterMotion | None
    """None unless it was asked for."""


def empty_readings(shape: Sequence[int], with_motion: bool) -> FilterReadings:
    """Readings of shape (E, S) to be filled."""
    motion = None
    if with_motion:
        motion = FilterMotion(
            np.zeros((*shape, 3)), np.zeros((*shape, 3)), np.zeros((2, *shape, 3)), np.zeros((2, *shape, 4))
        )
    return FilterReadings(
        position_m=np.zeros((*shape, 3)),
        tracker_from_station=np.zeros((*shape, 4)),
        quality=np.zeros(shape),
        ranges_received=np.zeros(shape, np.int8),
        ranges_rejected=np.zeros(shape, np.int8),
        hearing_share=np.zeros(shape[1]),
        echo_share=np.zeros(shape[1]),
        motion=motion,
    )
