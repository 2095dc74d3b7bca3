"""Kernel CCA on the neighbours: the method of Kim, Seol and Lee 2012 (docs/methods.md B)."""

from dataclasses import dataclass

from harness.core.arrays import Floats
from harness.reconstruct.methods import cca
from harness.reconstruct.methods.local_regression import LocalRegression


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
        return cca.regression_weights(inputs, query, outputs, self.width, self.bases, self.kappa, self.held)
