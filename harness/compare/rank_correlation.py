"""Kendall's rank correlation."""

import numpy as np

from harness.core.arrays import Floats


def tau_b(a: Floats, b: Floats) -> Floats:
    """Kendall's tau-b of (..., n) and (..., n) values, over the last axis; NaN where one side has only ties."""
    first, second = np.triu_indices(a.shape[-1], 1)
    sign_a, sign_b = (np.sign(side[..., first] - side[..., second]) for side in (a, b))
    with np.errstate(invalid="ignore"):
        out: Floats = np.sum(sign_a * sign_b, axis=-1) / np.sqrt(
            np.sum(sign_a**2, axis=-1) * np.sum(sign_b**2, axis=-1)
        )
    return out
