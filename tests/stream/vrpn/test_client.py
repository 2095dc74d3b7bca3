"""The client: every report of a server, its refusals, and what it does when a server goes, returns or lies."""

import socket
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from itertools import islice, pairwise

import numpy as np
import pytest

from harness.errors import BadInput
from harness.stream.frame import TrackerFrame
from harness.stream.line_events import LineEvent, TrackedBodies
from harness.stream.vrpn.client import VrpnConfig, VrpnTiming, VrpnTracker
from harness.stream.vrpn.connection import TrackerAddress
from harness.stream.vrpn.messages import (
    COOKIE,
    PONG,
    POSE,
    SENDER_DESCRIPTION,
    TYPE_DESCRIPTION,
    UDP_DESCRIPTION,
    MalformedMessage,
    MessageReader,
    PoseReport,
    VrpnMessage,
    encode_description,
    split_datagram,
)
from harness.testing.stream_checks import check_stream
from tests.stream.vrpn.feeder import (
    IMPATIENT,
    QUICK,
    TRACKER,
    Feeder,
    fed_server,
    port_of,
    scripted_server,
    wait_until_closed,
)

DESCRIPTIONS = b"".join(
    encode_description(kind, number, name, 0).encode()
    for kind, number, name in (
        (SENDER_DESCRIPTION, 4, TRACKER),
        (SENDER_DESCRIPTION, 5, "Other"),
        (TYPE_DESCRIPTION, 1, POSE),
        (TYPE_DESCRIPTION, 2, PONG),
        (TYPE_DESCRIPTION, 3, "vrpn_Tracker Velocity"),
    )
)
POSES = b"".join(
    PoseReport(0, 1_700_000_000_000_000 + 10_000 * n, (n, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)).encode(1, 4).encode()
    for n in range(40)
)
"""Reports of one sensor at 100 Hz."""


@pytest.fixture
def fed() -> Iterator[Feeder]:
    with fed_server() as feeder:
        yield feeder


def open_quick(
    port: str, config: VrpnConfig | None = None, *, timing: VrpnTiming = QUICK, **callbacks: object
) -> VrpnTracker:
    return VrpnTracker(port, config, timing=timing, **callbacks)  # type: ignore[arg-type]


def test_every_report_arrives_with_every_digit(fed: Feeder) -> None:
    reports: list[PoseReport] = []
    with open_quick(port_of(fed.server), on_report=lambda report, now_s: reports.append(report)) as tracker:
        assert tracker.stations == ("0", "1")
        frames = list(islice(tracker, 60))
        start_s = tracker.start_unix_s
    begin = fed.sent.index(reports[0])
    assert reports == fed.sent[begin : begin + len(reports)]
    whole = [frame for frame in frames if np.isfinite(frame.measured_s).all()]
    assert len(whole) > 20
    by_time = {report.time_us: report for report in reports}
    for frame in whole:
        for row in range(2):
            sent = by_time[round(1e6 * (start_s + frame.measured_s[row]))]
            assert frame.position_m[row].tolist() == list(sent.position_m)
            assert frame.tracker_from_station[row].tolist() == list(sent.quaternion)
    times_s = [tracker.measured_unix_s(frame)[0] for frame in whole]
    assert {round(1e6 * at_s) for at_s in times_s} <= set(by_time)


def test_it_is_a_stream_as_any_other(fed: Feeder) -> None:
    check_stream(lambda: open_quick(port_of(fed.server)), rate_hz=90.0, at_most=30)


def test_a_user_names_sensors(fed: Feeder) -> None:
    with open_quick(port_of(fed.server), VrpnConfig(("head",), (1,))) as tracker:
        assert (tracker.stations, tracker.sensors, tracker.station_list) == (("head",), (1,), "1 head; not read: 0")
        assert 5.0 < tracker.rate_hz < 150.0
        (frame,) = islice(tracker, 1)
        assert frame.position_m[0, 1] == -1.0 / 7.0
        assert tracker.counts["other_sensors"] > 0
    with open_quick(port_of(fed.server), VrpnConfig(("a",))) as tracker:
        assert tracker.station_list == "0 a; not read: 1"


@pytest.mark.parametrize(
    ("config", "problem"),
    [
        (VrpnConfig(("head",), (9,)), "sensor 9 asked for, but the sensors 0, 1 report"),
        (VrpnConfig(("a", "b", "c")), "3 sensors asked for, but the sensors 0, 1 report"),
    ],
)
def test_a_sensor_that_does_not_report_is_refused(fed: Feeder, config: VrpnConfig, problem: str) -> None:
    with pytest.raises(BadInput, match=problem):
        open_quick(port_of(fed.server), config)


def test_contradictory_names_are_refused() -> None:
    for names, sensors in ((("a", "a"), None), (("a",), (1, 2)), (("a", "b"), (2, 2)), (("a", "b"), (2, 1))):
        with pytest.raises(BadInput, match="Give each"):
            VrpnConfig(names, sensors)


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("vrpn:Tracker0@lab", TrackerAddress("Tracker0", "lab", 3883)),
        ("vrpn:Tracker0@lab:3884", TrackerAddress("Tracker0", "lab", 3884)),
        ("vrpn:a@b@10.0.0.1:1", TrackerAddress("a@b", "10.0.0.1", 1)),
        ("vrpn:Tracker0@tcp://lab:3884", TrackerAddress("Tracker0", "lab", 3884)),
        ("vrpn:Tracker0@udp://lab:3884", TrackerAddress("Tracker0", "lab", 3884, udp=True)),
        ("vrpn:Tracker0@[::1]", TrackerAddress("Tracker0", "::1", 3883)),
        ("vrpn:Tracker0@[::1]:99", TrackerAddress("Tracker0", "::1", 99)),
    ],
)
def test_addresses(text: str, address: TrackerAddress) -> None:
    assert TrackerAddress.parse(text) == address


@pytest.mark.parametrize(
    "text",
    [
        "vrpn:",
        "vrpn:Tracker0",
        "vrpn:@lab",
        "vrpn:T@",
        "vrpn:T@lab:0",
        "vrpn:T@lab:65536",
        "vrpn:T@lab:x",
        "vrpn:T@ftp://lab",
    ],
)
def test_what_is_no_address_is_refused(text: str) -> None:
    with pytest.raises(BadInput, match="no tracker of a VRPN server"):
        TrackerAddress.parse(text)


def test_a_server_without_the_tracker_is_refused_with_its_trackers(fed: Feeder) -> None:
    with pytest.raises(BadInput, match=r"no tracker called Head. It has Tracker0;"):
        open_quick(port_of(fed.server, "Head"), timing=replace(QUICK, silent_s=1.0))


def test_nobody_at_the_port_is_refused() -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with pytest.raises(BadInput, match=f"nothing listens at 127.0.0.1, port {port}"):
        open_quick(f"vrpn:{TRACKER}@127.0.0.1:{port}")


@pytest.mark.parametrize(
    ("sent", "problem"),
    [
        (b"HTTP/1.1 400 Bad Request\r\n", "no VRPN server: it begins with b'HTTP/1.1 400 Bad'"),
        (b"", "no VRPN server: nothing arrives"),
        (COOKIE + struct.pack(">I", 0xFFFFFFFF) + bytes(20), "no VRPN server: a message of 4,294,967,295 bytes"),
        (COOKIE + DESCRIPTIONS + VrpnMessage(2, 4, 0).encode(), "Tracker0 is there, but sends no report"),
        (COOKIE + DESCRIPTIONS, r"no tracker called Tracker0\. It has Other"),
        (COOKIE + DESCRIPTIONS + POSES[:88], "only 1 reports of a sensor in 0.5 s"),
    ],
)
def test_what_is_no_working_server_is_refused_in_one_line(sent: bytes, problem: str) -> None:
    def script(connection: socket.socket) -> None:
        connection.sendall(sent)
        wait_until_closed(connection)

    with scripted_server(script) as port, pytest.raises(BadInput, match=problem) as refused:
        open_quick(port, timing=IMPATIENT)
    assert "\n" not in str(refused.value)


def test_a_server_that_resets_the_connection_is_refused_without_numbers_of_the_system() -> None:
    def script(connection: socket.socket) -> None:
        connection.recv(1)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))

    with scripted_server(script) as port, pytest.raises(BadInput, match=r"the connection is gone \([A-Z][a-z ]+\)"):
        open_quick(port, timing=IMPATIENT)


def test_more_sensors_than_anyone_wears_are_refused() -> None:
    place, turn = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
    reports = b"".join(PoseReport(n, n, place, turn).encode(1, 4).encode() for n in range(1001))

    def script(connection: socket.socket) -> None:
        connection.sendall(COOKIE + DESCRIPTIONS + reports)
        wait_until_closed(connection)

    with scripted_server(script) as port, pytest.raises(BadInput, match="1,001 sensors report"):
        open_quick(port)


def test_a_given_rate_stands_in_where_none_can_be_measured() -> None:
    def script(connection: socket.socket) -> None:
        connection.sendall(COOKIE + DESCRIPTIONS + POSES[:88])
        wait_until_closed(connection)

    with scripted_server(script) as port, open_quick(port, VrpnConfig(rate_hz=50.0)) as tracker:
        assert tracker.rate_hz == 50.0


def test_messages_of_other_types_and_senders_are_left_out() -> None:
    others = b"".join(POSES[88 * n : 88 * n + 12] + struct.pack(">ii", *to) + POSES[88 * n + 20 : 88 * n + 88]
                      for n, to in enumerate([(5, 1), (4, 3), (4, 77), (77, 1)]))  # fmt: skip

    def script(connection: socket.socket) -> None:
        connection.sendall(COOKIE + DESCRIPTIONS + others + POSES)
        wait_until_closed(connection)

    with scripted_server(script) as port, open_quick(port, VrpnConfig(rate_hz=50.0)) as tracker:
        frames = list(islice(tracker, 40))
    assert [frame.position_m[0, 0] for frame in frames] == list(range(40))
    assert tracker.rate_hz == pytest.approx(100.0), "a rate that can be measured is"
    np.testing.assert_allclose([frame.measured_s[0] for frame in frames], 0.01 * np.arange(40), atol=1e-12)


def test_a_server_that_returns_is_found_again() -> None:
    events: list[LineEvent] = []
    with ExitStack() as servers:
        feeder = servers.enter_context(fed_server())
        port = feeder.server.port
        with open_quick(port_of(feeder.server), on_event=events.append) as tracker:
            frames = iter(tracker)
            list(islice(frames, 5))
            servers.close()
            back = threading.Event()

            def return_again() -> None:
                with fed_server(port):
                    back.wait(20.0)

            thread = threading.Thread(target=return_again)
            thread.start()
            try:
                while tracker.counts["reconnects"] == 0 or [event.kind for event in events][-1] != "connected":
                    next(frames)
            finally:
                back.set()
                thread.join()
    assert [event.kind for event in events] == ["connected", "unplugged", "connected"]
    assert tracker.counts["clock_resets"] == 0


def test_a_message_that_is_none_in_mid_stream_is_told_once_and_the_server_is_tried_again() -> None:
    events: list[LineEvent] = []
    opened = threading.Event()

    def script(connection: socket.socket) -> None:
        connection.sendall(COOKIE + DESCRIPTIONS + POSES)
        opened.wait(20.0)
        connection.sendall(struct.pack(">I", 7) + bytes(20))
        wait_until_closed(connection)

    with scripted_server(script) as port, open_quick(port, on_event=events.append) as tracker:
        opened.set()
        for _ in tracker:
            if tracker.counts["reconnects"] >= 2:
                tracker.close()
    texts = [event.text for event in events if event.kind == "garbage"]
    assert set(texts) == {
        "the server sends what is no message of VRPN: a message of 7 bytes, at most 64,000 are allowed"
    }
    kinds = [event.kind for event in events]
    assert all(before != after for before, after in pairwise(kinds))


@pytest.mark.parametrize("answers", [True, False])
def test_a_silent_server_is_pinged_and_given_up_if_it_does_not_answer(answers: bool) -> None:
    events: list[LineEvent] = []
    connections: list[socket.socket] = []
    pong = VrpnMessage(2, 4, 0).encode()

    def script(connection: socket.socket) -> None:
        connections.append(connection)
        connection.sendall(COOKIE + DESCRIPTIONS + POSES)
        while connection.recv(4096):
            if answers:
                connection.sendall(pong)

    with scripted_server(script) as port:
        tracker = open_quick(port, on_event=events.append, timing=IMPATIENT)
        with tracker:

            def close_at(event: LineEvent) -> None:
                events.append(event)
                if event.kind == ("silent" if answers else "unplugged"):
                    tracker.close()

            tracker._on_event = close_at
            list(tracker)
    told = [event.text for event in events if event.kind in ("silent", "unplugged")]
    assert told[-1].startswith("no report for " if answers else "the server does not answer")


def test_a_sensor_that_joins_later_is_told_once(fed: Feeder) -> None:
    events: list[LineEvent] = []
    with open_quick(port_of(fed.server), on_event=events.append) as tracker:
        fed.sensors = (0, 1, 8)
        for _ in tracker:
            if tracker.counts["other_sensors"] > 3:
                break
    texts = [event.text for event in events if event.kind == "unexpected"]
    assert texts == ["sensor 8 reports now and is left out: it is no station"]


def test_closing_ends_the_iteration_from_another_thread(fed: Feeder) -> None:
    with open_quick(port_of(fed.server)) as tracker:
        frames = iter(tracker)
        next(frames)
        thread = threading.Thread(target=tracker.close)
        thread.start()
        assert len(list(frames)) < 1000
        thread.join()


@contextmanager
def udp_server(packets: Callable[[], Iterator[bytes]]) -> Iterator[str]:
    """A server that connects to a client that asks for it, offers UDP, and sends these packets so."""
    with socket.socket(type=socket.SOCK_DGRAM) as asked:
        asked.bind(("127.0.0.1", 0))

        def run() -> None:
            request, _ = asked.recvfrom(200)
            host, port = request.rstrip(b"\0").split()
            with socket.create_connection((host.decode(), int(port)), timeout=10.0) as client:
                offer = VrpnMessage(UDP_DESCRIPTION, 9, 0, b"127.0.0.1\0").encode()
                client.sendall(COOKIE + DESCRIPTIONS + offer + offer)
                reader, answers = MessageReader(), list[VrpnMessage]()
                while not answers:
                    answers += [one for one in reader.feed(client.recv(4096)) if one.type == UDP_DESCRIPTION]
                (answer,) = answers
                for packet in packets():
                    asked.sendto(packet, (answer.payload.rstrip(b"\0").decode(), answer.sender))
                with suppress(ConnectionResetError):
                    wait_until_closed(client)

        thread = threading.Thread(target=run)
        thread.start()
        yield f"vrpn:{TRACKER}@udp://127.0.0.1:{asked.getsockname()[1]}"
        thread.join()


def test_reports_come_by_udp_where_it_is_offered_and_lost_ones_are_counted() -> None:
    def packets() -> Iterator[bytes]:
        for n in range(100):
            report = PoseReport(0, 10_000 * n, (n, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)).encode(1, 4)
            other = VrpnMessage(3, 4, 0, bytes(8))
            if n not in (7, 8, 90):  # lost on the way
                yield report.encode(2 * n) + other.encode(2 * n + 1)

    with udp_server(packets) as port, open_quick(port) as tracker:
        numbers = [frame.position_m[0, 0] for frame in islice(tracker, 97)]
        assert numbers == [n for n in range(100) if n not in (7, 8, 90)]
        assert tracker.counts["lost"] == 6
        tracker.close()
        assert tracker.counts["lost"] == 6


def test_a_packet_that_is_cut_is_refused() -> None:
    report = POSES[:88]
    assert [message.sender for message in split_datagram(report * 2)] == [4, 4]
    with pytest.raises(MalformedMessage, match="a packet that ends within a message, after 1 whole ones"):
        split_datagram(report + report[:-8])


def test_a_server_that_does_not_connect_back_is_refused() -> None:
    with socket.socket(type=socket.SOCK_DGRAM) as deaf:
        deaf.bind(("127.0.0.1", 0))
        port = f"vrpn:{TRACKER}@udp://127.0.0.1:{deaf.getsockname()[1]}"
        with pytest.raises(BadInput, match=r"127\.0\.0\.1 does not connect to this computer"):
            VrpnTracker(port, timing=replace(QUICK, connect_s=0.05))


def test_this_server_is_asked_as_any_other(fed: Feeder) -> None:
    with open_quick(f"vrpn:{TRACKER}@udp://127.0.0.1:{fed.server.port}") as tracker:
        assert len(list(islice(tracker, 5))) == 5


def test_after_a_pause_only_what_comes_then_is_delivered(fed: Feeder) -> None:
    seen: list[PoseReport] = []
    with open_quick(port_of(fed.server), on_report=lambda report, now_s: seen.append(report)) as tracker:
        tracker.pause()
        sent = len(fed.sent)
        list(islice(tracker, 3))
        assert tracker.counts["reconnects"] == 0
    assert fed.sent.index(seen[0]) >= sent - 2, "a report of before the pause was delivered"


class Seen:
    """An observer of bodies, frames and events, in their order."""

    def __init__(self) -> None:
        self.calls: list[TrackedBodies | TrackerFrame | LineEvent] = []

    def on_bodies(self, bodies: TrackedBodies) -> None:
        self.calls.append(bodies)

    def on_frame(self, frame: TrackerFrame) -> None:
        self.calls.append(frame)

    def on_event(self, event: LineEvent) -> None:
        self.calls.append(event)


def test_an_observer_sees_the_bodies_once_and_then_every_frame(fed: Feeder) -> None:
    seen = Seen()
    with open_quick(port_of(fed.server), observer=seen) as tracker:
        frames = list(islice(tracker, 5))
        start_s = tracker.start_unix_s
    others = [call for call in seen.calls if not isinstance(call, LineEvent)]
    first = others[0]
    assert isinstance(first, TrackedBodies)
    assert (first.names, first.start_unix_s) == (("0", "1"), start_s)
    assert others[1:6] == frames
