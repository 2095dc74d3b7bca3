"""Samples with known values, and a device to talk to without a line."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.is900.emulator.device import Device
from harness.stream.polhemus.codec.replies import Emitter
from harness.stream.polhemus.codec.samples import MAX_RANGES, DeviceSamples, FilterSamples
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.device import CommandDevice

NAMES = (
    *("left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head"),
    *("left_elbow", "right_elbow", "left_knee", "right_knee", "pelvis", "neck"),
)


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


FILTER_EMITTERS = (
    Emitter(1, (3.0, -2.5, -1.0), (0.0, 0.6, 0.8), 7001),
    Emitter(2, (3.5, -2.5, -1.0), (0.0, 0.0, 1.0), 7002),
    Emitter(4, (3.0, -3.5, -1.5), (0.0, 0.0, 1.0), 7004),
)
"""A constellation beside the origin."""


def with_filter(
    samples: DeviceSamples,
    prediction_ms: Sequence[int] = (),
    enhancement: Sequence[int] = (),
    *,
    quality: Floats | None = None,
    seed: int = 1,
) -> DeviceSamples:
    """Return the samples with a filter of random values: no two instants, stations or modes have the same.

    Stations that the settings do not reach have 0. `quality` replaces that of the samples.
    """
    rng = np.random.default_rng(seed)
    instants, stations = samples.taken_s.shape
    settings = np.zeros((2, stations), np.int64)
    settings[0, : len(prediction_ms)], settings[1, : len(enhancement)] = prediction_ms, enhancement
    turn = rotations.multiply(rotations.exp(rng.normal(size=(2, instants, stations, 3))), samples.tracker_from_station)
    made = FilterSamples(
        velocity_m_s=rng.normal(size=(instants, stations, 3)),
        turn_rad_s=rng.normal(size=(instants, stations, 3)),
        enhanced_position_m=samples.position_m + 0.1 * rng.normal(size=(2, instants, stations, 3)),
        enhanced_tracker_from_station=turn,
        ranges_received=rng.integers(0, MAX_RANGES + 1, (instants, stations)),
        ranges_rejected=rng.integers(0, MAX_RANGES + 1, (instants, stations)),
        emitters=FILTER_EMITTERS,
        prediction_ms=settings[0],
        enhancement=settings[1],
    )
    return replace(samples, filter=made, quality=samples.quality if quality is None else quality)


class DeviceSession:
    """A device and its clock."""

    def __init__(
        self,
        config: EmulatorConfig | None = None,
        stations: int = 4,
        quaternion: Floats | None = None,
        samples: DeviceSamples | None = None,
    ) -> None:
        self.device: CommandDevice = Device(samples or make_samples(stations, quaternion=quaternion), config, 0.0)
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
