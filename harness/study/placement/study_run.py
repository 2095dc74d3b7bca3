"""What every placement study does while it runs: measure sets, test the chosen ones on held-out clips, summarise.

`question_run` and `file_run` say which sets are measured, and how some of them are chosen.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from harness.compare import count_units
from harness.experiment.scenarios import Scenario
from harness.results.findings import BestSet, PlacementFindings, StationNames
from harness.results.findings.advice import SetError
from harness.study.placement.candidates import StationSet, names_of_places
from harness.study.placement.plan import PlacementPlan
from harness.study.placement.ranking import Costs, summarise_set
from harness.study.placement.set_results import SetResults


@dataclass
class StudyRun:
    """A placement study while it runs. Costs are errors, with the opposite sign where high values are good."""

    plan: PlacementPlan
    cache: SetResults

    def measure_in(
        self, scenario: Scenario, sets: Sequence[StationSet], methods: tuple[str, ...] = ()
    ) -> dict[StationSet, dict[str, float | None]]:
        """Set -> unit -> cost in a scenario, with its methods or some of them."""
        errors = self.cache.errors(self.plan.request(scenario, sets), self.plan.study.metric, methods)
        return {stations: self.plan.costs(by_unit) for stations, by_unit in errors.items()}

    def findings_of(self, costs: Mapping[StationSet, Costs], **found: Any) -> PlacementFindings:
        """The findings on the sets that were measured to choose, with other fields of `PlacementFindings`."""
        plan, sizes = self.plan, sorted({len(stations) for stations in costs})
        rates_hz = {size: plan.rate_hz(size) for size in sizes}
        return replace(
            plan.empty_findings(self.cache.command, sizes),
            tried=tuple(
                summarise_set(names_of_places(stations), rates_hz[len(stations)], plan.costs(by_unit))
                for stations, by_unit in costs.items()
            ),
            failures=dict(self.cache.failures),
            planned=self.cache.planned,
            **found,
        )


def costs_by_name(costs: Mapping[StationSet, Costs]) -> dict[StationNames, Costs]:
    """Costs by the names of the sets instead of their places."""
    return {names_of_places(stations): by_unit for stations, by_unit in costs.items()}


def add_held_out_error(best: BestSet, error: SetError) -> BestSet:
    """The best set of a size with its error on held-out clips."""
    return replace(
        best,
        held_out=error.error,
        held_out_low=error.low,
        held_out_high=error.high,
        held_out_clips=error.units,
    )


def choice_note(chosen_on: Iterable[str], tested_on: Iterable[str]) -> str:
    """The units on which sets were chosen, and those on which they were tested, in a sentence."""
    return (
        f"Sets were chosen on {count_units(chosen_on)} and then tested on held-out clips of {count_units(tested_on)}."
    )
