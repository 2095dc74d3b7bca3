"""Rows of one body as they stand in a file: those without a pose are left out, the others put in order."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.number_format import format_share
from harness.errors import BadFile
from harness.stream.poses.columns import NORM_TOLERANCE
from harness.stream.poses.pose_log import FileFinding

_LOST_SHARE = 0.05
"""Distance from (0, 0, 0) of the poses before and after, in median distances, from which on positions that are exactly
there count as not seen [choice]."""
_CUT_NORMS, _EXACT_NORM = 3.0, 1e-8
"""Deviations of a norm from 1 that show a row to be cut: in those of the other rows, and above that of exact ones."""
_FARTHEST = 1e9
"""Largest coordinate, in the file's unit [choice]."""


@dataclass(frozen=True, eq=False)
class RawPoses:
    """N rows of one body, in the units of the file."""

    name: str
    times: Floats
    """(N,) times on the file's clock."""
    positions: Floats
    """(N, 3)."""
    quaternions: Floats
    """(N, 4) components in the order of the file; zeros or NaN where there is no pose."""


def select_poses(path: Path, raw: RawPoses, findings: list[FileFinding], *, cut: bool) -> RawPoses:
    """The rows that hold a pose. BadFile for quaternions of another norm than 1.

    With `cut` the file ends without a line end: a last row with the worst norm has lost digits.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        norm = np.sqrt(np.sum(raw.quaternions**2, axis=1))
    present = np.isfinite(raw.times) & np.isfinite(raw.positions).all(axis=1) & np.isfinite(norm) & (norm > 0.0)
    deviation = np.where(present, np.abs(norm - 1.0), 0.0)
    if cut and len(norm) > 1 and deviation[-1] > _CUT_NORMS * deviation[:-1].max() + _EXACT_NORM:
        present[-1] = False
    wrong = np.flatnonzero(present & (deviation > NORM_TOLERANCE))
    if len(wrong):
        found = f"a quaternion of norm {norm[wrong[0]]:.3g} in row {wrong[0] + 1} of {raw.name}"
        raise BadFile(path, found, "unit quaternions", "Name the columns with --columns, or remove damaged rows.")
    far = np.flatnonzero(present & (np.abs(raw.positions) > _FARTHEST).any(axis=1))
    if len(far):
        found = f"a position of {np.abs(raw.positions[far[0]]).max():.3g} in row {far[0] + 1} of {raw.name}"
        raise BadFile(path, found, "coordinates in a unit of length", "Are the columns right?")
    zero = present & ~raw.positions.any(axis=1)
    if zero.any() and not zero[present].all():
        present &= ~_lost_at_origin(raw.positions, present, zero)
    lost = int(len(present) - np.count_nonzero(present))
    if lost:
        reason = "empty cells, a row that was cut off, quaternions of 0, or positions that jump to (0, 0, 0)"
        findings.append(FileFinding(f"gaps of {raw.name}", f"{lost} of {len(present)} rows hold no pose", reason))
    rows = np.flatnonzero(present)
    return RawPoses(raw.name, raw.times[rows], raw.positions[rows], raw.quaternions[rows] / norm[rows, None])


def _lost_at_origin(positions: Floats, present: Bools, zero: Bools) -> Bools:
    """Rows at exactly (0, 0, 0) next to which the body is elsewhere."""
    rows = np.flatnonzero(present & ~zero)
    size = np.linalg.norm(positions[rows], axis=1)
    scale = float(np.median(size))
    at = np.flatnonzero(zero)
    after = np.searchsorted(rows, at).clip(max=len(rows) - 1)
    before = (np.searchsorted(rows, at) - 1).clip(min=0)
    near = np.minimum(size[before], size[after]) < _LOST_SHARE * scale
    out: Bools = np.zeros_like(zero)
    out[at[~near]] = True
    return out


def sort_rows(raw: RawPoses, findings: list[FileFinding]) -> RawPoses:
    """The rows in the order of time, one at each time."""
    back = int(np.count_nonzero(np.diff(raw.times) < 0.0))
    if back:
        share = format_share(back / len(raw.times), 1)
        reason = "the time is less than that of the row before; they were sorted"
        findings.append(FileFinding(f"order of {raw.name}", f"{share} of the rows are out of order", reason))
    order: Ints = np.argsort(raw.times, kind="stable") if back else np.arange(len(raw.times))
    times, positions, quaternions = raw.times[order], raw.positions[order], raw.quaternions[order]
    fresh = np.append(True, np.diff(times) > 0.0)
    if not fresh.all():
        first = np.flatnonzero(fresh)[np.cumsum(fresh) - 1]
        same = (positions == positions[first]).all(axis=1) & (quaternions == quaternions[first]).all(axis=1)
        doubled, others = int(np.count_nonzero(~fresh & same)), int(np.count_nonzero(~fresh & ~same))
        for count, what in ((doubled, "repeat time and pose of another"), (others, "have the time of another")):
            if count:
                value = f"{format_share(count / len(fresh), 1)} of the rows {what}"
                findings.append(FileFinding(f"doubled rows of {raw.name}", value, "the first of them was kept"))
    return RawPoses(raw.name, times[fresh], positions[fresh], quaternions[fresh])
