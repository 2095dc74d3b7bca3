"""A small web server on the loopback interface: fixed pages, the newest events, and commands.

It answers requests that name itself as their host, so that a page of another site cannot reach it under another name.
Addresses are looked up among those of its content; it opens no file. Commands need a token, and browsers may send them
from its own page alone.
Pages ask for events again and again. A browser has six connections for all its tabs, and no tab may keep one.
"""

import json
import secrets
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Self

from harness.core.parsing import parse_json
from harness.errors import HarnessError, shorten

EVENTS_PATH, COMMAND_PATH = "/events", "/command/"
COMMAND_HEADER = "X-Harness-Token"
_CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; "
    "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_MAX_COMMAND_BYTES = 65536
_REQUEST_TIMEOUT_S = 30.0
_SHUTDOWN_POLL_S = 0.05
_NEWS_WAIT_S = 0.2
"""Longest wait for a message that a page asks for [s] [choice]; other tabs wait for its connection meanwhile."""
_MAX_THREADS = 128
"""Threads of the process with which further connections are closed at once [choice]."""


@dataclass(frozen=True)
class Resource:
    """What the server answers to one address."""

    kind: str
    """MIME type."""
    data: bytes
    file_name: str = ""
    """Name under which browsers save it; empty for content that is shown."""


Lookup = Callable[[str], Resource | None]
"""Path of an address, such as "/" -> its content, or None; may raise HarnessError."""
Command = Callable[[Mapping[str, Any]], Mapping[str, Any]]
"""Carries out a command with its JSON object; returns the JSON object of the answer; may raise HarnessError."""


class EventBoard:
    """The newest message of each kind, for any number of readers. Readers that are slow miss messages."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._messages: dict[str, tuple[int, str]] = {}
        self._count = 0
        self._closed = False

    def publish(self, kind: str, content: Mapping[str, Any]) -> None:
        """Replace the message of a kind. It does not wait for readers."""
        text = json.dumps(content, separators=(",", ":"))
        with self._changed:
            self._count += 1
            self._messages[kind] = (self._count, text)
            self._changed.notify_all()

    def close(self) -> None:
        """End all waiting readers."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def wait(self, seen: int, timeout_s: float) -> tuple[int, list[tuple[str, str]]] | None:
        """The messages after number `seen`, with the number of the last one; None when the board is closed.

        The list is empty when there is none within the time.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._count > seen, timeout_s)
            if self._closed:
                return None
            new = sorted((number, kind, text) for kind, (number, text) in self._messages.items() if number > seen)
            return self._count, [(kind, text) for _, kind, text in new]


class ViewServer:
    """Serves `lookup`, events and commands on a free port of 127.0.0.1 while its context is open."""

    def __init__(self, lookup: Lookup, commands: Mapping[str, Command] | None = None, *, token: str = "") -> None:
        """`commands` are called from threads of the server; `token` is what a request for one must carry."""
        self.board = EventBoard()
        self.token = token or secrets.token_urlsafe(24)
        handler = type("ViewHandler", (_RequestHandler,), {"view": self})
        self._lookup, self._commands = lookup, {} if commands is None else commands
        self._server = _HttpServer(("127.0.0.1", 0), handler)
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(_SHUTDOWN_POLL_S,), name="view server", daemon=True
        )

    @property
    def port(self) -> int:
        return int(self._server.server_address[1])

    @property
    def url(self) -> str:
        """Address of the first page."""
        return f"http://127.0.0.1:{self.port}/"

    def publish(self, kind: str, content: Mapping[str, Any]) -> None:
        """Send a message to every open page; a page that is slow gets the newest one of each kind."""
        self.board.publish(kind, content)

    def find(self, path: str) -> Resource | None:
        """Content of an address; None if there is none."""
        return self._lookup(path)

    def command(self, name: str) -> Command | None:
        """The command of that name; None if there is none."""
        return self._commands.get(name)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *raised: object) -> None:
        self.board.close()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


class _HttpServer(ThreadingHTTPServer):
    """A thread for each connection, as long as there are few. Its errors are one line."""

    daemon_threads = True
    request_queue_size = 64

    def verify_request(self, request: Any, client_address: Any) -> bool:
        return threading.active_count() < _MAX_THREADS

    def handle_error(self, request: Any, client_address: Any) -> None:
        error = sys.exception()
        print(f"harness: the page's server: {type(error).__name__}: {shorten(str(error))}", file=sys.stderr)


class _RequestHandler(BaseHTTPRequestHandler):
    """Answers one connection; `view` is the server that it belongs to."""

    view: ViewServer
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "harness", ""
    timeout = _REQUEST_TIMEOUT_S

    def do_GET(self) -> None:
        path, _, query = self.path.partition("?")
        if self._has_body():  # it is not read
            self.close_connection = True
        if not self._is_own_host():
            self._refuse(HTTPStatus.FORBIDDEN, "this server answers to its own name only")
        elif path == EVENTS_PATH:
            self._answer(lambda: self._news(query.removeprefix("after=")))
        else:
            self._answer(lambda: self.view.find(path))

    def do_POST(self) -> None:
        path = self.path.partition("?")[0]
        command = self.view.command(path.removeprefix(COMMAND_PATH)) if path.startswith(COMMAND_PATH) else None
        size = -1 if "Transfer-Encoding" in self.headers else _parse_size(self.headers.get("Content-Length", ""))
        self.close_connection |= not 0 <= size <= _MAX_COMMAND_BYTES  # its body is not read
        token = self.headers.get(COMMAND_HEADER, "")
        if not self._is_own_host():
            self._refuse(HTTPStatus.FORBIDDEN, "this server answers to its own name only")
        elif not self._is_own_page():
            self._refuse(HTTPStatus.FORBIDDEN, "commands come from the page of this server only")
        elif not secrets.compare_digest(token.encode(), self.view.token.encode()):
            self._refuse(HTTPStatus.FORBIDDEN, "the token is missing or wrong")
        elif command is None:
            self._refuse(HTTPStatus.NOT_FOUND, "there is no such command")
        elif not 0 <= size <= _MAX_COMMAND_BYTES:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "a command has a body of known length, up to 64 kB")
        else:
            self._answer(lambda: self._run(command, self.rfile.read(size)))

    def _run(self, command: Command, body: bytes) -> Resource:
        try:
            content = parse_json(body.decode())
        except ValueError:
            content = None
        if not isinstance(content, dict):
            raise _BadRequest
        return Resource("application/json", json.dumps(command(content)).encode())

    def _answer(self, make: Callable[[], Resource | None]) -> None:
        """Send what `make` returns; its errors as one line."""
        try:
            resource = make()
        except _BadRequest:
            self._refuse(HTTPStatus.BAD_REQUEST, "the body is no JSON object")
        except HarnessError as error:
            self._refuse(HTTPStatus.UNPROCESSABLE_ENTITY, str(error))
        else:
            if resource is None:
                self._refuse(HTTPStatus.NOT_FOUND, "there is no such page")
            else:
                self._send(HTTPStatus.OK, resource)

    def _own_names(self) -> set[str]:
        return {f"{name}:{self.view.port}" for name in ("127.0.0.1", "localhost")}

    def _is_own_host(self) -> bool:
        hosts = self.headers.get_all("Host", [])
        return len(hosts) == 1 and hosts[0] in self._own_names()

    def _is_own_page(self) -> bool:
        """Whether a command comes from this server's page, or from a program that is no browser."""
        own = {f"http://{name}" for name in self._own_names()}
        sites = self.headers.get_all("Sec-Fetch-Site", [])
        return set(self.headers.get_all("Origin", [])) <= own and set(sites) <= {"same-origin"}

    def _refuse(self, status: HTTPStatus, text: str) -> None:
        if self.command == "POST":  # its body may be unread
            self.close_connection = True
        self._send(status, Resource("text/plain; charset=utf-8", f"{shorten(text).rstrip()}\n".encode()))

    def _send(self, status: HTTPStatus, resource: Resource) -> None:
        self.send_response(status)
        self._send_safety_headers()
        self.send_header("Content-Type", resource.kind)
        self.send_header("Content-Length", str(len(resource.data)))
        if resource.file_name:
            self.send_header("Content-Disposition", f'attachment; filename="{resource.file_name}"')
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(resource.data)

    def _send_safety_headers(self) -> None:
        for name, value in (
            ("Content-Security-Policy", _CONTENT_SECURITY_POLICY),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("X-Content-Type-Options", "nosniff"),
            ("Referrer-Policy", "no-referrer"),
            ("Cache-Control", "no-store"),
        ):
            self.send_header(name, value)

    def _news(self, seen: str) -> Resource:
        """The messages after a number as JSON: a list of kind and content each, and the number to ask for next."""
        news = self.view.board.wait(max(_parse_size(seen), 0), _NEWS_WAIT_S)
        if news is None:
            raise HarnessError("The session has ended.")
        last, messages = news
        texts = [f"[{json.dumps(kind)},{text}]" for kind, text in messages]
        return Resource("application/json", f'{{"last":{last},"messages":[{",".join(texts)}]}}'.encode())

    def _has_body(self) -> bool:
        return "Transfer-Encoding" in self.headers or self.headers.get("Content-Length", "0") != "0"

    def handle_one_request(self) -> None:
        try:
            super().handle_one_request()
        except OSError:  # the browser closed the connection
            self.close_connection = True

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing: stderr is for the user of the program."""


def _parse_size(text: str) -> int:
    """A whole number of at most nine digits; -1 for another text."""
    return int(text) if text.isascii() and text.isdecimal() and len(text) < 10 else -1


class _BadRequest(Exception):
    """The body of a command is no JSON object."""
