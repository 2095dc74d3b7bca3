"""Selection of a run's finished cells by names and patterns of clips and methods."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from harness.errors import BadInput, UnknownName
from harness.results.cell import Cell
from harness.results.index import CellIndex
from harness.results.integrity import check_folder
from harness.results.storage import read_cells


def select_cells(out: Path, *, clips: Sequence[str] = (), methods: Sequence[str] = ()) -> Iterator[Cell]:
    """The finished cells of a run or sweep whose clip and method are chosen, in planned order, read one at a time.

    `clips` and `methods` are names or patterns, in which `*` stands for any text and `?` for one character; without
    any, all are chosen. A clip without a part ("13_17") stands for all its parts ("13_17@0.20-0.40"). Raises
    UnknownName for an entry that fits no finished cell, BadInput when no cell has a chosen clip and a chosen method,
    and BadFile as `read_cells`.
    """
    check_folder(out)
    with CellIndex(out, read_only=True) as index:
        cells = list(index.columns("key", "clip", "method"))
    _check_entries("clip", clips, [clip for _, clip, _ in cells])
    _check_entries("method", methods, [method for _, _, method in cells])
    keys = {key for key, clip, method in cells if _is_chosen(clip, clips) and _is_chosen(method, methods)}
    if cells and not keys:
        chosen = f"clip {', '.join(clips)} with method {', '.join(methods)}"
        raise BadInput(f"No finished cell of {out} has {chosen}.", "Each occurs, but not together.")
    return read_cells(out, keys)


def _check_entries(kind: str, entries: Sequence[str], names: Sequence[str]) -> None:
    known = tuple(dict.fromkeys(names))
    for entry in entries:
        if not any(_fits(name, entry) for name in known):
            raise UnknownName(kind, entry, known)


def _is_chosen(name: str, entries: Sequence[str]) -> bool:
    return not entries or any(_fits(name, entry) for entry in entries)


def _fits(name: str, entry: str) -> bool:
    """Whether a name fits a pattern; brackets stand for themselves, because they hold the options of a method."""
    pattern = re.escape(entry).replace(r"\*", ".*").replace(r"\?", ".")
    return any(re.fullmatch(pattern, text, re.DOTALL) for text in (name, name.partition("@")[0]))
