"""Principal component analysis of bone lengths: explained variance, and errors for a person left out."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.core.humanoid24 import BONES
from harness.core.seeds import generator

MODES = 5
"""Number of modes that Liu et al. 2011 keep."""
SUBSAMPLES = 200
"""Number of random subsets of the people, for the effect of their number."""
OTHER_SIDE = [
    BONES.index(other) if (other := {"l": "r", "r": "l"}.get(name[0], "") + name[1:]) in BONES else b
    for b, name in enumerate(BONES)
]
"""(24,) index of the bone on the other side; a bone in the middle has its own."""


@dataclass(frozen=True, eq=False)
class Eigenmodes:
    """Principal directions of N lengths of P people."""

    mean: Floats
    """(N,) mean over people."""
    modes: Floats
    """(B, N) orthonormal directions, B = min(P, N), by decreasing variance.

    The largest component of each is positive.
    """
    spread: Floats
    """(B,) standard deviation of the people along each direction."""

    @property
    def explained(self) -> Floats:
        """(B,) share of the variance that the first 1..B modes explain."""
        variance = self.spread**2
        out: Floats = np.cumsum(variance) / np.sum(variance)
        return out


def fit_eigenmodes(lengths: Floats) -> Eigenmodes:
    """Fit principal directions to lengths (P, N) of two people or more."""
    mean = lengths.mean(axis=0)
    _, size, modes = np.linalg.svd(lengths - mean, full_matrices=False)
    largest = np.take_along_axis(modes, np.abs(modes).argmax(axis=1, keepdims=True), axis=1)
    return Eigenmodes(mean, modes * np.sign(largest), size / np.sqrt(len(lengths) - 1.0))


def normalise_by_tibia(length_m: Floats) -> Floats:
    """Divide lengths (P, 24) by the length of each person's left tibia."""
    out: Floats = length_m / length_m[:, [BONES.index("ltibia")]]
    return out


def symmetrise(length_m: Floats) -> Floats:
    """Replace lengths (P, 24) of paired bones by the mean of left and right."""
    out: Floats = (length_m + length_m[:, OTHER_SIDE]) / 2.0
    return out


def leave_one_out_errors_m(length_m: Floats, modes: int) -> Floats:
    """Errors (P, 24) of each person's lengths, projected on `modes` modes of all others.

    With 0 modes, their mean [m].
    """
    errors = np.empty_like(length_m)
    for person in range(len(length_m)):
        others = fit_eigenmodes(np.delete(length_m, person, axis=0))
        deviation, basis = length_m[person] - others.mean, others.modes[:modes]
        errors[person] = deviation - deviation @ basis.T @ basis
    return errors


def explained_variance_by_count(length_m: Floats, counts: range, seed: int) -> Floats:
    """(C, 3) lowest, median and highest share explained by five modes, over random subsets of each count of people."""
    result = np.empty((len(counts), 3))
    for row, count in enumerate(counts):
        rng = generator(seed, "eigenmodes", count)
        subsets = np.array([rng.choice(len(length_m), count, replace=False) for _ in range(SUBSAMPLES)])
        deviations = length_m[subsets] - length_m[subsets].mean(axis=1, keepdims=True)
        variance = np.linalg.svd(deviations, compute_uv=False) ** 2
        shares = variance[:, :MODES].sum(axis=1) / variance.sum(axis=1)
        result[row] = np.quantile(shares, [0.0, 0.5, 1.0])
    return result
