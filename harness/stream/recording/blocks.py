"""Self-checking blocks that a recording consists of. This module does no input or output.

A file is a header and then blocks; all numbers are little-endian:

    header   8 bytes  89 49 53 39 30 30 0D 0A: text tools that corrupt files change some of these
             u32      version of the format
             u32      CRC-32 of these 12 bytes
    block    4 bytes  90 42 4C 4B, to find the next block after a damaged one
             4 bytes  kind, in letters (below)
             u32      bytes of payload, L
             f64      host monotonic clock [s]
             f64      host wall clock, since 1970 [s]
             L bytes  payload
             u32      CRC-32 of the block before this field

Every version begins with these 16 bytes of header. Readers skip blocks of a kind that they do not know. Version 1 holds
the bytes of a device's line. Version 2 holds poses instead, and readers that know version 1 alone refuse it.
"""

import io
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

MAGIC = b"\x89IS900\r\n"
VERSION, POSES_VERSION = 1, 2
BLOCK_MARKER = b"\x90BLK"
MAX_PAYLOAD_BYTES = 1 << 16
"""Longest payload [bytes]; it exposes a damaged length field."""

RECEIVED, SENT = "recv", "sent"
"""Bytes from and to the device, unchanged."""
CONFIGURED, EVENT, NOTE, ANSWERED, MARK = "conf", "evnt", "note", "answ", "mark"
"""JSON: the format of the bytes that follow, an event on the line, the origin of the recording, a command with its
decoded answer, the stretch of a capture that begins."""
BODIES, POSES = "body", "pose"
"""JSON of the bodies of poses and of what was concluded about their source; rows of poses (see `pose_recording.py`)."""

_CRC = struct.Struct("<I")
_VERSION = struct.Struct("<8sI")
_HEAD = struct.Struct("<4s4sIdd")
_LONGEST_BLOCK_BYTES = _HEAD.size + MAX_PAYLOAD_BYTES + _CRC.size
_PIECE_BYTES = 1 << 22


@dataclass(frozen=True)
class RecordingBlock:
    """One entry of a recording."""

    kind: str
    monotonic_s: float
    wall_s: float
    payload: bytes


@dataclass(frozen=True)
class DamagedSpan:
    """The bytes of a file from `begin` to before `end`, which form no whole block."""

    begin: int
    end: int


def _append_crc(content: bytes) -> bytes:
    return content + _CRC.pack(zlib.crc32(content))


FILE_HEADER = _append_crc(_VERSION.pack(MAGIC, VERSION))
POSES_HEADER = _append_crc(_VERSION.pack(MAGIC, POSES_VERSION))


def encode_block(block: RecordingBlock) -> bytes:
    """Return the bytes of a block. Its payload has at most `MAX_PAYLOAD_BYTES`."""
    head = _HEAD.pack(BLOCK_MARKER, block.kind.encode(), len(block.payload), block.monotonic_s, block.wall_s)
    return _append_crc(head + block.payload)


def read_version(data: bytes) -> int | None:
    """Return the version in a file's header; None when the header is truncated, damaged or of another format."""
    head, check = data[: _VERSION.size], data[_VERSION.size : len(FILE_HEADER)]
    if not head.startswith(MAGIC) or check != _CRC.pack(zlib.crc32(head)):
        return None
    return int(_VERSION.unpack(head)[1])


def read_blocks(data: bytes, begin: int = len(FILE_HEADER)) -> Iterator[RecordingBlock | DamagedSpan]:
    """Yield every whole block of a file from byte `begin` on, and the damaged spans between them."""
    file = io.BytesIO(data)
    file.seek(begin)
    return scan_blocks(file)


def scan_blocks(file: BinaryIO) -> Iterator[RecordingBlock | DamagedSpan]:
    """Yield what `read_blocks` does, from the present position of a file on, which is read in pieces."""
    base = whole_until = file.tell()
    window, offset = file.read(_PIECE_BYTES), 0
    while offset < len(window):
        while len(window) - offset < _LONGEST_BLOCK_BYTES and (more := file.read(_PIECE_BYTES)):
            window, base, offset = window[offset:] + more, base + offset, 0
        block, size = _read_block(window, offset)
        if block is None:
            following = window.find(BLOCK_MARKER, offset + 1)
            # A marker may begin in the last bytes of this piece and end in the next one.
            offset = following if following >= 0 else max(offset + 1, len(window) - len(BLOCK_MARKER) + 1)
            continue
        if base + offset > whole_until:
            yield DamagedSpan(whole_until, base + offset)
        yield block
        offset += size
        whole_until = base + offset
    if whole_until < base + len(window):
        yield DamagedSpan(whole_until, base + len(window))


def _read_block(data: bytes, offset: int) -> tuple[RecordingBlock | None, int]:
    """Return the block at this offset and its length; (None, 0) when it is absent, truncated or damaged."""
    if len(data) - offset < _HEAD.size:
        return None, 0
    marker, kind, length, monotonic_s, wall_s = _HEAD.unpack_from(data, offset)
    end = offset + _HEAD.size + length
    if (
        marker != BLOCK_MARKER
        or length > MAX_PAYLOAD_BYTES
        or data[end : end + _CRC.size] != _CRC.pack(zlib.crc32(memoryview(data)[offset:end]))
    ):
        return None, 0
    payload = data[offset + _HEAD.size : end]
    return RecordingBlock(kind.decode("latin-1"), monotonic_s, wall_s, payload), end + _CRC.size - offset
