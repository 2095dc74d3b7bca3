"""Header and parameters of a C3D file, and the number of its frames, which the size of the file must prove.

Layout: https://www.c3d.org/docs/C3D_User_Guide.pdf (header record, parameter format). The header and POINT:FRAMES
count frames in 16 bits; POINT:LONG_FRAMES and TRIAL:ACTUAL_START_FIELD and ACTUAL_END_FIELD count longer takes.
"""

import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Floats
from harness.errors import BadFile

BLOCK_BYTES = 512
MAX_MARKERS = 2000
FORMAT = "a C3D marker file"
FETCH_AGAIN = "Fetch or export it again."

_BYTE_ORDER = {84: "<", 85: "<", 86: ">"}
"""Byte order of integers by processor: Intel, DEC, MIPS."""
_DEC = 85
_WRAP = 0x10000
"""Number of values of a 16-bit count."""
_TOLERANCE = 1e-3
"""Largest relative difference between equal numbers of header and parameters."""

Parameter = tuple[str, ...] | Floats


@dataclass(frozen=True, eq=False)
class C3dHeader:
    """What header and parameters say."""

    path: Path
    processor: int
    markers: int
    analog: int
    """Analog values in a frame."""
    first: int
    last: int
    data_start: int
    """Place of the first frame in the file [bytes]."""
    scale: float
    """Factor of integer coordinates; negative in a file of floats."""
    rate_hz: float
    parameters: Mapping[str, Parameter]
    """Parameters by group and name ("POINT:LABELS"): texts, or numbers (N,)."""

    @property
    def value_bytes(self) -> int:
        """Bytes of one value of a frame."""
        return 4 if self.scale < 0.0 else 2

    @property
    def frame_bytes(self) -> int:
        """Bytes of a frame: four values a marker, and the analog values."""
        return (4 * self.markers + self.analog) * self.value_bytes

    def texts(self, name: str) -> tuple[str, ...]:
        """The texts of a parameter; () without it."""
        value = self.parameters.get(name, ())
        return value if isinstance(value, tuple) else ()

    def numbers(self, name: str) -> list[float]:
        """The numbers of a parameter; [] without it."""
        value = self.parameters.get(name, ())
        return [] if isinstance(value, tuple) else [float(number) for number in value]

    def decode(self, data: bytes | memoryview, code: str) -> NDArray[Any]:
        """Numbers of the file's processor: `code` is numpy's, such as "i2", "u2" and "f4"."""
        return _decode(data, code, self.processor)


def read_header(path: Path, data: bytes) -> C3dHeader:
    """Header and parameters of the bytes of a file; BadFile where they contradict each other."""
    if len(data) < 2 * BLOCK_BYTES or data[1] != 0x50:
        raise BadFile(path, "no C3D header", FORMAT, "Is it another format under this name?")
    start = (data[0] - 1) * BLOCK_BYTES
    if start < BLOCK_BYTES or start + BLOCK_BYTES > len(data) or data[start + 3] not in _BYTE_ORDER:
        raise BadFile(path, f"parameters at block {data[0]}, where there are none", FORMAT, FETCH_AGAIN)
    processor = data[start + 3]
    markers, analog, first, last = _integers(data[2:10], processor)
    scale, rate_hz = (float(_decode(data[at : at + 4], "f4", processor)[0]) for at in (12, 20))
    (block,) = _integers(data[16:18], processor)
    if not 0 < markers <= MAX_MARKERS:
        raise BadFile(path, f"{markers} markers", f"1 to {MAX_MARKERS} markers", FETCH_AGAIN)
    if not 2 <= block <= 1 + len(data) // BLOCK_BYTES or not math.isfinite(scale) or scale == 0.0:
        raise BadFile(path, f"data at block {block} with the scale {scale:g}", FORMAT, FETCH_AGAIN)
    parameters = _read_parameters(path, data[start : start + data[start + 2] * BLOCK_BYTES], processor)
    header = C3dHeader(
        path, processor, markers, analog, first, last, (block - 1) * BLOCK_BYTES, scale, rate_hz, parameters
    )
    pairs = {"USED": markers, "DATA_START": block, "RATE": rate_hz, "SCALE": scale}
    for name, value in pairs.items():
        for other in header.numbers(f"POINT:{name}")[:1]:
            if not abs(other - value) <= _TOLERANCE * abs(value):
                raise BadFile(path, f"POINT:{name} {other:g}, but {value:g} in the header", "one number", FETCH_AGAIN)
    return header


def count_frames(header: C3dHeader, size: int) -> range:
    """Every number of frames that a file of `size` bytes can hold, and that all its counts agree with.

    There is one, except where every count is at the limit of its 16 bits and the padding of the last block could be
    frames. BadFile for bytes left over, and for counts that contradict each other or the size.
    """
    data = size - header.data_start
    most, least = data // header.frame_bytes, max(-((BLOCK_BYTES - data) // header.frame_bytes), 1)
    counts = {"the header": header.last - header.first + 1}
    for name in ("POINT:FRAMES", "POINT:LONG_FRAMES"):
        for number in filter(math.isfinite, header.numbers(name)[:1]):
            counts[name] = int(number)
    begin, end = (header.numbers(f"TRIAL:ACTUAL_{name}_FIELD") for name in ("START", "END"))
    if begin and end:
        counts["TRIAL:ACTUAL_START_FIELD and ACTUAL_END_FIELD"] = _whole(end) - _whole(begin) + 1

    def agrees(name: str, frames: int) -> bool:
        if name == "the header":
            last = header.first + frames - 1
            return header.last in (last % _WRAP, min(last, _WRAP - 1))
        short = {frames % _WRAP, 0, _WRAP - 1} if name == "POINT:FRAMES" and frames >= _WRAP else set()
        signed = frames - _WRAP if name == "POINT:FRAMES" else frames
        return counts[name] in (frames, signed) or counts[name] % _WRAP in short

    fitting = [frames for frames in range(least, most + 1) if all(agrees(name, frames) for name in counts)]
    if fitting:
        return range(fitting[0], fitting[-1] + 1)
    said = ", ".join(f"{count} by {name}" for name, count in counts.items())
    truncated = most < min(counts.values())
    raise BadFile(
        header.path,
        f"{said}; {size} bytes hold {max(most, 0)}",
        "one number of frames",
        ("The file is truncated. " if truncated else "") + FETCH_AGAIN,
    )


def _whole(words: list[float]) -> int:
    """The number in two words of 16 bits, the lower one first."""
    return sum(int(word) % _WRAP * _WRAP**i for i, word in enumerate(words[:2]) if math.isfinite(word))


def _read_parameters(path: Path, block: bytes, processor: int) -> dict[str, Parameter]:
    """Follow the chain of groups and parameters; BadFile unless each ends before the next one begins."""
    groups: dict[int, str] = {}
    found: list[tuple[int, str, Parameter]] = []
    at = 4
    while at + 2 <= len(block) and block[at] != 0:
        length, group = struct.unpack_from("bb", block, at)
        name_end = at + 2 + abs(length)
        if name_end + 2 > len(block):
            break
        name = block[at + 2 : name_end].decode("latin-1").strip().upper()
        (step,) = _integers(block[name_end : name_end + 2], processor)
        if group < 0:
            groups[-group] = name
        elif group > 0 and name_end + 4 <= len(block):
            size, axes = struct.unpack_from("bB", block, name_end + 2)
            sizes = list(block[name_end + 4 : name_end + 4 + axes])
            begin = name_end + 4 + axes
            end = begin + abs(size) * math.prod(sizes)
            if size not in (-1, 1, 2, 4) or end > len(block) or (step and end > name_end + step):
                raise BadFile(path, f"a parameter that overruns its place at byte {at}", FORMAT, FETCH_AGAIN)
            found.append((group, name, _parameter(block[begin:end], size, sizes, processor)))
        if step == 0:
            break
        at = name_end + step
    if at + 2 > len(block):
        raise BadFile(path, "parameters without an end", FORMAT, FETCH_AGAIN)
    return {f"{groups.get(group, '')}:{name}": value for group, name, value in found}


def _parameter(data: bytes, size: int, sizes: list[int], processor: int) -> Parameter:
    if size == -1:
        width = sizes[0] if sizes else 1
        texts = (data[i : i + width] for i in range(0, len(data), max(width, 1)))
        return tuple(text.decode("latin-1").replace("\0", " ").strip() for text in texts)
    with np.errstate(invalid="ignore"):
        return _decode(data, {1: "i1", 2: "i2", 4: "f4"}[size], processor).astype(np.float64)


def _integers(data: bytes, processor: int) -> list[int]:
    return [int(number) for number in _decode(data, "u2", processor)]


def _decode(data: bytes | memoryview, code: str, processor: int) -> NDArray[Any]:
    """Numbers of a processor; DEC's floats have their words exchanged, and are four times as large."""
    if processor == _DEC and code == "f4":
        words = np.frombuffer(data, "<u2").reshape(-1, 2)[:, ::-1]
        with np.errstate(all="ignore"):
            return np.ascontiguousarray(words).view("<f4").ravel() / np.float32(4.0)
    return np.frombuffer(data, f"{_BYTE_ORDER[processor]}{code}")
