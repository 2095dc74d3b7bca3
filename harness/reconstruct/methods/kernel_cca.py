"""Kernel CCA (`kernel_cca`): regression by kernel canonical correlation analysis (docs/papers.md B).

For every frame the neighbours are the m training pairs of a kernel CCA between features and postures (`cca`). It gives
a weight for each neighbour. All other steps are those of `local_regression`: neighbours, smoothing, inverse kinematics.

Source: Kim, Seol and Lee 2012, eq. 2 to 6. Ours: centred Gram matrices and the ridge of eq. 3 (docs/papers.md E),
which also regularises eq. 4 unless `regularise_projection` is false.

Options: `neighbours` 12, `bases` 12, `kappa` 0.3, `width` 1, and those of `LocalRegression`;
scenarios/tune_kernel_cca.toml chose them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

from harness.core.arrays import Floats
from harness.core.ranges import Range
from harness.reconstruct.methods import cca
from harness.reconstruct.methods.local_regression import LocalRegression


@dataclass(frozen=True)
class KernelCca(LocalRegression):
    """Options of kernel CCA, a `Method`; scenarios/tune_kernel_cca.toml chose the defaults."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {**LocalRegression.RENAMED_KEYS, "held": "regularise_projection"}

    name: str = "kernel_cca"
    summary: str = (
        "kernel canonical correlation regression on the nearest examples, smoothed, then fitted to the trackers"
    )
    neighbours: Annotated[int, Range(1, 1_000_000)] = 12
    """k of eq. 2: neighbours of a frame; those of the frame before are added."""
    bases: Annotated[int, Range(1, 1_000_000)] = 12
    """l of eq. 4: number of canonical bases, at most m - 1."""
    kappa: Annotated[float, Range(0.0, 1e6)] = 0.3
    """Ridge of eq. 3, as a share of each Gram matrix's mean eigenvalue."""
    regularise_projection: bool = True
    """Whether the ridge of eq. 3 regularises the projection of eq. 4 too; false is eq. 4 as printed."""
    width: Annotated[float, Range(1e-06, 1e6)] = 1.0
    """Standard deviation of the Gaussian kernels, in RMS distances of two examples."""

    def weigh(self, inputs: Floats, query: Floats, outputs: Floats) -> Floats:
        return cca.regression_weights(
            inputs, query, outputs, self.width, self.bases, self.kappa, self.regularise_projection
        )


LITERAL = KernelCca(
    "kernel_cca:literal",
    "Kim et al. 2012 as printed, eq. 2 to 6, with constants chosen on validation clips",
    neighbours=8,
    index="kd_tree",
    jump_m=math.inf,
    outputs="quaternions",
    bases=6,
    kappa=0.01,
    regularise_projection=False,
)
"""The paper as printed. It leaves open the number of bases l, the ridge without which eq. 3 is singular, the prior and
the formulas of the final IK: docs/methods.md."""
