"""The outside of an emulator: where a client finds it. Nothing here blocks."""

from typing import Protocol


class Port(Protocol):
    """The outside of a line. A client may come and go."""

    @property
    def name(self) -> str:
        """What a client opens."""
        ...

    def readable(self) -> list[int]:
        """Descriptors whose bytes or clients are to be waited for."""
        ...

    def writable(self) -> list[int]:
        """Descriptors that have to take the rest of a message."""
        ...

    def read(self) -> bytes:
        """What came, without waiting."""
        ...

    def write(self, data: bytes) -> bool:
        """Send all of it sooner or later, or nothing: False when the client leaves no room, or is not there."""
        ...

    def baud(self) -> int | None:
        """Rate that the client has set [bit/s]; None where there is no such thing."""
        ...

    def unplug(self) -> None: ...
    def plug(self) -> None: ...
    def close(self) -> None: ...
