"""Messages of VRPN's network protocol, version 7: bytes in, messages out. This module does no input or output.

Both sides of a connection begin with a cookie of 24 bytes, then send messages; numbers are big-endian:

    length    u32  bytes of header and payload, without the padding at the end
    seconds   u32  time of the message since 1970, and microseconds of that second
    micros    i32
    sender    i32  who reports, by a number that a description gave a name; of a description the number described
    type      i32  kind of the message, likewise; negative kinds belong to the protocol
    sequence  u32  counts the messages
    payload        then zeros up to a multiple of 8 bytes

Source: Format_Of_Protocol.txt and vrpn_Connection.C of github.com/vrpn/vrpn; vrpn_Tracker.C for the report of a pose.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field

from harness.errors import HarnessError

DEFAULT_PORT = 3883
COOKIE = b"vrpn: ver. 07.35  0".ljust(24, b"\0")
"""Version 7.35, and 0 for no log files at the other side."""
_COOKIE_START = b"vrpn: ver. 07."
"""Programs of one major version understand each other."""
SENDER_DESCRIPTION, TYPE_DESCRIPTION, UDP_DESCRIPTION = -1, -2, -3
"""Types of the protocol. The last one offers UDP: its sender is the port, its payload the address in words."""
POSE, PING, PONG = "vrpn_Tracker Pos_Quat", "vrpn_Base ping_message", "vrpn_Base pong_message"
"""Names of the types of message that are used here."""
MAX_PAYLOAD_BYTES = 64_000
"""Longest payload: the size of VRPN's own buffers [bytes]."""
MAX_NAME_BYTES = 100
"""Longest name of a sender or type, with the zero at its end [bytes]."""
MAX_NAMES = 2000
"""Most senders, and most types, of a connection."""

_HEADER = struct.Struct(">IIiiiI")
_POSE = struct.Struct(">ii3d4d")
_ALIGNMENT = 8


class MalformedMessage(HarnessError):
    """Bytes that are no message of this protocol."""

    def __init__(self, problem: str) -> None:
        super().__init__(problem)
        (self.problem,) = self.args

    def __str__(self) -> str:
        return f"{self.problem}."


@dataclass(frozen=True, slots=True)
class VrpnMessage:
    """One message."""

    type: int
    sender: int
    time_us: int
    """Time of the message since 1970 [us]."""
    payload: bytes = b""
    sequence: int = field(default=0, compare=False)
    """Number of the message among those that its sender sent the same way."""

    def encode(self, sequence: int = 0) -> bytes:
        """The bytes of the message."""
        seconds, micros = divmod(self.time_us, 1_000_000)
        length = _HEADER.size + len(self.payload)
        head = _HEADER.pack(length, seconds % (1 << 32), micros, self.sender, self.type, sequence % (1 << 32))
        return head + self.payload + bytes(-length % _ALIGNMENT)


def encode_description(kind: int, number: int, name: str, time_us: int) -> VrpnMessage:
    """The message that gives a sender or type number its name."""
    text = name.encode() + b"\0"
    return VrpnMessage(kind, number, time_us, struct.pack(">I", len(text)) + text)


def decode_name(message: VrpnMessage) -> str:
    """The name in a description. Raises MalformedMessage."""
    payload = message.payload
    size = int.from_bytes(payload[:4], "big")
    if len(payload) < 4 or size != len(payload) - 4 or not 0 < size <= MAX_NAME_BYTES:
        raise MalformedMessage(f"a name of {size} bytes in a payload of {len(payload)}")
    return payload[4:].partition(b"\0")[0].decode(errors="replace")


@dataclass(frozen=True, slots=True)
class PoseReport:
    """The pose of one sensor at one time, with the numbers as they are on the wire."""

    sensor: int
    time_us: int
    """Time of the report since 1970, by the server's clock [us]."""
    position_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    """Tracker from sensor, (w, x, y, z); on the wire (x, y, z, w)."""

    def encode(self, type_number: int, sender: int) -> VrpnMessage:
        """The message of the report."""
        w, x, y, z = self.quaternion
        payload = _POSE.pack(self.sensor, self.sensor, *self.position_m, x, y, z, w)
        return VrpnMessage(type_number, sender, self.time_us, payload)


def decode_pose(message: VrpnMessage) -> PoseReport:
    """The report in a message. Raises MalformedMessage."""
    if len(message.payload) != _POSE.size:
        raise MalformedMessage(f"a pose of {len(message.payload)} bytes, expected {_POSE.size}")
    sensor, _, px, py, pz, x, y, z, w = _POSE.unpack(message.payload)
    if sensor < 0:
        raise MalformedMessage(f"a pose of sensor {sensor}")
    return PoseReport(sensor, message.time_us, (px, py, pz), (w, x, y, z))


class MessageReader:
    """Splits the bytes of one side of a connection into its cookie and messages.

    Feed it bytes in pieces of any length. Raises MalformedMessage at the first wrong cookie or length.
    """

    def __init__(self) -> None:
        self._waiting = bytearray()
        self.greeted = False
        """Whether the cookie has arrived."""

    @property
    def waiting_bytes(self) -> int:
        """Number of bytes of a message that is not complete."""
        return len(self._waiting)

    def feed(self, data: bytes) -> Iterator[VrpnMessage]:
        """Yield the messages that become complete."""
        self._waiting += data
        if not self.greeted:
            start = bytes(self._waiting[: len(_COOKIE_START)])
            if not _COOKIE_START.startswith(start):
                raise MalformedMessage(f"it begins with {bytes(self._waiting[:16])!r}, VRPN 7 with {_COOKIE_START!r}")
            if len(self._waiting) < len(COOKIE):
                return
            del self._waiting[: len(COOKIE)]
            self.greeted = True
        offset = 0
        try:
            while len(self._waiting) - offset >= _HEADER.size:
                length, seconds, micros, sender, kind, sequence = _HEADER.unpack_from(self._waiting, offset)
                if not _HEADER.size <= length <= _HEADER.size + MAX_PAYLOAD_BYTES:
                    raise MalformedMessage(f"a message of {length:,} bytes, at most {MAX_PAYLOAD_BYTES:,} are allowed")
                end = offset + length
                if end + -length % _ALIGNMENT > len(self._waiting):
                    break
                payload = bytes(self._waiting[offset + _HEADER.size : end])
                offset = end + -length % _ALIGNMENT
                yield VrpnMessage(kind, sender, 1_000_000 * seconds + micros, payload, sequence)
        finally:
            del self._waiting[:offset]


def split_datagram(data: bytes) -> list[VrpnMessage]:
    """The messages of a UDP packet, which holds whole ones alone. Raises MalformedMessage."""
    reader = MessageReader()
    reader.greeted = True
    messages = list(reader.feed(data))
    if reader.waiting_bytes:
        raise MalformedMessage(f"a packet that ends within a message, after {len(messages)} whole ones")
    return messages


class NameTable:
    """Names of the senders, or of the types, of the other side by their numbers."""

    def __init__(self) -> None:
        self._names: dict[int, str] = {}

    def add(self, message: VrpnMessage) -> None:
        """Take a description. Raises MalformedMessage."""
        if len(self._names) >= MAX_NAMES and message.sender not in self._names:
            raise MalformedMessage(f"more than {MAX_NAMES} names")
        self._names[message.sender] = decode_name(message)

    def __getitem__(self, number: int) -> str:
        """The name of a number; "" where it has none."""
        return self._names.get(number, "")

    def __iter__(self) -> Iterator[str]:
        return iter(self._names.values())
