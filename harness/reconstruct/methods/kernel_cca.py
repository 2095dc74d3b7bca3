"""Kernel CCA on the neighbours: the method of Kim, Seol and Lee 2012 (docs/methods.md B)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from harness.core.arrays import Floats
from harness.reconstruct.methods import cca
from harness.reconstruct.methods.local_regression import LocalRegression


@dataclass(frozen=True)
class KernelCca(LocalRegression):
    """Options of kernel CCA, a `Method`; scenarios/tune_kernel_cca.toml chose the defaults."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {"held": "regularise_projection"}

    name: str = "kernel_cca"
    summary: str = "kernel canonical correlation regression on the nearest examples, smoothed, then fitted"
    neighbours: int = 12
    bases: int = 12
    """l of eq. 4, and at most m - 1."""
    kappa: float = 0.3
    """How strongly eq. 3 is regularised."""
    regularise_projection: bool = True
    """Whether the ridge of eq. 3 regularises the projection of eq. 4 too; false is eq. 4 as printed."""
    width: float = 1.0
    """sigma of the kernels, in root mean square distances of two examples."""

    def weigh(self, inputs: Floats, query: Floats, outputs: Floats) -> Floats:
        return cca.regression_weights(
            inputs, query, outputs, self.width, self.bases, self.kappa, self.regularise_projection
        )
