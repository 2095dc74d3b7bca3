"""What the device says in one piece: a data record or a reply, which nothing may split."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Message:
    """Bytes for the line, or the word that what waits there is not wanted any more."""

    ready_s: float
    """When the first bit may go [s]."""
    data: bytes
    station: str = ""
    """Character of the station of a data record; "" for a reply."""
    halts: bool = False
    """Records that wait for the line are thrown away (`c`, restart)."""


@dataclass(frozen=True, slots=True)
class SentMessage:
    """A message that has gone over the line."""

    message: Message
    due_s: float
    """When its last byte is due [s]."""
    data: bytes
    """The bytes that go out: the message's own unless something befell them."""
    damage: tuple[str, ...] = ()
    """Kinds of the faults that befell it; () where it is as the device sent it."""
    written_s: float = float("nan")
    """When it was written [s]."""
    unread: bool = False
    """Not written: the client left no room for it."""

    @property
    def sound(self) -> bool:
        """Whether it went out, and as the device sent it."""
        return not self.damage and not self.unread
