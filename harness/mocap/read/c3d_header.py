"""Whether a C3D file hangs together: header, parameter chain and size, before a library that trusts them sees it.

Layout: https://www.c3d.org/docs/C3D_User_Guide.pdf (header record, parameter format).
"""

import math
import struct
from dataclasses import dataclass
from pathlib import Path

from harness.errors import BadFile

BLOCK = 512
MOST_MARKERS = 2000

_WHAT = "a C3D marker file"
_AGAIN = "Fetch or export it again."
_ORDER = {84: "<", 85: "<", 86: ">"}
"""Byte order of integers by processor: Intel, DEC, MIPS."""
_SIGN_BYTE = {84: 3, 85: 1, 86: 0}
"""Where a four-byte real has its sign."""


@dataclass(frozen=True)
class C3dHeader:
    """What the first block says."""

    markers: int
    frames: int
    processor: int


def check_header(path: Path) -> C3dHeader:
    """Read the header; BadFile if it, the parameters or the file's size contradict each other."""
    data = path.read_bytes()
    if len(data) < 2 * BLOCK or data[1] != 0x50:
        raise BadFile(path, "no C3D header", _WHAT, "Is it another format under this name?")
    start = (data[0] - 1) * BLOCK
    if start < BLOCK or start + BLOCK > len(data) or data[start + 3] not in _ORDER:
        raise BadFile(path, f"parameters at block {data[0]}, where there are none", _WHAT, _AGAIN)
    processor = data[start + 3]
    order = _ORDER[processor]
    markers, analog, first, last = struct.unpack_from(f"{order}4H", data, 2)
    (data_block,) = struct.unpack_from(f"{order}H", data, 16)
    frames = last - first + 1
    if not (0 < markers <= MOST_MARKERS and frames > 0):
        found = f"{markers} markers in {frames} frames"
        raise BadFile(path, found, f"1 to {MOST_MARKERS} markers, and frames", _AGAIN)
    whole = bool(data[12 + _SIGN_BYTE[processor]] & 0x80)
    needed = (data_block - 1) * BLOCK + frames * (4 * markers + analog) * (4 if whole else 2)
    if data_block < 2 or (len(data) < needed and last != 0xFFFF):
        found = f"{len(data)} bytes"
        raise BadFile(
            path, found, f"at least {needed}, for {frames} frames of {markers} markers", "It is cut. " + _AGAIN
        )
    _check_parameters(path, data[start : start + data[start + 2] * BLOCK], order)
    return C3dHeader(markers, frames, processor)


def _check_parameters(path: Path, block: bytes, order: str) -> None:
    """Follow the chain of groups and parameters: each must end where, or before, the next begins."""
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
                raise BadFile(path, f"a parameter that overruns its place at byte {at}", _WHAT, _AGAIN)
        if step == 0:
            return
        at = name_end + step
    if at + 2 > len(block):
        raise BadFile(path, "parameters without an end", _WHAT, _AGAIN)
