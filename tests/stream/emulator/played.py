"""Samples that tests know by heart, and a way to talk to a device without a line."""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.codec.samples import DeviceSamples
from harness.stream.emulator.config import EmulatorConfig
from harness.stream.emulator.device import Device

NAMES = ("left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head")


def samples(stations: int = 4, rate_hz: float = 50.0, instants: int = 100, turn: Floats | None = None) -> DeviceSamples:
    """Station s stands at (1 + s/10, -0.5, 1.5) m and moves 1 mm forward with each instant; 20 ppm fast from 5 s on."""
    taken_s = np.arange(instants)[:, None] / rate_hz + np.arange(stations) / (rate_hz * stations)
    place = np.empty((instants, stations, 3))
    place[..., 0] = 1.0 + 0.1 * np.arange(stations) + 0.001 * np.arange(instants)[:, None]
    place[..., 1:] = -0.5, 1.5
    return DeviceSamples(
        stations=NAMES[:stations],
        rate_hz=rate_hz,
        take_frames=instants,
        taken_s=taken_s,
        ready_s=0.004,
        device_s=5.0 + (1.0 + 20e-6) * taken_s,
        position_m=place,
        tracker_from_station=np.broadcast_to(rotations.IDENTITY if turn is None else turn, (instants, stations, 4)),
        quality=np.ones((instants, stations)),
    )


class Talk:
    """A device and its clock."""

    def __init__(self, config: EmulatorConfig | None = None, stations: int = 4, turn: Floats | None = None) -> None:
        self.device = Device(samples(stations, turn=turn), config, 0.0)
        self.now_s = 0.0

    def say(self, data: bytes, after_s: float = 0.0) -> bytes:
        """What the device answers to these bytes at once, said this much later than the last ones."""
        self.now_s += after_s
        before = self.device.advance(self.now_s)
        assert before == b"" or self.device.streaming
        self.device.receive(data, self.now_s)
        return self.device.advance(self.now_s)

    def wait(self, seconds: float) -> bytes:
        """What the device says during this time without being asked."""
        self.now_s += seconds
        return self.device.advance(self.now_s)
