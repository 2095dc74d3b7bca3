"""The interface of a port at which a client finds an emulator. No method blocks."""

from typing import Protocol


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
