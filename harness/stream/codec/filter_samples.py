"""What the filter of an emulated device knows besides the pose: prediction, enhancement and ranges act on it."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats, Ints, freeze
from harness.errors import BadInput
from harness.stream.codec.prediction import MAX_PREDICTION_MS, predict_poses
from harness.stream.codec.replies import Emitter

MAX_ENHANCEMENT = 2
"""Largest mode of perceptual enhancement (`MF`, docs/is900.md 4.2)."""
MAX_RANGES = 12
"""Ranges in a cycle: two microphones, six emitters (docs/is900.md 7)."""


@dataclass(frozen=True, eq=False)
class FilterSamples:
    """The filter's state at E instants of S stations, and the settings of the device after power-on.

    All vectors are in the tracker's axes. Raises ShapeError, and BadInput for a number out of its range.
    """

    velocity_m_s: Floats
    """(E, S, 3) estimated velocity [m/s]."""
    turn_rad_s: Floats
    """(E, S, 3) estimated angular velocity [rad/s]."""
    enhanced_position_m: Floats
    """(2, E, S, 3) positions of the enhancement modes 1 and 2 [m]."""
    enhanced_tracker_from_station: Floats
    """(2, E, S, 4) unit quaternions of the enhancement modes 1 and 2."""
    ranges_received: Ints
    """(E, S) ranges received in the last cycle, 0 to 12."""
    ranges_rejected: Ints
    """(E, S) ranges rejected in the last cycle, 0 to 12."""
    emitters: tuple[Emitter, ...]
    """The constellation that the device has saved."""
    prediction_ms: Ints
    """(S,) prediction (`Mp`) after power-on, 0 to 50 [ms]."""
    enhancement: Ints
    """(S,) enhancement (`MF`) after power-on, 0 to 2."""

    def __post_init__(self) -> None:
        freeze(self, np.int64, ranges_received=("E", "S"), ranges_rejected=("E", "S"))
        instants, stations = self.ranges_received.shape
        shape = (instants, stations, 3)
        freeze(self, velocity_m_s=shape, turn_rad_s=shape, enhanced_position_m=(2, *shape))
        freeze(self, enhanced_tracker_from_station=(2, instants, stations, 4))
        freeze(self, np.int64, prediction_ms=(stations,), enhancement=(stations,))
        for name, largest in (
            ("ranges_received", MAX_RANGES),
            ("ranges_rejected", MAX_RANGES),
            ("prediction_ms", MAX_PREDICTION_MS),
            ("enhancement", MAX_ENHANCEMENT),
        ):
            values = getattr(self, name)
            if values.size and not 0 <= values.min() <= values.max() <= largest:
                raise BadInput(f"{name} reaches from {values.min()} to {values.max()}.", f"Give 0 to {largest}.")

    def report_poses(
        self,
        position_m: Floats,
        tracker_from_station: Floats,
        prediction_ms: Ints,
        enhancement: Ints,
        at: int | slice = slice(None),
    ) -> tuple[Floats, Floats]:
        """Return the positions (..., S, 3) and quaternions (..., S, 4) that stations with these settings (S,) report.

        The given poses are those of mode 0 without prediction, at the instants `at`. Enhancement selects the pose, then
        prediction moves it on.
        """
        mode = np.asarray(enhancement)[:, None]
        return predict_poses(
            np.choose(mode, (position_m, *self.enhanced_position_m[:, at])),
            np.choose(mode, (tracker_from_station, *self.enhanced_tracker_from_station[:, at])),
            self.velocity_m_s[at],
            self.turn_rad_s[at],
            prediction_ms,
        )
