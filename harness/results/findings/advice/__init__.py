"""What a placement study recommends, and on what grounds."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.results.findings.advice.placement_advice import (
        Effort,
        HalvingRound,
        PlacementAdvice,
        SecondChoice,
        SecondMethod,
        SetError,
        SizeStep,
    )
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "Effort",
    "HalvingRound",
    "PlacementAdvice",
    "SecondChoice",
    "SecondMethod",
    "SetError",
    "SizeStep",
]
