"""Emitters of a constellation: what they must fulfil, and files that list them as an IS-900 does (docs/is900.md 6.4).

A file has `MCF` lines. A first line such as `# 9 emitters` says how many follow, and may go on with their source. It
shows that the last line is there; an IS-900 does not send it. Without it the numbers have to be those from 1 on, so
that any other line is missed.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from harness.core.input_file import MEGABYTE, read_input_file
from harness.errors import BadFile, shorten
from harness.stream.polhemus.codec import Emitter, parse_reply

FEWEST, MOST = 3, 200
"""Numbers of emitters of a constellation. A position needs three ranges; no known constellation has 200."""
SAME_PLACE_M = 1e-3
"""Emitters closer than this are at one place [m]."""
LARGEST_M = 1000.0
"""Largest coordinate of an emitter [m] [choice]."""
NORMAL_TOLERANCE = 0.005 * 3.0**0.5 + 1e-9
"""Difference of a normal's length from 1 that two decimals can cause."""
_LARGEST_NUMBER = 10**9
MCF_SUFFIX = ".mcf"
MAX_MCF_BYTES = MEGABYTE
"""Largest file that is read [choice]: 200 emitters take 14 kB."""
_KIND = "emitters as `MCF` lists them"
_LINE = "`31F`, number, position, normal and identity"
_ADVICE = "docs/is900.md 6.4 describes the lines."
_LONGEST_LINE = 200
_COUNT = re.compile(rb"# ([0-9]{1,4}) emitters?(?: .*)?")


class EmitterFault(NamedTuple):
    """Why emitters cannot be used."""

    row: int | None
    """Index of the emitter at fault; None for the number of emitters."""
    found: str
    expected: str


def find_emitter_fault(emitters: Sequence[Emitter]) -> EmitterFault | None:
    """The first fault of J emitters; None if they can be used."""
    for index, emitter in enumerate(emitters):
        if fault := _emitter_fault(index, emitter) or _duplicate_fault(index, emitter, emitters[:index]):
            return fault
        if index == MOST:
            return EmitterFault(index, f"more than {MOST} emitters", f"{FEWEST} to {MOST}")
    if len(emitters) < FEWEST:
        count = f"{len(emitters)} emitter{'s'[: len(emitters) != 1]}"
        return EmitterFault(None, count, f"{FEWEST} or more: a position needs as many ranges")
    return None


def _emitter_fault(index: int, emitter: Emitter) -> EmitterFault | None:
    if not 1 <= emitter.number <= _LARGEST_NUMBER or not 0 <= emitter.identity <= _LARGEST_NUMBER:
        found = f"emitter {emitter.number} with the identity {emitter.identity}"
        return EmitterFault(index, found, f"a number from 1 and an identity from 0, up to {_LARGEST_NUMBER:,}")
    if not all(abs(value) <= LARGEST_M for value in emitter.position_m):  # not so for NaN
        found = f"emitter {emitter.number} at {_point(emitter.position_m)} m"
        return EmitterFault(index, found, f"coordinates up to {LARGEST_M:g} m")
    length = float(np.sqrt(np.sum(np.square(emitter.normal))))
    if not abs(length - 1.0) <= NORMAL_TOLERANCE:
        found = f"emitter {emitter.number} with the normal {_point(emitter.normal)}, of length {length:.3f}"
        return EmitterFault(index, found, "a unit vector")
    return None


def _duplicate_fault(index: int, emitter: Emitter, before: Sequence[Emitter]) -> EmitterFault | None:
    for other in before:
        if other.number == emitter.number:
            return EmitterFault(index, f"a second emitter {emitter.number}", "a number of its own for each emitter")
        if np.sum(np.square(np.subtract(other.position_m, emitter.position_m))) <= SAME_PLACE_M**2:
            found = f"emitter {emitter.number} at the place of emitter {other.number}"
            return EmitterFault(index, found, f"emitters more than {1e3 * SAME_PLACE_M:g} mm apart")
    return None


def _point(vector: Sequence[float]) -> str:
    return f"({', '.join(f'{value:.4g}' for value in vector)})"


def read_mcf(path: Path) -> tuple[Emitter, ...]:
    """The emitters of a file, in its order; empty lines are skipped.

    Raises BadFile for a file that is damaged, and for emitters that no device can use; it names the line.
    """
    data = read_input_file(path, _KIND, MAX_MCF_BYTES, "`harness list` names no such files: check the path.")
    announced: int | None = None
    emitters, line_of = [], []
    for number, line in enumerate(data.replace(b"\r", b"\n" if b"\n" not in data else b"").split(b"\n"), start=1):
        if not line.strip():
            continue
        if number == 1 and (count := _COUNT.fullmatch(line)):
            announced = int(count[1])
            continue
        emitter = _parse_line(line)
        if emitter is None:
            found = f"the line '{shorten(line[:_LONGEST_LINE].decode('latin-1'), 60)}'"
            raise BadFile(path, found, _LINE, _ADVICE, number)
        emitters.append(emitter)
        line_of.append(number)
    if fault := find_emitter_fault(emitters):
        number_or_none = None if fault.row is None else line_of[fault.row]
        raise BadFile(path, fault.found, fault.expected, "Correct the file.", number_or_none)
    if lost := _find_lost(data, emitters, announced):
        raise BadFile(
            path,
            lost,
            "all lines of the emitters",
            "Restore the file, or announce their number in its first line: `# 9 emitters`.",
        )
    return tuple(emitters)


def _find_lost(data: bytes, emitters: Sequence[Emitter], announced: int | None) -> str:
    """What shows that a file lost a line or its end; "" if nothing does."""
    if announced is not None and announced != len(emitters):
        return f"{announced} emitters announced and {len(emitters)} listed"
    numbers = {emitter.number for emitter in emitters}
    missing = [number for number in range(1, len(emitters) + 1) if number not in numbers]
    if missing and announced is None:
        return f"no emitter {missing[0]}, though there are later ones"
    lines = data.splitlines()
    if not data.endswith((b"\n", b"\r")) and len(lines[-1]) < max(map(len, lines)):
        return "a last line that is shorter than others and has no end"
    return ""


def _parse_line(line: bytes) -> Emitter | None:
    if len(line) > _LONGEST_LINE or not line.isascii():
        return None
    reply = parse_reply(line.rstrip(b" "))
    return reply if isinstance(reply, Emitter) else None
