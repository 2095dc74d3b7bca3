"""Statistics of the methods of a run, computed from stored per-frame values.

Two means are given, because they differ when takes differ in length: over sequences (mean and standard deviation of
sequence means, as public evaluators print it) and over frames.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from harness.compare.run_summary.expected_orders import ExpectedOrder, evaluate_orders
from harness.compare.run_summary.recovery import RecoveryCollector
from harness.core.arrays import Floats
from harness.core.files import to_json_types
from harness.results import Cell, CellIndex, as_row, cell_folder, read_cell, varied_text
from harness.score import DEFINITIONS, FRAME_METRICS, SigmaSums, pool_frames, score_sigma, step_relative, step_times_ms

_COUNTS = tuple(name for name, d in DEFINITIONS.items() if d.unit == "frames")
GROUP_KEYS = ("method", "inputs", "split", "performer", "varied", "lag")
"""Cells that differ in one of these are never pooled."""


def compute_run_statistics(
    index: CellIndex, out: Path, orders: Sequence[ExpectedOrder], training_data: Mapping[str, str]
) -> dict[str, Any]:
    """What `summary.json` says of a run beyond its counts; every finished cell is read once.

    methods (with the `training_data` that they declare) and behaviours (see `SummaryStatistics.rows`), recovery (see
    `RecoveryCollector.rows`; empty unless the scenario varies a disturbance), expected_orders (see `evaluate_orders`)
    and cells (the rows).
    """
    rows, recovery = [], RecoveryCollector()
    methods, behaviours = SummaryStatistics(*GROUP_KEYS), SummaryStatistics(*GROUP_KEYS, "behaviour")
    for (key,) in index.columns("key"):
        cell = read_cell(cell_folder(out, key))
        rows.append(as_row(cell))
        for statistics in (methods, behaviours, recovery):
            statistics.add(cell)
    return {
        "methods": [{**row, "training_data": training_data.get(row["method"])} for row in methods.rows()],
        "behaviours": behaviours.rows(),
        "recovery": recovery.rows(),
        "expected_orders": evaluate_orders(orders, rows),
        "cells": rows,
    }


class SummaryStatistics:
    """Statistics per group of cells. Cells are added one at a time, so that a run of any length fits in memory."""

    def __init__(self, *by: str) -> None:
        self.by = by
        self._groups: dict[tuple[str, ...], _GroupStatistics] = {}

    def add(self, cell: Cell) -> None:
        name = tuple(_text(to_json_types(getattr(cell, field))) for field in self.by)
        self._groups.setdefault(name, _GroupStatistics()).add(cell)

    def rows(self) -> list[dict[str, Any]]:
        """One row per group: its identity, the numbers of sequences and frames, and the statistics of every metric."""
        return [{**group.named(self.by), **group.row()} for group in self._groups.values()]


class _GroupStatistics:
    def __init__(self) -> None:
        self.sequences: list[dict[str, Any]] = []
        self.frames: dict[str, list[Floats]] = {name: [] for name in FRAME_METRICS}
        self.step_ms: list[Floats] = []
        self.cpu_ms: list[Floats] = []
        self.sigma: SigmaSums | None = None

    def add(self, cell: Cell) -> None:
        self.sequences.append(as_row(cell))
        if cell.metrics["joint_angle_mean_deg"] is None:
            return
        for name, values in cell.scores.per_frame.items():
            self.frames[name].append(values[cell.scores.scored].astype(np.float32))
        timed = cell.scores.scored & (np.arange(len(cell)) > 0)
        self.step_ms.append(cell.step_ms[timed])
        if cell.sigma_scores and cell.angle_sigma_rad is not None:
            rows = cell.scores.scored
            sums = score_sigma(cell.truth_qpos[rows], cell.estimate_qpos[rows], cell.angle_sigma_rad[rows])
            self.sigma = sums if self.sigma is None else self.sigma + sums
        self.cpu_ms.append(np.array([np.where(timed, cell.step_cpu_ms, np.nan), cell.reference_cpu_ms]))

    def named(self, fields: Iterable[str]) -> dict[str, Any]:
        """Values of fields that all cells of the group share."""
        return {field: self.sequences[0][field] for field in fields}

    def row(self) -> dict[str, Any]:
        counts = {name: sum(row[name] for row in self.sequences) for name in _COUNTS}
        expected = counts["frames_expected"]
        measured = [name for name in DEFINITIONS if name not in counts and name != "coverage"]
        return {
            "sequences": len(self.sequences),
            **counts,
            "coverage": counts["frames_matched"] / expected if expected else 0.0,
            "metrics": {name: self._statistics(name) for name in measured},
            "sigma_scores": self.sigma.scores() if self.sigma else {},
        }

    def _statistics(self, name: str) -> dict[str, float | int | None]:
        values = np.array([row[name] for row in self.sequences if row[name] is not None], dtype=float)
        return {
            "mean": float(values.mean()) if len(values) else None,
            "sd": float(values.std(ddof=1)) if len(values) > 1 else None,
            "sequences": len(values),
            "frame_weighted": self._over_frames(name),
        }

    def _over_frames(self, name: str) -> float | None:
        if name in self.frames:
            columns = [values.astype(float) for values in self.frames[name]]
            value = pool_frames(np.concatenate(columns), DEFINITIONS[name].pool) if columns else np.nan
        else:
            value = self._times().get(name, np.nan)
        return float(value) if np.isfinite(value) else None

    def _times(self) -> dict[str, float]:
        if not self.step_ms:
            return {}
        relative = step_relative(*np.concatenate(self.cpu_ms, axis=1))
        return {**step_times_ms(np.concatenate(self.step_ms)), "step_relative": relative}


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, list):
        return " ".join(map(str, value))
    if isinstance(value, Mapping):
        return varied_text(value)
    return f"{value:.9g}" if isinstance(value, float) else str(value)
