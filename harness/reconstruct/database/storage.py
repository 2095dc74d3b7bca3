"""A database on disk: `posture.npy`, `step.npy` and `database.json`, read as memory maps; nothing is ever unpickled.

Frames are written as they come to a folder beside the final one, which takes its name once all is there. So a killed
run leaves nothing that looks finished, and nothing is overwritten.
"""

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from harness.core.arrays import Singles
from harness.core.files import flush, move_into_place, temporary_path, write_text
from harness.errors import BadFile, BadInput
from harness.reconstruct.database.motion_database import MotionDatabase, TakeSegment
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE

FORMAT, VERSION = "tracker-harness motion database", 1
COLUMNS = {"posture": POSTURE_SIZE, "step": 3}
_HEADER_FILE = "database.json"
_REBUILD_ADVICE = "Build the database again."


class MemoryWriter:
    """Collects runs in memory."""

    def __init__(self) -> None:
        self.segments: list[TakeSegment] = []
        self.rate_hz = 0.0
        self._parts: dict[str, list[Singles]] = {name: [] for name in COLUMNS}

    def __enter__(self) -> "MemoryWriter":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def add(self, run: TakeSegment, rate_hz: float, posture: Singles, step: Singles) -> None:
        """Append a run; BadInput when its rate is another than the others'."""
        if self.segments and rate_hz != self.rate_hz:
            found = f"{run.take} has {rate_hz:g} frames a second, and {self.segments[0].take} {self.rate_hz:g}."
            raise BadInput(found, "Bring all takes to the tracker's rate first.")
        start = self.segments[-1].stop if self.segments else 0
        self.rate_hz = rate_hz
        self.segments.append(replace(run, start=start, stop=start + len(posture)))
        self._store("posture", posture)
        self._store("step", step)

    def _store(self, name: str, rows: Singles) -> None:
        self._parts[name].append(rows)

    def result(self) -> MotionDatabase:
        posture, step = (np.concatenate(self._parts.pop(name)) for name in COLUMNS)
        for array in (posture, step):
            array.setflags(write=False)
        return MotionDatabase(self.rate_hz, posture, step, tuple(self.segments))


class FolderWriter(MemoryWriter):
    """Appends runs to files."""

    def __init__(self, folder: Path, beside: Path) -> None:
        super().__init__()
        self._folder, self._beside = folder, beside
        self._files: dict[str, BinaryIO] = {}
        for name in COLUMNS:
            self._files[name] = open(beside / f"{name}.npy", "w+b")  # noqa: SIM115  # until `close`
            self._header(name, 0)

    def _store(self, name: str, rows: Singles) -> None:
        self._files[name].write(np.ascontiguousarray(rows, "<f4").data)

    def _header(self, name: str, count: int) -> None:
        """The same length for any count: numpy leaves room for the first axis to grow."""
        card = {"descr": "<f4", "fortran_order": False, "shape": (count, COLUMNS[name])}
        self._files[name].seek(0)
        np.lib.format.write_array_header_1_0(self._files[name], card)

    def finish(self) -> None:
        """All files complete and on the disk."""
        for name, file in self._files.items():
            self._header(name, self.segments[-1].stop)
            file.flush()
            flush(self._beside / f"{name}.npy")
        card = {
            "format": FORMAT,
            "version": VERSION,
            "rate_hz": self.rate_hz,
            "runs": [asdict(r) for r in self.segments],
        }
        text = json.dumps(card, indent=0, allow_nan=False, ensure_ascii=False)
        write_text(self._beside / _HEADER_FILE, text)

    def close(self) -> None:
        for file in self._files.values():
            file.close()

    def result(self) -> MotionDatabase:
        return open_database(self._folder)


@contextmanager
def open_writer(folder: Path) -> Iterator[FolderWriter]:
    """A writer whose folder appears when all went well; BadFile when something of that name is there already."""
    taken = BadFile(folder, "is there already", "a name for a new folder", "Nothing is overwritten: choose another.")
    if os.path.lexists(folder):
        raise taken
    folder.parent.mkdir(parents=True, exist_ok=True)
    beside = temporary_path(folder)
    beside.mkdir()
    try:
        writer = FolderWriter(folder, beside)
        try:
            yield writer
            writer.finish()
        finally:
            writer.close()
        try:
            move_into_place(beside, folder)  # fails on a folder that has anything in it
        except OSError as error:
            raise taken from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def save_database(database: MotionDatabase, folder: Path) -> None:
    """`MotionDatabase.save`."""
    with open_writer(folder) as writer:
        for run in database.runs:
            where = slice(run.start, run.stop)
            writer.add(run, database.rate_hz, database.posture[where], database.step[where])


def open_database(folder: Path) -> MotionDatabase:
    """`MotionDatabase.open`."""
    card = _read_header(folder / _HEADER_FILE)
    runs = _read_segments(folder / _HEADER_FILE, card)
    arrays = {name: _map_array(folder / f"{name}.npy", (runs[-1].stop, width)) for name, width in COLUMNS.items()}
    return MotionDatabase(float(card["rate_hz"]), arrays["posture"], arrays["step"], runs)


def _read_header(path: Path) -> dict[str, Any]:
    expected = f"the card of a motion database, version {VERSION}"
    try:
        card = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise BadFile(path, f"cannot be read ({error.strerror})", expected, "Is this a motion database?") from error
    except ValueError as error:
        raise BadFile(path, f"not JSON: {error}", expected, _REBUILD_ADVICE) from error
    if not isinstance(card, dict) or card.get("format") != FORMAT:
        raise BadFile(path, "of some other kind", expected, "Is this a motion database?")
    if card.get("version") != VERSION:
        raise BadFile(path, f"version {card.get('version')!r}", expected, _REBUILD_ADVICE)
    rate_hz = card.get("rate_hz")
    if not isinstance(rate_hz, int | float) or isinstance(rate_hz, bool) or not 0.0 < rate_hz < np.inf:
        raise BadFile(path, f"a rate of {rate_hz!r}", "rate_hz above 0", _REBUILD_ADVICE)
    return card


def _read_segments(path: Path, card: dict[str, Any]) -> tuple[TakeSegment, ...]:
    """Runs that follow each other from row 0 on, or BadFile."""
    known = {field.name: field.type for field in fields(TakeSegment)}
    runs: list[TakeSegment] = []
    entries = card.get("runs")
    for which, entry in enumerate(entries if isinstance(entries, list) else []):
        if not isinstance(entry, dict) or entry.keys() != known.keys():
            raise BadFile(path, f"run {which} is {entry!r:.80}", f"an entry of {', '.join(known)}", _REBUILD_ADVICE)
        if any(type(entry[name]) is not kind for name, kind in known.items()):
            raise BadFile(path, f"run {which} has fields of the wrong kind", "texts and whole numbers", _REBUILD_ADVICE)
        run = TakeSegment(**entry)
        if run.start != (runs[-1].stop if runs else 0) or run.stop <= run.start or run.first_frame < 0:
            raise BadFile(path, f"run {which} has rows {run.start} to {run.stop}", "runs that join", _REBUILD_ADVICE)
        runs.append(run)
    if not runs:
        raise BadFile(path, "no runs", "one or more", _REBUILD_ADVICE)
    return tuple(runs)


def _map_array(path: Path, shape: tuple[int, int]) -> Singles:
    expected = f"an array of {shape[0]} x {shape[1]} float32"
    try:
        array: Singles = np.load(path, mmap_mode="r", allow_pickle=False)
    except OSError as error:
        raise BadFile(path, f"cannot be read ({error.strerror or error})", expected, _REBUILD_ADVICE) from error
    except (ValueError, EOFError) as error:
        raise BadFile(path, f"damaged: {error}", expected, _REBUILD_ADVICE) from error
    if array.dtype != np.dtype("<f4") or array.shape != shape or not array.flags.c_contiguous:
        raise BadFile(path, f"{' x '.join(map(str, array.shape))} {array.dtype}", expected, _REBUILD_ADVICE)
    return array
