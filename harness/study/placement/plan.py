"""What a placement study will do: its scenarios, its candidates, the sets known from the beginning, all checked.

Everything that does not exist, cannot be worn, or would be absurdly much is refused here, before anything is written.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from harness.compare.margins import margin_of
from harness.errors import BadInput
from harness.experiment.cells import check_names, open_scenario_motion
from harness.experiment.scenario import Scenario, expand_clips
from harness.results.placement_findings import StationPlacement
from harness.study.placement import published_claims, search
from harness.study.placement.candidates import CandidateGroup, StationSet, select_groups, station_set
from harness.study.placement.cell_cache import SetRequest, link_rate_hz
from harness.study.placement.config import PlacementStudy, base_scenario, find_placement_study, load_placement_study
from harness.study.placement.ranking import Costs
from harness.study.placement.refinement import check_clip_count
from harness.study.placement.search import names_of_places


@dataclass(frozen=True)
class PlacementPlan:
    """One study, ready to be done."""

    study: PlacementStudy
    groups: tuple[CandidateGroup, ...]
    scenario: Scenario
    """With the clips on which everything is chosen."""
    held_out: Scenario | None
    """The same with the clips on which nothing is."""
    condition_scenarios: Mapping[str, Scenario]
    """Condition -> its scenario."""
    motion: str

    @property
    def cost_sign(self) -> float:
        """Costs are errors times this: the less the better."""
        return 1.0 if margin_of(self.study.metric).rise_is_worse else -1.0

    @property
    def places(self) -> tuple[StationPlacement, ...]:
        return tuple(dict.fromkeys(place for unit in self.groups for place in unit))

    def request(self, scenario: Scenario, sets: Iterable[StationSet]) -> SetRequest:
        return SetRequest(scenario, tuple(dict.fromkeys(sets)), self.study.link)

    def rate_hz(self, size: int) -> float:
        """Of so many stations."""
        return link_rate_hz(self.scenario, size, self.study.link)

    def known_sets(self) -> list[StationSet]:
        """That will be tried whatever comes out: asked for at once they keep all workers busy."""
        study, found = self.study, list[StationSet]()
        if study.ablate:
            full, less = search.ablation_sets(study.ablate, self.groups)
            found += [full, *less.values()]
        if study.add:
            base, more = search.addition_sets(study.add, self.groups)
            found += [*([base] if base else []), *more.values()]
        if study.exhaustive:
            found += search.exhaustive_sets(study.exhaustive, self.groups)
        for claim in study.claim:
            suited, others, whole = published_claims.sets_of_claim(claim, self.groups)
            found += [suited, *others, whole]
        return list(dict.fromkeys(found))

    def sets_to_compare(self, tried: Iterable[StationSet]) -> list[StationSet]:
        """The sets that every condition ranks, those of `exhaustive` if there are; none without another condition."""
        if not self.condition_scenarios and len(self.study.methods) < 2:
            return []
        alike = search.exhaustive_sets(self.study.exhaustive, self.groups) if self.study.exhaustive else tried
        return [one for one in alike if len(one) == self.study.condition_size and not is_refined(one)]

    def describe_link(self, sizes: Sequence[int]) -> str:
        """In words."""
        if not self.study.link:
            return ""
        tracker = self.scenario.tracker
        slowed = [size for size in sizes if self.rate_hz(size) < tracker.rate_hz]
        if not slowed:
            return f"a line of {tracker.baud} baud carries all that were tried at {tracker.rate_hz:g} Hz"
        rates = ", ".join(f"{size} at {self.rate_hz(size):.4g} Hz" for size in slowed)
        return f"a line of {tracker.baud} baud carries {rates}, fewer at {tracker.rate_hz:g} Hz"

    def costs(self, errors: Costs) -> dict[str, float | None]:
        """The other way round as well."""
        return {clip: None if value is None else self.cost_sign * value for clip, value in errors.items()}


def is_refined(one: StationSet) -> bool:
    """Whether `refine` moved any of them."""
    return any(place.moved_from for place in one)


def plan_placement(path: Path | str, folder: Path | None) -> PlacementPlan:
    """Of a study's TOML file; BadFile, BadInput, UnknownName."""
    file = find_placement_study(path)
    study = load_placement_study(file)
    scenario = expand_clips(base_scenario(study, file.parent), folder)
    elsewhere = {one.name: expand_clips(base_scenario(study, file.parent, one), folder) for one in study.condition}
    held_out = _held_out_scenario(study, scenario)
    source = open_scenario_motion(scenario.motion, folder, scenario.seed)
    made = PlacementPlan(study, study.groups(), scenario, held_out, elsewhere, source.title)
    for one in filter(None, (scenario, held_out, *elsewhere.values())):
        alone = replace(one, worn=names_of_places(station_set(made.groups[:1], made.groups)))
        check_names([alone], folder)
    if study.exhaustive:
        search.check_cell_count(study.exhaustive, made.groups, len(scenario.motion.test) * len(scenario.methods))
    if study.refine and study.refine.set:
        start = station_set(select_groups(study.refine.set, made.groups, "refine.set"), made.groups)
        check_clip_count(start, len(scenario.motion.test))
    for size in {len(one) for one in made.known_sets()}:
        made.rate_hz(size)
    return made


def _held_out_scenario(study: PlacementStudy, scenario: Scenario) -> Scenario | None:
    motion = scenario.motion
    if not study.held_out:
        return None
    if both := sorted(set(study.held_out) & set(motion.test)):
        raise BadInput(f"held_out: {', '.join(both)} is also chosen on.", "Remove it from one of the two.")
    if len(set(motion.behaviours)) > 1:
        raise BadInput("held_out beside test clips of several behaviours.", "Hold out in a study of one behaviour.")
    return replace(scenario, motion=replace(motion, test=study.held_out, behaviours=motion.behaviours[:1]))
