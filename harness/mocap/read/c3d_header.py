"""Consistency check of a C3D file: header, parameter chain and size, before ezc3d, which trusts them, reads it.

Layout: https://www.c3d.org/docs/C3D_User_Guide.pdf (header record, parameter format).
"""

import math
import struct
from dataclasses import dataclass
from pathlib import Path

from harness.core.input_file import read_input_file
from harness.errors import BadFile
from harness.mocap.read.file_checks import LIMIT_BYTES

BLOCK_BYTES = 512
MAX_MARKERS = 2000

_FORMAT = "a C3D marker file"
_FETCH_AGAIN = "Fetch or export it again."
_BYTE_ORDER = {84: "<", 85: "<", 86: ">"}
"""Byte order of integers by processor: Intel, DEC, MIPS."""
_SIGN_BYTE_OFFSET = {84: 3, 85: 1, 86: 0}
"""Offset of the byte with the sign of a four-byte real, by processor."""


@dataclass(frozen=True)
class C3dHeader:
    """Contents of the header block."""

    markers: int
    frames: int
    processor: int


def check_header(path: Path) -> C3dHeader:
    """Read the header; BadFile if header, parameters and file size contradict each other."""
    data = read_input_file(path, _FORMAT, LIMIT_BYTES)
    if len(data) < 2 * BLOCK_BYTES or data[1] != 0x50:
        raise BadFile(path, "no C3D header", _FORMAT, "Is it another format under this name?")
    start = (data[0] - 1) * BLOCK_BYTES
    if start < BLOCK_BYTES or start + BLOCK_BYTES > len(data) or data[start + 3] not in _BYTE_ORDER:
        raise BadFile(path, f"parameters at block {data[0]}, where there are none", _FORMAT, _FETCH_AGAIN)
    processor = data[start + 3]
    order = _BYTE_ORDER[processor]
    markers, analog, first, last = struct.unpack_from(f"{order}4H", data, 2)
    (data_block,) = struct.unpack_from(f"{order}H", data, 16)
    frames = last - first + 1
    if not (0 < markers <= MAX_MARKERS and frames > 0):
        found = f"{markers} markers in {frames} frames"
        raise BadFile(path, found, f"1 to {MAX_MARKERS} markers, and frames", _FETCH_AGAIN)
    real = bool(data[12 + _SIGN_BYTE_OFFSET[processor]] & 0x80)
    needed = (data_block - 1) * BLOCK_BYTES + frames * (4 * markers + analog) * (4 if real else 2)
    if data_block < 2 or (len(data) < needed and last != 0xFFFF):
        found = f"{len(data)} bytes"
        raise BadFile(
            path,
            found,
            f"at least {needed}, for {frames} frames of {markers} markers",
            "The file is truncated. " + _FETCH_AGAIN,
        )
    _check_parameters(path, data[start : start + data[start + 2] * BLOCK_BYTES], order)
    return C3dHeader(markers, frames, processor)


def _check_parameters(path: Path, block: bytes, order: str) -> None:
    """Follow the chain of groups and parameters; BadFile unless each ends before the next one begins."""
    at = 4
    while at + 2 <= len(block) and block[at] != 0:
        length, group = struct.unpack_from("bb", block, at)
        name_end = at + 2 + abs(length)
        if name_end + 2 > len(block):
            break
        (step,) = struct.unpack_from(f"{order}H", block, name_end)
        if group > 0 and name_end + 4 <= len(block):
            size, axes = struct.unpack_from("bB", block, name_end + 2)
            sizes = block[name_end + 4 : name_end + 4 + axes]
            end = name_end + 4 + axes + abs(size) * math.prod(sizes)
            if size not in (-1, 1, 2, 4) or end > len(block) or (step and end > name_end + step):
                raise BadFile(path, f"a parameter that overruns its place at byte {at}", _FORMAT, _FETCH_AGAIN)
        if step == 0:
            return
        at = name_end + step
    if at + 2 > len(block):
        raise BadFile(path, "parameters without an end", _FORMAT, _FETCH_AGAIN)
