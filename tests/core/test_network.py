"""Where the system prefers ::1 for localhost, every socket of the harness still uses 127.0.0.1."""

import contextlib
import socket
from typing import Any

import numpy as np
import pytest

from harness.body import build_body
from harness.core.network import resolve_host
from harness.errors import BadInput
from harness.live import VmcOutput
from harness.stream.polhemus import TcpPort, UdpPort, open_transport
from tests.live.posing import configuration, live_pose

IPV4, IPV6 = socket.AF_INET, socket.AF_INET6


@pytest.fixture
def _prefers_ipv6(monkeypatch: pytest.MonkeyPatch) -> None:
    def resolve(host: str, port: int, *_: Any, **__: Any) -> list[tuple[Any, ...]]:
        known = {"localhost": ("::1", "127.0.0.1"), "six": ("::1",), "::1": ("::1",), "127.0.0.1": ("127.0.0.1",)}
        if host not in known:
            raise socket.gaierror(-2, "Name or service not known")
        both = {"::1": (IPV6, ("::1", port, 0, 0)), "127.0.0.1": (IPV4, ("127.0.0.1", port))}
        return [(both[one][0], 0, 0, "", both[one][1]) for one in known[host]]

    monkeypatch.setattr(socket, "getaddrinfo", resolve)


@pytest.mark.usefixtures("_prefers_ipv6")
@pytest.mark.parametrize(("host", "first"), [("localhost", IPV4), ("127.0.0.1", IPV4), ("::1", IPV6), ("six", IPV6)])
def test_ipv4_comes_first_unless_there_is_none(host: str, first: socket.AddressFamily) -> None:
    (family, address), *others = resolve_host(host, 7, socket.SOCK_DGRAM)
    assert family == first
    assert address[:2] == ({IPV4: "127.0.0.1", IPV6: "::1"}[first], 7)
    assert len(others) == (host == "localhost")


@pytest.mark.usefixtures("_prefers_ipv6")
def test_udp_reaches_a_receiver_at_localhost(rng: np.random.Generator) -> None:
    pytest.importorskip("pythonosc", reason="python-osc is not installed (extra `live`)")
    with socket.socket(IPV4, socket.SOCK_DGRAM) as ours:
        ours.bind(("127.0.0.1", 0))
        ours.settimeout(5.0)
        port = ours.getsockname()[1]
        with contextlib.closing(VmcOutput(f"localhost:{port}", build_body().skeleton)) as output:
            output.send(live_pose(configuration(rng)))
        assert ours.recv(2048).startswith(b"#bundle")
        ours.recv(2048)
        with contextlib.closing(UdpPort("localhost")) as broadcaster:
            broadcaster.send(b"packet", port)
            assert (broadcaster.sent, broadcaster.unsent) == (1, 0)
        assert ours.recv(64) == b"packet"


@pytest.mark.usefixtures("_prefers_ipv6")
def test_listeners_and_clients_meet_at_localhost() -> None:
    listener = TcpPort("localhost", 0)
    with contextlib.closing(listener), contextlib.closing(open_transport(listener.name)) as client:
        assert listener.name.startswith("tcp://localhost:")
        client.write(b"S")
        assert any(listener.read() for _ in range(1000))
    with contextlib.closing(open_transport(f"udp://localhost:{free_udp_port()}")) as receiver:
        port = int(receiver.name.rpartition(":")[2])
        with socket.socket(IPV4, socket.SOCK_DGRAM) as second, pytest.raises(OSError, match="in use"):
            second.bind(("127.0.0.1", port))


def free_udp_port() -> int:
    with socket.socket(IPV4, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_a_client_tries_the_next_address(monkeypatch: pytest.MonkeyPatch) -> None:
    """A host whose IPv4 address refuses is reached by its IPv6 address."""
    with socket.create_server(("::1", 0), family=IPV6) as server:
        port = server.getsockname()[1]
        both = [(IPV6, 0, 0, "", ("::1", port, 0, 0)), (IPV4, 0, 0, "", ("127.0.0.1", port))]
        monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: both)
        with contextlib.closing(open_transport(f"tcp://both:{port}")):
            connection, _ = server.accept()
            connection.close()


@pytest.mark.usefixtures("_prefers_ipv6")
def test_unknown_hosts_are_named() -> None:
    with pytest.raises(BadInput, match="nowhere"):
        UdpPort("nowhere")
    with pytest.raises(BadInput, match="nowhere"):
        TcpPort("nowhere", 0, anywhere=True)
    with pytest.raises(BadInput, match="no host called nowhere"):
        open_transport("tcp://nowhere:5")
