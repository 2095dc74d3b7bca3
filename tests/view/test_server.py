"""The viewer's server: its own host alone, its own addresses alone, commands with a token, the newest events."""

import http.client
import json
import socket
import threading
import time
from collections.abc import Iterator, Mapping
from typing import Any

import pytest

from harness.errors import BadInput
from harness.view.server import COMMAND_HEADER, EventBoard, Resource, ViewServer

PAGES = {"/": Resource("text/html", b"<p>hello"), "/movie": Resource("video/mp4", b"1234", "a.mp4")}


def find(path: str) -> Resource | None:
    if path == "/broken":
        raise BadInput("The clip is damaged.", "Restore it.")
    return PAGES.get(path)


def double(wanted: Mapping[str, Any]) -> Mapping[str, Any]:
    if not isinstance(wanted.get("n"), int):
        raise BadInput("No number.", "Name one.")
    return {"n": 2 * wanted["n"]}


@pytest.fixture
def server() -> Iterator[ViewServer]:
    with ViewServer(find, {"double": double}) as running:
        yield running


def ask(
    server: ViewServer, path: str, method: str = "GET", body: str | None = None, **headers: str
) -> tuple[int, bytes, dict[str, str]]:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    try:
        connection.putrequest(method, path, skip_host="Host" in headers)
        if body is not None:
            headers.setdefault("Content-Length", str(len(body)))
        for name, value in headers.items():
            connection.putheader(name.replace("_", "-"), value)
        connection.endheaders(body.encode() if body else None)
        answer = connection.getresponse()
        return answer.status, answer.read(), dict(answer.getheaders())
    finally:
        connection.close()


def command(server: ViewServer, name: str, body: str, token: str | None = None, **more: str) -> tuple[int, bytes]:
    headers = {COMMAND_HEADER: server.token if token is None else token, **more}
    return ask(server, f"/command/{name}", "POST", body, **headers)[:2]


def test_it_listens_on_loopback_alone(server: ViewServer) -> None:
    assert server.url == f"http://127.0.0.1:{server.port}/"
    assert server._server.server_address[0] == "127.0.0.1"


def test_a_page_is_served_with_headers_that_keep_others_out(server: ViewServer) -> None:
    status, body, headers = ask(server, "/?x=1")
    assert (status, body) == (200, b"<p>hello")
    assert headers["Content-Type"] == "text/html"
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert "Content-Disposition" not in headers
    assert ask(server, "/movie")[2]["Content-Disposition"] == 'attachment; filename="a.mp4"'


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "127.0.0.1:1", "localhost.evil.example:{port}", ""])
def test_another_host_is_refused(server: ViewServer, host: str) -> None:
    named = host.format(port=server.port)
    assert ask(server, "/", Host=named)[0] == 403
    assert command(server, "double", '{"n": 1}', Host=named)[0] == 403


def test_localhost_is_its_own_name(server: ViewServer) -> None:
    assert ask(server, "/", Host=f"localhost:{server.port}")[0] == 200


@pytest.mark.parametrize("path", ["/nothing", "/../etc/passwd", "/%2e%2e/etc/passwd", "//etc/passwd", "/movie/", "*"])
def test_unknown_addresses_are_not_found(server: ViewServer, path: str) -> None:
    assert ask(server, path)[0] == 404


def test_an_error_of_the_content_is_one_line(server: ViewServer) -> None:
    assert ask(server, "/broken")[:2] == (422, b"The clip is damaged. Restore it.\n")


def test_a_command_needs_the_token(server: ViewServer) -> None:
    assert command(server, "double", '{"n": 21}') == (200, b'{"n": 42}')
    for token in ("", "wrong", "é"):
        assert command(server, "double", '{"n": 21}', token.encode().decode("latin-1"))[0] == 403
    with ViewServer(find) as other:
        assert other.token != server.token


@pytest.mark.parametrize(
    ("name", "body", "status"),
    [("treble", "{}", 404), ("double", "{", 400), ("double", "[1]", 400), ("double", "{}", 422), ("", "{}", 404)],
)
def test_commands_that_make_no_sense_are_refused(server: ViewServer, name: str, body: str, status: int) -> None:
    assert command(server, name, body)[0] == status


@pytest.mark.parametrize("length", ["", "-1", "65537", "1e3", "²"])
def test_a_body_of_no_or_too_great_length_is_refused(server: ViewServer, length: str) -> None:
    headers = {COMMAND_HEADER: server.token, "Content-Length": length.encode().decode("latin-1")}
    assert ask(server, "/command/double", "POST", "{}", **headers)[0] == 413


def test_other_methods_are_refused(server: ViewServer) -> None:
    assert ask(server, "/", "PUT", "x")[0] == 501


def read_events(server: ViewServer, count: int) -> list[tuple[str, dict[str, Any]]]:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    connection.request("GET", "/events")
    answer = connection.getresponse()
    assert answer.getheader("Content-Type") == "text/event-stream"
    found: list[tuple[str, dict[str, Any]]] = []
    kind = ""
    while len(found) < count:
        line = answer.fp.readline().decode().strip()
        if line.startswith("event: "):
            kind = line.removeprefix("event: ")
        elif line.startswith("data: "):
            found.append((kind, json.loads(line.removeprefix("data: "))))
    connection.close()
    return found


def test_a_page_gets_the_newest_message_of_each_kind(server: ViewServer) -> None:
    for number in range(5):
        server.publish("frame", {"n": number})
    server.publish("status", {"rate": 40})
    assert read_events(server, 2) == [("frame", {"n": 4}), ("status", {"rate": 40})]


def test_messages_arrive_while_a_page_waits(server: ViewServer) -> None:
    found: list[tuple[str, dict[str, Any]]] = []
    reader = threading.Thread(target=lambda: found.extend(read_events(server, 2)))
    server.publish("frame", {"n": 1})
    reader.start()
    time.sleep(0.3)
    server.publish("frame", {"n": 2})
    reader.join(10)
    assert found == [("frame", {"n": 1}), ("frame", {"n": 2})]


def test_a_page_that_does_not_read_delays_nobody(server: ViewServer) -> None:
    """It fills its connection with messages of 100 kB and reads none of them."""
    with socket.create_connection(("127.0.0.1", server.port)) as silent:
        silent.sendall(f"GET /events HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n\r\n".encode())
        time.sleep(0.2)
        began = time.monotonic()
        for number in range(200):
            server.publish("frame", {"n": number, "text": "x" * 100_000})
        assert time.monotonic() - began < 2.0
        ((_, newest),) = read_events(server, 1)
        assert newest["n"] == 199


def test_closing_ends_readers_and_the_port(server: ViewServer) -> None:
    board = EventBoard()
    ended: list[object] = []
    waiting = threading.Thread(target=lambda: ended.append(board.wait(0, 30.0)))
    waiting.start()
    board.close()
    waiting.join(5)
    assert ended == [None]
    with ViewServer(find) as other:
        port = other.port
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", port), timeout=2)


def test_waiting_without_news_ends_after_the_time() -> None:
    assert EventBoard().wait(0, 0.01) == (0, [])
