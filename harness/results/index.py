"""Index of a folder's cells in one SQLite file, so that 100,000 of them are counted, listed and summarised in seconds.

The cells' own folders are authoritative: an index that is missing, damaged or of another version is rebuilt from them.
Besides the cells it holds the plan (the planned cells in the order of the table, and the outcome of each) and facts
about the work. One process writes, any number may read meanwhile. A process that has finished leaves a digest of the
whole content; there is none while a process writes, and after one was killed.
"""

import hashlib
import json
import os
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

from harness.core.files import TEMPORARY, content_key, flush, to_json_types
from harness.core.input_file import check_input_file
from harness.core.parsing import parse_json
from harness.errors import BadFile
from harness.results.cell import IDENTITY, OPTIONAL_COLUMNS, TRAILING_COLUMNS, read_row
from harness.score import DEFINITIONS

INDEX_FILE = "index.sqlite"
TEXTS = (
    *("scenario", "clip", "behaviour", "method", "inputs", "split", "performer", "calibration", "noise"),
    *("motion_source", "mount"),
)
"""Text columns that rows can be selected by, besides `seed`."""
_JSON_COLUMNS = ("varied", "stations")
_COLUMNS = ("key", *TEXTS, "seed", "rate_hz", *_JSON_COLUMNS, "seconds", *DEFINITIONS, "rest")
_ROW_KEYS = (*IDENTITY, *DEFINITIONS, *TRAILING_COLUMNS)
_TABLES = {"plan": "place", "cells": "key", "facts": "name", "digests": "file"}
"""Table -> the column that it is sorted by for the digest."""
_VERSION = int(content_key([_COLUMNS, list(_TABLES)])[:7], 16)
"""Version number in the file. An index with other columns or tables is rebuilt."""
_ADVICE = "Give its command again; finished cells are kept."
_PLAN_COLUMNS = "place INTEGER PRIMARY KEY, cell TEXT UNIQUE, key TEXT, failure TEXT"
_STORAGE_ERRORS = ("SQLITE_FULL", "SQLITE_IOERR", "SQLITE_READONLY", "SQLITE_CANTOPEN")
"""Beginnings of the names of errors that lie in the disk or the folder and not in the file."""
_DECLARATIONS = {"key": "TEXT PRIMARY KEY", "seed": "INTEGER", "rate_hz": "REAL", "seconds": "REAL"}
_FACTS = {
    **dict.fromkeys(("kind", "name", "command"), str),
    **dict.fromkeys(("made", "started_s", "seen_s"), int | float),
}
"""Types of the facts that readers use."""
_MAX_BYTES = 2**34
"""Largest index that is opened; it is not read into memory."""
_DAMAGE = (sqlite3.DatabaseError, UnicodeDecodeError)
"""What a damaged file raises; the second one for the name of a column that is not UTF-8."""
_KEYS_PER_QUERY = 500
"""Number of keys in one SQL query."""


class CellCounts(NamedTuple):
    """Counts of the planned cells by outcome."""

    planned: int
    finished: int
    failed: int


class CellIndex:
    """The index of a folder; a context manager. `read_only` is for readers while another process writes."""

    def __init__(self, out: Path, *, read_only: bool = False) -> None:
        """BadFile when there is no index to read."""
        self.path, self._cells = out / INDEX_FILE, out / "cells"
        if read_only:
            self._db = self._open_read_only()
        else:
            try:
                self._db = self._open()
            except _DAMAGE as error:  # damaged, edited or of another version: it is rebuilt
                if _is_storage_error(error):
                    raise
                self._remove()
                self._db = self._open()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._db.close()

    def add(self, rows: Iterable[Mapping[str, Any]], seconds: Iterable[float | None] | None = None) -> None:
        """Add rows as `cell.as_row` gives them, and the wall time of each [s].

        A row that exists is replaced. Its time stays where no other is given.
        """
        rows = list(rows)
        took = [None] * len(rows) if seconds is None else list(seconds)
        holes = ", ".join("?" * len(_COLUMNS))
        columns = (_as_columns(row, took_s) for row, took_s in zip(rows, took, strict=True))
        replaced = ", ".join(f"{name} = excluded.{name}" for name in _COLUMNS if name not in ("key", "seconds"))
        replaced += ", seconds = coalesce(excluded.seconds, seconds)"
        statement = f"INSERT INTO cells VALUES ({holes}) ON CONFLICT (key) DO UPDATE SET {replaced}"  # noqa: S608  # known names
        with self._db:
            self._db.executemany(statement, columns)

    def add_from_folders(self) -> int:
        """Add the finished cells of the folder that the index lacks; returns their number.

        Cells of older versions are left out, because no plan can ask for them any more.
        """
        known = {key for (key,) in self._db.execute("SELECT key FROM cells")}
        found = []
        for key in sorted(self.folders() - known):
            try:
                found.append(read_row(self._cells / key))
            except BadFile:
                continue
        self.add(found)
        return len(found)

    def folders(self) -> set[str]:
        """Keys of the finished cells in the folder, whether or not the index has them."""
        try:
            with os.scandir(self._cells) as entries:
                return {entry.name for entry in entries if not entry.name.startswith(TEMPORARY)}
        except FileNotFoundError:
            return set()

    def expect(self, cells: Sequence[str]) -> None:
        """Append cells to the plan by name; planned cells keep their place."""
        with self._db:
            self._db.executemany("INSERT OR IGNORE INTO plan (cell) VALUES (?)", ((cell,) for cell in cells))

    def reset(self, cells: Sequence[str]) -> None:
        """Forget the outcomes of these planned cells."""
        with self._db:
            self._db.executemany(
                "UPDATE plan SET key = NULL, failure = NULL WHERE cell = ?", ((cell,) for cell in cells)
            )

    def plan(self, cells: Sequence[str]) -> None:
        """Replace the plan by these cells in this order; their outcomes are kept."""
        outcomes = {cell: rest for cell, *rest in self._db.execute("SELECT cell, key, failure FROM plan")}
        with self._db:
            self._db.execute("DELETE FROM plan")
            self._db.executemany(
                "INSERT INTO plan (cell, key, failure) VALUES (?, ?, ?)",
                ((cell, *outcomes.get(cell, (None, None))) for cell in cells),
            )

    def record_outcomes(self, what: Iterable[tuple[str, str, str]]) -> None:
        """Record (cell, key, failure) of planned cells; either key or failure is empty."""
        with self._db:
            self._db.executemany(
                "UPDATE plan SET key = nullif(?, ''), failure = nullif(?, '') WHERE cell = ?",
                ((key, failure, cell) for cell, key, failure in what),
            )

    def counts(self) -> CellCounts:
        """Counts of the planned cells, as far as outcomes were recorded."""
        (row,) = self._select("SELECT count(*), count(key), count(failure) FROM plan")
        return CellCounts(*row)

    def failures(self) -> dict[str, str]:
        """Failed cell -> reason, in planned order."""
        self._check_types("plan", ("cell", "key", "failure"))
        return dict(self._select("SELECT cell, failure FROM plan WHERE failure IS NOT NULL ORDER BY place"))

    def unwritten(self) -> int:
        """Number of finished cells in the folder that the index lacks, because a process runs or was killed."""
        known = {key for (key,) in self._select("SELECT key FROM cells")}
        return len(self.folders() - known)

    def rows(self, **where: Any) -> Iterator[dict[str, Any]]:
        """Rows of the plan's finished cells in planned order whose columns (`TEXTS`, `seed`) equal `where`."""
        if strange := [name for name in where if name not in (*TEXTS, "seed")]:
            raise ValueError(f"no column {strange[0]!r}")
        chosen = "".join(f" AND {name} = ?" for name in where)
        question = f"SELECT cells.* FROM plan JOIN cells USING (key) WHERE 1{chosen} ORDER BY place"  # noqa: S608  # known names
        return map(self._as_row, self._select(question, tuple(where.values())))

    def rows_of(self, keys: Sequence[str]) -> Iterator[dict[str, Any]]:
        """Rows of these cells in this order; KeyError for a cell that the index lacks."""
        for start in range(0, len(keys), _KEYS_PER_QUERY):
            some = keys[start : start + _KEYS_PER_QUERY]
            question = f"SELECT * FROM cells WHERE key IN ({', '.join('?' * len(some))})"  # noqa: S608  # holes alone
            found = {columns[0]: columns for columns in self._db.execute(question, some)}
            yield from (self._as_row(found[key]) for key in some)

    def columns(self, *names: str) -> Iterator[tuple[Any, ...]]:
        """Columns of the plan's finished cells in planned order; `varied` and `stations` are JSON."""
        if strange := [name for name in names if name not in _COLUMNS]:
            raise ValueError(f"no column {strange[0]!r}")
        chosen = ", ".join(f"cells.{name}" for name in names)
        question = f"SELECT {chosen} FROM plan JOIN cells USING (key) ORDER BY place"  # noqa: S608  # known names
        self._check_types("cells", names)
        return self._select(question)

    def optional(self) -> Iterator[dict[str, Any]]:
        """`cell.OPTIONAL_COLUMNS` of the plan's finished cells in planned order."""
        for (text,) in self.columns("rest"):
            rest = self._parse(text) if any(f'"{name}":' in text for name in OPTIONAL_COLUMNS) else {}
            yield {name: rest.get(name, default) for name, default in OPTIONAL_COLUMNS.items()}

    def note(self, **facts: Any) -> None:
        """Store facts about the work, as values of JSON's types."""
        with self._db:
            self._db.executemany(
                "INSERT OR REPLACE INTO facts VALUES (?, ?)",
                ((name, json.dumps(to_json_types(value))) for name, value in facts.items()),
            )

    def write_digest(self, files: Mapping[str, str]) -> None:
        """Store the digests of other files of the folder, and then that of the whole index.

        The names of the finished cells are flushed to the disk before.
        """
        if self._cells.is_dir():
            flush(self._cells)
        with self._db:
            self._db.executemany("INSERT OR REPLACE INTO digests VALUES (?, ?)", files.items())
            self._db.execute("INSERT OR REPLACE INTO digests VALUES (?, ?)", (INDEX_FILE, _content_digest(self._db)))

    def check_digest(self) -> dict[str, str] | None:
        """The digests of other files of the folder; None while a process writes and after one was killed.

        BadFile when the content of the index does not fit its digest.
        """
        expected = "the index of a run or sweep"
        try:
            self._db.execute("BEGIN")  # another process may write between two statements
            digests = dict(self._db.execute("SELECT file, sha256 FROM digests").fetchall())
            fits = digests.get(INDEX_FILE) in (None, _content_digest(self._db))
            self._db.rollback()
        except _DAMAGE as error:
            raise BadFile(self.path, f"damaged: {error}", expected, _ADVICE) from error
        if not fits:
            raise BadFile(self.path, "damaged or edited: its content does not fit its digest", expected, _ADVICE)
        return digests if digests.pop(INDEX_FILE, None) else None

    def facts(self) -> dict[str, Any]:
        self._check_types("facts", ("name", "value"))
        facts = {name: self._parse(value) for name, value in self._select("SELECT name, value FROM facts")}
        for name, kind in _FACTS.items():
            if name in facts and (not isinstance(facts[name], kind) or isinstance(facts[name], bool)):
                raise self._damage(f"the fact {name} is {facts[name]!r:.40}")
        return facts

    def _select(self, question: str, values: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
        """Rows of a query; BadFile for a damaged file, also in the middle of the rows."""
        try:
            for row in self._db.execute(question, values):  # noqa: UP028  # `yield from` closes cursors of a closed index
                yield row
        except _DAMAGE as error:
            if _is_storage_error(error):
                raise
            raise self._damage(str(error)) from error

    def _check_types(self, table: str, columns: Sequence[str]) -> None:
        """BadFile when a value of these columns has another type than its column; SQLite itself allows any."""
        faults = " OR ".join(f"typeof({name}) NOT IN ({_column_types(name)})" for name in columns)
        found = list(self._select(f"SELECT {', '.join(columns)} FROM {table} WHERE {faults} LIMIT 1"))  # noqa: S608  # known names
        if found:
            raise self._damage(f"a row of {table} with values of another type")
        for name in (name for name in _JSON_COLUMNS if name in columns):
            for (text,) in self._select(f"SELECT DISTINCT {name} FROM {table}"):  # noqa: S608  # known names
                if not isinstance(self._parse(text or "[]"), dict if name == "varied" else list):
                    raise self._damage(f"a row of {table} whose {name} is {text!r:.40}")

    def _parse(self, text: Any) -> Any:
        try:
            return parse_json(text)
        except (ValueError, TypeError) as error:
            raise self._damage(str(error)) from error

    def _as_row(self, columns: Sequence[Any]) -> dict[str, Any]:
        """The row as it was added, and `seconds`."""
        values = dict(zip(_COLUMNS, columns, strict=True))
        rest = self._parse(values.pop("rest"))
        values |= {name: self._parse(values[name] or "null") for name in _JSON_COLUMNS}
        if not isinstance(rest, dict):
            raise self._damage(f"the row of cell {values['key']!s:.40} has no table")
        values |= rest
        if missing := [name for name in _ROW_KEYS if name not in values]:
            raise self._damage(f"the row of cell {values['key']!s:.40} has no {missing[0]}")
        values = {**OPTIONAL_COLUMNS, **values}
        return {name: values[name] for name in (*_ROW_KEYS, *OPTIONAL_COLUMNS, "seconds")}

    def _damage(self, found: str) -> BadFile:
        return BadFile(self.path, f"damaged ({found})", "the index of a run or sweep", _ADVICE)

    def _open(self) -> sqlite3.Connection:
        db = sqlite3.connect(self.path, timeout=30.0)
        try:
            if db.execute("PRAGMA user_version").fetchone()[0] not in (0, _VERSION):
                raise sqlite3.DatabaseError("another version")
            db.execute("PRAGMA journal_mode = WAL")
            db.execute("PRAGMA synchronous = NORMAL")  # a crash of the machine may lose rows, which the folders have
            with db:
                db.execute(f"CREATE TABLE IF NOT EXISTS cells ({', '.join(map(_column_declaration, _COLUMNS))})")
                db.execute(f"CREATE TABLE IF NOT EXISTS plan ({_PLAN_COLUMNS})")
                db.execute("CREATE TABLE IF NOT EXISTS facts (name TEXT PRIMARY KEY, value TEXT)")
                db.execute("CREATE TABLE IF NOT EXISTS digests (file TEXT PRIMARY KEY, sha256 TEXT)")
                db.execute(f"PRAGMA user_version = {_VERSION}")
                own = db.execute("SELECT sha256 FROM digests WHERE file = ?", (INDEX_FILE,)).fetchone()
                if own and own[0] != _content_digest(db):
                    raise sqlite3.DatabaseError("edited")
                db.execute("DELETE FROM digests")
        except _DAMAGE:
            db.close()
            raise
        return db

    def _open_read_only(self) -> sqlite3.Connection:
        expected = "the index of a run or sweep of this version of the harness"
        check_input_file(self.path, expected, _MAX_BYTES, _ADVICE)
        for end in ("-wal", "-shm"):  # SQLite would open these too
            if os.path.lexists(beside := self.path.with_name(self.path.name + end)):
                check_input_file(beside, expected, _MAX_BYTES, _ADVICE)
        # Of a folder that cannot be written, SQLite reads the file alone; nobody can be writing there.
        alone = "" if os.access(self.path.parent, os.W_OK) or self._has_log() else "&immutable=1"
        db = sqlite3.connect(f"{self.path.absolute().as_uri()}?mode=ro{alone}", uri=True, timeout=30.0)
        try:
            version = db.execute("PRAGMA user_version").fetchone()[0]
        except _DAMAGE as error:
            db.close()
            raise BadFile(self.path, str(error), expected, _ADVICE) from error
        if version != _VERSION:
            db.close()
            raise BadFile(self.path, "another version", expected, _ADVICE)
        return db

    def _has_log(self) -> bool:
        """Whether changes lie beside the file, as while another process writes."""
        return self.path.with_name(f"{INDEX_FILE}-wal").exists()

    def _remove(self) -> None:
        for path in self.path.parent.glob(f"{INDEX_FILE}*"):
            path.unlink()


def _content_digest(db: sqlite3.Connection) -> str:
    """SHA-256 of all rows of all tables but this digest."""
    state = hashlib.sha256()
    for table, order in _TABLES.items():
        for row in db.execute(f"SELECT * FROM {table} ORDER BY {order}"):  # noqa: S608  # known names
            if row[0] != INDEX_FILE:
                state.update(repr(row).encode())
    return state.hexdigest()


def _is_storage_error(error: Exception) -> bool:
    """Whether the disk or the folder is at fault, and not the content of the file."""
    return getattr(error, "sqlite_errorname", "").startswith(_STORAGE_ERRORS)


def _column_declaration(column: str) -> str:
    if column in DEFINITIONS:
        return f"{column} {'INTEGER' if DEFINITIONS[column].unit == 'frames' else 'REAL'}"
    return f"{column} {_DECLARATIONS.get(column, 'TEXT')}"


def _column_types(column: str) -> str:
    """The SQLite types that values of a column may have, as a list in SQL."""
    if column in DEFINITIONS or column in ("rate_hz", "seconds"):
        return "'integer', 'real', 'null'"
    return "'integer', 'null'" if column == "seed" else "'text', 'null'"


def _as_columns(row: Mapping[str, Any], seconds: float | None) -> tuple[Any, ...]:
    rest = {name: value for name, value in row.items() if name not in _COLUMNS}
    rest = {
        name: value for name, value in rest.items() if name not in OPTIONAL_COLUMNS or value != OPTIONAL_COLUMNS[name]
    }
    texts = {name: _json(row[name]) for name in _JSON_COLUMNS if name in row}
    values = {**row, **texts, "seconds": seconds, "rest": _json(rest)}
    return tuple(values.get(name) for name in _COLUMNS)


def _json(value: Any) -> str:
    return json.dumps(to_json_types(value), separators=(",", ":"), ensure_ascii=False)
