"""Poses as matrices: 4x4 or 3x4, a row a line, or all numbers of a matrix in a line (KITTI), with or without a time."""

from pathlib import Path

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadFile
from harness.stream.poses.number_table import TableHead

_LAST_ROW = (0.0, 0.0, 0.0, 1.0)
_MOST_DEVIATION = 0.02
"""Largest deviation of a product of a matrix's columns from that of a rotation."""
_IN_A_LINE = {12: 0, 16: 0, 13: 1, 17: 1}
"""Columns of a line with a whole matrix -> those before it."""


def holds_matrices(head: TableHead) -> bool:
    """Whether the rows of a table are matrices, whatever its header says."""
    if head.text_columns:
        return False
    if head.columns == 4:
        return _rows_of_matrix(head.rows) > 0
    if head.columns not in _IN_A_LINE or not np.isfinite(head.rows).all():
        return False
    return bool((_deviation(_in_lines(head.rows)[1]) < _MOST_DEVIATION).mean() > 0.95)


def split_matrices(head: TableHead, numbers: Floats) -> tuple[Floats | None, Floats, Floats, str]:
    """Times (N,) or None, positions (N, 3), quaternions (N, 4) w, x, y, z and what was left out, of all rows.

    Raises BadFile for matrices that are no rotations and translations.
    """
    left_out = ""
    if head.columns == 4:
        rows = _rows_of_matrix(head.rows)
        if len(numbers) % rows:
            left_out = "a matrix that was cut off at the end"
        whole = numbers[: len(numbers) // rows * rows].reshape(-1, rows, 4)
        times, matrices = None, whole[:, :3]
        if rows == 4 and np.any(whole[:, 3] != _LAST_ROW):
            at = int(np.flatnonzero((whole[:, 3] != _LAST_ROW).any(axis=1))[0])
            raise BadFile(head.path, f"matrix {at + 1} does not end with 0 0 0 1", "4x4 matrices", "Is a line missing?")
    else:
        times, matrices = _in_lines(numbers)
    return times, matrices[:, :, 3], convert_matrices(head.path, matrices[:, :, :3]), left_out


def convert_matrices(path: Path, matrices: Floats) -> Floats:
    """Quaternions (N, 4) w, x, y, z of matrices (N, 3, 3); zeros for matrices of zeros or that miss numbers.

    Raises BadFile for other matrices that are no rotations.
    """
    present = np.isfinite(matrices).all(axis=(1, 2)) & matrices.any(axis=(1, 2))
    wrong = np.flatnonzero(present & ~(_deviation(matrices) < _MOST_DEVIATION))
    if len(wrong):
        found = f"matrix {wrong[0] + 1} whose axes are not of length 1 and right angles, or that mirrors"
        raise BadFile(path, found, "rotation matrices", "Is it the right file?")
    out = np.zeros((len(matrices), 4))
    if present.any():
        out[present] = rotations.from_matrix(rotations.nearest_rotation(matrices[present]))
    return out


def _rows_of_matrix(rows: Floats) -> int:
    """4 or 3, the rows of each matrix in lines of four numbers; 0 where these are no matrices."""
    if len(rows) >= 4 and np.array_equal(rows[3 : len(rows) // 4 * 4 : 4], [_LAST_ROW] * (len(rows) // 4)):
        return 4
    whole = rows[: len(rows) // 3 * 3].reshape(-1, 3, 4)
    return 3 if len(whole) and bool((_deviation(whole) < _MOST_DEVIATION).mean() > 0.95) else 0


def _in_lines(rows: Floats) -> tuple[Floats | None, Floats]:
    """Times and matrices (N, 3, 4) of lines with a whole matrix."""
    before = _IN_A_LINE[rows.shape[1]]
    matrices = rows[:, before:].reshape(len(rows), -1, 4)
    if matrices.shape[1] == 4 and not np.any(matrices[:, :3, 3]) and np.any(matrices[:, 3, :3]):
        matrices = matrices.transpose(0, 2, 1)  # column by column
    return rows[:, 0] if before else None, matrices[:, :3]


def _deviation(matrices: Floats) -> Floats:
    """(N,) largest deviation of the left part of matrices (N, 3, 3 or 4) from a proper rotation; inf for a mirror."""
    turns = matrices[:, :, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        products = np.abs(np.einsum("nki,nkj->nij", turns, turns) - np.eye(3)).max(axis=(1, 2))
        mirrors = np.linalg.det(np.nan_to_num(turns, posinf=0.0, neginf=0.0)) <= 0.0
    out: Floats = np.where(mirrors | ~np.isfinite(matrices).all(axis=(1, 2)), np.inf, products)
    return out
