"""The viewer's server: its own host alone, its own addresses alone, commands with a token, the newest events."""

import contextlib
import http.client
import json
import socket
import threading
import time
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
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


@pytest.mark.parametrize("name", ["Origin", "Sec-Fetch-Site"])
def test_a_command_from_the_page_of_another_site_is_refused(server: ViewServer, name: str) -> None:
    """A browser adds these headers by itself; a program without a page has none of them."""
    host = f"http://127.0.0.1:{server.port}"
    own = {"Origin": [host, host.replace("127.0.0.1", "localhost")], "Sec-Fetch-Site": ["same-origin"]}
    others = {
        "Origin": ["http://evil.example", "null", "", "http://127.0.0.1", host.replace("http", "https"), f"{host}0"],
        "Sec-Fetch-Site": ["cross-site", "same-site", "none", ""],
    }
    for text in own[name]:
        assert command(server, "double", '{"n": 21}', **{name: text})[0] == 200
    for text in others[name]:
        assert command(server, "double", '{"n": 21}', **{name: text})[0] == 403
    assert ask(server, "/", **{name: others[name][0]})[0] == 200


@pytest.mark.parametrize(
    ("name", "body", "status"),
    [
        ("treble", "{}", 404),
        ("double", "{", 400),
        ("double", "[1]", 400),
        ("double", "{}", 422),
        ("", "{}", 404),
        ("double", "[" * 60_000, 400),
        ("double", '{"n":' * 10_000 + "1" + "}" * 10_000, 400),
        ("double", '{"n": ' + "9" * 5000 + "}", 400),
        ("double", '{"n": "\\ud800"}', 400),
    ],
)
def test_commands_that_make_no_sense_are_refused(server: ViewServer, name: str, body: str, status: int) -> None:
    assert command(server, name, body)[0] == status


@pytest.mark.parametrize("length", ["", "-1", "65537", "1e3", "²", "9" * 4400])
def test_a_body_of_no_or_too_great_length_is_refused(server: ViewServer, length: str) -> None:
    headers = {COMMAND_HEADER: server.token, "Content-Length": length.encode().decode("latin-1")}
    assert ask(server, "/command/double", "POST", "{}", **headers)[0] == 413


def test_other_methods_are_refused(server: ViewServer) -> None:
    assert ask(server, "/", "PUT", "x")[0] == 501


def news(server: ViewServer, after: object = 0) -> tuple[int, dict[str, dict[str, Any]]]:
    status, body, headers = ask(server, f"/events?after={after}")
    assert (status, headers["Content-Type"]) == (200, "application/json")
    content = json.loads(body)
    return content["last"], dict(content["messages"])


def test_a_page_gets_the_newest_message_of_each_kind(server: ViewServer) -> None:
    for number in range(5):
        server.publish("frame", {"n": number})
    server.publish("status", {"rate": 40})
    assert news(server) == (6, {"frame": {"n": 4}, "status": {"rate": 40}})
    assert news(server, 5) == (6, {"status": {"rate": 40}})
    for nonsense in ("", "x", "-1", "9" * 5000, "1e3", "%00"):
        assert news(server, nonsense) == news(server)


def test_messages_arrive_while_a_page_waits(server: ViewServer) -> None:
    found: list[tuple[int, dict[str, dict[str, Any]]]] = []
    server.publish("frame", {"n": 1})
    reader = threading.Thread(target=lambda: found.append(news(server, 1)))
    reader.start()
    time.sleep(0.05)
    server.publish("frame", {"n": 2})
    reader.join(10)
    assert found == [(2, {"frame": {"n": 2}})]


def test_a_page_without_news_keeps_no_connection_for_long(server: ViewServer) -> None:
    """Six connections are all that a browser opens: streams of events took them, and a seventh tab never loaded."""
    server.publish("frame", {"n": 1})
    began = time.monotonic()
    assert news(server, 1) == (1, {})
    assert time.monotonic() - began < 1.0


def test_a_page_that_does_not_read_delays_nobody(server: ViewServer) -> None:
    """It asks for messages of 100 kB and reads none of them."""
    with socket.create_connection(("127.0.0.1", server.port)) as silent:
        silent.sendall(200 * f"GET /events HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n\r\n".encode())
        began = time.monotonic()
        for number in range(200):
            server.publish("frame", {"n": number, "text": "x" * 100_000})
        assert time.monotonic() - began < 2.0
        assert news(server)[1]["frame"]["n"] == 199


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


def answers_of(server: ViewServer, data: bytes, *, half_closed: bool) -> bytes:
    """What the server answers to these bytes until it closes the connection, or for a tenth of a second."""
    answer = b""
    with socket.create_connection(("127.0.0.1", server.port), timeout=5) as client, contextlib.suppress(OSError):
        client.sendall(data)
        if half_closed:
            client.shutdown(socket.SHUT_WR)
        else:
            client.settimeout(0.02)
        while more := client.recv(65536):
            answer += more
    return answer


BAD_REQUESTS = [
    b"",
    b"\0",
    b"\r\n\r\n",
    b"GET",
    b"GET /\r\n\r\n",
    b"GET / HTTP/1.0\r\n\r\n",
    b"GET / HTTP/1.1\r\n\r\n",
    b"GET / HTTP/2.0\r\n\r\n",
    b"GET / HTTP/1." + b"9" * 5000 + b"\r\n\r\n",
    b"GET / HTTP/\xb2.1\r\n\r\n",
    b"GET http://[::1 HTTP/1.1\r\nHost: HOST\r\n\r\n",
    b"GET //[ HTTP/1.1\r\nHost: HOST\r\n\r\n",
    b"GET /\xff\xfe?\xff HTTP/1.1\r\nHost: HOST\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: HOST\r\nContent-Length: 5\r\n\r\nGET /",
    b"GET / HTTP/1.1\r\nHost: HOST\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: \xff\xfe\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: HOST\r\nHost: evil\r\n\r\n",
    b"GET / HTTP/1.1\r\n:\r\n \r\n\t x\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: HOST\r\n" + b"a: b\r\n" * 300 + b"\r\n",
    b"GET / HTTP/1.1\r\nHost: HOST\r\na: " + b"b" * 100_000 + b"\r\n\r\n",
    b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
    b"__class__ / HTTP/1.1\r\nHost: HOST\r\n\r\n",
    b"\xff / HTTP/1.1\r\nHost: HOST\r\n\r\n",
    b"PUT / HTTP/1.1\r\nHost: HOST\r\nExpect: 100-continue\r\n\r\n",
    b"POST /command/double HTTP/1.1\r\nHost: HOST\r\nContent-Length: " + b"9" * 4400 + b"\r\n\r\n",
    b"POST /command/double HTTP/1.1\r\nHost: HOST\r\nContent-Length: -5\r\n\r\n",
    b"POST /command/double HTTP/1.1\r\nHost: HOST\r\nTOKEN\r\nContent-Length: 60000\r\n\r\n[",
    b"POST /command/double HTTP/1.1\r\nHost: HOST\r\nTOKEN\r\nContent-Length: 4\r\n\r\n\xff\xfe{}",
    b"POST /command/double HTTP/1.1\r\nHost: HOST\r\nTOKEN\r\nContent-Length: 60000\r\n\r\n" + b"[" * 60_000,
    b"POST /command/double HTTP/1.1\r\nHost: HOST\r\nTOKEN\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n\r\n",
    b"POST http://[::1 HTTP/1.1\r\nHost: HOST\r\nTOKEN\r\nContent-Length: 2\r\n\r\n{}",
]


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """The bytes with some changed, removed or doubled."""
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 6))):
        at = int(rng.integers(0, len(out) + 1))
        match rng.integers(0, 3):
            case 0:
                out[at : at + 1] = rng.integers(0, 256, size=1, dtype=np.uint8).tobytes()
            case 1:
                del out[at : at + int(rng.integers(1, 30))]
            case _:
                out[at:at] = out[at : at + int(rng.integers(1, 30))]
    return bytes(out)


@pytest.mark.long
def test_no_bytes_of_a_client_end_the_server_or_print(
    server: ViewServer, rng: np.random.Generator, capfd: pytest.CaptureFixture[str]
) -> None:
    named = [
        data.replace(b"HOST", f"127.0.0.1:{server.port}".encode()).replace(
            b"TOKEN", f"{COMMAND_HEADER}: {server.token}".encode()
        )
        for data in BAD_REQUESTS
    ]
    for data in named:
        answer = answers_of(server, data, half_closed=True)
        assert answer == b"" or answer.startswith((b"HTTP/1.1 ", b"<!DOCTYPE", b"this server")), (
            data[:80],
            answer[:80],
        )
    for number in range(2000):
        answers_of(server, damaged(named[number % len(named)], rng), half_closed=number % 20 > 0)
    assert ask(server, "/")[:2] == (200, b"<p>hello")
    assert command(server, "double", '{"n": 21}') == (200, b'{"n": 42}')
    said = capfd.readouterr()
    assert (said.out, said.err) == ("", "")


def test_many_silent_clients_end_nothing(server: ViewServer, capfd: pytest.CaptureFixture[str]) -> None:
    with contextlib.ExitStack() as opened:
        for _ in range(200):
            client = opened.enter_context(socket.create_connection(("127.0.0.1", server.port), timeout=5))
            client.sendall(b"GET / HT")
        time.sleep(0.2)
        assert threading.active_count() < 150
    time.sleep(0.2)
    assert ask(server, "/")[0] == 200
    assert capfd.readouterr().err == ""


def test_a_defect_of_a_page_is_one_line(capfd: pytest.CaptureFixture[str]) -> None:
    with ViewServer(lambda path: PAGES[path]) as broken:
        with pytest.raises((http.client.HTTPException, OSError)):
            ask(broken, "/nothing")
        assert ask(broken, "/")[0] == 200
    (line,) = capfd.readouterr().err.splitlines()
    assert line == "harness: the page's server: KeyError: '/nothing'"
