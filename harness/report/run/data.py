"""The data of a run's page: the summary and, for every cell, the errors that are drawn, without the poses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from harness.compare.run_summary import GROUP_KEYS
from harness.core.arrays import Bools, Floats, Ints, Singles
from harness.core.estimate import name_with_lag
from harness.core.humanoid24 import standard_skeleton
from harness.core.split import training_note
from harness.report.kit.style import STYLES
from harness.results import Cell, Manifest, as_row, cell_folder, lag_of, read_cell, read_summary, setting_text
from harness.results.files import SUMMARY, check_cells, check_folder, check_row
from harness.score import (
    Pair,
    PoseSequence,
    compute_poses,
    hinge_errors_deg,
    in_skeleton_order,
    joint_errors_mm,
    local_errors_deg,
)

Row = Mapping[str, Any]
_GROUPS = ("methods", "behaviours")
WORST_METRICS = (
    "joint_angle_mean_deg",
    "mpjre_deg",
    "mpjpe_mm",
    "mpjpe_root_mm",
    "jitter_m_s3",
    "foot_skate_mm_s",
)
"""Metrics whose worst two seconds are shown."""


@dataclass(frozen=True, eq=False)
class Trace:
    """Errors and stream health of one cell over time: F frames, S stations, N scored frames."""

    key: str
    series: str
    """The series of the cell, see `RunData.series`."""
    behaviour: str
    clip: str
    stations: tuple[str, ...]
    health: Mapping[str, Any]
    notes: tuple[str, ...]
    time_s: Floats
    scored: Bools
    errors: Mapping[str, Floats]
    """Metric -> (F,) error, for WORST_METRICS; NaN where undefined."""
    rotation_deg: Floats
    """(N, 22) geodesic error of each hinged bone in the scored frames, float32."""
    position_mm: Floats
    """(N, 25) error of each joint centre in the scored frames, float32."""
    hinge_deg: Singles
    """(N, 48) error of each hinge angle in the scored frames, float32; (0, 48) without standard deviations."""
    sigma_deg: Singles
    """(F, 48) standard deviation that the method states for each hinge, float32; (0, 48) where it states none."""
    quality: Floats
    """(F, S) quality of each station, 0 to 1."""
    position_valid: Bools
    orientation_valid: Bools
    suspect: Bools


@dataclass(frozen=True, eq=False)
class RunData:
    """A finished run as its page shows it."""

    out: Path
    manifest: Manifest
    summary: Row
    traces: tuple[Trace, ...]
    full_summary: Row
    """The summary of all combinations of varied values; `summary` has only the last one."""

    @property
    def name(self) -> str:
        return str(self.manifest.inputs.get("name", self.out.name))

    @property
    def cells(self) -> Sequence[Row]:
        """The rows of the finished cells."""
        rows: Sequence[Row] = self.summary["cells"]
        return rows

    @cached_property
    def series_with_sigma(self) -> tuple[str, ...]:
        """The series whose methods state standard deviations, the lowest error first."""
        stated = {trace.series for trace in self.traces if len(trace.sigma_deg)}
        return tuple(name for name in self.ranked if name in stated)

    @property
    def varied_label(self) -> str:
        """The varied values that the page shows, as text; empty when the scenario varies none."""
        return setting_text(self.cells[0]) if self.cells else ""

    @cached_property
    def series(self) -> tuple[str, ...]:
        """Names of what is compared: methods, qualified by inputs, split and performer where these vary."""
        return tuple(dict.fromkeys(self.series_of(row) for row in self.summary["methods"]))

    @cached_property
    def lags(self) -> Mapping[str, int]:
        """Series -> number of later frames that its method uses."""
        return {self.series_of(row): lag_of(row) for row in self.summary["methods"]}

    @cached_property
    def ranked(self) -> tuple[str, ...]:
        """The series, sorted by mean error, the lowest first."""
        errors = {self.series_of(row): row["metrics"][WORST_METRICS[0]]["mean"] for row in self.summary["methods"]}
        return tuple(sorted(self.series, key=lambda name: np.inf if errors[name] is None else errors[name]))

    @cached_property
    def charted_series(self) -> tuple[str, ...]:
        """The series with the lowest errors, the lowest first, as many as a chart can distinguish."""
        return self.ranked[:STYLES]

    @cached_property
    def behaviours(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(str(row["behaviour"]) for row in self.cells))

    def trace(self, key: str) -> Trace:
        return next(trace for trace in self.traces if trace.key == key)

    def series_of(self, row: Row) -> str:
        """The series that a row of the summary belongs to."""
        return series_name(row, self.full_summary["methods"])

    def cell(self, key: str) -> Cell:
        return read_cell(cell_folder(self.out, key))


def read_run(out: Path) -> RunData:
    """Read the run in `out` one cell at a time; BadFile if the folder holds no run, or a damaged or edited one."""
    run = read_summary_only(out)
    return replace(run, traces=read_traces(run, run.cells))


def read_summary_only(out: Path) -> RunData:
    """Read the run in `out` without its traces, after a check of all its cells; BadFile as `read_run`."""
    check_folder(out)
    manifest, summary = Manifest.read(out / "manifest.json"), read_summary(out)
    check_cells(out, summary["cells"])
    return RunData(out, manifest, last_varied(summary), (), summary)


def read_traces(run: RunData, rows: Sequence[Row]) -> tuple[Trace, ...]:
    """The traces of some cells of a run, by their rows in its summary; BadFile for a damaged or edited cell."""
    return tuple(_trace(run, _cell_of_row(run, row)) for row in rows)


def _cell_of_row(run: RunData, row: Row) -> Cell:
    """The cell of a row of the summary; BadFile when they differ."""
    cell = run.cell(str(row["key"]))
    check_row(run.out / SUMMARY, row, as_row(cell))
    return cell


def series_name(row: Row, rows: Sequence[Row]) -> str:
    """Name of the series of a row: its method, qualified by what varies among `rows`, the methods of the summary.

    It states how many later frames the method uses if its own name does not, and training data other than the examples.
    """
    note = note_of(row, rows)
    parts = [note] if note else []
    if len({r["inputs"] for r in rows}) > 1:
        parts.append(str(row["inputs"]))
    if len({r["split"] for r in rows if r["method"] == row["method"]}) > 1:
        parts.append(f"split {row['split']}")
    if len({r["performer"] for r in rows}) > 1:
        parts.append(f"{row['performer'] or 'no'} performer")
    return name_with_lag(str(row["method"]), lag_of(row)) + (f" ({', '.join(parts)})" if parts else "")


def note_of(row: Row, rows: Sequence[Row]) -> str:
    """The note on the training data of the method of a row, as `rows`, the methods of the summary, have it."""
    return next((training_note(r.get("training_data")) for r in rows if r["method"] == row["method"]), "")


def last_varied(summary: Row) -> Row:
    """The part of a summary with the last combination of varied values."""
    if not summary["cells"]:
        return summary
    last = summary["cells"][-1]["varied"]
    parts = {name: [row for row in summary[name] if row["varied"] == last] for name in ("cells", *_GROUPS)}
    return {**summary, **parts}


def _trace(run: RunData, cell: Cell) -> Trace:
    pair, sigma_rad = scored_pair(cell), cell.angle_sigma_rad if cell.sigma_scores else None
    none: Singles = np.zeros((0, len(pair.skeleton.axes)), np.float32)
    return Trace(
        key=cell.key,
        series=run.series_of({name: getattr(cell, name) for name in GROUP_KEYS}),
        behaviour=cell.behaviour,
        clip=cell.clip,
        stations=cell.stations,
        health=cell.health,
        notes=cell.notes,
        time_s=cell.time_s,
        scored=cell.scores.scored,
        errors={name: cell.errors[name] for name in WORST_METRICS},
        rotation_deg=local_errors_deg(pair).astype(np.float32),
        position_mm=joint_errors_mm(pair).astype(np.float32),
        hinge_deg=none if sigma_rad is None else hinge_errors_deg(pair).astype(np.float32),
        sigma_deg=none if sigma_rad is None else np.rad2deg(in_skeleton_order(sigma_rad)).astype(np.float32),
        quality=cell.quality,
        position_valid=cell.position_valid,
        orientation_valid=cell.orientation_valid,
        suspect=cell.suspect,
    )


def scored_pair(cell: Cell) -> Pair:
    """Truth and estimate of the scored frames of a cell."""
    rows = cell.scores.scored
    return Pair(*pose_pair(cell, rows), cell.frame_index[rows], cell.rate_hz)


def pose_pair(cell: Cell, rows: Bools | Ints) -> tuple[PoseSequence, PoseSequence]:
    """Truth and estimate in some frames of a cell, each on its own skeleton."""
    true_skeleton, estimated_skeleton = (
        standard_skeleton().with_bones(bone_m) for bone_m in (cell.bone_m, cell.estimate_bone_m)
    )
    truth, estimate = cell.truth_qpos[rows], cell.estimate_qpos[rows]
    return compute_poses(true_skeleton, truth), compute_poses(estimated_skeleton, estimate)
