"""The serial line: one message at a time, ten bits per byte, a short queue before it. No I/O; time is an argument."""

from collections import deque
from dataclasses import dataclass

from harness.stream.codec.items import BITS_PER_BYTE


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


_END_OF_ROUND = "~"
"""Compares greater than every station, so that the next record starts a round."""
MAX_QUEUED_REPLIES = 256
"""Most replies that wait. A client that queries faster than the line answers loses the oldest."""


class SerialLine:
    """Computes when each message has left the line.

    A record that finds the queue full displaces the oldest waiting round.

    If it displaced the oldest record, a steady overload would drop records of the same stations again and again, since
    the rhythms of line and stations lock. A round of which a record has been sent is never dropped, nor is the newest
    round.

    The schedule is absolute: a message starts when it is ready and the line is free, never when the caller looked.
    """

    def __init__(self, baud: int, queue_records: int, paced: bool = True) -> None:
        self.baud, self._queue_records, self._paced = baud, queue_records, paced
        self.dropped = 0
        """Number of records that the line had no time for."""
        self.dropped_replies = 0
        self._waiting: deque[Message] = deque()
        self._sending: deque[tuple[float, Message]] = deque()
        """Messages that have started, and when the last byte of each is due [s]."""
        self._free_s = float("-inf")
        self._last_station = _END_OF_ROUND
        """Station of the latest record that has started."""

    def add(self, message: Message) -> None:
        """Queue a message. Messages must be added in sequence of their times."""
        self._start_ready(message.ready_s, strictly=True)
        if message.halts:
            self._waiting = deque(waiting for waiting in self._waiting if not waiting.station)
            self._last_station = _END_OF_ROUND
            return
        self._waiting.append(message)
        queued = [waiting for waiting in self._waiting if bool(waiting.station) == bool(message.station)]
        if message.station and len(queued) > self._queue_records:
            self._drop(self._oldest_round(queued))
        elif not message.station and len(queued) > MAX_QUEUED_REPLIES:
            self._waiting.remove(queued[0])
            self.dropped_replies += 1

    def _oldest_round(self, records: list[Message]) -> list[Message]:
        """Return the oldest round that may be dropped; [] when only a partly sent and the newest round wait."""
        rounds: list[list[Message]] = []
        previous_station = self._last_station
        for record in records:
            if not rounds or record.station <= previous_station:
                rounds.append([])
            rounds[-1].append(record)
            previous_station = record.station
        is_partial = records[0].station > self._last_station
        return next(iter(rounds[is_partial:-1]), [])

    def _drop(self, records: list[Message]) -> None:
        dropped_ids = set(map(id, records))
        self._waiting = deque(waiting for waiting in self._waiting if id(waiting) not in dropped_ids)
        self.dropped += len(records)

    def hold(self, from_s: float, until_s: float) -> None:
        """Start no message between these times."""
        self._start_ready(from_s, strictly=True)
        self._free_s = max(self._free_s, until_s)

    def pop_sent(self, now_s: float) -> list[tuple[float, Message]]:
        """Return the messages that have left the line by now, and when [s]."""
        self._start_ready(now_s)
        out = []
        while self._sending and self._sending[0][0] <= now_s:
            out.append(self._sending.popleft())
        return out

    @property
    def next_s(self) -> float:
        """When the next last byte is due [s]; inf when nothing waits."""
        if self._sending:
            return self._sending[0][0]
        return self._end_s(self._waiting[0]) if self._waiting else float("inf")

    def _start_ready(self, now_s: float, strictly: bool = False) -> None:
        """Start all messages that may start by this time, or strictly before it."""
        while self._waiting:
            start_s = max(self._free_s, self._waiting[0].ready_s)
            if start_s > now_s or (strictly and start_s == now_s):
                return
            message = self._waiting.popleft()
            self._last_station = message.station or self._last_station
            self._free_s = self._end_s(message)
            self._sending.append((self._free_s, message))

    def _end_s(self, message: Message) -> float:
        start_s = max(self._free_s, message.ready_s)
        return start_s + len(message.data) * BITS_PER_BYTE / self.baud if self._paced else start_s
