"""UDP packets as records: the same events as those of a serial line, so that everything after the decoder is shared."""

import numpy as np

from harness.stream.codec.datagram import DATAGRAM_START, Datagram, parse_datagram
from harness.stream.codec.decoder import DecoderEvent, Garbage, RecordRun, merge_adjacent
from harness.stream.codec.items import BLANK_STATUS, RECORD_HEAD, STATION_CHARACTERS, record_type
from harness.stream.codec.records import RecordFormat, Table

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
