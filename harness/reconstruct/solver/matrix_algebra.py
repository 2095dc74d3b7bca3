"""Small matrices in compiled loops, where one call of a library routine costs more than the numbers.

Vectors and 3 x 3 matrices come first, then the factor L^T D L and the inverse of a dense positive definite matrix of a
few dozen rows. That is too small for LAPACK: `np.linalg.solve` takes 3.4 times as long for 54 unknowns. It is too large
for a plain triple loop, whose inner loops are so short that their start takes most of the time. So two rows are
eliminated at a time, and rows are padded to a multiple of eight numbers: then every inner loop is a whole number of
vector instructions. Numbers right of the diagonal are never used.
"""

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled


@compiled
def dot(a: Floats, b: Floats) -> float:
    """The inner product of two vectors (N,), summed in order."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@compiled
def dot3(a: Floats, b: Floats) -> float:
    """The inner product of two vectors (3,)."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@compiled
def cross(a: Floats, b: Floats) -> Floats:
    """The cross product (3,) of two vectors (3,)."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@compiled
def multiply_vector(a: Floats, v: Floats) -> Floats:
    """A v (3,) of a matrix (3, 3) and a vector (3,)."""
    return np.array([dot3(a[0], v), dot3(a[1], v), dot3(a[2], v)])


@compiled
def multiply(a: Floats, b: Floats) -> Floats:
    """A B (3, 3)."""
    out = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]
    return out


@compiled
def multiply_transposed(a: Floats, b: Floats) -> Floats:
    """A B^T (3, 3)."""
    return multiply(a, np.ascontiguousarray(b.T))


@compiled
def transposed_multiply(a: Floats, b: Floats) -> Floats:
    """A^T B (3, 3)."""
    return multiply(np.ascontiguousarray(a.T), b)


@compiled
def axis_rotation(axis: Floats, angle: float) -> Floats:
    """The rotation matrix (3, 3) about a unit axis (3,) by an angle [rad]; the identity for an axis of zeros."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = axis[0], axis[1], axis[2]
    if x * x + y * y + z * z == 0.0:
        return np.eye(3)
    u = 1.0 - c
    return np.array(
        [
            [c + u * x * x, u * x * y - s * z, u * x * z + s * y],
            [u * x * y + s * z, c + u * y * y, u * y * z - s * x],
            [u * x * z - s * y, u * y * z + s * x, c + u * z * z],
        ]
    )


@compiled
def shortest_rotation(start: Floats, direction: Floats) -> Floats:
    """The rotation matrix (3, 3) of the smallest turn that takes a vector (3,) into a unit direction (3,)."""
    length = np.sqrt(dot3(start, start))
    axis, cosine = cross(start, direction) / length, dot3(start, direction) / length
    sine = np.sqrt(dot3(axis, axis))
    if sine < 1e-12:
        if cosine > 0.0:
            return np.eye(3)
        # Opposite: half a turn about any perpendicular axis; the smallest component gives the safest cross product.
        least = np.zeros(3)
        least[np.argmin(np.abs(direction))] = 1.0
        axis = cross(direction, least)
        return axis_rotation(axis / np.sqrt(dot3(axis, axis)), np.pi)
    return axis_rotation(axis / sine, np.arctan2(sine, cosine))


@compiled
def angle_about(axis: Floats, rotation: Floats) -> float:
    """The angle [rad] about a unit axis (3,) whose rotation is nearest to a matrix (3, 3): it maximises the trace."""
    skew = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    trace = rotation[0, 0] + rotation[1, 1] + rotation[2, 2]
    return float(np.arctan2(dot3(axis, skew), trace - dot3(axis, multiply_vector(rotation, axis))))


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


@compiled
def invert_positive_definite(matrix: Floats) -> Floats:
    """The inverse of a positive definite matrix (N, N), by Gauss-Jordan elimination of its lower triangle.

    `rows` start as the matrix and end as minus the inverse. A step exchanges the roles of unknowns and right-hand sides
    k and k + 1; both forms are symmetric, so the lower triangle suffices. `np.linalg.inv` takes 3.6 times as long for
    52 rows.
    """
    count = len(matrix)
    rows, pivots, solved = new_rows(count), new_rows(count)[:2], new_rows(count)[:2]
    for i in range(count):
        for j in range(i + 1):
            rows[i, j] = matrix[i, j]
    if count % 2 == 1:
        _exchange_one(rows, count - 1)
    for k in range(0, count - 1, 2):
        (p, q), (u, v) = (pivots[0], pivots[1]), (solved[0], solved[1])
        for j in range(k + 1):
            p[j], q[j] = rows[k, j], rows[k + 1, j]
        p[k + 1], q[k + 1] = rows[k + 1, k], rows[k + 1, k + 1]
        for i in range(k + 2, count):
            p[i], q[i] = rows[i, k], rows[i, k + 1]
        scale = 1.0 / (p[k] * q[k + 1] - p[k + 1] * p[k + 1])
        first, mixed, second = scale * q[k + 1], -scale * p[k + 1], scale * p[k]
        for j in range(count):
            u[j], v[j] = first * p[j] + mixed * q[j], mixed * p[j] + second * q[j]
        for i in range(count):
            row, a, b = rows[i], u[i], v[i]
            for j in range((i | 7) + 1):
                row[j] -= a * p[j] + b * q[j]
        for j in range(k):
            rows[k, j], rows[k + 1, j] = u[j], v[j]
        for i in range(k + 2, count):
            rows[i, k], rows[i, k + 1] = u[i], v[i]
        rows[k, k], rows[k + 1, k], rows[k + 1, k + 1] = -first, -mixed, -second
    out = np.empty((count, count))
    for i in range(count):
        for j in range(i + 1):
            out[i, j] = out[j, i] = -rows[i, j]
    return out


@compiled
def _exchange_one(rows: Floats, k: int) -> None:
    """The step of `invert_positive_definite` for the last of an odd number of rows alone."""
    pivot, scale = rows[k].copy(), 1.0 / rows[k, k]
    for i in range(k):
        for j in range(i + 1):
            rows[i, j] -= pivot[i] * scale * pivot[j]
    for j in range(k):
        rows[k, j] = scale * pivot[j]
    rows[k, k] = -scale
