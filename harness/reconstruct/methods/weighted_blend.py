"""Weighted blend (`weighted_blend`): neighbours weighted by their closeness (docs/papers.md C3).

Weights fall with a power of the distance in feature space. All other steps are those of `local_regression`: neighbours,
smoothing and inverse kinematics.

Source: the baseline of Kim, Seol and Lee 2012, which prints no weights; the power is ours.

Options: `neighbours` 16, `power` 4, and those of `LocalRegression`; scenarios/tune_weighted_blend.toml chose them.
"""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.core.ranges import Range
from harness.reconstruct.methods.local_regression import LocalRegression


@dataclass(frozen=True)
class WeightedBlend(LocalRegression):
    """Options of the weighted blend, a `Method`."""

    name: str = "weighted_blend"
    summary: str = "nearest examples weighted by inverse distance, smoothed, then fitted to the trackers"
    neighbours: Annotated[int, Range(1, 1_000_000)] = 16
    """k of eq. 2: neighbours of a frame; those of the frame before are added."""
    power: Annotated[float, Range(0.0, 100.0)] = 4.0
    """Exponent of the weights, distance^-power."""

    def weigh(self, inputs: Floats, query: Floats, outputs: Floats) -> Floats:
        return _inverse_distance_weights(inputs, query, self.power)


LITERAL = WeightedBlend(
    "weighted_blend:literal",
    "the baseline of Kim et al. 2012: 8 neighbours by inverse distance, with the steps of kernel_cca:literal",
    neighbours=8,
    index="kd_tree",
    jump_m=math.inf,
    outputs="quaternions",
    power=1.0,
)
"""The paper names the baseline and prints no weights; inverse distance is the plainest choice: docs/methods.md."""


@compiled
def _inverse_distance_weights(inputs: Floats, query: Floats, power: float) -> Floats:
    """(m,) weights distance^-power of inputs (m, n) for a query (n,), of sum 1."""
    out: Floats = np.empty(len(inputs))
    for i in range(len(inputs)):
        squared = 0.0
        for k in range(len(query)):
            squared += (inputs[i, k] - query[k]) ** 2
        out[i] = max(squared, 1e-12) ** (-0.5 * power)
    out /= out.sum()
    return out
