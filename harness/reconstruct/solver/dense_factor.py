"""Factor L^T D L of a dense positive definite matrix, compiled, for a few dozen unknowns.

Such a matrix is too small for LAPACK: `np.linalg.solve` takes 3.4 times as long for 54 unknowns. It is too large for a
plain triple loop, whose inner loops are so short that their start takes most of the time. So two rows are eliminated at
a time, and rows are padded to a multiple of eight numbers: then every inner loop is a whole number of vector
instructions. Numbers right of the diagonal are never used.
"""

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled


@compiled
def new_rows(count: int) -> Floats:
    """(N, N or up to 7 more) zeros: rows of a matrix (N, N), padded."""
    return np.zeros((count, (count + 7) & -8))


@compiled
def factorise(rows: Floats) -> bool:
    """Replace the lower triangle of a matrix, in padded rows, by D L and D; False unless it is positive definite.

    Elimination goes from the last row to the first, as in `levenberg_marquardt`. Row k becomes d_k times that of L.
    """
    k = len(rows) - 1
    while k > 0:
        first, second = rows[k], rows[k - 1]
        if not first[k] > 0.0:  # NaN fails, too
            return False
        by_first = 1.0 / first[k]
        share = first[k - 1] * by_first
        for j in range(k):
            second[j] -= share * first[j]
        if not second[k - 1] > 0.0:
            return False
        by_second = 1.0 / second[k - 1]
        for i in range(k - 1):
            row, a, b = rows[i], first[i] * by_first, second[i] * by_second
            for j in range((i | 7) + 1):
                row[j] -= a * first[j] + b * second[j]
        k -= 2
    return bool(k < 0 or rows[0, 0] > 0.0)


@compiled
def solve_factorised(factor: Floats, x: Floats) -> None:
    """x := A^-1 x (N,), in place, for the factor of A."""
    for k in range(len(x) - 1, -1, -1):
        row, share = factor[k], x[k] / factor[k, k]
        for i in range(k):
            x[i] -= row[i] * share
    for k in range(len(x)):
        row, total = factor[k], x[k]
        for i in range(k):
            total -= row[i] * x[i]
        x[k] = total / row[k]
