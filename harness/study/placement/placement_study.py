"""Where trackers go: a study of candidates, tried in sets, ranked with their ties, and held against what papers say.

Nothing is chosen on the clips that are held out: modes and rankings see the scenario's test clips alone, and what they
chose is then judged on the others. Where a study holds none out, what choosing flatters the best set by is told beside
it (see `ranking.crossed`). Papers' claims are judged on the held-out clips where there are enough.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from harness.compare.paired_statistics import MIN_CLIPS, bootstrap_interval, compare_paired
from harness.errors import Outcome
from harness.experiment.cells import ProgressCallback, clear_caches
from harness.experiment.executors import TaskExecutor, run_in_process
from harness.experiment.scenario import Scenario
from harness.results import manifest
from harness.results.findings import Claim
from harness.results.placement_findings import (
    BestSet,
    PlacementFindings,
    PlacementSearch,
    StationNames,
    write_placement,
)
from harness.score.metrics import DEFINITIONS
from harness.study.papers.paper_study import open_study
from harness.study.placement import published_claims, search
from harness.study.placement.candidates import StationSet, select_groups, station_set
from harness.study.placement.cell_cache import CellCache
from harness.study.placement.config import PublishedClaim
from harness.study.placement.plan import PlacementPlan, is_refined, plan_placement
from harness.study.placement.ranking import Costs, best_by_size, complete_sets, min_clips, summarise_set
from harness.study.placement.refinement import refine_set
from harness.study.placement.search import ModeResult, names_of_places
from harness.study.placement.stability import ConditionCosts, rank_agreements, rank_by_condition

FINDINGS = "findings.json"


def run_placement(
    path: Path | str,
    out: Path,
    *,
    folder: Path | None = None,
    each: TaskExecutor = run_in_process,
    command: str = "",
    progress: ProgressCallback = lambda last, done, planned: None,
) -> tuple[PlacementFindings, Outcome]:
    """Do the study in a TOML file, and write findings.json into `out`.

    `out` is made, or resumed when it holds this study, else refused (BadInput). What a study tries may change while its
    cells are kept: modes and claims are no part of what it is. INCOMPLETE when a cell failed, NOT_COMPARABLE when
    nothing was measured; what papers say and we do not find is a result like any other.
    """
    clear_caches()  # files may have changed since the last run
    ready = plan_placement(path, folder)
    open_study(out, {"placement": ready.study.name, "motion": ready.motion, "seed": ready.scenario.seed})
    (out / "cells").mkdir(exist_ok=True)
    findings = _PlacementRun(ready, CellCache(out, folder, each, command, progress)).findings(command)
    write_placement(out / FINDINGS, findings)
    if findings.failures:
        return findings, Outcome.INCOMPLETE
    return findings, Outcome.PASS if findings.best else Outcome.NOT_COMPARABLE


class _PlacementRun:
    """One study under way."""

    def __init__(self, ready: PlacementPlan, trying: CellCache) -> None:
        self.plan, self.study, self.trying = ready, ready.study, trying
        self.costs: dict[StationSet, dict[str, float | None]] = {}
        """Of every set that was tried on the clips on which choices are made."""

    def measure(self, sets: Sequence[StationSet]) -> Mapping[StationSet, Costs]:
        errors = self.trying.errors(self.plan.request(self.plan.scenario, sets), self.study.metric)
        self.costs |= {one: self.plan.costs(found) for one, found in errors.items()}
        return {one: self.costs[one] for one in sets}

    def findings(self, command: str) -> PlacementFindings:
        ready, study, scenario = self.plan, self.study, self.plan.scenario
        self.measure(ready.known_sets())
        modes = list(self._modes())
        searches, ends = self._searches()
        best = best_by_size(
            {names_of_places(one): self.costs[one] for one in self.costs if not is_refined(one)}, ready.cost_sign
        )
        rivals = [self._rival(claim) for claim in study.claim]
        compared = ready.sets_to_compare(self.costs)
        judged = self._judged([one.stations for one in best], [*rivals, *ends])
        asked = [ready.request(one, compared) for one in ready.condition_scenarios.values()]
        self.trying.run_missing([*([ready.request(ready.held_out, judged)] if ready.held_out else []), *asked])
        held = self._on(ready.held_out, judged) if ready.held_out else {}
        each = self._elsewhere(compared)
        best = tuple(_with_held_out_error(one, held.get(one.stations, {}), ready.cost_sign) for one in best)
        rated = sorted({len(one) for one in self.costs})
        return PlacementFindings(
            name=study.name,
            title=study.title,
            metric=study.metric,
            unit=DEFINITIONS[study.metric].unit,
            motion=ready.motion,
            behaviours=tuple(dict.fromkeys(scenario.motion.behaviours)),
            methods=scenario.methods,
            noise=scenario.profile or scenario.noise + ("*" if scenario.components else ""),
            link=ready.describe_link(rated),
            seed=scenario.seed,
            command=command,
            candidates=tuple(dict.fromkeys((*ready.places, *(place for one in self.costs for place in one)))),
            tried=tuple(
                summarise_set(names_of_places(one), ready.rate_hz(len(one)), ready.costs(c))
                for one, c in self.costs.items()
            ),
            best=best,
            circumstances=manifest.current_circumstances(),
            rankings=tuple(ranking for mode in modes for ranking in mode.rankings),
            searches=tuple(_with_held_out_gain(one, held) for one in searches),
            worth=tuple(worth for mode in modes for worth in mode.worth),
            compared=tuple(map(names_of_places, compared)),
            conditions=rank_by_condition(each, list(map(names_of_places, compared)), ready.cost_sign),
            agreements=rank_agreements(each, list(map(names_of_places, compared))),
            claims=tuple(self._claims(rivals, held)),
            notes=tuple(self._notes(modes, held)),
            failures=dict(self.trying.failures),
            planned=self.trying.planned,
            better="lower" if ready.cost_sign > 0.0 else "higher",
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
        """Those that go step by step, and the sets where `refine_set` began and ended."""
        study, units, found, ends = self.study, self.plan.groups, list[PlacementSearch](), list[StationSet]()
        if study.greedy:
            found.append(search.search_greedy(study.greedy, units, self.measure))
        if study.refine:
            named = select_groups(study.refine.set, units, "refine.set") if study.refine.set else ()
            start = station_set(named, units) or search.best_measured_set(study.refine.size, self.costs)
            steps, end = refine_set(study.refine, start, self.measure, len(self.plan.scenario.motion.test))
            found.append(steps)
            ends = [start, end]
        return found, ends

    def _rival(self, claim: PublishedClaim) -> StationSet:
        """The best other set that a paper could have meant, on the clips on which choices are made."""
        _, others, _ = published_claims.sets_of_claim(claim, self.plan.groups)
        found = published_claims.best_alternative(
            [names_of_places(one) for one in others], {names_of_places(one): self.costs[one] for one in others}
        )
        return next((one for one in others if names_of_places(one) == found), ())

    def _judged(self, best: Sequence[StationNames], others: Sequence[StationSet]) -> list[StationSet]:
        """What was chosen or is claimed: it is judged on the held-out clips."""
        by_name = {names_of_places(one): one for one in self.costs}
        found = [by_name[one] for one in best] + [one for one in others if one]
        for claim in self.study.claim:
            suited, _, whole = published_claims.sets_of_claim(claim, self.plan.groups)
            found += [suited, whole]
        return list(dict.fromkeys(found))

    def _on(
        self, scenario: Scenario, sets: Sequence[StationSet], methods: tuple[str, ...] = ()
    ) -> dict[StationNames, Costs]:
        """What sets cost in a scenario, to its methods or some of them."""
        errors = self.trying.errors(self.plan.request(scenario, sets), self.study.metric, methods)
        return {names_of_places(one): self.plan.costs(found) for one, found in errors.items()}

    def _elsewhere(self, compared: Sequence[StationSet]) -> list[ConditionCosts]:
        """The study's own condition, each of its methods if there are several, and the others."""
        if not compared:
            return []
        ready, scenario = self.plan, self.plan.scenario
        own = ConditionCosts(f"{' and '.join(dict.fromkeys(scenario.motion.behaviours))} (the study's own)", "own", {})
        found = [replace(own, costs={names_of_places(one): self.costs[one] for one in compared})]
        if len(scenario.methods) > 1:
            found += [ConditionCosts(m, "method", self._on(scenario, compared, (m,))) for m in scenario.methods]
        for name, other in ready.condition_scenarios.items():
            found.append(ConditionCosts(name, _condition_kind(scenario, other), self._on(other, compared)))
        return found

    def _claims(self, rivals: Sequence[StationSet], held: Mapping[StationNames, Costs]) -> Iterator[Claim]:
        clips = len(self.study.held_out)
        on, costs = f"judged on {clips} clips on which nothing was chosen", held
        if clips < MIN_CLIPS:
            on = "judged on the clips on which the best other was chosen, which flatters that one"
            costs = {names_of_places(one): costs for one, costs in self.costs.items()}
        unit = DEFINITIONS[self.study.metric].unit
        for claim, rival in zip(self.study.claim, rivals, strict=True):
            suited, _, whole = published_claims.sets_of_claim(claim, self.plan.groups)
            yield from published_claims.evaluate_claim(
                claim,
                names_of_places(suited),
                names_of_places(rival),
                names_of_places(whole),
                costs,
                unit=unit,
                judged_on=on,
            )

    def _notes(self, modes: Sequence[ModeResult], held: Mapping[StationNames, Costs]) -> Iterator[str]:
        """What a reader must know."""
        clips = len(self.plan.scenario.motion.test)
        if held:
            yield (
                f"Chosen on {clips} clips; what was chosen is judged on {len(self.study.held_out)} others, on which "
                "nothing was chosen."
            )
        else:
            yield (
                f"Chosen and judged on the same {clips} clips, which flatters what was chosen; beside it stands the "
                "error of the set that the other clips would have chosen, clip by clip."
            )
        for ranking in (ranking for mode in modes for ranking in mode.rankings):
            if clips < (least := min_clips(len(ranking.rows) - 1)) and len(ranking.rows) > 1:
                yield (
                    f"{ranking.title}: {clips} clips cannot show that any of {len(ranking.rows)} sets is better than "
                    f"another; {least} might."
                )
        _, left_out = complete_sets({names_of_places(one): costs for one, costs in self.costs.items()})
        yield from left_out


def _condition_kind(own: Scenario, other: Scenario) -> str:
    """In what a condition differs."""
    for kind, differs in (
        ("behaviour", own.motion != other.motion),
        ("method", own.methods != other.methods),
        ("noise", (own.noise, own.components) != (other.noise, other.components)),
    ):
        if differs:
            return kind
    return "setting"


def _with_held_out_error(best: BestSet, costs: Costs, sign: float) -> BestSet:
    """With its mean on the held-out clips."""
    values = np.array([sign * value for value in costs.values() if value is not None])
    if not len(values) or len(values) < len(costs):
        return best
    low, high = bootstrap_interval(values) if len(values) >= MIN_CLIPS else (None, None)
    mean = float(values.mean())
    return replace(best, held_out=mean, held_out_low=low, held_out_high=high, held_out_clips=len(values))


def _with_held_out_gain(found: PlacementSearch, held: Mapping[StationNames, Costs]) -> PlacementSearch:
    """With what the end saves against the beginning on the held-out clips."""
    first, last = (held.get(step.stations) for step in (found.steps[0], found.steps[-1]))
    if found.mode != "refine" or first is None or last is None or first is last:
        return found
    saved = compare_paired(first, last)
    clips = len(saved.clips)
    return replace(found, held_out=saved.mean, held_out_low=saved.low, held_out_high=saved.high, held_out_clips=clips)
