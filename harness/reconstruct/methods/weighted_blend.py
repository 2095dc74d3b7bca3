"""The weighted blend of the neighbours: the baseline of Kim, Seol and Lee 2012 (docs/methods.md C3)."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.reconstruct.methods.local_regression import LocalRegression


@dataclass(frozen=True)
class WeightedBlend(LocalRegression):
    """A `Method`."""

    name: str = "weighted_blend"
    summary: str = "the nearest examples blended by their closeness, smoothed, then fitted to the trackers"
    neighbours: int = 16
    power: float = 4.0
    """Weights fall with this power of the distance."""

    def weigh(self, inputs: Floats, query: Floats, outputs: Floats) -> Floats:
        return _inverse_distance_weights(inputs, query, self.power)


@compiled
def _inverse_distance_weights(inputs: Floats, query: Floats, power: float) -> Floats:
    """`WeightedBlend.weigh`."""
    out: Floats = np.empty(len(inputs))
    for i in range(len(inputs)):
        squared = 0.0
        for k in range(len(query)):
            squared += (inputs[i, k] - query[k]) ** 2
        out[i] = max(squared, 1e-12) ** (-0.5 * power)
    out /= out.sum()
    return out
