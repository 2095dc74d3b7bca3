"""The emulator at real ports, with real clients: it plays the frames of the simulation, bit by bit."""

import time
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadInput
from harness.experiment import Playback, prepare_playback
from harness.stream.emulators import serve_emulator
from harness.stream.frame import TrackerFrame
from harness.stream.polhemus.codec import commands
from harness.stream.polhemus.codec.items import record_type
from harness.stream.polhemus.codec.reader import FrameReader, WireFormat
from harness.stream.polhemus.driver.open_transport import open_transport
from harness.stream.polhemus.driver.transport import Transport
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.device_state import Message, SentMessage
from harness.stream.polhemus.emulator.server import ServerCounts
from tests.stream.is900.emulator.played import DeviceSession

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


def test_messages_are_counted_with_their_delays() -> None:
    counts, record, reply = ServerCounts(), Message(0.0, b"01P", "1"), Message(0.0, b"21S")
    for late_s in (0.1, 0.4, 0.2):
        counts.add(SentMessage(record, 1.0, b"01P", written_s=1.0 + late_s))
    counts.add(SentMessage(reply, 2.0, b"2?S", ("flip",), written_s=2.0))
    counts.add(SentMessage(record, 3.0, b"01P", unread=True))
    assert (counts.records, counts.replies, counts.damaged, counts.unread, counts.bytes) == (3, 1, 1, 1, 12)
    assert list(counts.late_s) == pytest.approx([0.1, 0.4, 0.2, 0.0])
    assert counts.max_late_s == pytest.approx(0.4)


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


CONTROL_LIST = (22, 23, 1)


def read_controls(session: DeviceSession, at_s: float) -> list[tuple[int, int, int]]:
    """Buttons and joystick of each station at this time after power-on [s]."""
    session.send(b"", after_s=at_s - session.now_s)
    table = np.frombuffer(session.send(b"P"), record_type(CONTROL_LIST))
    return [(int(row["buttons"]), int(row["joystick"][0]), int(row["joystick"][1])) for row in table]


def open_session(controls: str | None = None) -> DeviceSession:
    session = DeviceSession(EmulatorConfig() if controls is None else EmulatorConfig(controls=controls))
    session.send(b"f" + b"".join(b"O%c,22,23,1\r" % station for station in b"1234"))
    return session


@pytest.mark.parametrize(
    ("at_s", "expected"),
    [
        (1.019, (2, 255, 127)),  # the second button; the joystick is at the right stop, a quarter of 4 s
        (3.019, (8, 0, 127)),  # the left stop
        (5.019, (32, 127, 255)),  # the trigger; the joystick is at the front stop
        (7.019, (0, 127, 0)),  # no button; the rear stop
        (9.019, (2, 255, 127)),  # a period of 8 s later
    ],
)
def test_buttons_are_pressed_in_turn_and_the_joystick_reaches_its_stops(
    at_s: float, expected: tuple[int, int, int]
) -> None:
    buttons, x, y = read_controls(open_session(), at_s)[0]
    assert buttons == expected[0]
    assert abs(x - expected[1]) <= 1
    assert abs(y - expected[2]) <= 1


def test_each_station_is_a_second_ahead_of_the_one_before() -> None:
    assert [controls[0] for controls in read_controls(open_session(), 2.519)] == [4, 8, 16, 32]


def test_controls_may_stand_still() -> None:
    session = open_session("still")
    for at_s in (0.5, 1.5, 6.5):
        assert read_controls(session, at_s) == [(0, 127, 127)] * 4


def test_an_unknown_pattern_is_refused() -> None:
    with pytest.raises(BadInput, match="Use cycle or still"):
        EmulatorConfig(controls="wild")


def test_the_inertia_cube_of_a_station_has_its_number() -> None:
    """A station that is off has none, -1 (docs/is900.md 14)."""
    session = DeviceSession(stations=6)
    answers = [session.send(b"MCI%c\r\n" % station) for station in b"123456789ABC"]
    numbers = [int(answer[3:]) for answer in answers]
    assert numbers == [1, 2, 3, 4, 5, 6] + [-1] * 6
    assert session.send(b"l2,0\rMCI2\r") == b"32I-1\r\n"
