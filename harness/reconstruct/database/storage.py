"""A motion database on disk: `posture.npy`, `step.npy` and `database.json`. Arrays are read as memory maps.

Frames are written as they come into a temporary folder beside the final one, which is renamed once all are there. So a
killed process leaves nothing that looks finished. Nothing is overwritten, and nothing is unpickled.
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
from harness.core.files import MAX_JSON_BYTES, flush, move_into_place, remove_leftovers, temporary_path, write_text
from harness.core.input_file import check_input_file, read_input_file
from harness.core.npz_file import read_npy_header
from harness.core.parsing import parse_json
from harness.errors import BadFile, BadInput
from harness.reconstruct.database.frames import MotionFrames, TakeSegment
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE

FORMAT, VERSION = "tracker-harness motion database", 1
COLUMNS = {"posture": POSTURE_SIZE, "step": 3}
_MAX_ARRAY_BYTES = 2**40
"""Largest array that is mapped; it is not read into memory."""
_HEADER_FILE = "database.json"
_REBUILD_ADVICE = "Build the database again."


class MemoryWriter:
    """Collects segments in memory."""

    def __init__(self) -> None:
        self.segments: list[TakeSegment] = []
        self.rate_hz = 0.0
        self._parts: dict[str, list[Singles]] = {name: [] for name in COLUMNS}

    def __enter__(self) -> "MemoryWriter":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def add(self, segment: TakeSegment, rate_hz: float, posture: Singles, step: Singles) -> None:
        """Append a segment; BadInput when its rate differs from that of the others."""
        if self.segments and rate_hz != self.rate_hz:
            rates = f"{segment.take} has {rate_hz:g} frames a second, {self.segments[0].take} {self.rate_hz:g}."
            raise BadInput(rates, "Resample all takes to the tracker's rate first.")
        start = self.segments[-1].stop if self.segments else 0
        self.rate_hz = rate_hz
        self.segments.append(replace(segment, start=start, stop=start + len(posture)))
        self._store("posture", posture)
        self._store("step", step)

    def _store(self, name: str, rows: Singles) -> None:
        self._parts[name].append(rows)

    def result(self) -> MotionFrames:
        """All segments that were added; the writer is empty afterwards."""
        posture, step = (np.concatenate(self._parts.pop(name)) for name in COLUMNS)
        for array in (posture, step):
            array.setflags(write=False)
        return MotionFrames(self.rate_hz, posture, step, tuple(self.segments))


class FolderWriter(MemoryWriter):
    """Appends segments to files in the folder `temporary`, which becomes `folder`."""

    def __init__(self, folder: Path, temporary: Path) -> None:
        super().__init__()
        self._folder, self._temporary = folder, temporary
        self._files: dict[str, BinaryIO] = {}
        for name in COLUMNS:
            self._files[name] = open(temporary / f"{name}.npy", "w+b")  # noqa: SIM115  # until `close`
            self._write_header(name, 0)

    def _store(self, name: str, rows: Singles) -> None:
        self._files[name].write(np.ascontiguousarray(rows, "<f4").data)

    def _write_header(self, name: str, count: int) -> None:
        """Write the npy header for `count` rows; numpy leaves room for the count, so the length is constant."""
        card = {"descr": "<f4", "fortran_order": False, "shape": (count, COLUMNS[name])}
        self._files[name].seek(0)
        np.lib.format.write_array_header_1_0(self._files[name], card)

    def finish(self) -> None:
        """Complete all files and flush them to the disk."""
        for name, file in self._files.items():
            self._write_header(name, self.segments[-1].stop)
            file.flush()
            flush(self._temporary / f"{name}.npy")
        card = {"format": FORMAT, "version": VERSION, "rate_hz": self.rate_hz}
        card["runs"] = [asdict(segment) for segment in self.segments]
        text = json.dumps(card, indent=0, allow_nan=False, ensure_ascii=False)
        write_text(self._temporary / _HEADER_FILE, text)

    def close(self) -> None:
        for file in self._files.values():
            file.close()

    def result(self) -> MotionFrames:
        """The finished folder, memory-mapped."""
        return open_database(self._folder)


@contextmanager
def open_writer(folder: Path) -> Iterator[FolderWriter]:
    """A writer whose folder appears when the block ends without an error; BadFile when the name is taken."""
    taken = BadFile(
        folder, "exists already", "the name of a new folder", "Choose another name: nothing is overwritten."
    )
    if os.path.lexists(folder):
        raise taken
    folder.parent.mkdir(parents=True, exist_ok=True)
    remove_leftovers(folder)
    temporary = temporary_path(folder)
    temporary.mkdir()
    try:
        writer = FolderWriter(folder, temporary)
        try:
            yield writer
            writer.finish()
        finally:
            writer.close()
        try:
            move_into_place(temporary, folder)  # fails on a folder that has anything in it
        except OSError as error:
            raise taken from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def save_database(database: MotionFrames, folder: Path) -> None:
    """Write frames to a new folder; see `MotionDatabase.save`."""
    with open_writer(folder) as writer:
        for segment in database.segments:
            where = slice(segment.start, segment.stop)
            writer.add(segment, database.rate_hz, database.posture[where], database.step[where])


def open_database(folder: Path) -> MotionFrames:
    """The frames of a folder, memory-mapped; see `MotionDatabase.open`."""
    card = _read_header(folder / _HEADER_FILE)
    segments = _read_segments(folder / _HEADER_FILE, card)
    arrays = {name: _map_array(folder / f"{name}.npy", (segments[-1].stop, width)) for name, width in COLUMNS.items()}
    return MotionFrames(float(card["rate_hz"]), arrays["posture"], arrays["step"], segments)


def _read_header(path: Path) -> dict[str, Any]:
    expected = f"the header of a motion database, version {VERSION}"
    data = read_input_file(path, expected, MAX_JSON_BYTES, "Is this a motion database?")
    try:
        card = parse_json(data.decode("utf-8"))
    except ValueError as error:
        raise BadFile(path, f"not JSON: {error}", expected, _REBUILD_ADVICE) from error
    if not isinstance(card, dict) or card.get("format") != FORMAT:
        raise BadFile(path, "not a motion database", expected, "Is this a motion database?")
    if card.get("version") != VERSION:
        raise BadFile(path, f"version {card.get('version')!r}", expected, _REBUILD_ADVICE)
    rate_hz = card.get("rate_hz")
    if not isinstance(rate_hz, int | float) or isinstance(rate_hz, bool) or not 0.0 < rate_hz < np.inf:
        raise BadFile(path, f"a rate of {rate_hz!r}", "rate_hz above 0", _REBUILD_ADVICE)
    return card


def _read_segments(path: Path, card: dict[str, Any]) -> tuple[TakeSegment, ...]:
    """The segments, which must follow each other from row 0 on; BadFile otherwise."""
    types = {field.name: field.type for field in fields(TakeSegment)}
    segments: list[TakeSegment] = []
    entries = card.get("runs")
    for number, entry in enumerate(entries if isinstance(entries, list) else []):
        if not isinstance(entry, dict) or entry.keys() != types.keys():
            raise BadFile(path, f"run {number} is {entry!r:.80}", f"an entry of {', '.join(types)}", _REBUILD_ADVICE)
        if any(type(entry[name]) is not type_ for name, type_ in types.items()):
            raise BadFile(
                path, f"run {number} has fields of the wrong type", "texts and whole numbers", _REBUILD_ADVICE
            )
        segment = TakeSegment(**entry)
        if (
            segment.start != (segments[-1].stop if segments else 0)
            or segment.stop <= segment.start
            or segment.first_frame < 0
        ):
            raise BadFile(
                path,
                f"run {number} has rows {segment.start} to {segment.stop}",
                "runs that follow each other",
                _REBUILD_ADVICE,
            )
        segments.append(segment)
    if not segments:
        raise BadFile(path, "no runs", "one or more", _REBUILD_ADVICE)
    return tuple(segments)


def _map_array(path: Path, shape: tuple[int, int]) -> Singles:
    expected = f"an array of {shape[0]} x {shape[1]} float32"
    size = check_input_file(path, expected, _MAX_ARRAY_BYTES, _REBUILD_ADVICE)
    try:
        with open(path, "rb") as file:
            found, fortran, dtype = read_npy_header(file)
            start = file.tell()
    except OSError as error:
        raise BadFile(path, f"cannot be read ({error.strerror or error})", expected, _REBUILD_ADVICE) from error
    except ValueError as error:
        raise BadFile(path, f"damaged: {error}", expected, _REBUILD_ADVICE) from error
    if dtype != np.dtype("<f4") or found != shape or fortran:
        raise BadFile(path, f"{' x '.join(map(str, found))} {dtype}", expected, _REBUILD_ADVICE)
    if size != start + shape[0] * shape[1] * dtype.itemsize:
        raise BadFile(path, f"damaged: {size} bytes", expected, _REBUILD_ADVICE)
    return np.memmap(path, dtype, "r", start, shape)
