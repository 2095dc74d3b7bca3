"""Many cells as one table: a row for each, and what the cells of each method come to in each place of a sweep."""

import csv
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.files import write_whole
from harness.results.index import CellIndex
from harness.results.summary import FIRST_METRICS
from harness.score.metrics import DEFINITIONS

FIRST = ("scenario", "clip", "behaviour", "method", "inputs", "protocol", "performer", "calibration", "noise", "seed")
METRICS = (*FIRST_METRICS, *(name for name in DEFINITIONS if name not in FIRST_METRICS))
TIMES = (*(n for n in METRICS if n.startswith(("step_", "first_step_"))), "fps", "seconds")
"""Columns that are never twice the same."""
SUMMED = ("joint_angle_mean_deg", "mpjre_deg", "mpjpe_mm", "mpjpe_root_mm", "jitter_m_s3", "coverage", "step_p50_ms")
"""Metrics of the summary; the table has the rest."""
GROUP = ("scenario", "method", "inputs", "protocol", "performer", "varied")
"""Cells that differ in these are never pooled."""


def write_table(index: CellIndex, path: Path) -> None:
    """The plan's finished cells in planned order; a column `vary.KEY` for each key, empty where a metric was not
    measured. The same cells give the same bytes, apart from `TIMES`."""
    write_whole(path, _lines(index))


def _lines(index: CellIndex) -> Iterator[str]:
    texts = sorted({text for (text,) in index.columns("varied")})
    varied = {text: json.loads(text) for text in texts}
    keys = list(dict.fromkeys(key for values in varied.values() for key in values))
    values = {text: [_short(found[key]) if key in found else "" for key in keys] for text, found in varied.items()}
    lines, places = _Lines(), len(FIRST)
    table = csv.writer(lines, lineterminator="\n")
    table.writerow([*FIRST, *(f"vary.{key}" for key in keys), *METRICS, "key", "seconds"])
    yield lines.last
    for columns in index.columns(*FIRST, "varied", "key", "seconds", *METRICS):
        first, (text, key, seconds), figures = columns[:places], columns[places : places + 3], columns[places + 3 :]
        table.writerow([*first, *values[text]])
        yield f"{lines.last[:-1]},{_figures(figures)},{key},{_figures((seconds,))}\n"


class _Lines:
    """What a csv writer wrote last."""

    last = ""

    def write(self, line: str) -> None:
        self.last = line


def _short(value: Any) -> str:
    """One value of a key; lists of names as tables have them."""
    if isinstance(value, list) and all(isinstance(name, str) for name in value):
        return "+".join(value)
    return value if isinstance(value, str) else json.dumps(value, separators=(",", ":"))


def _figures(values: Sequence[float | None]) -> str:
    """Nine digits of each, empty where there is none; all at once, for there are millions."""
    try:
        return ",".join(["%.9g"] * len(values)) % tuple(values)
    except TypeError:
        return ",".join("" if value is None else f"{value:.9g}" for value in values)


def groups(index: CellIndex) -> list[dict[str, Any]]:
    """What each group of the plan's finished cells is, its clips and cells, and mean and standard deviation of `SUMMED`
    over clips, each first averaged over its seeds; in planned order."""
    found: dict[tuple[str, ...], int] = {}
    clips: dict[tuple[int, str], int] = {}
    group_of, clip_of, figures = [], [], []
    for columns in index.columns(*GROUP, "clip", *SUMMED):
        name = columns[: len(GROUP)]
        group = found.setdefault(name, len(found))
        group_of.append(group)
        clip_of.append(clips.setdefault((group, columns[len(GROUP)]), len(clips)))
        figures.append(columns[len(GROUP) + 1 :])
    table = np.array(figures, dtype=np.float64).reshape(-1, len(SUMMED))  # None becomes NaN
    of_clip = np.array([group for group, _ in clips], dtype=np.int64)
    cells, clip_counts = (np.bincount(np.array(of, np.int64), minlength=len(found)) for of in (group_of, of_clip))
    statistics = [_statistics(column, np.array(clip_of, dtype=np.int64), of_clip) for column in table.T]
    return [
        {
            **dict(zip(GROUP, name, strict=True)),
            "varied": json.loads(name[-1]),
            "cells": int(cells[group]),
            "clips": int(clip_counts[group]),
            "metrics": {metric: of[group] for metric, of in zip(SUMMED, statistics, strict=True)},
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
