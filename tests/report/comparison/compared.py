"""Comparisons as `harness compare` makes them, of sides whose differences are known."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from harness.compare import Comparison, Difference, compare_results
from harness.core.seeds import generator
from harness.errors import Outcome
from tests.compare.sides import manifest, side

METRIC = "mpjpe_mm"
OTHER = manifest(
    commit="89abcdef0123456789abcdef0123456789abcdef",
    dirty=True,
    packages={"numpy": "2.4.0"},
    constants={"local_pca": "LocalPca(neighbours=20)"},
)
CIRCUMSTANCES = ("commit", "dirty", "packages.numpy", "constants.local_pca")
CHANGES = {"ik": 0.0, "local_pca": 0.05, "dynamic_map": -0.06}
"""Method -> relative increase of the error in B: the same, worse and better."""


def scattered(change: float, clips: int) -> list[float]:
    """How many times as large the errors in B are: by about this share more on each clip."""
    if not change:
        return [1.0] * clips
    draws = generator(1, "scattered", str(change)).normal(size=clips)
    return (1.0 + change + 0.02 * np.asarray(draws)).tolist()  # type: ignore[no-any-return]


def compared(changes: Mapping[str, float | Sequence[float]] = CHANGES, clips: int = 24) -> Comparison:
    """B against A, in which every method errs as much on each clip; a share, or the factors of the clips."""
    factors = {name: scattered(by, clips) if isinstance(by, float) else by for name, by in changes.items()}
    a, b = side("baseline gate", dict.fromkeys(factors, 1.0), clips), side("results/gate", factors, clips)
    return compare_results(a, replace(b, manifest=OTHER), metrics=[METRIC])


def every_verdict(clips: int = 24) -> Comparison:
    """The same, worse, better, and a method of which it cannot be told."""
    return compared({**CHANGES, "torn": [1.5 if n % 2 else 0.55 for n in range(clips)]}, clips)


def one_line(change: float, clips: int = 24, method: str = "local_pca") -> Difference:
    """The gated line of one method."""
    return next(line for line in compared({method: change}, clips).differences if line.gated)


def nothing_compared(**changes: object) -> Comparison:
    """A comparison without a line, as of sides whose inputs differ."""
    found = replace(compared({"ik": 0.0}, 6), differences=(), outcome=Outcome.NOT_COMPARABLE)
    return replace(found, **changes)  # type: ignore[arg-type]  # of names that it has
