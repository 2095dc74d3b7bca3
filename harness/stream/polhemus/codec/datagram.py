"""The UDP packet of an IS-900: one per station, port 5001 by default (docs/is900.md 9).

Unlike the serial record it has a checksum. It is a sum, so a flipped bit is always detected, but swapped bytes are not.
"""

import struct
from dataclasses import dataclass

import numpy as np

from harness.stream.polhemus.codec.decoder import DecoderEvent, Garbage, RecordRun, merge_adjacent
from harness.stream.polhemus.codec.items import BLANK_STATUS, RECORD_HEAD, STATION_CHARACTERS, record_type
from harness.stream.polhemus.codec.records import RecordFormat, Table

_HEAD, _STATION_DATA = 0xFF, 1
DATAGRAM_START = bytes([_HEAD, _STATION_DATA])
"""The first two bytes of a packet with station data."""
_BODY_STRUCT = struct.Struct("<4B4B8B3f3f")
_TIME_STRUCT = struct.Struct("<f")


@dataclass(frozen=True)
class Datagram:
    """The report of one station. Values are as on the wire; those with fractions are single precision."""

    sequence: int
    """Counter, 0 to 255, then 0 again."""
    model: int
    """Model of the tracker; no source lists the numbers."""
    station: int
    """Station number, from 1."""
    quality: int
    """Tracking quality, 0 (lost) to 255, as item 40."""
    buttons: int
    """Button bits, as item 22."""
    analogue: tuple[int, ...]
    """(8,) analogue values 0 to 255; the joystick has the first two."""
    yaw_pitch_roll_deg: tuple[float, float, float]
    position_m: tuple[float, float, float]
    time_s: float | None = None
    """Device clock [s]; None where the time was not configured."""

    def packet(self) -> bytes:
        """Return the packet: 40 bytes, or 44 with the time."""
        values = (self.model, self.station, self.quality, self.buttons, *self.analogue)
        places = (*self.yaw_pitch_roll_deg, *self.position_m)
        body = _BODY_STRUCT.pack(_HEAD, _STATION_DATA, self.sequence & 0xFF, 0, *values, *places)[4:]
        body += b"" if self.time_s is None else _TIME_STRUCT.pack(self.time_s)
        return bytes([_HEAD, _STATION_DATA, self.sequence & 0xFF, sum(body) & 0xFF]) + body


def parse_datagram(packet: bytes) -> Datagram | None:
    """Parse a packet; None for camera data, a wrong length or a wrong checksum."""
    if len(packet) not in (_BODY_STRUCT.size, _BODY_STRUCT.size + _TIME_STRUCT.size) or packet[:2] != bytes(
        [_HEAD, _STATION_DATA]
    ):
        return None
    if sum(packet[4:]) & 0xFF != packet[3]:
        return None
    _, _, sequence, _, model, station, quality, buttons, *rest = _BODY_STRUCT.unpack_from(packet)
    yaw, pitch, roll, x, y, z = rest[8:]
    time_s = float(_TIME_STRUCT.unpack_from(packet, _BODY_STRUCT.size)[0]) if len(packet) > _BODY_STRUCT.size else None
    return Datagram(sequence, model, station, quality, buttons, tuple(rest[:8]), (yaw, pitch, roll), (x, y, z), time_s)


DATAGRAM_LIST = (40, 2, 4, 22, 23, 21)
"""The content of a packet as an output list: quality, position, angles, buttons, joystick, time."""
DATAGRAM_FORMAT = RecordFormat(metres_per_unit=1.0, seconds_per_tick=1.0)
"""Packets are in metres and seconds, whatever the device is set to (docs/is900.md 9)."""
_STATION_NUMBERS = range(1, 1 + len(STATION_CHARACTERS))
PACKET_BYTES = (44, 40)
"""Length of a packet with the time and without it [bytes]."""


class DatagramDecoder:
    """Decodes packets to records. Chunks hold whole packets, as UDP delivers them.

    A packet is known by its start, its length and its sum. Packets of other stations are left out.
    """

    pending = 0
    """Number of undecided bytes: none, since no packet is in two chunks."""

    def __init__(self, items: tuple[int, ...], stations: bytes) -> None:
        """`items` is `DATAGRAM_LIST`, or that list without 21 where the packets have no time."""
        self._items, self._stations, self._type = items, stations, record_type(items)
        self._offset = 0

    def feed(self, data: bytes) -> list[DecoderEvent]:
        """Return the records and the other bytes of these packets."""
        events: list[DecoderEvent] = []
        begin = 0
        while begin < len(data):
            end, packet = _find_packet(data, begin)
            if packet is None:
                events.append(Garbage(self._offset + begin, end - begin))
            elif STATION_CHARACTERS[packet.station - 1] in self._stations:
                events.append(RecordRun(self._offset + begin, self._items, self._table(packet), end - begin))
            begin = end
        self._offset += len(data)
        return merge_adjacent(events)

    def finish(self) -> list[DecoderEvent]:
        """Return nothing, since nothing is undecided."""
        return []

    def _table(self, packet: Datagram) -> Table:
        table = np.zeros(1, self._type)
        table["head"], table["status"] = RECORD_HEAD, BLANK_STATUS
        table["station"] = STATION_CHARACTERS[packet.station - 1]
        table["quality"], table["buttons"], table["joystick"] = packet.quality, packet.buttons, packet.analogue[:2]
        table["position"], table["yaw_pitch_roll_deg"] = packet.position_m, packet.yaw_pitch_roll_deg
        if 21 in self._items:
            table["time"] = np.nan if packet.time_s is None else packet.time_s
        return table


def split_packets(data: bytes) -> list[Datagram]:
    """Return the packets of a chunk."""
    packets, begin = [], 0
    while begin < len(data):
        begin, packet = _find_packet(data, begin)
        packets += [] if packet is None else [packet]
    return packets


def _find_packet(data: bytes, begin: int) -> tuple[int, Datagram | None]:
    """Return the end of the packet at this offset, and the packet; without one, the start of the next, and None."""
    found = [(begin + size, parse_datagram(data[begin : begin + size])) for size in PACKET_BYTES]
    sound = [(end, packet) for end, packet in found if packet is not None and packet.station in _STATION_NUMBERS]
    for end, packet in sound:
        if end == len(data) or data.startswith(DATAGRAM_START, end):
            return end, packet
    if sound:  # what follows is damaged
        return sound[0]
    following = data.find(DATAGRAM_START, begin + 1)
    return (following if following >= 0 else len(data)), None
