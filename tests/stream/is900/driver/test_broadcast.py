"""The UDP broadcast of the emulator, read by the driver: a fifth source of the same frames."""

import contextlib
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.cli import main
from harness.errors import BadInput
from harness.experiment import prepare_playback
from harness.stream.emulators import serve_emulator
from harness.stream.is900.driver.broadcast import Is900Broadcast
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.is900 import open_tracker
from harness.stream.line_events import LineEvent
from harness.stream.polhemus.codec.datagram import Datagram, parse_datagram
from harness.stream.polhemus.codec.samples import DeviceSamples
from harness.stream.polhemus.driver.config import DriverTiming
from harness.stream.polhemus.driver.open_transport import open_transport
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.server import EmulatorServer
from harness.stream.polhemus.emulator.udp_broadcast import parse_udp_address
from harness.stream.recording.recording import read_recording
from harness.stream.recording.recording_writer import RecordingWriter
from harness.stream.recording.replay import RecordingStream
from harness.testing.stream_checks import check_stream
from tests.long_demo import write_long_demo
from tests.stream.is900.emulator.played import NAMES, make_samples
from tests.stream.wire import frames_equal

RATE_HZ, ATTEMPTS, MAX_LATE_S = 10.0, 5, 0.1
TIMEOUT_S = 60.0


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def broadcast(samples: DeviceSamples | None = None, **config: Any) -> Iterator[tuple[EmulatorServer, str]]:
    """An emulator that broadcasts, and the port at which the driver hears it."""
    number = free_port()
    options = EmulatorConfig(**{"udp": True, "udp_port": number, **config})
    with serve_emulator(samples or make_samples(rate_hz=RATE_HZ), options, tcp="127.0.0.1:0") as emulator:
        yield emulator, f"udp://127.0.0.1:{number}"


def test_the_broadcast_satisfies_the_contract_of_streams() -> None:
    with broadcast() as (_, port):
        frames = check_stream(lambda: open_tracker(port), rate_hz=RATE_HZ, at_most=15)
    assert len(frames) == 15


def test_the_frames_are_those_of_the_simulation(tmp_path: Path) -> None:
    """Within single precision of metres, degrees and seconds; validity and suspicion are equal."""
    playback = prepare_playback(write_long_demo(tmp_path), clip="boxing_p1_01", stations=4, rate_hz=RATE_HZ)
    simulated = playback.simulation.frames
    for _ in range(ATTEMPTS):  # a frame is closed when its packets are late
        with broadcast(playback.samples) as (_, port), open_tracker(port, DriverConfig(rate_hz=RATE_HZ)) as tracker:
            _, *received = islice(tracker, 41)  # it begins anywhere in a round
        gaps_s = np.diff([frame.received_s for frame in received])
        if gaps_s.max() < 1.0 / RATE_HZ + MAX_LATE_S:
            break
    first_s = received[0].measured_s[0]
    start = int(np.argmin([abs(frame.measured_s[0] - first_s) for frame in simulated]))
    pairs = list(zip(received, simulated[start:], strict=False))
    assert len(pairs) == 40
    for one, other in pairs:
        np.testing.assert_allclose(one.measured_s, other.measured_s, atol=1e-4)
        np.testing.assert_allclose(one.position_m, other.position_m, atol=1e-6)
        same_sign = np.sum(one.tracker_from_station * other.tracker_from_station, axis=1)
        np.testing.assert_allclose(np.abs(same_sign[one.orientation_valid]), 1.0, atol=1e-6)
        for name in ("position_valid", "orientation_valid", "suspect"):
            assert (getattr(one, name) == getattr(other, name)).all(), name
    assert any(not frame.position_valid.all() for frame, _ in pairs), "no station was lost: the motion is too easy"


def test_a_recording_of_a_broadcast_replays_as_it_was_live(tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    config = DriverConfig(stations=NAMES[:2])
    with broadcast() as (_, port), RecordingWriter(path) as writer, open_tracker(port, config, observer=writer) as one:
        live = list(islice(one, 20))
    (wire,) = read_recording(path).formats
    assert wire.datagrams
    assert wire.stations == NAMES[:2]
    for speed in ("max", 1e9):
        replayed = list(RecordingStream(path, speed))
        assert all(frames_equal(a, b) for a, b in zip(live, replayed, strict=False))
        assert len(replayed) >= 20


def test_packets_that_waited_before_the_iteration_are_dropped() -> None:
    """They would all seem to arrive at one moment, while the device's clock says otherwise."""
    with broadcast() as (_, port), open_tracker(port) as tracker:
        time.sleep(1.0)
        began_s = time.monotonic()
        frames = list(islice(tracker, 10))
        assert frames[0].received_s > began_s
        assert frames[-1].received_s - frames[1].received_s > 0.5
        assert tracker.counts["clock_resets"] == 0
        assert not any(frame.suspect.any() for frame in frames)


def test_two_recordings_in_one_file_have_the_frames_of_their_sessions_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    live = []
    with broadcast() as (_, port):
        for _ in range(2):
            with RecordingWriter(path) as writer, open_tracker(port, observer=writer) as tracker:
                live.append(list(islice(tracker, 8)))
    stream = RecordingStream(path)
    replayed = list(stream)
    assert stream.counts["sessions"] == 2
    received_s = [frame.received_s for frame in replayed]
    first, second = ([frame.received_s for frame in part] for part in live)
    assert received_s[:8] == first
    assert set(second) <= set(received_s)
    assert not [moment for moment in received_s if first[-1] + 1.0 / RATE_HZ < moment < second[0]]


def test_a_command_switches_the_broadcast_on_and_off() -> None:
    """It is off after power-on, goes to this computer, and needs no stream on the line."""
    with (
        broadcast(udp=False) as (emulator, port),
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
    ):
        receiver.bind(("127.0.0.1", int(port.rpartition(":")[2])))
        other.bind(("127.0.0.1", 0))
        client = open_transport(emulator.name)
        receiver.settimeout(0.5)
        with pytest.raises(TimeoutError):
            receiver.recv(100)
        receiver.settimeout(TIMEOUT_S)
        client.write(b"MEthUdp1\r\n")
        packets = [parse_datagram(receiver.recv(100)) for _ in range(8)]
        assert all(packet is not None for packet in packets)
        assert [packet.station for packet in packets if packet] == [1, 2, 3, 4] * 2
        numbers = [packet.sequence for packet in packets if packet]
        assert numbers == list(range(numbers[0], numbers[0] + 8))
        assert {packet.model for packet in packets if packet} == {4}
        client.write(b"MEthUdpPort%d\r\n" % other.getsockname()[1])
        other.settimeout(TIMEOUT_S)
        assert parse_datagram(other.recv(100)) is not None
        client.write(b"MEthUdp0\r\nS")
        assert client.read(TIMEOUT_S)[:3] == b"21S"
        off_s = time.monotonic()
        other.settimeout(0.5)
        with contextlib.suppress(TimeoutError):
            while other.recv(100):
                assert time.monotonic() - off_s < 0.4, "it goes on"
        client.close()


def test_silence_is_reported_once_and_ends_when_packets_return() -> None:
    events: list[LineEvent] = []
    timing = DriverTiming(stalled_s=0.3, silent_s=1.0, measure_s=0.5)
    with broadcast() as (emulator, port):
        tracker = Is900Broadcast(port, on_event=events.append, timing=timing)
        frames = iter(tracker)
        before = next(frames)
        client = open_transport(emulator.name)
        client.write(b"MEthUdp0\r\n")
        switch_on = threading.Timer(2.0, client.write, (b"MEthUdp1\r\n",))
        switch_on.start()
        after = next(frame for frame in frames if frame.received_s > before.received_s + 1.5)
        switch_on.join()
        client.close()
        tracker.close()
    assert [event.kind for event in events] == ["connected", "stalled", "silent", "connected"]
    assert after.position_valid.any()
    assert list(frames) == []


def test_stations_of_a_broadcast_that_come_and_go_are_told_by_name() -> None:
    events: list[LineEvent] = []
    timing = DriverTiming(stalled_s=0.4, silent_s=0.8, measure_s=0.5)
    with broadcast(characters="135B") as (emulator, port):
        client = open_transport(emulator.name)
        client.write(b"lB,0\r\n")
        time.sleep(0.2)
        config = DriverConfig(stations=("head", "hand"), characters="13")
        with Is900Broadcast(port, config, on_event=events.append, timing=timing) as tracker:
            assert tracker.station_list == "1 head, 3 hand"
            frames = iter(tracker)
            for command, kind in (
                (b"", "connected"),
                (b"l3,0\r", "missing"),
                (b"l3,1\r", "present"),
                (b"lB,1\r", "unexpected"),
            ):
                client.write(command)
                began_s = time.monotonic()
                while kind not in {event.kind for event in events} and time.monotonic() - began_s < TIMEOUT_S:
                    assert len(next(frames).quality) == 2
        client.close()
    assert [event.kind for event in events] == ["connected", "missing", "present", "unexpected"], events
    assert "station 3 (hand)" in events[1].text
    assert "station B was switched on" in events[3].text, "station 5 was there before, unasked"


def test_packets_of_other_hosts_are_left_out() -> None:
    with broadcast() as (_, port), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        try:
            other.bind(("127.0.0.2", 0))
        except OSError:
            pytest.skip("this system has one loopback address only")
        with open_tracker(port) as tracker:
            frames = iter(tracker)
            next(frames)
            for _ in range(20):
                other.sendto(b"\xff\x01 no packet of the tracker", ("127.0.0.1", int(port.rpartition(":")[2])))
            list(islice(frames, 3))
            assert tracker.counts["garbage_bytes"] == 0


@pytest.mark.parametrize(
    ("config", "complaint"),
    [
        (DriverConfig(boresight=True), "packets carry no commands"),
        (DriverConfig(alignment=((0.0,) * 3, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))), "packets carry no commands"),
        (DriverConfig(stations=NAMES[:5]), r"5 stations requested .* packets of 4 arrive \(1, 2, 3, 4\)"),
    ],
)
def test_what_a_broadcast_cannot_give_is_refused(config: DriverConfig, complaint: str) -> None:
    with broadcast() as (_, port), pytest.raises(BadInput, match=complaint):
        open_tracker(port, config)


def test_a_port_without_packets_is_named_with_a_remedy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    port = f"udp://127.0.0.1:{free_port()}"
    assert main(["record", port, str(tmp_path / "a.rec")]) == 2
    said = capsys.readouterr().err
    assert f"Port {port}: no packet of an IS-900 arrived in 2 s. Switch the broadcast on (MEthUdp1)" in said
    assert main(["record", port, str(tmp_path / "a.rec"), "--items", "2,4,1"]) == 2
    assert "--items with udp://" in capsys.readouterr().err
    assert main(["record", port, str(tmp_path / "a.rec"), "--send", "S"]) == 2
    assert "--send with udp://" in capsys.readouterr().err
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        with pytest.raises(BadInput, match="another program receives at port"):
            open_tracker(f"udp://127.0.0.1:{taken.getsockname()[1]}")
    for address in ("udp://127.0.0.1", "udp://:5001"):
        with pytest.raises(BadInput, match="Write udp://HOST:PORT"):
            open_tracker(address)


def test_other_computers_are_excluded_by_default() -> None:
    assert parse_udp_address("5001", anywhere=False) == ("127.0.0.1", 5001)
    with pytest.raises(BadInput, match="--anywhere"):
        parse_udp_address("192.168.1.255:5001", anywhere=False)
    assert parse_udp_address("192.168.1.255:5001", anywhere=True) == ("192.168.1.255", 5001)
    with pytest.raises(BadInput, match="HOST:PORT"):
        parse_udp_address("there", anywhere=False)
    with pytest.raises(BadInput, match="udp_port = 0"):
        EmulatorConfig(udp_port=0)


def test_a_device_without_time_stamps_is_read_by_the_hosts_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """The time may be absent or constant where it was not requested (docs/is900.md 9)."""
    from harness.stream.polhemus.emulator import udp_broadcast

    original = Datagram
    for time_s in (None, 0.0):
        monkeypatch.setattr(
            udp_broadcast, "Datagram", lambda sent=time_s, **values: replace(original(**values), time_s=sent)
        )
        with broadcast() as (_, port), open_tracker(port) as tracker:
            frames = list(islice(tracker, 5))
        assert 21 not in tracker.wire.items
        assert tracker.wire.rate_hz == pytest.approx(RATE_HZ, rel=0.25)
        assert all(np.isnan(frame.measured_s).all() and frame.position_valid.all() for frame in frames[1:])
