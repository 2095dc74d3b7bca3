"""Sides of comparisons made up in memory and as folders; no figure in here was ever measured."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.files import content_key, to_json
from harness.core.seeds import generator
from harness.results import CellIndex, CellResult, Manifest, ResultSet
from harness.results.cell import IDENTITY, TRAILING_COLUMNS
from harness.results.files import compute_digests, file_digest, insert_digest
from harness.score import DEFINITIONS, VERSIONS

SIZES = {"joint_angle_mean_deg": 2.0, "mpjpe_mm": 12.0, "jitter_m_s3": 700.0}

UNUSED: Mapping[str, Any] = {
    **dict.fromkeys((*IDENTITY, *TRAILING_COLUMNS), ""),
    "stations": [],
    "rate_hz": 40.0,
    "health": {},
    "calibration_errors": {},
}
"""Columns that comparisons do not read."""


def manifest(**circumstances: Any) -> Manifest:
    return Manifest({"name": "made_up", "seed": 1}, VERSIONS, {"commit": "abc", **circumstances})


def cell(clip: str = "walk_01", method: str = "ik", times: float = 1.0, **fields: Any) -> CellResult:
    """Errors that belong to the clip, `times` as large; other fields by name, inputs that define it in `defined_by`."""
    size = float(np.exp(generator(1, "made up", clip).normal(0.0, 0.3)))
    metrics: dict[str, Any] = dict.fromkeys(DEFINITIONS)
    metrics |= {name: times * size * of_it for name, of_it in SIZES.items()}
    metrics |= {"frames_matched": 200, "frames_expected": 200, **fields.pop("metrics", {})}
    content: dict[str, Any] = {
        "scenario": "demo",
        "clip": clip,
        "seed": 1,
        "method": method,
        "inputs": "pos+ori",
        "split": "sequence",
        "noise": "default",
        "varied": {},
        "behaviour": "walking",
        "performer": "known",
        **fields,
    }
    defined_by = {
        "clip": clip,
        "seed": content["seed"],
        "inputs": content["inputs"],
        "tracker": {"rate_hz": 40.0, "items": [40, 2]},
        "examples": {} if content["split"] == "none" else {f"walk_{n}": f"digest {n}" for n in range(6)},
        "withheld": [],
        "metric_versions": VERSIONS,
        **content.pop("defined_by", {}),
    }
    return CellResult(defined_by=defined_by, metrics=metrics, **content)


def side(
    title: str = "A",
    methods: Mapping[str, float | Sequence[float]] | None = None,
    clips: int = 8,
    failed: Sequence[str] = (),
    **fields: Any,
) -> ResultSet:
    """Method -> how many times as large its errors are as made up, on all clips or on each."""
    cells = []
    for method, times in (methods or {"ik": 1.0}).items():
        each = [times] * clips if isinstance(times, int | float) else times
        cells += [cell(f"walk_{n:02}", method, float(t), **fields) for n, t in enumerate(each)]
    return ResultSet(title, manifest(), tuple(cells), len(cells) + len(failed), tuple(failed))


def write_run(out: Path, judged: ResultSet) -> Path:
    """As far as comparisons read one."""
    out.mkdir(parents=True)
    rows = []
    for cell in judged.cells:
        identity = {name: value for name, value in vars(cell).items() if name not in ("metrics", "defined_by")}
        key = content_key(identity)
        rows.append({**UNUSED, **identity, **cell.metrics, "key": key})
        write_cell_files(out / "cells" / key, rows[-1], cell)
    names = [f"{row['method']} on {row['clip']} of {row['key']}" for row in rows]
    with CellIndex(out) as index:
        index.plan([*names, *judged.failed])
        index.add(rows)
        index.record_outcomes((name, row["key"], "") for name, row in zip(names, rows, strict=True))
        index.record_outcomes((name, "", "Traceback: no pose") for name in judged.failed)
        index.note(kind="run")
        _write(out / "manifest.json", judged.manifest.as_dict())
        (out / "summary.csv").write_text("")
        _write(out / "summary.json", _summary(judged, rows))
        index.write_digest(compute_digests(out))
    return out


def write_cell_files(folder: Path, row: Mapping[str, Any], cell: CellResult) -> None:
    """The files of a cell, without frames."""
    folder.mkdir(parents=True)
    (folder / "frames.npz").write_bytes(b"no frames")
    content = {name: row[name] for name in (*IDENTITY, *TRAILING_COLUMNS)}
    digest = file_digest(folder / "frames.npz", "", "")
    _write(
        folder / "cell.json",
        {**content, "metrics": cell.metrics, "defined_by": cell.defined_by, "frames_sha256": digest},
    )


def _summary(judged: ResultSet, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    return {
        "outcome": "incomplete" if judged.failed else "pass",
        "cells_finished": len(rows),
        "cells_planned": judged.planned,
        "failures": dict.fromkeys(judged.failed, "Traceback: no pose"),
        "methods": [],
        "behaviours": [],
        "cells": rows,
    }


def _write(path: Path, content: Mapping[str, Any]) -> None:
    """Without the flush to the disk that a run waits for."""
    path.write_text(insert_digest(to_json(content)))
