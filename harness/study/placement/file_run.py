"""A study in a file: its modes measure sets, and what they choose is tested.

Modes and rankings use the scenario's test clips only. What they chose is then measured on the held-out clips. Where a
study has no held-out clips, the cross-validated error of the best set is reported beside it (see
`ranking.cross_validated_cost`). Papers' claims are tested on the held-out clips where there are enough of them.
"""

import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from harness.compare import MIN_UNITS, compare_paired, count_needed, count_units
from harness.experiment.scenarios import Scenario
from harness.results.findings import (
    BenchmarkStatement,
    PlacementFindings,
    PlacementSearch,
    StationNames,
    StatisticalPower,
)
from harness.study.placement import search
from harness.study.placement.advice import set_error
from harness.study.placement.candidates import StationSet, names_of_places, select_groups, station_set
from harness.study.placement.config import PublishedClaim
from harness.study.placement.plan import is_refined
from harness.study.placement.power import choose_pilot, estimate_power
from harness.study.placement.ranking import (
    ConditionCosts,
    Costs,
    best_alternative,
    best_by_size,
    complete_sets,
    evaluate_claim,
    rank_agreements,
    rank_by_condition,
    sets_of_claim,
)
from harness.study.placement.refinement import refine_set
from harness.study.placement.search import ModeResult
from harness.study.placement.study_run import StudyRun, add_held_out_error, choice_note, costs_by_name


@dataclass
class FileRun(StudyRun):
    """The study of a file while it runs."""

    costs: dict[StationSet, Costs] = field(default_factory=dict)
    """Set -> costs on the test clips, for every set that was measured."""

    def measure(self, sets: Sequence[StationSet]) -> Mapping[StationSet, Costs]:
        """Measure sets on the test clips."""
        self.costs |= self.measure_in(self.plan.scenario, sets)
        return {stations: self.costs[stations] for stations in sets}

    def findings(self, jobs: int, announce: Callable[[StatisticalPower], None]) -> PlacementFindings:
        """Measure the first sets as a pilot, announce what the study can show, then measure and test all sets."""
        announce(power := self._power(jobs))
        plan = self.plan
        self.measure(plan.known_sets())
        modes = list(self._modes())
        searches, ends = self._searches()
        measured = {stations: costs for stations, costs in self.costs.items() if not is_refined(stations)}
        best = best_by_size(costs_by_name(measured), plan.cost_sign)
        alternatives = [self._best_alternative(claim) for claim in plan.study.claim]
        compared = plan.sets_to_compare(self.costs)
        tested = self._sets_to_test([stations.stations for stations in best], [*alternatives, *ends])
        requests = [plan.request(scenario, compared) for scenario in plan.condition_scenarios.values()]
        self.cache.run_missing([*([plan.request(plan.held_out, tested)] if plan.held_out else []), *requests])
        held = costs_by_name(self.measure_in(plan.held_out, tested)) if plan.held_out else {}
        conditions = self._condition_costs(compared)
        names = list(map(names_of_places, compared))
        errors = {s.stations: set_error(s.stations, plan.costs(held.get(s.stations, {}))) for s in best}
        return self.findings_of(
            self.costs,
            candidates=tuple(dict.fromkeys((*plan.places, *(place for stations in self.costs for place in stations)))),
            best=tuple(add_held_out_error(stations, errors[stations.stations]) for stations in best),
            rankings=tuple(ranking for rankings, _ in modes for ranking in rankings),
            searches=tuple(_with_held_out_gain(stations, held) for stations in searches),
            contributions=tuple(contribution for _, contributions in modes for contribution in contributions),
            compared=tuple(names),
            conditions=rank_by_condition(conditions, names, plan.cost_sign),
            agreements=rank_agreements(conditions, names),
            claims=tuple(self._claims(alternatives, held)),
            notes=tuple(self._notes(modes, held)),
            power=power,
        )

    def _power(self, jobs: int) -> StatisticalPower:
        """What the study can show, and how long it takes with so many workers, from its first sets."""
        plan, first = self.plan, self.plan.first_sets()
        pilot = self.measure_in(plan.scenario, choose_pilot(first)) if first else {}
        cell_s = statistics.median(self.cache.seconds) if self.cache.seconds else None
        units, clips = len(plan.units(plan.scenario)), len(plan.scenario.motion.test)

        def duration_s(units_then: int) -> float | None:
            return None if cell_s is None else plan.cell_count(-(-units_then * clips // units)) * cell_s / jobs

        return estimate_power(pilot, units=units, sets=len(first), unit=plan.unit, cell_s=cell_s, duration_s=duration_s)

    def _modes(self) -> Iterator[ModeResult]:
        study, units = self.plan.study, self.plan.groups
        if study.ablate:
            yield search.ablate(study.ablate, units, self.measure)
        if study.add:
            yield search.add(study.add, units, self.measure)
        if study.exhaustive:
            yield search.search_exhaustive(study.exhaustive, units, self.measure)

    def _searches(self) -> tuple[list[PlacementSearch], list[StationSet]]:
        """Results of the stepwise searches; also the first and last set of `refine_set`."""
        study, units, searches, ends = self.plan.study, self.plan.groups, list[PlacementSearch](), list[StationSet]()
        if study.greedy:
            searches.append(search.search_greedy(study.greedy, units, self.measure))
        if study.refine:
            groups = select_groups(study.refine.set, units, "refine.set") if study.refine.set else ()
            start = station_set(groups, units) or search.best_measured_set(study.refine.size, self.costs)
            steps, end = refine_set(study.refine, start, self.measure, len(self.plan.units(self.plan.scenario)))
            searches.append(steps)
            ends = [start, end]
        return searches, ends

    def _best_alternative(self, claim: PublishedClaim) -> StationSet:
        """The best set of a claim's size, other than the claimed one, on the test clips."""
        _, others, _ = sets_of_claim(claim, self.plan.groups)
        costs = costs_by_name({stations: self.costs[stations] for stations in others})
        best = best_alternative(list(costs), costs)
        return next((stations for stations in others if names_of_places(stations) == best), ())

    def _sets_to_test(self, best: Sequence[StationNames], others: Sequence[StationSet]) -> list[StationSet]:
        """Sets that were chosen or claimed; they are measured on the held-out clips."""
        by_name = {names_of_places(stations): stations for stations in self.costs}
        tested = [by_name[names] for names in best] + [stations for stations in others if stations]
        for claim in self.plan.study.claim:
            claimed, _, full = sets_of_claim(claim, self.plan.groups)
            tested += [claimed, full]
        return list(dict.fromkeys(tested))

    def _condition_costs(self, compared: Sequence[StationSet]) -> list[ConditionCosts]:
        """Costs under the study's own condition, with each of its methods if it has several, and in others."""
        if not compared:
            return []
        scenario = self.plan.scenario
        own = ConditionCosts(f"{' and '.join(dict.fromkeys(scenario.motion.behaviours))} (the study's own)", "own", {})
        conditions = [replace(own, costs=costs_by_name({stations: self.costs[stations] for stations in compared}))]
        if len(scenario.methods) > 1:
            conditions += [
                ConditionCosts(m, "method", costs_by_name(self.measure_in(scenario, compared, (m,))))
                for m in scenario.methods
            ]
        for name, other in self.plan.condition_scenarios.items():
            costs = costs_by_name(self.measure_in(other, compared))
            conditions.append(ConditionCosts(name, _condition_kind(scenario, other), costs))
        return conditions

    def _claims(
        self, alternatives: Sequence[StationSet], held: Mapping[StationNames, Costs]
    ) -> Iterator[BenchmarkStatement]:
        units = self.plan.units(self.plan.held_out) if self.plan.held_out else ()
        basis, costs = f"tested on held-out clips of {count_units(units)}", held
        if len(units) < MIN_UNITS:
            basis = "tested on the clips on which the best other set was chosen, which favours that set"
            costs = costs_by_name(self.costs)
        for claim, alternative in zip(self.plan.study.claim, alternatives, strict=True):
            claimed, _, full = sets_of_claim(claim, self.plan.groups)
            yield from evaluate_claim(
                claim,
                names_of_places(claimed),
                names_of_places(alternative),
                names_of_places(full),
                costs,
                unit=self.plan.unit,
                basis=basis,
            )

    def _notes(self, modes: Sequence[ModeResult], held: Mapping[StationNames, Costs]) -> Iterator[str]:
        """Notes on how sets were chosen and tested, and what was left out."""
        units = self.plan.units(self.plan.scenario)
        counted = count_units(units)
        if held and self.plan.held_out:
            yield choice_note(units, self.plan.units(self.plan.held_out))
        else:
            yield (
                f"Sets were chosen and tested on the same clips of {counted}, which favours the chosen sets. The "
                "cross-validated error is given beside: of each unit, that of the set that the other units choose."
            )
        if slow := self.cache.line_loss:
            yield slow
        for ranking in (ranking for rankings, _ in modes for ranking in rankings):
            if len(units) < (least := count_needed(len(ranking.rows) - 1)) and len(ranking.rows) > 1:
                yield (
                    f"{ranking.title}: {counted} cannot show a significant difference between {len(ranking.rows)} "
                    f"sets; at least {least} units are needed."
                )
        _, left_out = complete_sets(costs_by_name(self.costs))
        yield from left_out


def _condition_kind(own: Scenario, other: Scenario) -> str:
    """The kind of a condition: in what its scenario differs from the study's own."""
    for kind, differs in (
        ("behaviour", own.motion != other.motion),
        ("method", own.methods != other.methods),
        ("noise", (own.noise, own.components, own.physics) != (other.noise, other.components, other.physics)),
    ):
        if differs:
            return kind
    return "setting"


def _with_held_out_gain(result: PlacementSearch, held: Mapping[StationNames, Costs]) -> PlacementSearch:
    """Add the gain of the last set over the first on the held-out clips."""
    first, last = (held.get(step.stations) for step in (result.steps[0], result.steps[-1]))
    if result.mode != "refine" or first is None or last is None or first is last:
        return result
    gain = compare_paired(first, last)
    units = len(gain.units)
    return replace(result, held_out=gain.mean, held_out_low=gain.low, held_out_high=gain.high, held_out_clips=units)
