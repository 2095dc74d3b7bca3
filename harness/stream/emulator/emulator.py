"""Device, faults and line together, still without input or output: bytes in, bytes with their times out."""

from harness.errors import UnknownName
from harness.stream.codec.samples import DeviceSamples
from harness.stream.emulator.config import EmulatorConfig
from harness.stream.emulator.device import Device
from harness.stream.emulator.faults import FaultEpisode, FaultInjector
from harness.stream.emulator.message import SentMessage
from harness.stream.emulator.serial_line import SerialLine
from harness.stream.emulator.settings import STATION_NAMES


class Emulator:
    """What a host finds at the other end of a line. Times are asked for in order."""

    def __init__(self, samples: DeviceSamples, config: EmulatorConfig | None = None, now_s: float = 0.0) -> None:
        """UnknownName when a fault is about a station that nobody wears."""
        self.config = config or EmulatorConfig()
        self.device = Device(samples, self.config, now_s)
        self.line = SerialLine(self.config.baud, self.config.queue_records, self.config.paced)
        self.episodes: list[FaultEpisode] = []
        """All that have begun."""
        self.unplugged_messages = 0
        """Messages that went while the line was unplugged."""
        self._lasting: list[FaultEpisode] = []
        self._faults = FaultInjector(self.config.faults, self.config.seed, now_s)
        for fault in self.config.faults:
            if fault.station and fault.station not in samples.stations:
                raise UnknownName("station", fault.station, samples.stations)
            if fault.kind == "firmware":
                self.device.firmware = fault.firmware

    def receive(self, data: bytes, now_s: float) -> None:
        """Bytes from the host; lost while the line is unplugged."""
        self._until(now_s)
        if not self.unplugged(now_s):
            self.device.receive(data, now_s)
            self._hand_over(now_s)

    def advance(self, now_s: float) -> list[SentMessage]:
        """What has gone over the line by now, and was not asked for before."""
        self._until(now_s)
        out = []
        for due_s, message in self.line.gone(now_s):
            data, damage = self._faults.corrupt(message.data, self._on("burst", due_s), due_s)
            if self._on("disconnect", due_s):
                self.unplugged_messages += 1
            else:
                out.append(SentMessage(message, due_s, data, damage))
        self._lasting = [spell for spell in self._lasting if spell.to_s > now_s]
        return out

    def unplugged(self, now_s: float) -> bool:
        """Whether the line is not there at this moment."""
        return self._on("disconnect", now_s)

    @property
    def next_s(self) -> float:
        """When there will be something to do, unless bytes come before [s]."""
        ready_s = self.device.next_s + self.device.samples.ready_s
        return min([self.line.next_s, ready_s, self._faults.next_s, *(spell.to_s for spell in self._lasting)])

    def _until(self, now_s: float) -> None:
        """Let happen what happens until now."""
        begun = self._faults.pop_started(now_s)
        ended = [spell for spell in [*self._lasting, *begun] if spell.to_s <= now_s]
        changes = [*((spell.from_s, True, spell) for spell in begun), *((spell.to_s, False, spell) for spell in ended)]
        for at_s, begins, spell in sorted(changes, key=lambda change: change[0]):
            self._hand_over(at_s)
            if begins:
                self._begin(spell)
            if spell.fault.kind == "lost_station":
                self._lose(at_s)
        self._hand_over(now_s)

    def _begin(self, spell: FaultEpisode) -> None:
        self.episodes.append(spell)
        self._lasting.append(spell)
        if spell.fault.kind == "stall":
            self.line.hold(spell.from_s, spell.to_s)
        elif spell.fault.kind == "reset":
            self.device.restart(spell.from_s)

    def _lose(self, at_s: float) -> None:
        """Tell the device which stations are out of sight at this moment."""
        names = self.device.samples.stations
        spells = (spell for spell in self._lasting if spell.fault.kind == "lost_station")
        out = (spell.fault.station or names[0] for spell in spells if spell.from_s <= at_s < spell.to_s)
        self.device.set_lost_stations(STATION_NAMES[names.index(name)] for name in out)

    def _hand_over(self, now_s: float) -> None:
        """What the device says until now goes to the line, at the rate that it has set."""
        for message in self.device.messages(now_s):
            self.line.add(message)
        self.line.baud = self.device.settings.baud

    def _on(self, kind: str, at_s: float) -> bool:
        return any(spell.fault.kind == kind and spell.from_s <= at_s < spell.to_s for spell in self._lasting)
