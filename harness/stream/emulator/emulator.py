"""Device, faults and line together, without input or output: bytes in, bytes with their times out."""

from harness.errors import UnknownName
from harness.stream.codec.samples import DeviceSamples
from harness.stream.emulator.config import EmulatorConfig
from harness.stream.emulator.device import Device
from harness.stream.emulator.faults import FaultEpisode, FaultInjector
from harness.stream.emulator.serial_line import SentMessage, SerialLine


class Emulator:
    """The device and the line as a host sees them. Calls must have increasing times."""

    def __init__(self, samples: DeviceSamples, config: EmulatorConfig | None = None, now_s: float = 0.0) -> None:
        """Switch the device on. Raises UnknownName when a fault names a station that is not in the samples."""
        self.config = config or EmulatorConfig()
        self.device = Device(samples, self.config, now_s)
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
        self.device.set_lost_stations(self.device.rounds.plugged[names.index(name)] for name in lost)

    def _queue_messages(self, now_s: float) -> None:
        """Pass the device's messages until now to the line, at the device's baud rate."""
        for message in self.device.messages(now_s):
            self.line.add(message)
        self.line.baud = self.device.settings.baud

    def _is_active(self, kind: str, at_s: float) -> bool:
        return any(episode.fault.kind == kind and episode.from_s <= at_s < episode.to_s for episode in self._active)
