"""Baselines: results of a run or sweep that are small enough for version control, to compare with later.

`results/baselines/NAME` has three files. The same run gives the same bytes.

- manifest.json: the manifest of the run;
- summary.json: counts and the results of each method;
- cells.json: identity and comparable metrics of every cell, sorted, one per line, without poses and frames. Conditions
  that all cells share are stored once; other conditions once for all cells that have them in common.

cells.json has the digests of the two other files, and each file has its own.
"""

import json
import os
import re
import shutil
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from harness.compare.margins import MARGINS
from harness.compare.matching import PAIRING_KEYS
from harness.core.files import (
    content_key,
    move_into_place,
    remove_leftovers,
    temporary_path,
    to_json,
    to_json_types,
    write_text,
)
from harness.core.interrupts import defer_interrupts
from harness.core.output_place import place_fault
from harness.errors import BadFile, BadInput, shorten
from harness.results import BASELINE_FILES, COUNT_METRICS, SCHEMA, ResultSet, load_results
from harness.results.files import (
    BASELINES,
    CELLS_FILE,
    file_digest,
    insert_digest,
    read_summary_json,
    require_kind,
    write_result_json,
)
from harness.score import DEFINITIONS

_SUMMARY_KEYS = ("outcome", "cells_finished", "cells_planned", "methods", "groups")
"""Keys of summary.json that a baseline keeps: a run has `methods`, a sweep has `groups`."""


def write_baseline(run: Path, name: str, folder: Path = BASELINES, force: bool = False) -> Path:
    """Save the results of a finished run or sweep as baseline `name`; returns its folder.

    BadInput for an invalid name, for a run with missing cells (nothing could be gated there) and for a baseline that
    exists, unless `force` replaces it. BadFile for a folder that is no run.
    """
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}", name):
        raise BadInput(
            f"'{shorten(name, 60)}' is not a valid name of a baseline.",
            "Use up to 100 letters, digits, - _ and ., as in main_2.",
        )
    if not run.is_dir():
        require_kind(run, "run", "sweep")
    results, target = load_results(run), folder / name
    if missing := results.planned - len(results.cells):
        raise BadInput(
            f"{run} lacks {missing} of {results.planned} cells.", "Repeat its command until all cells are finished."
        )
    if not results.cells:
        raise BadInput(f"{run} has no cells.", "A baseline needs at least one.")
    if target.exists() and not force:
        raise BadInput(f"Baseline {name} exists ({target}).", "Choose another name, or replace it with --force.")
    if fault := place_fault(folder):
        raise BadFile(target, fault, "a folder to write", "Work in another folder.")
    remove_leftovers(target)
    temporary = temporary_path(target)
    shutil.rmtree(temporary, ignore_errors=True)
    try:
        temporary.mkdir(parents=True)
        summary = read_summary_json(run)
        write_result_json(temporary / "manifest.json", results.manifest.as_dict())
        kept = {kind: summary[kind] for kind in _SUMMARY_KEYS if kind in summary}
        write_result_json(temporary / "summary.json", kept)
        advice = "Save it again."
        digests = {file: file_digest(temporary / file, "a file of a baseline", advice) for file in BASELINE_FILES}
        write_text(temporary / CELLS_FILE, insert_digest(_cells_json(name, results, digests)))
        _replace_folder(temporary, target)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return target


def _replace_folder(new: Path, target: Path) -> None:
    """Move a folder to `target`; an earlier one is put back when that fails."""
    previous = target.with_name(f".replaced-{os.getpid()}-{target.name}")  # no temporary name: those are removed
    with defer_interrupts():
        if target.exists():
            os.rename(target, previous)
        try:
            move_into_place(new, target)
        except OSError:
            if previous.exists() and not target.exists():
                os.rename(previous, target)
            raise
        finally:
            shutil.rmtree(previous, ignore_errors=True)


def _cells_json(name: str, results: ResultSet, digests: Mapping[str, str]) -> str:
    """The text of cells.json, which `load_results` reads; `digests` are those of the other files."""
    cells = sorted(results.cells, key=lambda cell: [str(to_json_types(getattr(cell, name))) for name in PAIRING_KEYS])
    definitions = [to_json_types(cell.defined_by) for cell in cells]
    first, *others = definitions
    shared = {name: first[name] for name in first if all(_shares_value(other, first, name) for other in others)}
    metrics = [
        name for name in DEFINITIONS if name in (*COUNT_METRICS, *MARGINS) and any(name in c.metrics for c in cells)
    ]
    parts, lines = {}, []
    for cell, definition in zip(cells, definitions, strict=True):
        rest = {name: definition[name] for name in sorted(definition) if name not in shared}
        part = content_key(rest)[:12]
        parts[part] = rest
        line = {
            f.name: getattr(cell, f.name) for f in fields(cell) if f.name not in ("defined_by", "metrics", "line_loss")
        }
        lines.append({**line, "part": part, "metrics": [cell.metrics.get(name) for name in metrics]})
    head = {
        "name": name,
        "schema": SCHEMA,
        "digests": digests,
        "planned": results.planned,
        "shared": shared,
        "parts": parts,
        "metrics": metrics,
    }
    rows = ",\n  ".join(json.dumps(to_json_types(line), allow_nan=False, ensure_ascii=False) for line in lines)
    return f'{to_json(head).rstrip().removesuffix("}").rstrip()},\n "cells": [\n  {rows}\n ]\n}}\n'


def _shares_value(definition: Mapping[str, Any], other: Mapping[str, Any], name: str) -> bool:
    return name in definition and bool(definition[name] == other[name])
