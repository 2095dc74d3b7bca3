"""The state of an emulated device: settings, clock, stations, logs and the messages that wait to be sent.

It does no input or output; time is an argument. `device.Device` adds the commands.
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import ClassVar

from harness.stream.polhemus.codec.replies import ParsedReply, StatusRecord
from harness.stream.polhemus.codec.samples import DeviceSamples
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.player import RoundEncoder, SamplePlayer
from harness.stream.polhemus.emulator.settings import STATION_NAMES, DeviceSettings, StationSettings

_LOG_LENGTH = 100
"""Entries of the error log, of the command log, and replies that wait while the device is suspended."""


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


class DeviceState:
    """What a device is and does apart from reading commands: it plays samples and queues messages.

    Stations beyond those of the samples are not plugged in.
    """

    config_type: ClassVar[type[EmulatorConfig]] = EmulatorConfig
    """Type of the configuration; its defaults serve where none is given."""

    def __init__(self, samples: DeviceSamples, config: EmulatorConfig | None = None, now_s: float = 0.0) -> None:
        """Switch the device on at `now_s` [s]."""
        self.samples, self.config = samples, config or self.config_type()
        self.firmware = self.config.firmware
        self.rounds = RoundEncoder(SamplePlayer(samples, now_s), self.config)
        self.streaming = self.suspended = False
        self.command_count = self.refused_count = 0
        """Numbers of all commands and of the rejected ones."""
        self.errors: deque[ParsedReply] = deque(maxlen=_LOG_LENGTH)
        self.log: deque[str] = deque(maxlen=_LOG_LENGTH)
        """Commands, while the command log is open."""
        self._factory = _factory_settings(samples, self.config, self.rounds.station_characters)
        self.settings: DeviceSettings = self._factory
        self._saved = self._factory
        self._next = 0, 0
        """Round and station row of the next reading while streaming."""
        self._silent_until_s = float("-inf")
        self._out: list[Message] = []
        self._held: deque[Message] = deque(maxlen=_LOG_LENGTH)
        """Replies of a suspended device."""

    def messages(self, now_s: float) -> list[Message]:
        """Return all messages since the last call, in sequence, including the readings until `now_s`."""
        self._play(now_s)
        out, self._out = self._out, []
        return out

    def advance(self, now_s: float) -> bytes:
        """Return the bytes of `messages`, as over an infinitely fast line."""
        return b"".join(message.data for message in self.messages(now_s))

    @property
    def next_s(self) -> float:
        """When the next reading is taken [s]; inf unless streaming."""
        return self.rounds.player.time_s(*self._next) if self.streaming else float("inf")

    @property
    def active(self) -> str:
        """Characters of the stations that report."""
        return "".join(name for name in self.rounds.station_characters if self.settings.station(name).active)

    def set_lost_stations(self, stations: Iterable[str]) -> None:
        """Lose exactly these stations from now on, in addition to what the samples say."""
        self.rounds.set_lost_stations(stations)

    def reply(self, now_s: float, *replies: ParsedReply) -> None:
        """Send replies, or hold them while the device is suspended."""
        messages = [Message(now_s, reply.line()) for reply in replies]
        if self.suspended:
            self._held.extend(messages)
        else:
            self._out += messages

    def status_record(self) -> StatusRecord:
        """Return the reply to `S`."""
        return StatusRecord(
            binary=self.settings.binary,
            centimetres=self.settings.centimetres,
            continuous=self.streaming,
            firmware=self.firmware,
            identification=self.config.identification,
            short=self.config.status_bytes == 54,
        )

    def start_streaming(self, now_s: float) -> None:
        """Send records from the next whole round of stations on."""
        if not self.streaming:
            self.streaming, self._next = True, (self.rounds.player.first_from(now_s), 0)

    def stop(self, now_s: float) -> None:
        """Stop before the next record, never inside one."""
        self.streaming = False
        self._out.append(Message(now_s, b"", halts=True))

    def poll(self, now_s: float) -> None:
        """Send one record of each active station, ascending, with its latest reading."""
        for name in "" if self.suspended else self.active:
            number = self.rounds.player.latest(now_s, self.rounds.station_characters.index(name))
            self._out.append(Message(now_s, self.rounds.records(number, self.settings)[name], name))

    def suspend(self, now_s: float) -> None:
        """Hold replies and discard readings until `resume`."""
        self.suspended = True
        self._out.append(Message(now_s, b"", halts=True))

    def resume(self, now_s: float) -> None:
        """End a suspension and send the held replies."""
        self.suspended = False
        self._out += [replace(message, ready_s=now_s) for message in self._held]
        self._held.clear()

    def save(self) -> None:
        """Save the settings for the next restart."""
        self._saved = self.settings

    def restore_factory_defaults(self) -> None:
        """Return to factory defaults. The saved settings stay saved."""
        self.settings = self._factory

    def restart(self, now_s: float) -> None:
        """Restart as after command 19 or a power cut.

        The saved settings return, the device is polled, its clock starts anew, and it is silent at first.
        """
        self._play(now_s)
        self.stop(now_s)
        self.suspended = False
        self.settings = self._saved
        self._held.clear()
        self._silent_until_s = now_s + self.config.restart_s
        self.rounds.player.begin(self._silent_until_s)

    def _is_due(self, number: int, row: int) -> bool:
        """Whether a station that streams sends its reading of a round."""
        return True

    def _play(self, now_s: float) -> None:
        """Send the readings until now."""
        player, plugged = self.rounds.player, self.rounds.station_characters
        while self.streaming:
            number, row = self._next
            taken_s = player.time_s(number, row)
            if taken_s > now_s:
                return
            self._next = (number, row + 1) if row + 1 < len(plugged) else (number + 1, 0)
            name = plugged[row]
            if self.settings.station(name).active and not self.suspended and self._is_due(number, row):
                data = self.rounds.records(number, self.settings)[name]
                self._out.append(Message(taken_s + self.samples.ready_s, data, name))


def _factory_settings(samples: DeviceSamples, config: EmulatorConfig, plugged: str) -> DeviceSettings:
    """Return the settings after power-on: plugged stations are on, and a filter brings its settings."""
    stations = [StationSettings(active=name in plugged, hemisphere=config.hemisphere) for name in STATION_NAMES]
    settings = DeviceSettings(
        tuple(stations),
        boresight_as_fastrak=config.fastrak,
        unit_in_commands=config.fastrak,
        baud=config.baud,
        udp=config.udp,
        udp_port=config.udp_port,
    )
    if (filtered := samples.filter) is None:
        return settings
    initial = zip(filtered.prediction_ms.tolist(), filtered.enhancement.tolist(), strict=True)
    for name, (prediction_ms, enhancement) in zip(plugged, initial, strict=True):
        row = STATION_NAMES.index(name)
        stations[row] = replace(stations[row], prediction_ms=prediction_ms, enhancement=enhancement)
    emitters = filtered.emitters
    return replace(settings, stations=tuple(stations), emitters=emitters, draft_emitters=emitters)
