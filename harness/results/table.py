"""The finished cells of a folder as a table with one row per cell, and statistics of groups of cells over clips."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.csv_text import csv_line
from harness.core.files import write_parts
from harness.results.cell import EXTRA_IDENTITY, IDENTITY, OPTIONAL_COLUMNS, varied_text
from harness.results.index import CellIndex
from harness.score import DEFINITIONS, SIGMA_DEFINITIONS

FIRST_METRICS = (
    "frames_matched",
    "frames_expected",
    "joint_angle_mean_deg",
    "joint_angle_rms_deg",
    "mpjre_deg",
    "mpjpe_mm",
    "mpjpe_root_mm",
    "jitter_m_s3",
    "step_p50_ms",
    "step_p99_ms",
    "fps",
)
METRIC_COLUMNS = (*FIRST_METRICS, *(name for name in DEFINITIONS if name not in FIRST_METRICS))
COLUMNS = (*IDENTITY, *METRIC_COLUMNS, *EXTRA_IDENTITY, "key", "seconds")
"""Columns of summary.csv. A column `vary.KEY` for each varied key follows, then `LAST_COLUMNS` if a cell has them."""
LAST_COLUMNS = ("lag", *SIGMA_DEFINITIONS)
"""Columns of a table in which some method has a lag or states standard deviations."""
TIME_COLUMNS = (*(n for n in METRIC_COLUMNS if n.startswith(("step_", "first_step_"))), "fps", "seconds")
"""Columns whose values differ from run to run."""
SUMMARY_METRICS = (
    "joint_angle_mean_deg",
    "mpjre_deg",
    "mpjpe_mm",
    "mpjpe_root_mm",
    "jitter_m_s3",
    "coverage",
    "fallback_share",
    "step_p50_ms",
)
"""Metrics of the groups in summary.json; the table has all metrics."""
TABLE_GROUP_KEYS = ("scenario", "method", "inputs", "split", "performer", "varied")
"""Cells that differ in one of these are never pooled."""


def write_table(index: CellIndex, path: Path) -> None:
    """Write the plan's finished cells in planned order: `COLUMNS`, and one column `vary.KEY` for each varied key.

    A field is empty where a metric was not measured. The same cells give the same bytes, apart from `TIME_COLUMNS`.
    """
    write_parts(path, _csv_lines(index))


def _csv_lines(index: CellIndex) -> Iterator[str]:
    varied = {text: json.loads(text) for text in sorted({text for (text,) in index.columns("varied")})}
    keys = list(dict.fromkeys(key for values in varied.values() for key in values))
    fields = {
        text: (varied_text(values), [_format_value(values[key]) if key in values else "" for key in keys])
        for text, values in varied.items()
    }
    identities, metrics = len(IDENTITY), len(METRIC_COLUMNS)
    stations, rate = IDENTITY.index("stations"), IDENTITY.index("rate_hz")
    last = LAST_COLUMNS if any(values != OPTIONAL_COLUMNS for values in index.optional()) else ()
    yield csv_line([*COLUMNS, *(f"vary.{key}" for key in keys), *last])
    for row, of_cell in zip(index.columns(*COLUMNS), index.optional(), strict=True):
        identity, figures, (scenario, performer, varied_json, key, seconds) = (
            list(row[:identities]),
            row[identities : identities + metrics],
            row[identities + metrics :],
        )
        identity[stations] = " ".join(json.loads(identity[stations] or "[]"))
        identity[rate] = _format_numbers((identity[rate],))
        text, values = fields[varied_json]
        figures_last = [of_cell["lag"], *(of_cell["sigma_scores"].get(name) for name in SIGMA_DEFINITIONS)]
        further = [_format_numbers((value,)) for value in figures_last[: len(last)]]
        rest = csv_line([scenario, performer, text, key, _format_numbers((seconds,)), *values, *further])
        yield f"{csv_line(identity)[:-1]},{_format_numbers(figures)},{rest}"


def _format_value(value: Any) -> str:
    """Text of one varied value; names of a list are joined by +."""
    if isinstance(value, list) and all(isinstance(name, str) for name in value):
        return "+".join(value)
    return value if isinstance(value, str) else json.dumps(value, separators=(",", ":"))


def _format_numbers(values: Sequence[float | None]) -> str:
    """Values with nine digits, separated by commas; empty for None. One format call, because there are millions."""
    try:
        return ",".join(["%.9g"] * len(values)) % tuple(values)
    except TypeError:
        return ",".join("" if value is None else f"{value:.9g}" for value in values)


def compute_group_statistics(index: CellIndex) -> list[dict[str, Any]]:
    """One record per group of the plan's finished cells, in planned order.

    It has the group's identity, its numbers of clips and cells, and the mean and standard deviation over clips of
    `SUMMARY_METRICS`. Each clip is first averaged over its seeds.
    """
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
    """Statistics of each group; `clip_of` has the clip of each cell, `group_of` the group of each clip."""
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
