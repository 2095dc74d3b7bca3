"""Changes inside of archives, recordings and databases that leave their checksums right, so that readers go on."""

import io
import json
import random
import sqlite3
import struct
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from harness.stream.recording import CONFIGURED, FILE_HEADER, RECEIVED, RecordingBlock, encode_block, read_blocks
from tests.fuzz.changes import BYTES, Change, change_json, json_value

_SHAPES = ("(10**12,)", "(1000000000000,)", "(-1, 3)", "(2, 3", "(0,)", "()", "(3,)", "(True,)", "(" * 3000, "9" * 5000)
_KINDS = ("conf", "evnt", "note", "recv", "sent", "body", "pose", "mark", "\xff\0\0\0")
_TYPES = ("<f8", "|O", "<U9", "<c16", "|b1", "<f2", "|V8", ">f8", "<M8[s]", "", "x", "<f8'*9", "<i8", "<U99999999999")


def change_npz(data: bytes, rng: random.Random) -> bytes:
    """Another array, name, type or header in an archive of arrays."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        files = {info.filename: archive.read(info) for info in archive.infolist()}
    name = rng.choice(sorted(files))
    way = rng.randrange(8)
    if way == 0:
        del files[name]
    elif way == 1:
        files[rng.choice(sorted(files))] = files[name]
    elif way == 2:
        files[name] = rng.choice(BYTES)(files[name], rng)
    elif way == 3:
        files[name] = _npy_header(rng)
    else:
        array = np.load(io.BytesIO(files[name]), allow_pickle=False)
        files[name] = _npy(_change_array(array, rng))
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as archive:
        for entry, content in files.items():
            archive.writestr(entry, content)
    return packed.getvalue()


def _npy_header(rng: random.Random) -> bytes:
    """A header with a shape and a type of its own, and little behind it."""
    order = rng.choice(("False", "True", "1"))
    text = f"{{'descr': '{rng.choice(_TYPES)}', 'fortran_order': {order}, 'shape': {rng.choice(_SHAPES)}, }}\n"
    if rng.random() < 0.2:
        text = rng.choice(("[" * 5000, "{" * 100, "", "\0", "{'descr': [('a', '<f8'), ('a', '<f8')]}", "L" * 9000))
    version = rng.choice(((1, 0), (2, 0), (3, 0), (9, 9)))
    length = struct.pack("<H" if version == (1, 0) else "<I", len(text) + rng.choice((0, 0, 0, 60000)))
    return b"\x93NUMPY" + bytes(version) + length + text.encode("latin-1") + bytes(24)


def _change_array(array: np.ndarray[Any, Any], rng: random.Random) -> np.ndarray[Any, Any]:
    way = rng.randrange(7)
    if way == 0:
        return np.array([{"a": 1}, None], dtype=object)
    if way == 1:
        with np.errstate(all="ignore"):
            return array.astype(rng.choice(("U9", "c16", "f2", "i8", "u1", "bool", "S3", "f4")))
    if way == 2:
        return array[..., None]
    if way == 3:
        return array.reshape(-1)[: rng.randrange(array.size + 1)]
    if array.dtype.kind != "f" or not array.size:
        return np.zeros(array.shape, array.dtype)
    changed = array.astype(float)
    many = rng.randrange(changed.size) if way == 4 else slice(None)
    changed.flat[many] = rng.choice((np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, -1.0, 1e7))
    with np.errstate(all="ignore"):
        return changed.astype(array.dtype)


def _npy(array: np.ndarray[Any, Any]) -> bytes:
    out = io.BytesIO()
    np.save(out, array, allow_pickle=True)
    return out.getvalue()


def change_recording(data: bytes, rng: random.Random) -> bytes:
    """Other payloads, times, kinds and orders of blocks whose checksums are right."""
    header = data[: len(FILE_HEADER)] if data.startswith(FILE_HEADER[:8]) else FILE_HEADER
    blocks = [block for block in read_blocks(data) if isinstance(block, RecordingBlock)]
    for _ in range(rng.choice((1, 1, 2, 5))):
        here = rng.randrange(len(blocks)) if rng.random() < 0.5 else rng.choice(_few_by_kind(blocks))
        blocks[here : here + 1] = _change_block(blocks[here], rng)
        if not blocks:
            return header
    if rng.random() < 0.1:
        rng.shuffle(blocks)
    return header + b"".join(map(encode_block, blocks))


def _few_by_kind(blocks: list[RecordingBlock]) -> list[int]:
    """Places of the blocks that do not hold received bytes, which are few."""
    return [place for place, block in enumerate(blocks) if block.kind != RECEIVED] or [0]


def _change_block(block: RecordingBlock, rng: random.Random) -> list[RecordingBlock]:
    way = rng.randrange(6)
    if way == 0:
        return []
    if way == 1:
        return [block, block]
    if way == 2:
        times = (float("nan"), float("inf"), -1.0, 1e308, 0.0, block.monotonic_s + 1e6, block.monotonic_s - 1e6)
        return [RecordingBlock(block.kind, rng.choice(times), rng.choice(times), block.payload)]
    if way == 3:
        return [RecordingBlock(rng.choice(_KINDS), 1.0, 1.0, block.payload)]
    payload = block.payload
    if block.kind == RECEIVED or way == 4:
        return [RecordingBlock(block.kind, block.monotonic_s, block.wall_s, rng.choice(BYTES)(payload, rng)[:60000])]
    payload = change_json(payload, rng)[:65536] if payload[:1] == b"{" else payload
    return [RecordingBlock(block.kind if rng.random() < 0.9 else CONFIGURED, block.monotonic_s, block.wall_s, payload)]


def change_database(data: bytes, rng: random.Random) -> bytes:
    """Other values, types and tables in a SQLite file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "x.sqlite"
        path.write_bytes(data)
        db = sqlite3.connect(path, isolation_level=None)
        db.execute("PRAGMA journal_mode = DELETE")
        tables = [name for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
        for _ in range(rng.choice((1, 1, 3))):
            _change_table(db, rng.choice(tables), rng)
        db.close()
        return path.read_bytes()


def _change_table(db: sqlite3.Connection, table: str, rng: random.Random) -> None:
    way = rng.randrange(10)
    columns = [row[1] for row in db.execute(f"PRAGMA table_info({table})")]
    if way == 0:
        db.execute(f"DROP TABLE IF EXISTS {table}")
    elif way == 1:
        db.execute(f"PRAGMA user_version = {rng.choice((0, 1, 2**31 - 1))}")
    elif way == 2 and columns:
        db.execute(f"ALTER TABLE {table} RENAME COLUMN {rng.choice(columns)} TO other")
    elif way == 3:
        db.execute(f"DELETE FROM {table} WHERE rowid % 2 = 0")  # noqa: S608  # known names
    elif columns:
        value = json_value(rng)
        if isinstance(value, dict | list):
            value = json.dumps(value)
        if isinstance(value, int) and abs(value) >= 2**63:
            value = float("inf")
        if isinstance(value, str):
            value = rng.choice((value.encode(errors="surrogatepass").decode("latin-1"), "{", "[1]", "\0"))
        if rng.random() < 0.2:
            value = b"\xff\xfe"
        where = "" if rng.random() < 0.3 else "WHERE rowid = 1"
        db.execute(f"UPDATE OR IGNORE {table} SET {rng.choice(columns)} = ? {where}", (value,))  # noqa: S608  # known names
        if rng.random() < 0.1:  # text that is not UTF-8
            db.execute(f"UPDATE OR IGNORE {table} SET {rng.choice(columns)} = CAST(x'fffe41' AS TEXT) {where}")  # noqa: S608  # known names


NPZ: tuple[Change, ...] = (*BYTES, *(change_npz,) * 12)
RECORDING: tuple[Change, ...] = (*BYTES, *(change_recording,) * 14)
DATABASE: tuple[Change, ...] = (*BYTES, *(change_database,) * 8)
