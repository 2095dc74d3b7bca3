"""The readings that an emulated device plays in a loop, and what its filter knows besides: prediction, enhancement,
ranges.
"""

from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, Ints, freeze
from harness.errors import BadInput, ShapeError
from harness.stream.polhemus.codec.replies import Emitter

MAX_PREDICTION_MS = 50
"""Largest setting [ms]."""


def predict_poses(
    position_m: Floats,
    tracker_from_station: Floats,
    velocity_m_s: Floats,
    turn_rad_s: Floats,
    prediction_ms: Ints,
) -> tuple[Floats, Floats]:
    """Return positions (..., S, 3) and quaternions (..., S, 4) this many milliseconds (S,) ahead.

    Velocity and turn rate (..., S, 3) are in the tracker's axes and stay constant meanwhile [m/s, rad/s]. Stations with
    0 ms are returned to the bit, and results do not depend on the leading shape.
    """
    ahead_s = 1e-3 * np.asarray(prediction_ms, dtype=float)[:, None]
    moves = ahead_s > 0.0
    turned = rotations.multiply(rotations.exp(turn_rad_s * ahead_s), tracker_from_station)
    return (
        np.where(moves, position_m + velocity_m_s * ahead_s, position_m),
        np.where(moves, turned, tracker_from_station),
    )


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


@dataclass(frozen=True, eq=False)
class DeviceSamples:
    """E instants of S stations in the tracker frame.

    After the last instant the motion continues from the first without a jump.
    """

    stations: tuple[str, ...]
    """Station names, in the order of the device's stations; by default the first is station `1`, and so on."""
    rate_hz: float
    """Readings per second of each station."""
    take_frames: int
    """Number of instants, from the first, that belong to the take itself; the others lead back to its beginning."""
    taken_s: Floats
    """(E, S) when each station is sampled, from the beginning of the loop [s]."""
    ready_s: float
    """Time from the sample to its first bit on a free line [s]."""
    device_s: Floats
    """(E, S) the device's clock at that time, in the loop in which it was set to zero [s]."""
    position_m: Floats
    """(E, S, 3) position as the device estimates it, without prediction and enhancement [m]."""
    tracker_from_station: Floats
    """(E, S, 4) unit quaternions, likewise."""
    quality: Floats
    """(E, S) tracking quality, 0 (lost) to 1 (best)."""
    filter: FilterSamples | None = None
    """What the filter knows besides; None where errors are drawn from distributions. The device then stores prediction,
    enhancement and emitters without effect, and reports as many ranges as the quality suggests."""

    def __post_init__(self) -> None:
        freeze(self, taken_s=("E", "S"))
        shape = self.taken_s.shape
        freeze(self, device_s=shape, quality=shape, position_m=(*shape, 3), tracker_from_station=(*shape, 4))
        if self.filter is not None and (filtered := self.filter.ranges_received.shape) != shape:
            raise ShapeError("DeviceSamples", "filter", filtered, str(shape))

    def __len__(self) -> int:
        return len(self.taken_s)

    @property
    def loop_s(self) -> float:
        """Duration of a loop [s]."""
        return len(self) / self.rate_hz

    @property
    def reach_m(self) -> float:
        """Largest coordinate that a station reports after power-on [m].

        With a filter, readings of lost stations are left out: its estimate may be anywhere.
        """
        if self.filter is None:
            return float(np.abs(self.position_m).max())
        settings = self.filter.prediction_ms, self.filter.enhancement
        position_m, _ = self.filter.report_poses(self.position_m, self.tracker_from_station, *settings)
        return float(np.abs(position_m[np.rint(255.0 * self.quality) > 0.0]).max(initial=0.0))

    @property
    def device_loop_s(self) -> float:
        """Duration of a loop by the device's clock [s]."""
        if len(self) < 2:
            return self.loop_s
        pace = (self.device_s[-1, 0] - self.device_s[0, 0]) / (self.taken_s[-1, 0] - self.taken_s[0, 0])
        return float(pace * self.loop_s)
