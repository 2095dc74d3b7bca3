"""Kernel CCA on the neighbours: the method of Kim, Seol and Lee 2012 (docs/methods.md B)."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.reconstruct import cca
from harness.reconstruct.local_regression import LocalRegression


@dataclass(frozen=True)
class KernelCca(LocalRegression):
    """A `Method`."""

    name: str = "kernel_cca"
    summary: str = "kernel canonical correlation regression on the nearest examples, smoothed, then fitted"
    neighbours: int = 12
    bases: int = 12
    """l of eq. 4, and at most m - 1."""
    kappa: float = 0.3
    """How strongly eq. 3 is regularised."""
    held: bool = True
    """Whether eq. 4 is, too."""
    width: float = 1.0
    """sigma of the kernels, in root mean square distances of two examples."""

    def weigh(self, inputs: Floats, query: Floats, outputs: Floats) -> Floats:
        middle = inputs.mean(axis=0)
        x = inputs - middle
        away = x - (query - middle)
        kernel_x, sharpness = cca.gaussian(cca.squared_distances(x), self.width)
        kernel_y, sharpness_y = cca.gaussian(cca.squared_distances(outputs - outputs.mean(axis=0)), self.width)
        if sharpness == 0.0 or sharpness_y == 0.0:  # all of them are the same
            return np.full(len(x), 1.0 / len(x))
        near = np.exp(-sharpness * np.vecdot(away, away))
        return cca.weights(kernel_x, kernel_y, near, bases=self.bases, kappa=self.kappa, held=self.held)
