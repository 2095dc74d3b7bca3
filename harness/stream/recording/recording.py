"""Recordings: everything that passed over the line, in both directions, with the host's times.

The file layout is described in `blocks.py`. A recording only grows, by whole blocks. A crash or a damaged disk
costs only the blocks it touches, and these are reported. A recording that was cut off can be continued. Blocks by kind:

    recv, sent   bytes from and to the device; an empty recv block: nothing arrived and an overdue frame was closed
    conf         JSON of the `WireFormat` of the bytes that follow; the device's clock starts at zero there
    evnt         JSON of an event on the line, as the driver reported it
    note         JSON of the origin of what follows: the port, or the scenario, clip, seed, stations and rate; "plan" is
                 the digest of the trust plan that the recording is made for, the same in every note of a file
    answ         JSON of a command that a person sent, with the bytes and the decoded values of its answer
    mark         JSON of the stretch of a capture that begins here and lasts to the next mark, such as
                 {"stretch": "static"}; the stretch "" ends one
    body, pose   poses of another program in place of bytes (`pose_recording.py`), in files of version 2
"""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO

from harness.core.file_kind import wrong_file
from harness.core.input_file import MEGABYTE, open_input_file, read_input_file
from harness.errors import BadFile, shorten
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.recording.block_content import (
    EXPECTED_FILE,
    block_content,
    note_values,
    timed_contents,
    wire_format_of,
)
from harness.stream.recording.blocks import (
    ANSWERED,
    CONFIGURED,
    EVENT,
    FILE_HEADER,
    MARK,
    NOTE,
    POSES_VERSION,
    DamagedSpan,
    RecordingBlock,
    read_blocks,
    read_version,
    scan_blocks,
)

_KIND_BYTES = 1 << 20
"""Bytes in which the beginning of a recording whose header is damaged must have a whole block."""
MAX_BYTES = 2048 * MEGABYTE
"""Largest recording that is read: some two days of a full serial line."""


@dataclass(frozen=True, eq=False)
class Recording:
    """The content of a recording at the time it was read."""

    path: Path
    data: bytes

    def blocks(self) -> Iterator[RecordingBlock]:
        """Yield every whole block, in file order."""
        return (entry for entry in self._entries() if isinstance(entry, RecordingBlock))

    @cached_property
    def damage(self) -> tuple[str, ...]:
        """Descriptions of the damaged or truncated parts, in file order."""
        out: list[str] = []
        deque(describe_damage(self._entries(), out), maxlen=0)
        return tuple(out)

    @cached_property
    def formats(self) -> tuple[WireFormat, ...]:
        """Wire format of each configuration of the device. Raises BadFile when one cannot be read."""
        return tuple(wire_format_of(self.path, block) for block in self.blocks() if block.kind == CONFIGURED)

    @cached_property
    def note(self) -> dict[str, Any]:
        """The latest note on the origin of the recording; empty when there is none."""
        notes = [block for block in self.blocks() if block.kind == NOTE]
        return block_content(self.path, notes[-1]) if notes else {}

    def note_values(self, name: str) -> tuple[str, ...]:
        """The different values that the notes have under a name, in file order.

        "" stands for a note without the name, and for blocks that come before the first note.
        """
        return note_values(self.path, self.blocks(), name)

    @property
    def events(self) -> list[dict[str, Any]]:
        """Events on the line: kind, text, time on the host's clock [s] and time since the first block [s]."""
        first_s = next((block.monotonic_s for block in self.blocks()), 0.0)
        found = []
        for block in self.blocks():
            if block.kind != EVENT:
                continue
            event = block_content(self.path, block)
            if not all(isinstance(event.get(name), str) for name in ("kind", "text")):
                raise BadFile(self.path, "an event without kind and text", EXPECTED_FILE, "Record again.")
            texts = {name: shorten(event[name]) for name in ("kind", "text")}
            found.append({"monotonic_s": block.monotonic_s, "elapsed_s": block.monotonic_s - first_s, **texts})
        return found

    @property
    def marks(self) -> list[dict[str, Any]]:
        """Marks of stretches, with the time on the host's clock [s] at which each begins."""
        return timed_contents(self.path, self.blocks(), MARK)

    @property
    def answers(self) -> list[dict[str, Any]]:
        """Commands that a person sent, with their answers and the time on the host's clock [s]."""
        return timed_contents(self.path, self.blocks(), ANSWERED)

    def _entries(self) -> Iterator[RecordingBlock | DamagedSpan]:
        return read_blocks(self.data, len(FILE_HEADER) if read_version(self.data) else 0)


def read_recording(path: Path | str) -> Recording:
    """Read a recording, whatever part of it is damaged or truncated.

    Raises BadFile for a file that is no recording, or one of a newer version.
    """
    path = Path(path)
    data = read_input_file(path, EXPECTED_FILE, MAX_BYTES, "`harness record PORT FILE` makes one.")
    if not data:
        raise BadFile(path, "an empty file", EXPECTED_FILE, "Nothing was recorded into it.")
    _check_kind(path, data)
    return Recording(path, data)


def open_recording(path: Path, *, of_poses: bool = False) -> BinaryIO:
    """Open a recording at its first block, to read it in pieces; `of_poses` allows version 2 as well.

    Raises BadFile as `read_recording`.
    """
    file = open_input_file(path, EXPECTED_FILE, MAX_BYTES, "`harness record PORT FILE` makes one.")
    try:
        if not seek_first_block(path, file, of_poses=of_poses):
            raise BadFile(path, "an empty file", EXPECTED_FILE, "Nothing was recorded into it.")
    except BadFile:
        file.close()
        raise
    return file


def seek_first_block(path: Path, file: BinaryIO, *, of_poses: bool = False) -> bool:
    """Go to the first block of a file; False in an empty one. Raises BadFile unless it is a recording."""
    head = file.read(_KIND_BYTES)
    if not (of_poses and read_version(head) == POSES_VERSION):
        _check_kind(path, head)
    file.seek(len(FILE_HEADER) if read_version(head) else 0)
    return bool(head)


def read_marks(path: Path) -> list[dict[str, Any]]:
    """Return what the marks of a recording say, of bytes or of poses, in the order of the file. Raises BadFile."""
    with open_recording(path, of_poses=True) as file:
        return timed_contents(path, whole_blocks(file), MARK)


def whole_blocks(file: BinaryIO) -> Iterator[RecordingBlock]:
    """Yield the whole blocks of a file from its present position on; it is read in pieces."""
    return (entry for entry in scan_blocks(file) if isinstance(entry, RecordingBlock))


def describe_damage(entries: Iterable[RecordingBlock | DamagedSpan], damage: list[str]) -> Iterator[RecordingBlock]:
    """Yield the whole blocks, and append a description of each damaged part between them to `damage`.

    Its times count from the first whole block.
    """
    damaged: DamagedSpan | None = None
    first_s = before_s = None
    for entry in entries:
        if isinstance(entry, DamagedSpan):
            damaged = entry
            continue
        first_s = entry.monotonic_s if first_s is None else first_s
        now_s = entry.monotonic_s - first_s
        if damaged:
            damage.append(_damage_text(damaged, before_s, now_s))
        damaged, before_s = None, now_s
        yield entry
    if damaged:
        damage.append(_truncation_text(damaged, before_s))


def _check_kind(path: Path, data: bytes) -> None:
    """Raise BadFile unless the file is a recording or the beginning of one."""
    version = read_version(data)
    if version == POSES_VERSION:
        expected = "a recording of a device's line"
        raise BadFile(path, "a recording of poses", expected, "`harness inspect`, `replay` and `view` read it.")
    if version is not None and version > POSES_VERSION:
        problem, known = f"a recording of version {version}", f"version {POSES_VERSION} at most"
        raise BadFile(path, problem, known, "Use the newer version of the harness that made it.")
    if (
        version is None
        and not FILE_HEADER.startswith(data)
        and all(isinstance(entry, DamagedSpan) for entry in read_blocks(data, 0))
    ):
        advice = "Is it the right file? What other poses lack, `harness inspect` says. Nothing was changed."
        raise wrong_file(path, "no recording", EXPECTED_FILE, advice)


def _damage_text(span: DamagedSpan, before_s: float | None, after_s: float) -> str:
    what = f"bytes {span.begin} to {span.end} are damaged"
    if before_s is None:
        return f"{what}: the beginning; times count from the first whole block"
    return f"{what}: between {before_s:.3f} s and {after_s:.3f} s"


def _truncation_text(span: DamagedSpan, before_s: float | None) -> str:
    when = "" if before_s is None else f", from {before_s:.3f} s on"
    return f"the last {span.end - span.begin} bytes are cut off{when}"
