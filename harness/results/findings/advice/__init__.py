"""What a placement study recommends, and on what grounds."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.results.findings.advice.placement_advice import Effort as Effort
    from harness.results.findings.advice.placement_advice import HalvingRound as HalvingRound
    from harness.results.findings.advice.placement_advice import PlacementAdvice as PlacementAdvice
    from harness.results.findings.advice.placement_advice import SecondChoice as SecondChoice
    from harness.results.findings.advice.placement_advice import SecondMethod as SecondMethod
    from harness.results.findings.advice.placement_advice import SetError as SetError
    from harness.results.findings.advice.placement_advice import SizeStep as SizeStep
else:
    __getattr__, __dir__ = lazy_names(__name__)
