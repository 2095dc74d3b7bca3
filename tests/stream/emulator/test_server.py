"""The emulator at real ports, with real clients: it plays the frames of the simulation, bit by bit."""

import time
from pathlib import Path

import numpy as np
import pytest

from harness.experiment.playback import Playback, prepare_playback
from harness.stream.codec import commands
from harness.stream.codec.reader import FrameReader, WireFormat
from harness.stream.driver.transport import Transport, open_transport
from harness.stream.emulator import EmulatorConfig, serve_emulator
from harness.stream.frame import TrackerFrame

TIMEOUT_S = 120.0
"""Time that a loaded machine gets before a test fails [s]."""


@pytest.fixture(scope="module")
def walk() -> Playback:
    return prepare_playback("builtin_walking", noise="default", stations=6)


def configure(client: Transport, stations: str = "123456") -> None:
    client.write(commands.STOP)
    for station in stations:
        client.write(commands.station_command("O", station, (40, 2, 11, 21, 1)))
    for command in (commands.BINARY, commands.CENTIMETRES, commands.MILLISECONDS, commands.ZERO_CLOCK, commands.STREAM):
        client.write(command)


def read_frames(client: Transport, wire: WireFormat, count: int) -> list[TrackerFrame]:
    reader, frames, until_s = FrameReader(wire), list[TrackerFrame](), time.monotonic() + TIMEOUT_S
    while len(frames) < count and time.monotonic() < until_s:
        frames += reader.feed(client.read(1.0), time.monotonic())
    return frames


def values_equal(first: TrackerFrame, second: TrackerFrame) -> bool:
    names = [name for name in TrackerFrame.__slots__ if name != "received_s"]
    return all(np.array_equal(getattr(first, n).astype(float), getattr(second, n).astype(float), True) for n in names)


@pytest.mark.parametrize("port_kind", ["pty", "tcp"])
def test_the_frames_are_those_of_the_simulation(port_kind: str, walk: Playback, tmp_path: Path) -> None:
    port_arguments = {"pty": tmp_path / "is900"} if port_kind == "pty" else {"tcp": "127.0.0.1:0"}
    with serve_emulator(walk.samples, EmulatorConfig(), **port_arguments) as emulator:
        client = open_transport(emulator.name)
        configure(client)
        frames = read_frames(client, WireFormat(walk.samples.stations, walk.samples.rate_hz), 40)
        client.close()
    simulated = walk.simulation.frames
    start = [frame.measured_s[0] for frame in simulated].index(frames[0].measured_s[0])
    pairs = list(zip(frames, simulated[start:], strict=False))
    assert len(pairs) >= 40
    assert all(values_equal(*pair) for pair in pairs)
