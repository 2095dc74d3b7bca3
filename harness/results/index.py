"""The finished cells of a folder in one SQLite file, so that 100,000 of them are counted, listed and summed up at once.

What counts are the cells' own folders: the index is made of them anew where it is missing, damaged or of another
version. Beside the cells it keeps the plan: which ones were asked for, in the order of the table, and what became of
each. One process writes, any number read meanwhile.
"""

import json
import os
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from harness.core.files import TEMPORARY, content_key, to_json_types
from harness.errors import BadFile
from harness.results.cell import IDENTITY, TRAILING_COLUMNS, read_row
from harness.score.metrics import DEFINITIONS

INDEX_FILE = "index.sqlite"
TEXTS = ("scenario", "clip", "behaviour", "method", "inputs", "split", "performer", "calibration", "noise")
"""Columns to choose by, besides `seed`."""
_COLUMNS = ("key", *TEXTS, "seed", "varied", "seconds", *DEFINITIONS, "rest")
_ROW_KEYS = (*IDENTITY, *DEFINITIONS, *TRAILING_COLUMNS, "seconds")
_VERSION = int(content_key(_COLUMNS)[:7], 16)
"""Goes into the file: an index with other columns is made anew."""
_PLAN_COLUMNS = "place INTEGER PRIMARY KEY, cell TEXT UNIQUE, key TEXT, failure TEXT"
_KEYS_PER_QUERY = 500
"""Keys in one question."""


@dataclass(frozen=True)
class CellCounts:
    """What became of the plan."""

    planned: int
    finished: int
    failed: int


class CellIndex:
    """A folder's index, to be closed; `read_only` for whoever looks on while another process writes."""

    def __init__(self, out: Path, *, read_only: bool = False) -> None:
        """BadFile when there is none to read."""
        self.path, self._cells = out / INDEX_FILE, out / "cells"
        if read_only:
            self._db = self._opened_to_read()
        else:
            try:
                self._db = self._opened()
            except sqlite3.DatabaseError:  # damaged: all that is in it can be had again
                self._remove()
                self._db = self._opened()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._db.close()

    def add(self, rows: Iterable[Mapping[str, Any]], seconds: Iterable[float | None] | None = None) -> None:
        """Rows as `cell.as_row` has them, and how long each took; one that is there already stays as it is."""
        rows = list(rows)
        took = [None] * len(rows) if seconds is None else list(seconds)
        holes = ", ".join("?" * len(_COLUMNS))
        columns = (_as_columns(row, took_s) for row, took_s in zip(rows, took, strict=True))
        with self._db:
            self._db.executemany(f"INSERT OR IGNORE INTO cells VALUES ({holes})", columns)  # noqa: S608  # holes alone

    def add_from_folders(self) -> int:
        """Add the finished cells that lie in the folder and are not here; how many. Those of older versions, which
        nobody can ask for any more, are left out."""
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
        """Keys of the cells that are finished, whether they are here or not yet."""
        try:
            with os.scandir(self._cells) as entries:
                return {entry.name for entry in entries if not entry.name.startswith(TEMPORARY)}
        except FileNotFoundError:
            return set()

    def expect(self, cells: Sequence[str]) -> None:
        """Put cells at the end of the plan, by name; those that stand in it already stay where they are."""
        with self._db:
            self._db.executemany("INSERT OR IGNORE INTO plan (cell) VALUES (?)", ((cell,) for cell in cells))

    def reset(self, cells: Sequence[str]) -> None:
        """Nothing is known of these cells of the plan any more."""
        with self._db:
            self._db.executemany(
                "UPDATE plan SET key = NULL, failure = NULL WHERE cell = ?", ((cell,) for cell in cells)
            )

    def plan(self, cells: Sequence[str]) -> None:
        """These cells in this order are the plan, and no others; what is known of them is kept."""
        known = {cell: rest for cell, *rest in self._db.execute("SELECT cell, key, failure FROM plan")}
        with self._db:
            self._db.execute("DELETE FROM plan")
            self._db.executemany(
                "INSERT INTO plan (cell, key, failure) VALUES (?, ?, ?)",
                ((cell, *known.get(cell, (None, None))) for cell in cells),
            )

    def record_outcomes(self, what: Iterable[tuple[str, str, str]]) -> None:
        """(cell, key, failure) of cells of the plan; one of the two is empty."""
        with self._db:
            self._db.executemany(
                "UPDATE plan SET key = nullif(?, ''), failure = nullif(?, '') WHERE cell = ?",
                ((key, failure, cell) for cell, key, failure in what),
            )

    def counts(self) -> CellCounts:
        """Of the plan, as far as it was written down."""
        row = self._db.execute("SELECT count(*), count(key), count(failure) FROM plan").fetchone()
        return CellCounts(*row)

    def failures(self) -> dict[str, str]:
        """Cell -> why it has no result, in planned order."""
        question = "SELECT cell, failure FROM plan WHERE failure IS NOT NULL ORDER BY place"
        return dict(self._db.execute(question).fetchall())

    def unwritten(self) -> int:
        """Finished cells in the folder of which nothing is here: of a process that goes on, or was killed."""
        known = {key for (key,) in self._db.execute("SELECT key FROM cells")}
        return len(self.folders() - known)

    def rows(self, **where: Any) -> Iterator[dict[str, Any]]:
        """The plan's finished cells in planned order, those whose columns (`TEXTS`, `seed`) are as `where` says."""
        if strange := [name for name in where if name not in (*TEXTS, "seed")]:
            raise ValueError(f"no column {strange[0]!r}")
        chosen = "".join(f" AND {name} = ?" for name in where)
        question = f"SELECT cells.* FROM plan JOIN cells USING (key) WHERE 1{chosen} ORDER BY place"  # noqa: S608  # known names
        return map(_as_row, self._db.execute(question, tuple(where.values())))

    def rows_of(self, keys: Sequence[str]) -> Iterator[dict[str, Any]]:
        """These cells, in this order; KeyError for one that is not here."""
        for start in range(0, len(keys), _KEYS_PER_QUERY):
            some = keys[start : start + _KEYS_PER_QUERY]
            question = f"SELECT * FROM cells WHERE key IN ({', '.join('?' * len(some))})"  # noqa: S608  # holes alone
            found = {columns[0]: columns for columns in self._db.execute(question, some)}
            yield from (_as_row(found[key]) for key in some)

    def columns(self, *names: str) -> Iterator[tuple[Any, ...]]:
        """Some columns of the plan's finished cells in planned order; `varied` is JSON."""
        if strange := [name for name in names if name not in _COLUMNS]:
            raise ValueError(f"no column {strange[0]!r}")
        chosen = ", ".join(f"cells.{name}" for name in names)
        question = f"SELECT {chosen} FROM plan JOIN cells USING (key) ORDER BY place"  # noqa: S608  # known names
        return iter(self._db.execute(question))

    def note(self, **facts: Any) -> None:
        """Keep facts about the work, in JSON's types."""
        with self._db:
            self._db.executemany(
                "INSERT OR REPLACE INTO facts VALUES (?, ?)",
                ((name, json.dumps(to_json_types(value))) for name, value in facts.items()),
            )

    def facts(self) -> dict[str, Any]:
        return {name: json.loads(value) for name, value in self._db.execute("SELECT name, value FROM facts")}

    def _opened(self) -> sqlite3.Connection:
        db = sqlite3.connect(self.path, timeout=30.0)
        try:
            if db.execute("PRAGMA user_version").fetchone()[0] not in (0, _VERSION):
                raise sqlite3.DatabaseError("another version")
            db.execute("PRAGMA journal_mode = WAL")
            db.execute("PRAGMA synchronous = NORMAL")  # a crash of the machine may cost rows, which are in the folders
            with db:
                db.execute(f"CREATE TABLE IF NOT EXISTS cells ({', '.join(map(_column_declaration, _COLUMNS))})")
                db.execute(f"CREATE TABLE IF NOT EXISTS plan ({_PLAN_COLUMNS})")
                db.execute("CREATE TABLE IF NOT EXISTS facts (name TEXT PRIMARY KEY, value TEXT)")
                db.execute(f"PRAGMA user_version = {_VERSION}")
        except sqlite3.DatabaseError:
            db.close()
            raise
        return db

    def _opened_to_read(self) -> sqlite3.Connection:
        expected, advice = "the index of a sweep", "Give the command of the sweep again; finished cells are kept."
        if not self.path.is_file():
            raise BadFile(self.path, "no such file", expected, advice)
        db = sqlite3.connect(f"{self.path.absolute().as_uri()}?mode=ro", uri=True, timeout=30.0)
        try:
            version = db.execute("PRAGMA user_version").fetchone()[0]
        except sqlite3.DatabaseError as error:
            db.close()
            raise BadFile(self.path, str(error), expected, advice) from error
        if version != _VERSION:
            db.close()
            raise BadFile(self.path, "another version", expected, advice)
        return db

    def _remove(self) -> None:
        for path in self.path.parent.glob(f"{INDEX_FILE}*"):
            path.unlink()


def _column_declaration(column: str) -> str:
    if column in DEFINITIONS:
        return f"{column} {'INTEGER' if DEFINITIONS[column].unit == 'frames' else 'REAL'}"
    kinds = {"key": "TEXT PRIMARY KEY", "seed": "INTEGER", "seconds": "REAL"}
    return f"{column} {kinds.get(column, 'TEXT')}"


def _as_columns(row: Mapping[str, Any], seconds: float | None) -> tuple[Any, ...]:
    rest = _json({name: value for name, value in row.items() if name not in _COLUMNS})
    held = {**row, "varied": _json(row["varied"]), "seconds": seconds, "rest": rest}
    return tuple(held.get(name) for name in _COLUMNS)


def _as_row(columns: Sequence[Any]) -> dict[str, Any]:
    """As it was added, and `seconds`."""
    held = dict(zip(_COLUMNS, columns, strict=True))
    held |= {**json.loads(held.pop("rest")), "varied": json.loads(held["varied"])}
    return {name: held[name] for name in _ROW_KEYS}


def _json(value: Any) -> str:
    return json.dumps(to_json_types(value), separators=(",", ":"), ensure_ascii=False)
