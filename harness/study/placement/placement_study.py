"""A placement study: candidate places are measured in sets, ranked with their ties, and compared with papers' claims.

Modes and rankings use the scenario's test clips only. What they chose is then measured on the held-out clips. Where a
study has no held-out clips, the cross-validated error of the best set is reported beside it (see
`ranking.cross_validated_cost`). Papers' claims are tested on the held-out clips where there are enough of them.
"""

import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from harness.compare import MIN_UNITS, compare_paired, count_needed, count_units, mean_interval
from harness.core.progress import ProgressCallback
from harness.errors import Outcome
from harness.experiment import check_names, clear_caches
from harness.experiment.scenarios import Scenario
from harness.experiment.workers import TaskExecutor, run_in_process
from harness.mocap import LibraryFolders
from harness.results import open_study
from harness.results.files import FINDINGS
from harness.results.findings import (
    BenchmarkStatement,
    BestSet,
    PlacementFindings,
    PlacementSearch,
    StationNames,
    StatisticalPower,
    write_placement,
)
from harness.score import DEFINITIONS
from harness.study.placement import search
from harness.study.placement.answer import QuestionRun
from harness.study.placement.candidates import StationSet, select_groups, station_set
from harness.study.placement.config import PublishedClaim
from harness.study.placement.plan import PlacementPlan, is_refined, plan_placement, plan_study
from harness.study.placement.power import choose_pilot, estimate_power
from harness.study.placement.question import PlacementQuestion, question_study
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
    summarise_set,
)
from harness.study.placement.refinement import refine_set
from harness.study.placement.search import ModeResult, names_of_places
from harness.study.placement.set_results import SetResults

Announce = Callable[[StatisticalPower | str], None]
"""Receives what a study can show before its cells run, and lines about the search of a question."""


def run_placement(
    asked: Path | str | PlacementQuestion,
    out: Path,
    *,
    folder: LibraryFolders | None = None,
    executor: TaskExecutor = run_in_process,
    jobs: int = 1,
    command: str = "",
    progress: ProgressCallback = lambda last, done, planned: None,
    announce: Announce = lambda news: None,
) -> tuple[PlacementFindings, Outcome]:
    """Run the study in a TOML file, or the one that answers a question, and write findings.json into `out`.

    Without `folder` a question's motion is built in, else the library's. The first sets of a file's study are measured
    as a pilot; `announce` is told what the study can show, and how long it will take with `jobs` workers, before the
    other cells run. The sets of a question are searched by halves (see `answer`).

    `out` is created, or resumed when it holds this study, else refused (BadInput). Its lock is held meanwhile. Modes
    and claims are not part of the identity of a study: they may change while its cells are kept. The outcome is
    INCOMPLETE when a cell failed, NOT_COMPARABLE when nothing was measured, or not every set because of its line, else
    PASS: a claim that is not reproduced is a result.
    """
    clear_caches()  # files may have changed since the last run
    question = None
    if isinstance(asked, PlacementQuestion):
        question = question_study(asked, folder)
        scenario = question.scenario
        plan = plan_study(question.study, lambda name: scenario, folder)
        check_names([replace(plan.scenario, methods=(asked.second,))] if asked.second else [], folder)
    else:
        plan = plan_placement(asked, folder)
    cache = SetResults(out, folder, executor, command, progress, plan.study.link)
    identity = {"placement": plan.study.name, "motion": plan.motion, "seed": plan.scenario.seed}
    with open_study(cache.out, identity):
        (cache.out / "cells").mkdir(exist_ok=True)
        if question:
            findings = QuestionRun(question, plan, cache, announce).findings()
        else:
            findings = _run_file(plan, cache, jobs, announce)
        write_placement(cache.out / FINDINGS, findings)
    if findings.failures:
        return findings, Outcome.INCOMPLETE
    return findings, Outcome.PASS if findings.best and not cache.line_loss else Outcome.NOT_COMPARABLE


def _run_file(plan: PlacementPlan, cache: SetResults, jobs: int, announce: Announce) -> PlacementFindings:
    """Measure the first sets of a plan as a pilot, then all."""
    sets = choose_pilot(plan.first_sets())
    pilot = _PlacementRun(plan, cache).measure(sets) if sets else {}
    cell_s = statistics.median(cache.seconds) if cache.seconds else None
    units, clips = len(plan.units(plan.scenario)), len(plan.scenario.motion.test)
    power = estimate_power(
        pilot,
        units=units,
        sets=len(plan.first_sets()),
        unit=DEFINITIONS[plan.study.metric].unit,
        cell_s=cell_s,
        duration_s=lambda n: None if cell_s is None else plan.cell_count(-(-n * clips // units)) * cell_s / jobs,
    )
    announce(power)
    return _PlacementRun(plan, cache).findings(cache.command, power)


class _PlacementRun:
    """One placement study while it runs."""

    def __init__(self, plan: PlacementPlan, cache: SetResults) -> None:
        self.plan, self.study, self.cache = plan, plan.study, cache
        self.costs: dict[StationSet, dict[str, float | None]] = {}
        """Set -> costs on the test clips, for every set that was measured."""

    def measure(self, sets: Sequence[StationSet]) -> Mapping[StationSet, Costs]:
        """Measure sets on the test clips."""
        errors = self.cache.errors(self.plan.request(self.plan.scenario, sets), self.study.metric)
        self.costs |= {stations: self.plan.costs(by_clip) for stations, by_clip in errors.items()}
        return {stations: self.costs[stations] for stations in sets}

    def findings(self, command: str, power: StatisticalPower) -> PlacementFindings:
        plan, study = self.plan, self.study
        self.measure(plan.known_sets())
        modes = list(self._modes())
        searches, ends = self._searches()
        best = best_by_size(
            {names_of_places(stations): self.costs[stations] for stations in self.costs if not is_refined(stations)},
            plan.cost_sign,
        )
        alternatives = [self._best_alternative(claim) for claim in study.claim]
        compared = plan.sets_to_compare(self.costs)
        tested = self._sets_to_test([stations.stations for stations in best], [*alternatives, *ends])
        requests = [plan.request(scenario, compared) for scenario in plan.condition_scenarios.values()]
        self.cache.run_missing([*([plan.request(plan.held_out, tested)] if plan.held_out else []), *requests])
        held = self._costs_in(plan.held_out, tested) if plan.held_out else {}
        conditions = self._condition_costs(compared)
        best = tuple(
            _with_held_out_error(stations, held.get(stations.stations, {}), plan.cost_sign) for stations in best
        )
        places = tuple(dict.fromkeys((*plan.places, *(place for stations in self.costs for place in stations))))
        return replace(
            plan.empty_findings(command, sorted({len(stations) for stations in self.costs})),
            candidates=places,
            tried=tuple(
                summarise_set(names_of_places(stations), plan.rate_hz(len(stations)), plan.costs(c))
                for stations, c in self.costs.items()
            ),
            best=best,
            rankings=tuple(ranking for rankings, _ in modes for ranking in rankings),
            searches=tuple(_with_held_out_gain(stations, held) for stations in searches),
            contributions=tuple(contribution for _, contributions in modes for contribution in contributions),
            compared=tuple(map(names_of_places, compared)),
            conditions=rank_by_condition(conditions, list(map(names_of_places, compared)), plan.cost_sign),
            agreements=rank_agreements(conditions, list(map(names_of_places, compared))),
            claims=tuple(self._claims(alternatives, held)),
            notes=tuple(self._notes(modes, held)),
            power=power,
            failures=dict(self.cache.failures),
            planned=self.cache.planned,
        )

    def _modes(self) -> Iterator[ModeResult]:
        study, units = self.study, self.plan.groups
        if study.ablate:
            yield search.ablate(study.ablate, units, self.measure)
        if study.add:
            yield search.add(study.add, units, self.measure)
        if study.exhaustive:
            yield search.search_exhaustive(study.exhaustive, units, self.measure)

    def _searches(self) -> tuple[list[PlacementSearch], list[StationSet]]:
        """Results of the stepwise searches; also the first and last set of `refine_set`."""
        study, units, searches, ends = self.study, self.plan.groups, list[PlacementSearch](), list[StationSet]()
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
        best = best_alternative(
            [names_of_places(stations) for stations in others],
            {names_of_places(stations): self.costs[stations] for stations in others},
        )
        return next((stations for stations in others if names_of_places(stations) == best), ())

    def _sets_to_test(self, best: Sequence[StationNames], others: Sequence[StationSet]) -> list[StationSet]:
        """Sets that were chosen or claimed; they are measured on the held-out clips."""
        by_name = {names_of_places(stations): stations for stations in self.costs}
        tested = [by_name[names] for names in best] + [stations for stations in others if stations]
        for claim in self.study.claim:
            claimed, _, full = sets_of_claim(claim, self.plan.groups)
            tested += [claimed, full]
        return list(dict.fromkeys(tested))

    def _costs_in(
        self, scenario: Scenario, sets: Sequence[StationSet], methods: tuple[str, ...] = ()
    ) -> dict[StationNames, Costs]:
        """Costs of sets in a scenario, with its methods or some of them."""
        errors = self.cache.errors(self.plan.request(scenario, sets), self.study.metric, methods)
        return {names_of_places(stations): self.plan.costs(by_clip) for stations, by_clip in errors.items()}

    def _condition_costs(self, compared: Sequence[StationSet]) -> list[ConditionCosts]:
        """Costs under the study's own condition, with each of its methods if it has several, and in others."""
        if not compared:
            return []
        scenario = self.plan.scenario
        own = ConditionCosts(f"{' and '.join(dict.fromkeys(scenario.motion.behaviours))} (the study's own)", "own", {})
        conditions = [replace(own, costs={names_of_places(stations): self.costs[stations] for stations in compared})]
        if len(scenario.methods) > 1:
            conditions += [
                ConditionCosts(m, "method", self._costs_in(scenario, compared, (m,))) for m in scenario.methods
            ]
        for name, other in self.plan.condition_scenarios.items():
            conditions.append(ConditionCosts(name, _condition_kind(scenario, other), self._costs_in(other, compared)))
        return conditions

    def _claims(
        self, alternatives: Sequence[StationSet], held: Mapping[StationNames, Costs]
    ) -> Iterator[BenchmarkStatement]:
        units = self.plan.units(self.plan.held_out) if self.plan.held_out else ()
        basis, costs = f"tested on held-out clips of {count_units(units)}", held
        if len(units) < MIN_UNITS:
            basis = "tested on the clips on which the best other set was chosen, which favours that set"
            costs = {names_of_places(stations): costs for stations, costs in self.costs.items()}
        unit = DEFINITIONS[self.study.metric].unit
        for claim, alternative in zip(self.study.claim, alternatives, strict=True):
            claimed, _, full = sets_of_claim(claim, self.plan.groups)
            yield from evaluate_claim(
                claim,
                names_of_places(claimed),
                names_of_places(alternative),
                names_of_places(full),
                costs,
                unit=unit,
                basis=basis,
            )

    def _notes(self, modes: Sequence[ModeResult], held: Mapping[StationNames, Costs]) -> Iterator[str]:
        """Notes on how sets were chosen and tested, and what was left out."""
        units = self.plan.units(self.plan.scenario)
        counted = count_units(units)
        if held and self.plan.held_out:
            others = count_units(self.plan.units(self.plan.held_out))
            yield f"Sets were chosen on {counted} and then tested on held-out clips of {others}."
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
        _, left_out = complete_sets({names_of_places(stations): costs for stations, costs in self.costs.items()})
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


def _with_held_out_error(best: BestSet, costs: Costs, sign: float) -> BestSet:
    """Add the mean on the held-out clips."""
    values = np.array([sign * value for value in costs.values() if value is not None])
    if not len(values) or len(values) < len(costs):
        return best
    low, high = mean_interval(values) if len(values) >= MIN_UNITS else (None, None)
    mean = float(values.mean())
    return replace(best, held_out=mean, held_out_low=low, held_out_high=high, held_out_clips=len(values))


def _with_held_out_gain(result: PlacementSearch, held: Mapping[StationNames, Costs]) -> PlacementSearch:
    """Add the gain of the last set over the first on the held-out clips."""
    first, last = (held.get(step.stations) for step in (result.steps[0], result.steps[-1]))
    if result.mode != "refine" or first is None or last is None or first is last:
        return result
    gain = compare_paired(first, last)
    units = len(gain.units)
    return replace(result, held_out=gain.mean, held_out_low=gain.low, held_out_high=gain.high, held_out_clips=units)
