"""Many cells as one table: a row for each, and what the cells of each method come to in each place of a sweep."""

import csv
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.files import write_parts
from harness.results.index import CellIndex
from harness.results.summary import FIRST_METRICS
from harness.score.metrics import DEFINITIONS

LEADING_COLUMNS = (
    "scenario",
    "clip",
    "behaviour",
    "method",
    "inputs",
    "split",
    "performer",
    "calibration",
    "noise",
    "seed",
)
METRIC_COLUMNS = (*FIRST_METRICS, *(name for name in DEFINITIONS if name not in FIRST_METRICS))
TIME_COLUMNS = (*(n for n in METRIC_COLUMNS if n.startswith(("step_", "first_step_"))), "fps", "seconds")
"""Columns that are never twice the same."""
SUMMARY_METRICS = (
    "joint_angle_mean_deg",
    "mpjre_deg",
    "mpjpe_mm",
    "mpjpe_root_mm",
    "jitter_m_s3",
    "coverage",
    "step_p50_ms",
)
"""Metrics of the summary; the table has the rest."""
TABLE_GROUP_KEYS = ("scenario", "method", "inputs", "split", "performer", "varied")
"""Cells that differ in these are never pooled."""


def write_table(index: CellIndex, path: Path) -> None:
    """The plan's finished cells in planned order; a column `vary.KEY` for each key, empty where a metric was not
    measured. The same cells give the same bytes, apart from `TIME_COLUMNS`."""
    write_parts(path, _csv_lines(index))


def _csv_lines(index: CellIndex) -> Iterator[str]:
    texts = sorted({text for (text,) in index.columns("varied")})
    varied = {text: json.loads(text) for text in texts}
    keys = list(dict.fromkeys(key for values in varied.values() for key in values))
    values = {
        text: [_format_value(found[key]) if key in found else "" for key in keys] for text, found in varied.items()
    }
    lines, places = _LastLineWriter(), len(LEADING_COLUMNS)
    table = csv.writer(lines, lineterminator="\n")
    table.writerow([*LEADING_COLUMNS, *(f"vary.{key}" for key in keys), *METRIC_COLUMNS, "key", "seconds"])
    yield lines.last
    for columns in index.columns(*LEADING_COLUMNS, "varied", "key", "seconds", *METRIC_COLUMNS):
        first, (text, key, seconds), figures = columns[:places], columns[places : places + 3], columns[places + 3 :]
        table.writerow([*first, *values[text]])
        yield f"{lines.last[:-1]},{_format_numbers(figures)},{key},{_format_numbers((seconds,))}\n"


class _LastLineWriter:
    """What a csv writer wrote last."""

    last = ""

    def write(self, line: str) -> None:
        self.last = line


def _format_value(value: Any) -> str:
    """One value of a key; lists of names as tables have them."""
    if isinstance(value, list) and all(isinstance(name, str) for name in value):
        return "+".join(value)
    return value if isinstance(value, str) else json.dumps(value, separators=(",", ":"))


def _format_numbers(values: Sequence[float | None]) -> str:
    """Nine digits of each, empty where there is none; all at once, for there are millions."""
    try:
        return ",".join(["%.9g"] * len(values)) % tuple(values)
    except TypeError:
        return ",".join("" if value is None else f"{value:.9g}" for value in values)


def compute_group_statistics(index: CellIndex) -> list[dict[str, Any]]:
    """What each group of the plan's finished cells is, its clips and cells, and mean and standard deviation of `SUMMARY_METRICS`
    over clips, each first averaged over its seeds; in planned order."""
    found: dict[tuple[str, ...], int] = {}
    clips: dict[tuple[int, str], int] = {}
    group_of, clip_of, figures = [], [], []
    for columns in index.columns(*TABLE_GROUP_KEYS, "clip", *SUMMARY_METRICS):
        name = columns[: len(TABLE_GROUP_KEYS)]
        group = found.setdefault(name, len(found))
        group_of.append(group)
        clip_of.append(clips.setdefault((group, columns[len(TABLE_GROUP_KEYS)]), len(clips)))
        figures.append(columns[len(TABLE_GROUP_KEYS) + 1 :])
    table = np.array(figures, dtype=np.float64).reshape(-1, len(SUMMARY_METRICS))  # None becomes NaN
    of_clip = np.array([group for group, _ in clips], dtype=np.int64)
    cells, clip_counts = (np.bincount(np.array(of, np.int64), minlength=len(found)) for of in (group_of, of_clip))
    statistics = [_statistics(column, np.array(clip_of, dtype=np.int64), of_clip) for column in table.T]
    return [
        {
            **dict(zip(TABLE_GROUP_KEYS, name, strict=True)),
            "varied": json.loads(name[-1]),
            "cells": int(cells[group]),
            "clips": int(clip_counts[group]),
            "metrics": {metric: of[group] for metric, of in zip(SUMMARY_METRICS, statistics, strict=True)},
        }
        for name, group in found.items()
    ]


def _statistics(values: Floats, clip_of: Ints, group_of: Ints) -> Sequence[dict[str, float | int | None]]:
    """Of each group, from the values of its cells, which clip each cell is of, and which group each clip."""
    known = np.isfinite(values)
    counts = np.bincount(clip_of[known], minlength=len(group_of))
    measured = counts > 0
    means = np.bincount(clip_of[known], values[known], minlength=len(group_of))[measured] / counts[measured]
    group, count = group_of[measured], int(group_of.max()) + 1 if len(group_of) else 0
    clips = np.bincount(group, minlength=count)
    mean = np.bincount(group, means, minlength=count) / np.maximum(clips, 1)
    squares = np.bincount(group, (means - mean[group]) ** 2, minlength=count)
    sd = np.sqrt(squares / np.maximum(clips - 1, 1))
    return [
        {
            "mean": float(mean[n]) if clips[n] else None,
            "sd": float(sd[n]) if clips[n] > 1 else None,
            "clips": int(clips[n]),
        }
        for n in range(count)
    ]
