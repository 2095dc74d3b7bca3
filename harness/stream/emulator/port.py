"""The interface of a port at which a client finds an emulator. No method blocks."""

from typing import Protocol

from harness.errors import BadInput

_LOOPBACK = ("127.0.0.1", "::1", "localhost")


def parse_address(text: str, default_host: str = "") -> tuple[str, int]:
    """Split `HOST:PORT`, or `PORT` where there is a default host. Raises BadInput."""
    host, _, number = text.rpartition(":")
    host = host or default_host
    if not host or not (number.isascii() and number.isdecimal() and len(number) <= 5) or int(number) > 65535:
        raise BadInput(f"{text!r} is no HOST:PORT.", "An example is 127.0.0.1:5005.")
    return host.strip("[]"), int(number)


def check_loopback(host: str, anywhere: bool, risk: str) -> None:
    """Raise BadInput for an address outside this computer, unless `anywhere`. `risk` says what others could do."""
    if host not in _LOOPBACK and not anywhere:
        raise BadInput(f"{host} is reachable from other computers.", f"Use 127.0.0.1, or --anywhere: {risk}.")


class Port(Protocol):
    """The client's end of a line. A client may come and go."""

    @property
    def name(self) -> str:
        """The name that a client opens."""
        ...

    def readable(self) -> list[int]:
        """Return the descriptors to wait for bytes or clients from."""
        ...

    def writable(self) -> list[int]:
        """Return the descriptors that must take the rest of a message."""
        ...

    def read(self) -> bytes:
        """Return the bytes that have arrived, without waiting."""
        ...

    def write(self, data: bytes) -> bool:
        """Send all of the data sooner or later, or nothing.

        Returns False when the client is absent or leaves no room.
        """
        ...

    def baud(self) -> int | None:
        """Return the baud rate that the client has set [bit/s]; None where there is none."""
        ...

    def unplug(self) -> None:
        """Make the port unusable for the client, as if the cable were pulled out."""
        ...

    def plug(self) -> None:
        """Make the port usable again; no effect if it is usable."""
        ...

    def close(self) -> None:
        """Release the port for good."""
        ...
