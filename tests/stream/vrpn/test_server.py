"""The server: byte for byte what a client sees, both ways to connect, and clients that lie or do not read."""

import socket
import struct
from collections.abc import Iterator
from contextlib import suppress

import pytest

from harness.errors import BadInput
from harness.stream.vrpn import server as server_module
from harness.stream.vrpn.listening import parse_served_name
from harness.stream.vrpn.messages import (
    COOKIE,
    PING,
    SENDER_DESCRIPTION,
    TYPE_DESCRIPTION,
    PoseReport,
    VrpnMessage,
    encode_description,
)
from harness.stream.vrpn.server import VrpnServer, open_server
from tests.stream.vrpn.feeder import wait_until_closed

REPORT = PoseReport(1, 1_700_000_000_000_007, (0.5, -1.0, 2.0), (0.5, 0.25, -0.25, 1.0))
REPORT_BYTES = bytes.fromhex(
    "00000058" "6553f100" "00000007" "00000000" "00000000" "00000005"  # 88 bytes, time, sender 0, type 0, sixth message
    "00000001" "00000001" "3fe0000000000000" "bff0000000000000" "4000000000000000"  # sensor, padding, position
    "3fd0000000000000" "bfd0000000000000" "3ff0000000000000" "3fe0000000000000"  # x, y, z, w
)  # fmt: skip
GREETING_BYTES = 24 + sum(24 + -(-(5 + len(name)) // 8) * 8 for name in (
    "Head", "Head-joints", "vrpn_Tracker Pos_Quat", PING, "vrpn_Base pong_message"
))  # fmt: skip


@pytest.fixture
def lines() -> list[str]:
    return []


@pytest.fixture
def server(lines: list[str]) -> Iterator[VrpnServer]:
    with VrpnServer(["Head", "Head-joints"], port=0, log=lines.append) as server:
        yield server


def connect(server: VrpnServer) -> socket.socket:
    return socket.create_connection(("127.0.0.1", server.port), timeout=10.0)


def read(client: socket.socket, size: int) -> bytes:
    """Exactly so many bytes."""
    data = b""
    while len(data) < size:
        piece = client.recv(size - len(data))
        assert piece, "closed"
        data += piece
    return data


def greet(server: VrpnServer, client: socket.socket) -> bytes:
    """Send a client's cookie; what the server sends before reports."""
    client.sendall(COOKIE)
    return read(client, GREETING_BYTES)


def test_a_client_sees_cookie_names_and_reports(server: VrpnServer) -> None:
    with connect(server) as client:
        assert read(client, 24) == b"vrpn: ver. 07.35  0\0\0\0\0\0"
        client.sendall(COOKIE)
        first = read(client, 40)
        assert (first[:4], first[12:20]) == (b"\0\0\0\x21", struct.pack(">ii", 0, SENDER_DESCRIPTION))
        assert first[24:] == b"\0\0\0\x05Head\0" + bytes(7)
        rest = read(client, GREETING_BYTES - 64)
        kinds = [(SENDER_DESCRIPTION, 1, "Head-joints"), (TYPE_DESCRIPTION, 0, "vrpn_Tracker Pos_Quat")]
        for kind, number, name in kinds:
            assert struct.pack(">ii", number, kind) in rest
            assert name.encode() + b"\0" in rest
        assert server.wait_for_client(10.0)
        server.send("Head", [REPORT])
        assert read(client, 88) == REPORT_BYTES
        server.send("Head-joints", [REPORT])
        assert read(client, 88)[12:16] == b"\0\0\0\x01"
    assert server.sent == 2


def test_a_client_that_asks_by_a_packet_is_connected_to(server: VrpnServer) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening, socket.socket(type=socket.SOCK_DGRAM) as asking:
        listening.settimeout(10.0)
        packet = f"some.host.name {listening.getsockname()[1]}\0".encode()
        for bad in (b"", b"host", b"host 80\0", b"host -5\0", b"host 99999\0", b"a b c\0", packet[:-1] + b"x\0"):
            asking.sendto(bad, ("127.0.0.1", server.port))
        asking.sendto(packet, ("127.0.0.1", server.port))
        client, _ = listening.accept()
        with client:
            client.settimeout(10.0)
            greet(server, client)
            asking.sendto(packet, ("127.0.0.1", server.port))  # a client asks once a second
            server.send("Head", [REPORT])
            assert read(client, 88) == REPORT_BYTES
            assert server.clients == 1


def test_a_ping_of_a_served_tracker_is_answered(server: VrpnServer) -> None:
    with connect(server) as client:
        greet(server, client)
        names = [(SENDER_DESCRIPTION, 7, "Other"), (SENDER_DESCRIPTION, 9, "Head-joints"), (TYPE_DESCRIPTION, 3, PING)]
        client.sendall(b"".join(encode_description(kind, number, name, 0).encode() for kind, number, name in names))
        client.sendall(VrpnMessage(3, 7, 0).encode() + VrpnMessage(3, 9, 0).encode())
        pong = read(client, 24)
        assert pong[:4] + pong[12:20] == b"\0\0\0\x18" + struct.pack(">ii", 1, 2)


def test_a_client_gets_no_report_before_its_cookie(server: VrpnServer) -> None:
    with connect(server) as client:
        read(client, 24)
        server.send("Head", [REPORT])
        assert not server.clients
        client.sendall(COOKIE)
        assert REPORT_BYTES[24:] not in read(client, GREETING_BYTES - 24)


@pytest.mark.parametrize("sent", [b"GET / HTTP/1.1\r\n\r\n", COOKIE + struct.pack(">I", 0xFFFFFFF0) + bytes(20)])
def test_what_is_no_client_is_disconnected_and_told(server: VrpnServer, lines: list[str], sent: bytes) -> None:
    with connect(server) as client, connect(server) as other:
        client.sendall(sent)
        with suppress(ConnectionResetError):
            wait_until_closed(client)
        greet(server, other)
        server.send("Head", [REPORT])
        assert read(other, 88) == REPORT_BYTES
    assert sum("it sent what is no message of VRPN" in line for line in lines) == 1


def test_a_client_that_does_not_read_is_disconnected(
    server: VrpnServer, lines: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server_module, "MAX_UNREAD_BYTES", 1 << 20)
    with connect(server) as client, connect(server) as other:
        greet(server, client)
        greet(server, other)
        while not any("MB unread" in line for line in lines):
            server.send("Head", [REPORT] * 100)
            read(other, 8800)
        assert server.clients == 1


def test_too_many_clients_are_turned_away(
    server: VrpnServer, lines: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server_module, "MAX_CLIENTS", 1)
    with connect(server) as client, connect(server) as other:
        greet(server, client)
        assert other.recv(10) == b""
    assert any("127.0.0.1 is turned away" in line for line in lines)


def test_reports_are_delivered_before_the_server_ends() -> None:
    server = VrpnServer(["Head"], port=0)
    with connect(server) as client:
        client.sendall(COOKIE)
        assert server.wait_for_client(10.0)
        server.send("Head", [REPORT] * 20_000)
        server.close()
        server.close()
        data = b""
        while piece := client.recv(1 << 16):
            data += piece
    assert data.count(REPORT_BYTES[24:]) == 20_000


def test_the_port_can_be_used_again_at_once() -> None:
    with VrpnServer(["Head", "Head-joints"], port=0) as server, connect(server) as client:
        greet(server, client)
        port = server.port
        server.close()
        with VrpnServer(["Head"], port=port) as again:
            assert again.names == (f"Head@127.0.0.1:{port}",)
            with pytest.raises(BadInput, match=f"VRPN at 127.0.0.1:{port}: another program listens there"):
                VrpnServer(["Head"], port=port)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("Head", ("Head", "127.0.0.1", 3883)),
        ("Head@4000", ("Head", "127.0.0.1", 4000)),
        ("Head@:4000", ("Head", "127.0.0.1", 4000)),
        ("Head@10.0.0.1:0", ("Head", "10.0.0.1", 0)),
    ],
)
def test_what_is_served_and_where(text: str, parts: tuple[str, str, int]) -> None:
    assert parse_served_name(text) == parts


@pytest.mark.parametrize("text", ["", "@:4000", "Head@", "Head@x", "Head@:70000", "a" * 60, "a\nb"])
def test_a_place_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(BadInput):
        parse_served_name(text)


def test_an_address_of_another_computer_is_refused() -> None:
    with pytest.raises(BadInput, match=r"VRPN at 192\.0\.2\.1:0: [A-Z][a-z ]+\. Name an address of this computer"):
        open_server("Head@192.0.2.1:0", anywhere=True)


def test_other_computers_need_to_be_asked_for() -> None:
    with pytest.raises(BadInput, match=r"0\.0\.0\.0 is reachable from other computers"):
        open_server("Head@0.0.0.0:0")
    with open_server("Head@0.0.0.0:0", ("", "-joints"), anywhere=True) as server:
        assert server.trackers == ("Head", "Head-joints")
