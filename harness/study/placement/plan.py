"""The plan of a placement study: its scenarios, its candidates, and the sets that are known in advance.

Unknown names, impossible placements and too many cells are refused here, before anything is written.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from harness.compare import margin_of
from harness.core.files import content_key
from harness.core.split import ClipPart
from harness.errors import BadInput
from harness.experiment import check_names
from harness.experiment.scenarios import Scenario, expand_clips, find_scenario, load_scenario, open_scenario_motion
from harness.mocap import LibraryFolders, MotionSource
from harness.results import current_circumstances
from harness.results.findings import CandidatePlace, PlacementFindings
from harness.score import DEFINITIONS
from harness.study.placement import search
from harness.study.placement.candidates import CandidateGroup, StationSet, names_of_places, select_groups, station_set
from harness.study.placement.config import (
    PlacementStudy,
    base_scenario,
    find_placement_study,
    load_placement_study,
)
from harness.study.placement.ranking import Costs, sets_of_claim
from harness.study.placement.refinement import check_unit_count
from harness.study.placement.set_results import SetRequest, clips_of_units, link_rate_hz


@dataclass(frozen=True)
class PlacementPlan:
    """A checked placement study."""

    study: PlacementStudy
    groups: tuple[CandidateGroup, ...]
    scenario: Scenario
    """The scenario with the test clips, on which sets are chosen."""
    held_out: Scenario | None
    """The scenario with the held-out clips; None without any."""
    condition_scenarios: Mapping[str, Scenario]
    """Condition -> its scenario."""
    motion: str
    """Title of the motion."""
    folder: LibraryFolders | None = None
    """Motion library; None for synthetic motion."""

    def units(self, scenario: Scenario) -> tuple[str, ...]:
        """The units of statistics in one of its scenarios, sorted."""
        return tuple(clips_of_units(scenario, self.folder))

    @property
    def cost_sign(self) -> float:
        """Factor between errors and costs, for which lower is better: 1 or -1."""
        return 1.0 if margin_of(self.study.metric).rise_is_worse else -1.0

    @property
    def unit(self) -> str:
        """The unit of the metric."""
        return DEFINITIONS[self.study.metric].unit

    @property
    def places(self) -> tuple[CandidatePlace, ...]:
        """All candidate places."""
        return tuple(dict.fromkeys(place for unit in self.groups for place in unit))

    def request(self, scenario: Scenario, sets: Iterable[StationSet]) -> SetRequest:
        """A request to measure sets in a scenario."""
        return scenario, tuple(dict.fromkeys(sets))

    def rate_hz(self, size: int) -> float:
        """Rate of a number of stations [Hz]."""
        return link_rate_hz(self.scenario, size, self.study.link)

    def known_sets(self) -> list[StationSet]:
        """Sets that are measured in any case; requested together they keep all workers busy."""
        study, sets = self.study, list[StationSet]()
        if study.ablate:
            full, less = search.ablation_sets(study.ablate, self.groups)
            sets += [full, *less.values()]
        if study.add:
            base, more = search.addition_sets(study.add, self.groups)
            sets += [*([base] if base else []), *more.values()]
        if study.exhaustive:
            sets += search.exhaustive_sets(study.exhaustive, self.groups)
        for claim in study.claim:
            claimed, others, full = sets_of_claim(claim, self.groups)
            sets += [claimed, *others, full]
        return list(dict.fromkeys(sets))

    def first_sets(self) -> list[StationSet]:
        """Sets that are measured in any case, of the size that has most of them; the first steps of a search if none.

        The pilot of the study is chosen from them (see `power.choose_pilot`).
        """
        study, known = self.study, self.known_sets()
        if not known and study.greedy:
            base = select_groups(study.greedy.base, self.groups, "greedy.base") if study.greedy.base else ()
            added = [unit for unit in select_groups(study.greedy.of, self.groups, "greedy.of") if unit not in base]
            known = [station_set([*base, unit], self.groups) for unit in added]
        sizes = Counter(map(len, known))
        size = max(sizes, key=lambda size: (sizes[size], size), default=0)
        return [stations for stations in known if len(stations) == size]

    def cell_count(self, clips: int) -> int:
        """Number of cells with so many clips to choose on; of a search without a fixed number of steps, the most."""
        study, held = self.study, len(self.study.held_out)
        sets = len(self.known_sets())
        if study.greedy:
            sets += study.greedy.most * len(self.groups)
        if study.refine:
            sets += 4 * study.refine.size * study.refine.most_moves
        sizes = len({len(stations) for stations in self.known_sets()}) or (study.greedy.most if study.greedy else 1)
        compared = len(self.sets_to_compare(self.known_sets()))
        elsewhere = sum(len(s.motion.test) * len(s.methods) for s in self.condition_scenarios.values()) * compared
        return (sets * clips + sizes * held) * len(study.methods) + elsewhere

    def sets_to_compare(self, measured: Iterable[StationSet]) -> list[StationSet]:
        """The sets that every condition ranks: those of `exhaustive`, else all measured; none without conditions."""
        if not self.condition_scenarios and len(self.study.methods) < 2:
            return []
        candidates = search.exhaustive_sets(self.study.exhaustive, self.groups) if self.study.exhaustive else measured
        return [
            stations
            for stations in candidates
            if len(stations) == self.study.condition_size and not is_refined(stations)
        ]

    def describe_link(self, sizes: Sequence[int]) -> str:
        """Describe the rates that the serial line allows."""
        if not self.study.link:
            return ""
        tracker = self.scenario.tracker
        slowed = [size for size in sizes if self.rate_hz(size) < tracker.rate_hz]
        if not slowed:
            return f"a line of {tracker.baud} baud carries all sets at {tracker.rate_hz:g} Hz"
        rates = ", ".join(f"{size} at {self.rate_hz(size):.4g} Hz" for size in slowed)
        return f"a line of {tracker.baud} baud carries {rates}; fewer stations run at {tracker.rate_hz:g} Hz"

    def empty_findings(self, command: str, sizes: Sequence[int]) -> PlacementFindings:
        """Findings that say what is asked, with sets of these sizes, and have no results yet."""
        study, scenario = self.study, self.scenario
        return PlacementFindings(
            name=study.name,
            title=study.title,
            metric=study.metric,
            unit=self.unit,
            motion=self.motion,
            behaviours=tuple(dict.fromkeys(scenario.motion.behaviours)),
            methods=scenario.methods,
            noise=scenario.noise_label,
            link=self.describe_link(sizes),
            seed=scenario.seed,
            command=command,
            candidates=self.places,
            tried=(),
            best=(),
            circumstances=current_circumstances(),
            sizes=study.sizes,
            better="lower" if self.cost_sign > 0.0 else "higher",
        )

    def costs(self, errors: Costs) -> dict[str, float | None]:
        """Convert errors to costs; the conversion is its own inverse."""
        return {clip: None if value is None else self.cost_sign * value for clip, value in errors.items()}


def is_refined(stations: StationSet) -> bool:
    """Whether `refine` moved any station of a set."""
    return any(place.moved_from for place in stations)


def plan_placement(path: Path | str, folder: LibraryFolders | None) -> PlacementPlan:
    """Plan the study of a TOML file; BadFile, BadInput, UnknownName."""
    file = find_placement_study(path)
    return plan_study(load_placement_study(file), lambda name: load_scenario(find_scenario(name, file.parent)), folder)


def plan_study(study: PlacementStudy, load: Callable[[str], Scenario], folder: LibraryFolders | None) -> PlacementPlan:
    """Plan a study whose scenarios `load` gives by name; BadInput, UnknownName."""
    scenario = expand_clips(base_scenario(study, load), folder)
    conditions = {c.name: expand_clips(base_scenario(study, load, c), folder) for c in study.condition}
    conditions = {name: _name_by_places(condition, scenario) for name, condition in conditions.items()}
    source = open_scenario_motion(scenario.motion, folder, scenario.seed)
    held_out = _held_out_scenario(study, scenario, source)
    plan = PlacementPlan(study, study.groups(), scenario, held_out, conditions, source.title, folder)
    for checked in filter(None, (scenario, held_out, *conditions.values())):
        first = replace(checked, worn=names_of_places(station_set(plan.groups[:1], plan.groups)))
        check_names([first], folder)
    if study.exhaustive:
        search.check_cell_count(study.exhaustive, plan.groups, len(scenario.motion.test) * len(scenario.methods))
    if study.refine and study.refine.set:
        start = station_set(select_groups(study.refine.set, plan.groups, "refine.set"), plan.groups)
        check_unit_count(start, len(plan.units(scenario)))
    for size in {*(len(stations) for stations in plan.known_sets()), *study.sizes}:
        plan.rate_hz(size)
    return plan


def _name_by_places(condition: Scenario, own: Scenario) -> Scenario:
    """A condition with a name of its own where it moves stations: the name of a cell leaves their places out."""
    if condition.stations == own.stations:
        return condition
    return replace(condition, name=f"{condition.name}_{content_key(condition.content()['stations'])[:8]}")


def _held_out_scenario(study: PlacementStudy, scenario: Scenario, source: MotionSource) -> Scenario | None:
    """The scenario with the held-out clips; their behaviours are the source's where the test clips have several."""
    motion = scenario.motion
    if not study.held_out:
        return None
    if both := sorted(set(study.held_out) & set(motion.test)):
        raise BadInput(f"held_out: {', '.join(both)} is also a test clip.", "Remove it from one of the two.")
    behaviours = motion.behaviours[:1]
    if len(set(motion.behaviours)) > 1:
        behaviours = tuple(source.behaviour(ClipPart.parse(clip).clip) for clip in study.held_out)
    return replace(scenario, motion=replace(motion, test=study.held_out, behaviours=behaviours))
