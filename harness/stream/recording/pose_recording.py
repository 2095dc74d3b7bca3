"""Recordings of poses: a pose log in the blocks of a recording, so that marks, plans and digests work on it.

Such a file has version 2 and holds no byte of a device. After the note comes a block `body`: JSON of the bodies' names,
the source, the clock and what was concluded about the source. Blocks `pose` hold rows in the order of time, each 68
bytes: number of the body (u32), time of the log [s], position [m] and quaternion w, x, y, z (8 x f64). The clocks of a
block are those of its first row. A damaged or cut block costs its rows alone.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core.fault_report import is_system_fault
from harness.core.fields import build
from harness.core.file_kind import POSES_KIND, file_kind
from harness.core.files import atomic_path, require_writable
from harness.core.input_file import open_input_file, read_input_file
from harness.errors import BadFile, BadInput, HarnessError
from harness.stream.poses.number_table import EXPECTED_FILE, read_head
from harness.stream.poses.options import PoseFileOptions
from harness.stream.poses.pose_file import read_pose_log
from harness.stream.poses.pose_log import BodyPoses, FileFinding, PoseLog
from harness.stream.recording.block_content import PLAN_FILE, block_content
from harness.stream.recording.blocks import (
    BODIES,
    MARK,
    MAX_PAYLOAD_BYTES,
    NOTE,
    POSES,
    POSES_HEADER,
    POSES_VERSION,
    RecordingBlock,
    encode_block,
    read_blocks,
    read_version,
)
from harness.stream.recording.recording import MAX_BYTES, describe_damage

EXPECTED_POSES = "a recording of poses by `harness record`"
POSE_ROW = np.dtype([("body", "<u4"), ("time_s", "<f8"), ("position_m", "<f8", 3), ("quaternion", "<f8", 4)])
"""A row of a block of poses."""
_ROWS_PER_BLOCK = MAX_PAYLOAD_BYTES // POSE_ROW.itemsize


@dataclass(frozen=True, eq=False)
class PoseRecording:
    """Poses with what a recording adds to them."""

    path: Path
    log: PoseLog
    note: Mapping[str, Any]
    """The origin of the recording; "plan" is the digest of the trust plan that it was made for."""
    marks: tuple[tuple[float, str], ...] = ()
    """Times of the log [s] at which stretches begin, in order, and their names; "" ends one."""
    damage: tuple[str, ...] = ()
    """Descriptions of the damaged or truncated parts of the file."""

    @property
    def plan(self) -> str:
        """Digest of the plan; "" without one."""
        return str(self.note.get(PLAN_FILE) or "")


def open_poses(paths: Sequence[Path], options: PoseFileOptions | None = None) -> PoseRecording:
    """Read a recording of poses, or files of another program (`read_pose_log`). Raises BadFile as these do."""
    if len(paths) == 1 and is_pose_recording(paths[0]):
        if options is not None and replace(options, untimed=False) != PoseFileOptions():
            advice = "Units, columns and axes were settled when it was made: leave such options out."
            raise BadInput(f"{paths[0].name} is a recording of poses.", advice)
        return read_pose_recording(paths[0])
    return PoseRecording(paths[0], read_pose_log(paths, options), {})


def is_pose_recording(path: Path) -> bool:
    """Whether a file begins as a recording of poses. Raises BadFile for one that cannot be read."""
    with open_input_file(path, EXPECTED_FILE, MAX_BYTES) as file:
        return read_version(file.read(len(POSES_HEADER))) == POSES_VERSION


def is_pose_file(path: Path) -> bool:
    """Whether a file is a recording of poses, or text with rows of numbers that no other verb reads."""
    if not path.is_file():
        return False
    if file_kind(path) == POSES_KIND:
        return True
    try:
        read_head(path)
    except BadFile:
        return False
    return True


def write_pose_recording(
    path: Path, log: PoseLog, note: Mapping[str, Any], marks: Sequence[tuple[float, str]] = ()
) -> None:
    """Write poses as a recording, whole or not at all. Raises BadFile for a file that exists.

    `marks` are times of the log [s] at which stretches begin, and their names.
    """
    if path.exists():
        raise BadFile(path, "it exists", "a new file", "Poses are not appended to a recording: choose another name.")
    require_writable(path, "a recording", force=False)
    try:
        with atomic_path(path) as temporary, open(temporary, "wb") as file:
            file.writelines(_encode(log, note, marks))
    except OSError as error:
        if is_system_fault(error):
            raise
        raise BadFile(path, f"it cannot be written ({error.strerror})", "a recording", "Choose another.") from error


def encode_bodies(
    names: Sequence[str], source: str, clock: str, start_unix_s: float | None, findings: Iterable[FileFinding]
) -> bytes:
    """The payload of a block `body`."""
    content = {"bodies": names, "source": source, "clock": clock, "start_unix_s": start_unix_s}
    return json.dumps({**content, "findings": [asdict(finding) for finding in findings]}).encode()


def _encode(log: PoseLog, note: Mapping[str, Any], marks: Sequence[tuple[float, str]]) -> Iterator[bytes]:
    def block(kind: str, at_s: float, payload: bytes) -> bytes:
        return encode_block(RecordingBlock(kind, at_s, (log.start_unix_s or 0.0) + at_s, payload))

    yield POSES_HEADER
    yield block(NOTE, 0.0, json.dumps(note, default=str).encode())
    yield block(BODIES, 0.0, encode_bodies(log.names, log.source, log.clock, log.start_unix_s, log.findings))
    rows = _rows(log)
    begins = np.searchsorted(rows["time_s"], [at_s for at_s, _ in marks]).tolist()
    pending = list(zip(begins, marks, strict=True))
    edges = sorted({*range(0, len(rows), _ROWS_PER_BLOCK), *(n for n in begins if n < len(rows)), len(rows)})
    for first, end in zip(edges, [*edges[1:], len(rows)], strict=True):
        while pending and pending[0][0] <= first:
            _, (at_s, stretch) = pending.pop(0)
            yield block(MARK, at_s, json.dumps({"stretch": stretch}).encode())
        for begin in range(first, end, _ROWS_PER_BLOCK):
            part = rows[begin : min(begin + _ROWS_PER_BLOCK, end)]
            yield block(POSES, float(part["time_s"][0]), part.tobytes())


def _rows(log: PoseLog) -> NDArray[Any]:
    """All poses as rows in the order of time."""
    rows = np.empty(sum(len(body.times_s) for body in log.bodies), dtype=POSE_ROW)
    begin = 0
    for number, body in enumerate(log.bodies):
        part = rows[begin : (begin := begin + len(body.times_s))]
        part["body"], part["time_s"] = number, body.times_s
        part["position_m"], part["quaternion"] = body.positions_m, body.quaternions
    return rows[np.argsort(rows["time_s"], kind="stable")]


def read_pose_recording(path: Path) -> PoseRecording:
    """Read a recording of poses, whatever part of it is damaged. Raises BadFile where no pose is left."""
    data = read_input_file(path, EXPECTED_POSES, MAX_BYTES)
    damage = list[str]()
    head: dict[str, Any] = {}
    note: dict[str, Any] = {}
    marks, parts = list[tuple[float, str]](), list[NDArray[Any]]()
    for block in describe_damage(read_blocks(data, len(POSES_HEADER)), damage):
        if block.kind == NOTE:
            note = block_content(path, block)
        elif block.kind == BODIES:
            head = block_content(path, block)
        elif block.kind == MARK:
            marks.append((block.monotonic_s, str(block_content(path, block).get("stretch", ""))))
        elif block.kind == POSES:
            if len(block.payload) % POSE_ROW.itemsize:
                raise BadFile(path, "a block of poses that ends within a row", EXPECTED_POSES, "Record again.")
            parts.append(np.frombuffer(block.payload, dtype=POSE_ROW))
    try:
        names = [str(name) for name in head["bodies"]]
        findings = tuple(build(FileFinding, finding, "finding") for finding in head["findings"])
        start, source, clock = head["start_unix_s"], str(head["source"]), str(head["clock"])
        rows = np.concatenate(parts) if parts else np.empty(0, dtype=POSE_ROW)
        bodies = [_body(name, rows[rows["body"] == number]) for number, name in enumerate(names)]
        first_s = min((float(body.times_s[0]) for body in bodies if body is not None), default=0.0)
        if first_s:  # the first block is damaged
            bodies = [body and replace(body, times_s=body.times_s - first_s) for body in bodies]
            marks = [(at_s - first_s, stretch) for at_s, stretch in marks]
        start_s = None if start is None else float(start) + first_s
        log = PoseLog(tuple(body for body in bodies if body is not None), source, findings, clock, start_s)
    except (KeyError, TypeError, ValueError, HarnessError) as error:
        lost = "; ".join(damage) or f"its description of the bodies is not usable ({error})"
        raise BadFile(path, f"no poses ({lost})", EXPECTED_POSES, "Record it again.") from error
    return PoseRecording(path, log, note, tuple(marks), tuple(damage))


def _body(name: str, rows: NDArray[Any]) -> BodyPoses | None:
    """The poses of a body; None where all of its blocks are damaged."""
    if not len(rows):
        return None
    return BodyPoses(name, rows["time_s"], rows["position_m"], rows["quaternion"])
