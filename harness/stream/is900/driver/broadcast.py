"""An IS-900 that broadcasts UDP packets, as a `TrackerStream`. Nothing is sent to it, so it must be set up already."""

import contextlib
from collections import Counter

import numpy as np

from harness.errors import BadInput
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.line_events import LineEventKind, NullLineObserver
from harness.stream.polhemus.codec.datagram import DATAGRAM_FORMAT, DATAGRAM_LIST, Datagram, split_packets
from harness.stream.polhemus.codec.items import STATION_CHARACTERS
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.driver.connection import NoAnswer
from harness.stream.polhemus.driver.rate import MIN_RECORDS, estimate_rate_hz
from harness.stream.polhemus.driver.station_watch import StationWatch
from harness.stream.polhemus.driver.tracker import Tracker
from harness.stream.polhemus.driver.transport import LineLost

_MIN_TIME_STEPS = 2
"""Fewest different stamps of a clock that counts. Where the time was not requested, the field may be constant."""


class Is900Broadcast(Tracker):
    """Receiver of the UDP packets of an IS-900. It listens, finds stations and rate, and streams while it is iterated.

    Packets can be lost or doubled on a network; a station without a packet is an invalid row. `close` may be called
    from any thread. Raises BadInput when no packets arrive, or when the configuration needs commands.
    """

    config: DriverConfig
    _config_type = DriverConfig

    def _open(self) -> None:
        """Listen until the stations and their rate are known."""
        if self.config.boresight or self.config.alignment is not None:
            raise BadInput(f"Port {self.port}: packets carry no commands.", "Set boresight and alignment by a line.")
        self._transport = self._host.open(self.port, 0)
        try:
            # These packets belong to no session, so the observer does not see them.
            self._line = self._connect_line(self._transport, NullLineObserver())
            self._line.on_data = lambda data, now_s: None
            self._wire = self._read_wire_format()
        except BaseException:
            self.close()
            raise
        self._stations = StationWatch(self._timing)
        self._packets: Counter[str] = Counter()
        """Packets of this session by station."""
        self._trouble: LineEventKind | None = "stalled"
        self._last_byte_s = self._host.monotonic_s()

    @property
    def identification(self) -> str:
        """Name of the source; packets have none of the device."""
        return "a broadcast"

    @property
    def setup_note(self) -> str:
        """What a person at the device should know of its set-up, in one line."""
        return "a broadcast takes no commands: settings of other programs are as they were, and cannot be read"

    def close(self) -> None:
        """Stop listening and end every iteration. May be called from any thread, and more than once."""
        if not self._closing.is_set():
            self._closing.set()
            with contextlib.suppress(LineLost):
                self._transport.close()

    def _step(self) -> None:
        """Wait once for packets and process them."""
        if not self._streaming:
            self._start()
        _, now_s = self._receive()
        self._report_trouble(now_s)

    def _on_data(self, data: bytes, now_s: float) -> None:
        self._packets.update(map(_character, split_packets(data)))
        super()._on_data(data, now_s)

    def _report_trouble(self, now_s: float) -> None:
        """Report silence once, the return of packets, and stations that come and go."""
        for event in self._stations.update(self._packets, now_s):
            text = "; its packets are left out" if event.kind == "unexpected" else ""
            self._report(event.kind, event.text + text)
        silent_s = now_s - self._last_byte_s
        if self._frames and self._trouble is not None:
            self._trouble = None
            self._report("connected", f"packets arrive: {len(self.stations)} stations at {self._wire.rate_hz:g} Hz")
        elif self._trouble is None and silent_s > self._timing.stalled_s:
            self._trouble = "stalled"
            self._report("stalled", f"no packet for {silent_s:.1f} s")
        elif self._trouble == "stalled" and silent_s > self._timing.silent_s:
            self._trouble = "silent"
            self._report("silent", f"no packet for {silent_s:.1f} s")

    def _start(self) -> None:
        """Begin a session. Packets that waited since the set-up are dropped, because nobody knows when they arrived."""
        while self._transport.read(0.0):
            pass
        self._line = self._connect_line(self._transport, self._observer)
        self._observer.on_configured(self._wire)
        self._stations.start(self._wire, self._host.monotonic_s(), self._heard)
        self._reader.begin_session(self._wire, self._host.monotonic_s())
        self._streaming = True

    def _read_wire_format(self) -> WireFormat:
        """Listen for a while, and find the stations, the rate and whether packets have a time."""
        packets = self._listen()
        heard = "".join(c for c in STATION_CHARACTERS.decode() if c in map(_character, packets))
        if not heard:
            raise NoAnswer(
                f"Port {self.port}: no packet of an IS-900 arrived in {self._timing.silent_s:g} s.",
                "Switch the broadcast on (MEthUdp1), and listen at its port: udp://0.0.0.0:5001 hears the network.",
            )
        self._heard = heard
        characters = self.config.characters or heard
        if missing := [c for c in characters if c not in heard]:
            raise BadInput(
                f"Port {self.port}: no packets of station {', '.join(missing)} arrive; they are of {', '.join(heard)}.",
                "Name one of these, or switch the missing one on.",
            )
        names = self.config.stations or tuple(characters)
        if len(names) > len(characters):
            raise BadInput(
                f"Port {self.port}: {len(names)} stations requested ({', '.join(names)}), packets of {len(characters)} "
                f"arrive ({', '.join(characters)}).",
                "Name at most these.",
            )
        first = [packet for packet in packets if _character(packet) == characters[0]]
        times_s = [packet.time_s for packet in first if packet.time_s is not None]
        has_time = len(set(times_s)) >= _MIN_TIME_STEPS
        return WireFormat(
            stations=names,
            rate_hz=self.config.rate_hz or self._rate_hz(first, has_time),
            items=DATAGRAM_LIST if has_time else tuple(code for code in DATAGRAM_LIST if code != 21),
            settings=DATAGRAM_FORMAT,
            characters=characters[: len(names)].encode(),
            zeroed=False,
            datagrams=True,
        )

    def _listen(self) -> list[Datagram]:
        """Return the packets of `measure_s` after the first one, which must come within `silent_s`."""
        packets: list[Datagram] = []
        until_s = self._host.monotonic_s() + self._timing.silent_s
        while (left_s := until_s - self._host.monotonic_s()) > 0.0:
            new = split_packets(self._line.receive(left_s))
            if new and not packets:
                until_s = self._host.monotonic_s() + self._timing.measure_s
            packets += new
        return packets

    def _rate_hz(self, own: list[Datagram], has_time: bool) -> float:
        """Return rounds per second by the stamps of a station's packets, or by their number where there are none."""
        rate_hz = estimate_rate_hz(np.array([packet.time_s for packet in own], float)) if has_time else None
        rate_hz = rate_hz or len(own) / self._timing.measure_s
        if len(own) < MIN_RECORDS:
            raise BadInput(
                f"Port {self.port}: too few packets of station {_character(own[0])} arrived.", "Give the rate."
            )
        return rate_hz


def _character(packet: Datagram) -> str:
    """Return the character of a packet's station."""
    return chr(STATION_CHARACTERS[packet.station - 1])
