"""Acclaim motion files (AMC): position of the root and angles of the bones, frame by frame, for the skeleton of an ASF.

An AMC file records neither its frame rate nor its unit of length: the caller gives the rate, the ASF file the unit. A
bone's row has the angles of its `dof` in that order, in degrees, the last one outermost.
"""

from array import array
from collections.abc import Iterator
from itertools import islice
from operator import itemgetter
from pathlib import Path
from typing import NoReturn, TextIO

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import Clip
from harness.core.skeleton import Skeleton
from harness.errors import BadFile, BadInput
from harness.mocap.read.asf import INCH_M, ROOT_ORDER, WORLD_FROM_ASF, read_asf_file
from harness.mocap.read.file_checks import MAX_VALUE, check_last_line, check_size, parse_numbers

CMU_UNIT_M = INCH_M / 0.45
"""Length of 1 in every file of the CMU library [m], 0.056444."""

_FORMAT = "an AMC motion"
_FETCH_AGAIN = "The file is truncated; fetch it again."

_Line = tuple[int, str]


def read_amc_clip(asf: Path | str, amc: Path | str, *, rate_hz: float) -> Clip:
    """Read an AMC file with its ASF file, in the unit of the latter; see `read_amc`."""
    skeleton, unit_m = read_asf_file(asf)
    return read_amc(amc, skeleton, rate_hz=rate_hz, unit_m=unit_m)


def read_amc(path: Path | str, skeleton: Skeleton, *, rate_hz: float, unit_m: float = CMU_UNIT_M) -> Clip:
    """Read the motion of an AMC file for `skeleton`; angles are those in the file, not unwrapped.

    The clip has the name of the file ("13_17"); its subject is the part before the underscore. Memory is bounded by
    `file_checks.LIMIT_BYTES`. Raises BadFile with the line for rows that are missing, repeated, unknown, of the wrong
    length or not numbers, and for frames that are cut, repeated or left out; BadInput for a rate not above 0.
    """
    path = Path(path)
    if not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise BadInput(f"{path.name} cannot have a rate of {rate_hz} Hz.", "CMU's clips have 120 Hz, some 60.")
    check_size(path, _FORMAT)
    names = ("root", *(name for name, channels in zip(skeleton.names, skeleton.hinges, strict=True) if channels))
    counts = dict(zip(skeleton.names, map(len, skeleton.hinges), strict=True)) | {"root": len(ROOT_ORDER)}
    with path.open(encoding="latin-1") as file:
        order, values = _parse(path, {name: counts[name] for name in names}, file)
    starts = dict(zip(order, np.cumsum([0, *(counts[name] for name in order)]).tolist(), strict=False))
    dofs = [starts[name] + k for name in names[1:] for k in range(counts[name])]
    root = values[:, starts["root"] : starts["root"] + len(ROOT_ORDER)]
    return Clip(
        name=path.stem,
        subject=path.stem.split("_", 1)[0],
        source=path.parent.name,
        behaviour="",
        skeleton=skeleton,
        rate_hz=rate_hz,
        root_m=root[:, :3] * unit_m @ WORLD_FROM_ASF.T,
        world_from_root=_root_rotation(np.deg2rad(root[:, 3:])),
        angles_rad=np.deg2rad(values[:, dofs]),
    )


def _parse(path: Path, counts: dict[str, int], file: TextIO) -> tuple[tuple[str, ...], Floats]:
    """Names of a frame's rows in order, and the values of every frame (T, sum of counts) in that order."""
    lines = _content_lines(file)
    block = _read_first_frame(path, lines, 1 + len(counts))
    order = tuple(text.split(None, 1)[0] for _, text in block[1:])
    if sorted(order) != sorted(counts):
        _raise_frame_error(path, counts, tuple(counts), block, None)
    words_in_frame = 1 + len(order) + sum(counts.values())
    starts = np.cumsum([1, *(1 + counts[name] for name in order[:-1])]).tolist()
    names_of = itemgetter(0, *starts)
    values_of = itemgetter(*sorted(set(range(1, words_in_frame)) - set(starts)))
    values = array("d")
    first = expected = int(block[0][1])
    while block:
        words = " ".join([text for _, text in block]).split()
        row = None
        if len(words) == words_in_frame and names_of(words) == (str(expected), *order):
            row = _parse_floats(values_of(words))
        if row is None:
            _raise_frame_error(path, counts, order, block, expected)
        values.extend(row)
        expected += 1
        block = list(islice(lines, 1 + len(order)))
    check_last_line(path)
    return order, np.frombuffer(values).reshape(expected - first, -1)


def _content_lines(file: TextIO) -> Iterator[_Line]:
    """Line numbers and stripped lines, without comments and blank lines."""
    for line, text in enumerate(file, start=1):
        text = text.strip()
        if text and text[0] != "#":
            yield line, text


def _read_first_frame(path: Path, lines: Iterator[_Line], lines_in_frame: int) -> list[_Line]:
    """Skip the keywords and return the lines of the first frame."""
    keywords = set()
    for line, text in lines:
        if not text.startswith(":"):
            if ":DEGREES" not in keywords or not _is_frame_number(text):
                raise BadFile(path, f"{text[:40]!r}", ":DEGREES and then frame 1", f"Is it {_FORMAT}?", line)
            return [(line, text), *islice(lines, lines_in_frame - 1)]
        keywords.add(text.upper())
    raise BadFile(path, "no frames", _FORMAT, _FETCH_AGAIN)


def _parse_floats(words: tuple[str, ...]) -> list[float] | None:
    """The words as numbers; None if one is not a number or is too large."""
    try:
        row = list(map(float, words))
    except ValueError:
        return None
    return row if all(abs(value) < MAX_VALUE for value in row) else None


def _is_frame_number(text: str) -> bool:
    """Whether a line is a frame number."""
    return text.isascii() and text.isdecimal() and len(text) < 10


def _raise_frame_error(
    path: Path, counts: dict[str, int], order: tuple[str, ...], block: list[_Line], expected: int | None
) -> NoReturn:
    """Raise BadFile with what is wrong in a frame that does not match the first one."""
    line, text = block[0]
    if expected is not None and text != str(expected):
        again = _is_frame_number(text) and int(text) < expected
        found = f"frame {text} again" if again else f"{text[:40]!r}"
        advice = "Frames are repeated." if again else "Frames or rows are missing or too many; fetch the file again."
        raise BadFile(path, found, f"frame {expected}", advice, line)
    seen: set[str] = set()
    for (line, text), name in zip(block[1:], order, strict=False):
        found, *values = text.split()
        missing = ", ".join(n for n in counts if n not in seen)
        if _is_frame_number(found):
            raise BadFile(path, f"frame {found} before {missing}", "every bone of the skeleton", _FETCH_AGAIN, line)
        if found not in counts:
            advice = "Does the ASF belong to this AMC?"
            raise BadFile(path, f"unknown bone {found[:40]!r}", f"one of {missing}", advice, line)
        if found in seen:
            raise BadFile(path, f"bone {found} twice in one frame", f"one of {missing}", "Remove one.", line)
        if expected is not None and found != name:
            raise BadFile(path, f"bone {found}", f"{name}, as in the first frame", "Rows are mixed up.", line)
        parse_numbers(path, values, counts[found], f"{found} (does the ASF belong to this AMC?)", line)
        seen.add(found)
    cut = f"the end of the file inside frame {block[0][1]}"
    raise BadFile(path, cut, f"{len(counts)} rows", _FETCH_AGAIN, line)


def _root_rotation(angles_rad: Floats) -> Floats:
    """World quaternions (T, 4) of angles RX RY RZ (T, 3) [rad], the last outermost, with continuous signs."""
    x, y, z = (rotations.exp(angles_rad[:, k, None] * WORLD_FROM_ASF[:, k]) for k in range(3))
    return rotations.continuous(rotations.multiply(z, rotations.multiply(y, x)))
