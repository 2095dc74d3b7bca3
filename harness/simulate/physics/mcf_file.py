"""Files of `MCF` lines: the emitters of a constellation, as an IS-900 lists them (docs/is900.md 6.4)."""

from collections.abc import Sequence
from pathlib import Path

from harness.core.files import write_bytes
from harness.core.input_file import MEGABYTE, read_input_file
from harness.errors import BadFile, shorten
from harness.simulate.physics.emitter_checks import find_emitter_fault
from harness.stream.codec.replies import Emitter

MCF_SUFFIX = ".mcf"
MAX_MCF_BYTES = MEGABYTE
"""Largest file that is read [choice]: 200 emitters take 14 kB."""
_KIND = "emitters as `MCF` lists them"
_LINE = "`31F`, number, position, normal and identity"
_ADVICE = "docs/is900.md 6.4 describes the lines."
_LONGEST_LINE = 200


def read_mcf(path: Path) -> tuple[Emitter, ...]:
    """The emitters of a file, in its order; empty lines are skipped.

    Raises BadFile for a file that is damaged, and for emitters that no device can use; it names the line.
    """
    data = read_input_file(path, _KIND, MAX_MCF_BYTES, "`harness list` names no such files: check the path.")
    emitters, line_of = [], []
    for number, line in enumerate(data.replace(b"\r", b"\n" if b"\n" not in data else b"").split(b"\n"), start=1):
        if not line.strip():
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
    return tuple(emitters)


def write_mcf(path: Path, emitters: Sequence[Emitter]) -> None:
    """Write emitters as the lines that the device sends; positions have 4 decimals, normals 2."""
    write_bytes(path, b"".join(emitter.line() for emitter in emitters))


def _parse_line(line: bytes) -> Emitter | None:
    if len(line) > _LONGEST_LINE or not line.isascii():
        return None
    return Emitter.parse(line.decode("ascii").rstrip(" "))
