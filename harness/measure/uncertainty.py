"""Uncertainty budget of one measured quantity, in the terms of the GUM (JCGM 100:2008)."""

import math
from dataclasses import dataclass
from typing import Any, Literal

from harness.core.number_format import Interval

_LEVEL = 0.975
"""Upper quantile of a coverage of 95 %."""


@dataclass(frozen=True)
class BudgetComponent:
    """One source of uncertainty."""

    name: str
    standard: float
    """Standard uncertainty, in the unit of the quantity."""
    kind: Literal["A", "B"]
    """A: from the scatter of the readings; B: stated by somebody."""
    freedom: float = math.inf
    """Degrees of freedom."""


@dataclass(frozen=True)
class UncertaintyBudget:
    """Components of the uncertainty of a single reading of a quantity."""

    quantity: str
    """What is measured, such as "length of the bar"."""
    unit: str
    components: tuple[BudgetComponent, ...]
    bias: Interval
    """Mean of the readings minus the stated value; not measured without one. No reading is corrected for it."""

    @property
    def combined(self) -> float:
        """Combined standard uncertainty: the root of the sum of the squares; the bias is not among them."""
        return math.sqrt(sum(one.standard**2 for one in self.components))

    @property
    def freedom(self) -> float:
        """Effective degrees of freedom (Welch and Satterthwaite, GUM G.4.1)."""
        below = sum(one.standard**4 / one.freedom for one in self.components)
        return self.combined**4 / below if below > 0.0 else math.inf

    @property
    def coverage_factor(self) -> float:
        """Factor k of a coverage of 95 %, by Student's t with the effective degrees of freedom."""
        from scipy import special

        freedom = self.freedom
        return float(special.ndtri(_LEVEL) if math.isinf(freedom) else special.stdtrit(max(freedom, 1.0), _LEVEL))

    @property
    def expanded(self) -> float:
        """Expanded uncertainty U = k u, where the size of a bias that was not corrected is added (GUM F.2.4.5)."""
        bias = abs(self.bias.value) if self.bias.is_measured else 0.0
        return self.coverage_factor * self.combined + bias

    def as_dict(self) -> dict[str, Any]:
        """All numbers, for programs."""
        return {
            "quantity": self.quantity,
            "unit": self.unit,
            "components": [{"name": one.name, "standard": one.standard, "type": one.kind} for one in self.components],
            "bias": self.bias.as_dict(),
            "combined": self.combined,
            "coverage_factor": self.coverage_factor,
            "expanded": self.expanded,
        }
