"""The UDP packet of an IS-900: one per station, port 5001 by default (docs/is900.md 9).

Unlike the serial record it has a checksum. It is a sum, so a flipped bit is always detected, but swapped bytes are not.
"""

import struct
from dataclasses import dataclass

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
