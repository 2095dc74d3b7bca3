"""Principal directions of people's bone lengths: what a few of them keep, and what they say of a person left out."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.core.humanoid24 import BONES
from harness.core.seeds import generator

MODES = 5
"""That Liu et al. 2011 keep."""
SUBSAMPLES = 200
"""Of some of the people, to see what their number does."""
OTHER_SIDE = [
    BONES.index(other) if (other := {"l": "r", "r": "l"}.get(name[0], "") + name[1:]) in BONES else b
    for b, name in enumerate(BONES)
]
"""(24,) the bone on the other side; a bone in the middle is its own."""


@dataclass(frozen=True, eq=False)
class Eigenmodes:
    """Principal directions of N numbers of P people."""

    mean: Floats
    """(N,)"""
    modes: Floats
    """(B, N) orthonormal, B = min(P, N), the largest first; the largest number of each is positive."""
    spread: Floats
    """(B,) standard deviation of the people along each."""

    @property
    def kept(self) -> Floats:
        """(B,) the share of the variance that the first 1..B modes keep."""
        variance = self.spread**2
        out: Floats = np.cumsum(variance) / np.sum(variance)
        return out


def fit_eigenmodes(numbers: Floats) -> Eigenmodes:
    """Of the numbers (P, N) of two people or more."""
    mean = numbers.mean(axis=0)
    _, size, modes = np.linalg.svd(numbers - mean, full_matrices=False)
    largest = np.take_along_axis(modes, np.abs(modes).argmax(axis=1, keepdims=True), axis=1)
    return Eigenmodes(mean, modes * np.sign(largest), size / np.sqrt(len(numbers) - 1.0))


def normalise_by_tibia(length_m: Floats) -> Floats:
    """Lengths (P, 24) over each person's left tibia."""
    out: Floats = length_m / length_m[:, [BONES.index("ltibia")]]
    return out


def symmetrise(length_m: Floats) -> Floats:
    """Lengths (P, 24) with left and right alike: the mean of both."""
    out: Floats = (length_m + length_m[:, OTHER_SIDE]) / 2.0
    return out


def leave_one_out_errors_m(length_m: Floats, modes: int) -> Floats:
    """Errors (P, 24) [m] of each person's lengths, as told by so many modes of all the others; 0: by their mean."""
    errors = np.empty_like(length_m)
    for person in range(len(length_m)):
        others = fit_eigenmodes(np.delete(length_m, person, axis=0))
        off, kept = length_m[person] - others.mean, others.modes[:modes]
        errors[person] = off - off @ kept.T @ kept
    return errors


def explained_variance_by_count(length_m: Floats, counts: range, seed: int) -> Floats:
    """(C, 3) lowest, median and highest share that five modes keep of so many of the people, drawn again and again."""
    found = np.empty((len(counts), 3))
    for row, count in enumerate(counts):
        rng = generator(seed, "eigenmodes", count)
        chosen = np.array([rng.choice(len(length_m), count, replace=False) for _ in range(SUBSAMPLES)])
        off = length_m[chosen] - length_m[chosen].mean(axis=1, keepdims=True)
        variance = np.linalg.svd(off, compute_uv=False) ** 2
        shares = variance[:, :MODES].sum(axis=1) / variance.sum(axis=1)
        found[row] = np.quantile(shares, [0.0, 0.5, 1.0])
    return found
