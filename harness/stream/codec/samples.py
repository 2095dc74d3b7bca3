"""What a device has to say, before it is asked for it: the readings that an emulator plays, lap after lap."""

from dataclasses import dataclass

from harness.core.arrays import Floats, freeze


@dataclass(frozen=True, eq=False)
class DeviceSamples:
    """E instants of S stations in the tracker's frame; after the last one it goes on from the first, without a jump."""

    stations: tuple[str, ...]
    """Names; the first is station `1` of the device, and so on."""
    rate_hz: float
    """Readings per second of each station."""
    take_frames: int
    """So many instants, from the first, are the take itself; the others lead back to its beginning."""
    taken_s: Floats
    """(E, S) when each station is sampled, from the beginning of a lap [s]."""
    ready_s: float
    """From the sample to the first bit on the line, when that is free [s]."""
    device_s: Floats
    """(E, S) what the device's clock says then, in the lap that began when it was set to zero [s]."""
    position_m: Floats
    """(E, S, 3) as the device believes."""
    tracker_from_station: Floats
    """(E, S, 4) unit quaternions."""
    quality: Floats
    """(E, S) 0 lost to 1 best."""

    def __post_init__(self) -> None:
        freeze(self, taken_s=("E", "S"))
        each = self.taken_s.shape
        freeze(self, device_s=each, quality=each, position_m=(*each, 3), tracker_from_station=(*each, 4))

    def __len__(self) -> int:
        return len(self.taken_s)

    @property
    def loop_s(self) -> float:
        """How long a lap takes [s]."""
        return len(self) / self.rate_hz

    @property
    def device_loop_s(self) -> float:
        """The same by the device's clock [s]."""
        if len(self) < 2:
            return self.loop_s
        pace = (self.device_s[-1, 0] - self.device_s[0, 0]) / (self.taken_s[-1, 0] - self.taken_s[0, 0])
        return float(pace * self.loop_s)
