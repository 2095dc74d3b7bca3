"""Kernel canonical correlation analysis of a few pairs, as a regression: Kim et al. 2012, eq. 3 to 5.

Of m pairs only Gram matrices are needed: H of the inputs, F of the outputs, and the kernel between a new input and the
m inputs. The prediction is linear in the outputs, so the result is a weight for each of them. Weights sum to 1.

With full rank, eq. 3 has correlation 1 in every direction. So Gram matrices are centred and regularised
(docs/papers.md E): (H + kH I)^-1 F (F + kF I)^-1 H x = rho^2 x, with kH = kappa times H's mean eigenvalue. Centring
uses an orthonormal basis of the vectors of sum 0, which leaves m - 1 dimensions and no singular matrix. The same ridge
can regularise the projection of eq. 4, by x^T H (H + kH I) x in place of x^T H^2 x: as printed, the last bases follow
noise.
"""

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.reconstruct.solver.matrix_algebra import dot

_EIGENVALUE_FLOOR = 1e-12
"""Added to eigenvalues between 0 and 1, so that outputs may have a lower rank."""
_ROUNDING = 1e-15
"""Relative size below which an off-diagonal element counts as 0."""
_UNDERFLOW = 1e-290
"""Squared length below which a Householder vector is skipped."""


@compiled
def regression_weights(
    inputs: Floats, query: Floats, outputs: Floats, width: float, bases: int, kappa: float, regularise_projection: bool
) -> Floats:
    """(m,) weights of outputs (m, d) for inputs (m, n) and a query (n,), with Gaussian kernels.

    The kernels' standard deviation is `width` RMS distances of two examples. Weights are equal when all inputs or all
    outputs are the same.
    """
    between, across = squared_distances(inputs), squared_distances(outputs)
    if between.sum() <= 0.0 or across.sum() <= 0.0:
        return np.full(len(inputs), 1.0 / len(inputs))
    sharpness = _kernel_precision(between, width)
    near = np.empty(len(inputs))
    for i in range(len(inputs)):
        far = 0.0
        for k in range(len(query)):
            far += (inputs[i, k] - query[k]) ** 2
        near[i] = np.exp(-sharpness * far)
    kernel_x, kernel_y = (
        _gaussian_kernel(between, sharpness),
        _gaussian_kernel(across, _kernel_precision(across, width)),
    )
    return weights_from_kernels(kernel_x, kernel_y, near, bases, kappa, regularise_projection)


@compiled
def squared_distances(points: Floats) -> Floats:
    """(m, m) squared distances of points (m, n); exactly 0 when all points are equal."""
    away = points - points[0]
    gram = away @ away.T
    out: Floats = np.zeros_like(gram)
    for i in range(len(gram)):
        for j in range(i):
            out[i, j] = out[j, i] = max(gram[i, i] + gram[j, j] - 2.0 * gram[i, j], 0.0)
    return out


@compiled
def _kernel_precision(squared: Floats, width: float) -> float:
    """1 / 2 s^2 of a Gaussian exp(-d^2 / 2 s^2) that is `width` RMS distances wide, from squared distances (m, m)."""
    count = len(squared)
    return float(0.5 * count * (count - 1) / (width * width * squared.sum()))


@compiled
def _gaussian_kernel(squared: Floats, sharpness: float) -> Floats:
    """(m, m) Gaussian kernel of squared distances (m, m)."""
    out: Floats = np.ones_like(squared)
    for i in range(len(out)):
        for j in range(i):
            out[i, j] = out[j, i] = np.exp(-sharpness * squared[i, j])
    return out


@compiled
def weights_from_kernels(
    inputs: Floats, outputs: Floats, query: Floats, bases: int, kappa: float, regularise_projection: bool
) -> Floats:
    """(m,) weights of m >= 2 outputs, from Gram matrices (m, m) of both sides and the query's kernel (m,).

    `regularise_projection` applies the ridge of eq. 3 to eq. 4. ArithmeticError when all inputs or outputs are equal.
    """
    count = len(query)
    squared, y, root = _canonical_bases(_centre(inputs), _centre(outputs), bases, kappa)
    new = _helmert_contrasts((query - inputs.sum(axis=1) / count).reshape(-1, 1)).reshape(-1)
    if regularise_projection:  # with this ridge, eq. 4 and 5 are a projection onto the rows F y
        contrasts = _project(root.T @ (root @ new), y)
    else:
        seen = y @ root.T
        x = y - _ridge(_centre(inputs), kappa) * (seen @ root)
        reduced = squared * np.linalg.solve(x @ x.T, seen @ (root @ new))  # eq. 4
        contrasts = y.T @ np.linalg.solve(y @ y.T, reduced)  # eq. 5
    return _from_helmert_contrasts(contrasts) + 1.0 / count


@compiled
def _canonical_bases(inputs: Floats, outputs: Floats, bases: int, kappa: float) -> tuple[Floats, Floats, Floats]:
    """The l pairs of bases of highest correlation, for centred Gram matrices of n = m - 1 dimensions.

    With R = H (H + kH I)^-1 and the Cholesky factor L of F (F + kF I)^-1, the matrix L^T R L is symmetric, and its
    eigenvectors w give  F y = L w  and, up to length,  x = (H + kH I)^-1 L w. Returns squared correlations (l,) in
    ascending order, the examples' reduced outputs F y (l, n), and a root W (n, n) of (H + kH I)^-1 = W^T W.
    """
    count = len(inputs)
    ridge_x, ridge_y = _ridge(inputs, kappa), _ridge(outputs, kappa)
    if ridge_x <= 0.0 or ridge_y <= 0.0:
        raise ArithmeticError("a Gram matrix is not positive definite: are all examples the same?")
    root_x, root_y = _inverse_root(inputs, ridge_x), _inverse_root(outputs, ridge_y)
    shrunk = (root_y.T @ root_y) * -ridge_y
    for i in range(count):
        shrunk[i, i] += 1.0 + _EIGENVALUE_FLOOR
    upper = np.linalg.cholesky(shrunk).T.astype(np.float64)
    left_out = root_x @ upper.T
    squared, vectors = symmetric_eigen(upper @ upper.T - ridge_x * (left_out.T @ left_out))
    best = np.argsort(squared)[max(count - bases, 0) :]
    return squared[best], vectors[best] @ upper, root_x


@compiled
def _inverse_root(gram: Floats, ridge: float) -> Floats:
    """(n, n) root W of (G + ridge I)^-1 = W^T W."""
    upper = np.linalg.cholesky(gram + ridge * np.eye(len(gram))).T
    out = np.eye(len(gram))
    for i in range(len(gram)):
        for k in range(i):
            _add_scaled(out[i], -upper[k, i], out[k])
        out[i] /= upper[i, i]
    return out


@compiled
def symmetric_eigen(matrix: Floats) -> tuple[Floats, Floats]:
    """Eigenvalues (n,) and eigenvectors (n, n), in rows and in no order, of a symmetric matrix, which is overwritten.

    Householder reflections to tridiagonal form, then QL steps with implicit shifts (Golub & Van Loan 1996, 8.3). `eigh`
    takes 1.9 times as long for 11 rows.
    """
    size = len(matrix)
    rows, off_diagonal = np.eye(size), np.zeros(size)
    reflector, along, turned = np.zeros(size), np.zeros(size), np.zeros(size)
    for k in range(size - 1):
        reflector[:] = matrix[k]
        reflector[: k + 1] = 0.0
        squared = dot(reflector, reflector)
        if squared < _UNDERFLOW:
            continue
        off_diagonal[k] = -np.copysign(np.sqrt(squared), reflector[k + 1])
        reflector[k + 1] -= off_diagonal[k]
        share = np.sqrt(0.5 * dot(reflector, reflector))
        for i in range(k + 1, size):
            reflector[i] /= share  # I - v v^T is the reflection
        along[:], turned[:] = 0.0, 0.0
        for i in range(k + 1, size):
            row, other, share = matrix[i], rows[i], reflector[i]
            for j in range(size):
                along[j] += share * row[j]
                turned[j] += share * other[j]
        _add_scaled(along, -0.5 * dot(along, reflector), reflector)
        for i in range(k + 1, size):
            row, other, share, more = matrix[i], rows[i], reflector[i], along[i]
            for j in range(size):
                row[j] -= share * along[j] + more * reflector[j]
                other[j] -= share * turned[j]
    values = np.diag(matrix).copy()
    for low in range(size):
        while True:
            high = low
            while high < size - 1 and abs(off_diagonal[high]) > _ROUNDING * (abs(values[high]) + abs(values[high + 1])):
                high += 1
            if high == low:
                break
            _ql_step(values, off_diagonal, rows, low, high)
    return values, rows


@compiled
def _ql_step(values: Floats, off_diagonal: Floats, rows: Floats, low: int, high: int) -> None:
    """A QL step on the block from `low` to `high` of a tridiagonal matrix; `rows` accumulate the rotations."""
    shift = (values[low + 1] - values[low]) / (2.0 * off_diagonal[low])
    shift = values[low] - off_diagonal[low] / (shift + np.copysign(np.sqrt(shift * shift + 1.0), shift))
    g, c, s, p = values[high] - shift, 1.0, 1.0, 0.0
    for i in range(high - 1, low - 1, -1):
        f, b = s * off_diagonal[i], c * off_diagonal[i]
        r = np.sqrt(f * f + g * g)
        off_diagonal[i + 1] = r
        if r == 0.0:
            values[i + 1] -= p
            off_diagonal[high] = 0.0
            return
        share = 1.0 / r
        s, c = share * f, share * g
        g = values[i + 1] - p
        r = (values[i] - g) * s + 2.0 * c * b
        p = s * r
        values[i + 1] = g + p
        g = c * r - b
        row, below = rows[i], rows[i + 1]
        for k in range(len(values)):
            row[k], below[k] = c * row[k] - s * below[k], s * row[k] + c * below[k]
    values[low] -= p
    off_diagonal[low], off_diagonal[high] = g, 0.0


@compiled
def _project(vector: Floats, across: Floats) -> Floats:
    """Projection (n,) of a vector onto the span of l others (l, n), which are orthonormalised in place."""
    out = np.zeros_like(vector)
    for i in range(len(across)):
        for j in range(i):
            _add_scaled(across[i], -dot(across[i], across[j]), across[j])
        across[i] /= np.sqrt(dot(across[i], across[i]))
        _add_scaled(out, dot(across[i], vector), across[i])
    return out


@compiled
def _add_scaled(to: Floats, share: float, other: Floats) -> None:
    """Add a multiple of another vector (n,) in place."""
    for k in range(len(to)):
        to[k] += share * other[k]


@compiled
def _ridge(gram: Floats, kappa: float) -> float:
    return float(kappa * np.trace(gram) / len(gram))


@compiled
def _centre(gram: Floats) -> Floats:
    """(n, n) centred Gram matrix, from (m, m), n = m - 1, in Helmert's basis."""
    return _helmert_contrasts(np.ascontiguousarray(_helmert_contrasts(gram).T))


@compiled
def _helmert_contrasts(values: Floats) -> Floats:
    """(m - 1, k) coordinates of values (m, k) in Helmert's orthonormal basis of the vectors of sum 0."""
    out, total = np.empty((len(values) - 1, values.shape[1])), values[0].copy()
    for rank in range(1, len(values)):
        share = 1.0 / np.sqrt(rank * (rank + 1.0))
        for k in range(len(total)):
            out[rank - 1, k] = share * (total[k] - rank * values[rank, k])
            total[k] += values[rank, k]
    return out


@compiled
def _from_helmert_contrasts(values: Floats) -> Floats:
    """(m,) vector of sum 0 with these Helmert coordinates (m - 1,)."""
    out = np.zeros(len(values) + 1)
    for rank in range(1, len(out)):
        share = values[rank - 1] / np.sqrt(rank * (rank + 1.0))
        out[:rank] += share
        out[rank] -= rank * share
    return out
