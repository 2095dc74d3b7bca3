"""Samples with known values, and a device to talk to without a line."""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.codec.samples import DeviceSamples
from harness.stream.emulator.config import EmulatorConfig
from harness.stream.emulator.device import Device

NAMES = ("left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head")


def make_samples(
    stations: int = 4, rate_hz: float = 50.0, instants: int = 100, quaternion: Floats | None = None
) -> DeviceSamples:
    """Station s is at (1 + s/10, -0.5, 1.5) m and moves 1 mm forward with each instant; its clock starts at 5 s, 20 ppm
    fast.
    """
    taken_s = np.arange(instants)[:, None] / rate_hz + np.arange(stations) / (rate_hz * stations)
    position_m = np.empty((instants, stations, 3))
    position_m[..., 0] = 1.0 + 0.1 * np.arange(stations) + 0.001 * np.arange(instants)[:, None]
    position_m[..., 1:] = -0.5, 1.5
    return DeviceSamples(
        stations=NAMES[:stations],
        rate_hz=rate_hz,
        take_frames=instants,
        taken_s=taken_s,
        ready_s=0.004,
        device_s=5.0 + (1.0 + 20e-6) * taken_s,
        position_m=position_m,
        tracker_from_station=np.broadcast_to(
            rotations.IDENTITY if quaternion is None else quaternion, (instants, stations, 4)
        ),
        quality=np.ones((instants, stations)),
    )


class DeviceSession:
    """A device and its clock."""

    def __init__(
        self, config: EmulatorConfig | None = None, stations: int = 4, quaternion: Floats | None = None
    ) -> None:
        self.device = Device(make_samples(stations, quaternion=quaternion), config, 0.0)
        self.now_s = 0.0

    def send(self, data: bytes, after_s: float = 0.0) -> bytes:
        """Return the device's immediate reply to bytes that are sent `after_s` seconds after the previous ones."""
        self.now_s += after_s
        before = self.device.advance(self.now_s)
        assert before == b"" or self.device.streaming
        self.device.receive(data, self.now_s)
        return self.device.advance(self.now_s)

    def wait(self, seconds: float) -> bytes:
        """Return what the device sends by itself during this time."""
        self.now_s += seconds
        return self.device.advance(self.now_s)
