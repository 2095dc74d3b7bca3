"""Files of `MCF` lines: the emitters of a constellation, as an IS-900 lists them (docs/is900.md 6.4).

A first line such as `# 9 emitters` says how many follow. It shows that the last line is there; an IS-900 does not send
it. Without it the numbers have to be those from 1 on, so that any other line is missed.
"""

import re
from collections.abc import Sequence
from pathlib import Path

from harness.core.files import write_bytes
from harness.core.input_file import MEGABYTE, read_input_file
from harness.errors import BadFile, shorten
from harness.simulate.physics.emitter_checks import find_emitter_fault
from harness.stream.codec.replies import Emitter, parse_reply

MCF_SUFFIX = ".mcf"
MAX_MCF_BYTES = MEGABYTE
"""Largest file that is read [choice]: 200 emitters take 14 kB."""
_KIND = "emitters as `MCF` lists them"
_LINE = "`31F`, number, position, normal and identity"
_ADVICE = "docs/is900.md 6.4 describes the lines."
_LONGEST_LINE = 200
_COUNT = re.compile(rb"# ([0-9]{1,4}) emitters?")


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
        number_or_none = None if fault.index is None else line_of[fault.index]
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


def write_mcf(path: Path, emitters: Sequence[Emitter]) -> None:
    """Write their number, then emitters as the device sends them; positions have 4 decimals, normals 2."""
    lines = (emitter.line() for emitter in emitters)
    write_bytes(path, b"# %d emitters\r\n%b" % (len(emitters), b"".join(lines)))


def _parse_line(line: bytes) -> Emitter | None:
    if len(line) > _LONGEST_LINE or not line.isascii():
        return None
    reply = parse_reply(line.rstrip(b" "))
    return reply if isinstance(reply, Emitter) else None
