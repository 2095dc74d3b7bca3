"""Self-checking blocks: what a recording is made of, without input or output.

A file is a header and then blocks, all numbers least significant byte first:

    header   8 bytes  89 49 53 39 30 30 0D 0A: what text tools change, they change here
             u32      version of the format
             u32      CRC-32 of these 12 bytes
    block    4 bytes  90 42 4C 4B, to find the next block after a damaged one
             4 bytes  kind, in letters (below)
             u32      bytes of payload, L
             f64      host monotonic clock [s]
             f64      host wall clock, since 1970 [s]
             L bytes  payload
             u32      CRC-32 of all the block before it

Every version begins with these 16 bytes of header. A kind that a reader does not know is none of its business.
"""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

MAGIC = b"\x89IS900\r\n"
VERSION = 1
BLOCK_MARKER = b"\x90BLK"
MAX_PAYLOAD_BYTES = 1 << 16
"""No payload has more bytes: a damaged length is soon seen through."""

RECEIVED, SENT = "recv", "sent"
"""Bytes from and to the device, as they were."""
CONFIGURED, EVENT, NOTE = "conf", "evnt", "note"
"""JSON: how to read what is received from here on, what befell the line, what made the recording."""

_CRC = struct.Struct("<I")
_VERSION = struct.Struct("<8sI")
_HEAD = struct.Struct("<4s4sIdd")


@dataclass(frozen=True)
class RecordingBlock:
    """One entry of a recording."""

    kind: str
    monotonic_s: float
    wall_s: float
    payload: bytes


@dataclass(frozen=True)
class DamagedSpan:
    """Bytes of a file, from `begin` to before `end`, that are no whole block."""

    begin: int
    end: int


def _append_crc(content: bytes) -> bytes:
    return content + _CRC.pack(zlib.crc32(content))


FILE_HEADER = _append_crc(_VERSION.pack(MAGIC, VERSION))


def encode_block(block: RecordingBlock) -> bytes:
    """The bytes of a block; its payload is no longer than LONGEST."""
    head = _HEAD.pack(BLOCK_MARKER, block.kind.encode(), len(block.payload), block.monotonic_s, block.wall_s)
    return _append_crc(head + block.payload)


def read_version(data: bytes) -> int | None:
    """What the header of a file says; None when it is cut, damaged or another file's."""
    head, check = data[: _VERSION.size], data[_VERSION.size : len(FILE_HEADER)]
    if not head.startswith(MAGIC) or check != _CRC.pack(zlib.crc32(head)):
        return None
    return int(_VERSION.unpack(head)[1])


def read_blocks(data: bytes, begin: int = len(FILE_HEADER)) -> Iterator[RecordingBlock | DamagedSpan]:
    """Every whole block of a file from byte `begin` on, and in their places the bytes that belong to none."""
    at = whole_until = begin
    while at < len(data):
        block, size = _read_block(data, at)
        if block is None:
            found = data.find(BLOCK_MARKER, at + 1)
            at = found if found >= 0 else len(data)
            continue
        if at > whole_until:
            yield DamagedSpan(whole_until, at)
        yield block
        at = whole_until = at + size
    if whole_until < len(data):
        yield DamagedSpan(whole_until, len(data))


def _read_block(data: bytes, at: int) -> tuple[RecordingBlock | None, int]:
    """The block that begins here and its bytes; None when there is none, or not all of it, or it is damaged."""
    if len(data) - at < _HEAD.size:
        return None, 0
    marker, kind, length, monotonic_s, wall_s = _HEAD.unpack_from(data, at)
    end = at + _HEAD.size + length
    if (
        marker != BLOCK_MARKER
        or length > MAX_PAYLOAD_BYTES
        or data[end : end + _CRC.size] != _CRC.pack(zlib.crc32(memoryview(data)[at:end]))
    ):
        return None, 0
    payload = data[at + _HEAD.size : end]
    return RecordingBlock(kind.decode("latin-1"), monotonic_s, wall_s, payload), end + _CRC.size - at
