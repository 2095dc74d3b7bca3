"""Messages of the device: data records and replies, which are never interrupted."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Message:
    """Bytes for the line, or a request to discard the records that wait for it."""

    ready_s: float
    """Earliest time of the first bit [s]."""
    data: bytes
    station: str = ""
    """Character of the station of a data record; "" for a reply."""
    halts: bool = False
    """Whether records that wait for the line are discarded (`c`, restart)."""


@dataclass(frozen=True, slots=True)
class SentMessage:
    """A message that has left the line."""

    message: Message
    due_s: float
    """When its last byte is due [s]."""
    data: bytes
    """The bytes that leave the line: those of the message unless a fault changed them."""
    damage: tuple[str, ...] = ()
    """Kinds of the faults that changed the message; () when it is intact."""
    written_s: float = float("nan")
    """When it was written [s]."""
    unread: bool = False
    """Whether it was not written, because the client left no room for it."""

    @property
    def sound(self) -> bool:
        """Whether the message was written without change."""
        return not self.damage and not self.unread
