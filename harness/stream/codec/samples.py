"""The readings that an emulated device plays in a loop."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats, freeze
from harness.errors import ShapeError
from harness.stream.codec.filter_samples import FilterSamples


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
