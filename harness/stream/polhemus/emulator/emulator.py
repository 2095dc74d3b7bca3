"""Device, serial line and faults together, without input or output: bytes in, bytes with their times out."""

from collections import deque
from typing import ClassVar

from harness.errors import UnknownName
from harness.stream.polhemus.codec.items import BITS_PER_BYTE
from harness.stream.polhemus.codec.samples import DeviceSamples
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.device import CommandDevice
from harness.stream.polhemus.emulator.device_state import Message, SentMessage
from harness.stream.polhemus.emulator.faults import FaultEpisode, FaultInjector

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


class LineEmulator:
    """A device and its line as a host sees them. Calls must have increasing times."""

    device_type: ClassVar[type[CommandDevice]]

    def __init__(self, samples: DeviceSamples, config: EmulatorConfig | None = None, now_s: float = 0.0) -> None:
        """Switch the device on. Raises UnknownName when a fault names a station that is not in the samples."""
        self.device = self.device_type(samples, config, now_s)
        self.config = self.device.config
        self.line = SerialLine(self.config.baud, self.config.queue_records, self.config.paced)
        self.episodes: list[FaultEpisode] = []
        """All fault episodes that have begun."""
        self.unplugged_messages = 0
        """Number of messages that were sent while the line was unplugged."""
        self._active: list[FaultEpisode] = []
        self._faults = FaultInjector(self.config.faults, self.config.seed, now_s)
        for fault in self.config.faults:
            if fault.station and fault.station not in samples.stations:
                raise UnknownName("station", fault.station, samples.stations)
            if fault.kind == "firmware":
                self.device.firmware = fault.firmware

    def receive(self, data: bytes, now_s: float) -> None:
        """Take bytes from the host; they are lost while the line is unplugged."""
        self._advance_to(now_s)
        if not self.unplugged(now_s):
            self.device.receive(data, now_s)
            self._queue_messages(now_s)

    def advance(self, now_s: float) -> list[SentMessage]:
        """Return the messages that have left the line since the last call."""
        self._advance_to(now_s)
        sent = []
        for due_s, message in self.line.pop_sent(now_s):
            data, damage = self._faults.corrupt(message.data, self._is_active("burst", due_s), due_s)
            if self._is_active("disconnect", due_s):
                self.unplugged_messages += 1
            else:
                sent.append(SentMessage(message, due_s, data, damage))
        self._active = [episode for episode in self._active if episode.to_s > now_s]
        return sent

    def unplugged(self, now_s: float) -> bool:
        """Whether the line is unplugged at this time."""
        return self._is_active("disconnect", now_s)

    @property
    def next_s(self) -> float:
        """When something will happen next, unless bytes arrive before [s]."""
        ready_s = self.device.next_s + self.device.samples.ready_s
        return min([self.line.next_s, ready_s, self._faults.next_s, *(episode.to_s for episode in self._active)])

    def _advance_to(self, now_s: float) -> None:
        """Start and end the episodes that are due by now, in sequence."""
        started = self._faults.pop_started(now_s)
        ended = [episode for episode in [*self._active, *started] if episode.to_s <= now_s]
        changes = [
            *((episode.from_s, True, episode) for episode in started),
            *((episode.to_s, False, episode) for episode in ended),
        ]
        for at_s, is_start, episode in sorted(changes, key=lambda change: change[0]):
            self._queue_messages(at_s)
            if is_start:
                self._start_episode(episode)
            if episode.fault.kind == "lost_station":
                self._update_lost_stations(at_s)
        self._queue_messages(now_s)

    def _start_episode(self, episode: FaultEpisode) -> None:
        self.episodes.append(episode)
        self._active.append(episode)
        if episode.fault.kind == "stall":
            self.line.hold(episode.from_s, episode.to_s)
        elif episode.fault.kind == "reset":
            self.device.restart(episode.from_s)

    def _update_lost_stations(self, at_s: float) -> None:
        """Tell the device which stations are lost at this time."""
        names = self.device.samples.stations
        episodes = (episode for episode in self._active if episode.fault.kind == "lost_station")
        lost = (episode.fault.station or names[0] for episode in episodes if episode.from_s <= at_s < episode.to_s)
        self.device.set_lost_stations(self.device.rounds.station_characters[names.index(name)] for name in lost)

    def _queue_messages(self, now_s: float) -> None:
        """Pass the device's messages until now to the line, at the device's baud rate."""
        for message in self.device.messages(now_s):
            self.line.add(message)
        self.line.baud = self.device.settings.baud

    def _is_active(self, kind: str, at_s: float) -> bool:
        return any(episode.fault.kind == kind and episode.from_s <= at_s < episode.to_s for episode in self._active)
