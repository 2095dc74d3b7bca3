"""The serial line: one message at a time, ten bits to a byte, a short queue before it. No I/O: time is an argument."""

from collections import deque

from harness.stream.codec.items import BITS_PER_BYTE
from harness.stream.emulator.message import Message

_END_OF_ROUND = "~"
"""After all stations: the next record begins a round."""
MAX_QUEUED_REPLIES = 256
"""Replies that wait; a client that asks faster than the line answers loses the oldest."""


class SerialLine:
    """When each message has gone. A record that finds the queue full displaces the oldest whole round that waits.

    Were it the oldest record, a steady overload would hit the same stations again and again, since the rhythm of the
    line and that of the stations lock. A round that has begun to go, and the newest one, are let be.

    The schedule is absolute: a message starts when it is ready and the line is free, never when somebody looked.
    """

    def __init__(self, baud: int, queue_records: int, paced: bool = True) -> None:
        self.baud, self._queue_records, self._paced = baud, queue_records, paced
        self.dropped = 0
        """Records that the line had no time for."""
        self.dropped_replies = 0
        self._waiting: deque[Message] = deque()
        self._going: deque[tuple[float, Message]] = deque()
        """Messages that began, and when the last byte of each is due [s]."""
        self._free_s = float("-inf")
        self._begun = _END_OF_ROUND
        """Station of the last record that began."""

    def add(self, message: Message) -> None:
        """A message after all others; those in order of time."""
        self._begin(message.ready_s, before=True)
        if message.halts:
            self._waiting = deque(waiting for waiting in self._waiting if not waiting.station)
            self._begun = _END_OF_ROUND
            return
        self._waiting.append(message)
        alike = [waiting for waiting in self._waiting if bool(waiting.station) == bool(message.station)]
        if message.station and len(alike) > self._queue_records:
            self._drop(self._oldest_round(alike))
        elif not message.station and len(alike) > MAX_QUEUED_REPLIES:
            self._waiting.remove(alike[0])
            self.dropped_replies += 1

    def _oldest_round(self, records: list[Message]) -> list[Message]:
        """Of those that wait; [] where only a begun one and the newest do."""
        rounds: list[list[Message]] = []
        before = self._begun
        for record in records:
            if not rounds or record.station <= before:
                rounds.append([])
            rounds[-1].append(record)
            before = record.station
        begun = records[0].station > self._begun
        return next(iter(rounds[begun:-1]), [])

    def _drop(self, records: list[Message]) -> None:
        these = set(map(id, records))
        self._waiting = deque(waiting for waiting in self._waiting if id(waiting) not in these)
        self.dropped += len(records)

    def hold(self, from_s: float, until_s: float) -> None:
        """Nothing begins between these moments."""
        self._begin(from_s, before=True)
        self._free_s = max(self._free_s, until_s)

    def gone(self, now_s: float) -> list[tuple[float, Message]]:
        """What has left the line by now, and when [s]."""
        self._begin(now_s)
        out = []
        while self._going and self._going[0][0] <= now_s:
            out.append(self._going.popleft())
        return out

    @property
    def next_s(self) -> float:
        """When the next last byte is due [s]; inf when nothing waits."""
        if self._going:
            return self._going[0][0]
        return self._end_s(self._waiting[0]) if self._waiting else float("inf")

    def _begin(self, now_s: float, before: bool = False) -> None:
        """Start whatever may start by this moment (`before`: earlier than it)."""
        while self._waiting:
            start_s = max(self._free_s, self._waiting[0].ready_s)
            if start_s > now_s or (before and start_s == now_s):
                return
            message = self._waiting.popleft()
            self._begun = message.station or self._begun
            self._free_s = self._end_s(message)
            self._going.append((self._free_s, message))

    def _end_s(self, message: Message) -> float:
        start_s = max(self._free_s, message.ready_s)
        return start_s + len(message.data) * BITS_PER_BYTE / self.baud if self._paced else start_s
