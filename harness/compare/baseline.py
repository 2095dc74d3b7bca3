"""Baselines: what a run or sweep measured, small enough to be kept under version control, to compare with later.

`results/baselines/NAME` has manifest.json, summary.json (counts and what each method came to) and cells.json: identity
and comparable metrics of every cell, sorted, in a line each; of what defines cells, what all share stands once, and the
rest once for all the cells that it is the same for. No poses and no frames. The same run gives the same bytes.
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
    read_json,
    temporary_path,
    to_json,
    to_json_types,
    write_json,
    write_text,
)
from harness.errors import BadInput
from harness.results.reader import BASELINES, CELLS_FILE, COUNT_METRICS, SCHEMA, ResultSet, load_results
from harness.score.metrics import DEFINITIONS

_SUMMARY_KEYS = ("outcome", "cells_finished", "cells_planned", "methods", "groups")
"""What is kept of a summary: a run's says what each method came to, a sweep's what each group of cells did."""


def write_baseline(run: Path, name: str, folder: Path = BASELINES, force: bool = False) -> Path:
    """Keep what a finished run or sweep measured as baseline `name`; returns its folder.

    BadInput for a name that is no plain one, for a run that is not whole (a reference with holes would gate nothing
    there) and for a baseline that exists, unless `force` replaces it. BadFile for what is no run.
    """
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", name):
        raise BadInput(f"{name!r} is no name of a baseline.", "Letters, digits, - _ and . make one, such as main_2.")
    if not run.is_dir():
        raise BadInput(f"{run} is no folder.", "Name one that `harness run` or `harness sweep` wrote.")
    judged, target = load_results(run), folder / name
    if missing := judged.planned - len(judged.cells):
        raise BadInput(
            f"{run} lacks {missing} of {judged.planned} cells.", "Give its command again until all are there."
        )
    if not judged.cells:
        raise BadInput(f"{run} has no cells.", "A baseline needs some.")
    if target.exists() and not force:
        raise BadInput(
            f"There is a baseline {name} already ({target}).", "Choose another name, or replace it with --force."
        )
    beside = temporary_path(target)
    shutil.rmtree(beside, ignore_errors=True)
    beside.mkdir(parents=True)
    summary = read_json(run / "summary.json", "the summary of a run or sweep")
    write_json(beside / "manifest.json", judged.manifest.as_dict())
    write_json(beside / "summary.json", {kind: summary[kind] for kind in _SUMMARY_KEYS if kind in summary})
    write_text(beside / CELLS_FILE, _cells_json(judged))
    before = beside.with_name(f"{beside.name}-before")
    if target.exists():
        os.rename(target, before)
    move_into_place(beside, target)
    shutil.rmtree(before, ignore_errors=True)
    return target


def _cells_json(judged: ResultSet) -> str:
    """What `judged.read_judged` reads back."""
    cells = sorted(judged.cells, key=lambda cell: [str(to_json_types(getattr(cell, name))) for name in PAIRING_KEYS])
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
        line = {f.name: getattr(cell, f.name) for f in fields(cell) if f.name not in ("defined_by", "metrics")}
        lines.append({**line, "part": part, "metrics": [cell.metrics.get(name) for name in metrics]})
    head = {"schema": SCHEMA, "planned": judged.planned, "shared": shared, "parts": parts, "metrics": metrics}
    rows = ",\n  ".join(json.dumps(to_json_types(line), allow_nan=False, ensure_ascii=False) for line in lines)
    return f'{to_json(head).rstrip().removesuffix("}").rstrip()},\n "cells": [\n  {rows}\n ]\n}}\n'


def _shares_value(one: Mapping[str, Any], other: Mapping[str, Any], name: str) -> bool:
    return name in one and bool(one[name] == other[name])
