"""The answer to a question: sets are searched by halves, tested on held-out clips, and compared by a second method.

What is chosen, and on which clips, follows from the question alone. It depends neither on time nor on the number of
workers. A search that takes longer than its effort usually does goes on, and says so.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from time import monotonic

from harness.compare import compare_paired
from harness.core.number_format import count_noun
from harness.experiment.scenarios import Scenario, open_scenario_motion
from harness.results.findings import BestSet, MarginalContribution, PlacementFindings, StationNames, StatisticalPower
from harness.results.findings.advice import PlacementAdvice, SecondChoice, SecondMethod, SetError
from harness.study.placement.advice import advise, compare_levels, compare_second, find_front, set_error
from harness.study.placement.candidates import StationSet, names_of_places
from harness.study.placement.effort import FINALISTS, CellForecast, last_round, plan_rounds
from harness.study.placement.halving import Race, SearchLimits, add_stations, race_all
from harness.study.placement.power import estimate_power
from harness.study.placement.question import QuestionStudy, count_sets, list_sets
from harness.study.placement.question_clips import Units
from harness.study.placement.ranking import Costs, best_by_size, sort_by_cost
from harness.study.placement.search import contribution, shapley_contributions
from harness.study.placement.study_run import StudyRun, add_held_out_error, choice_note, costs_by_name

LATE = 1.5
"""A search is late when it takes so many times as long as its effort usually does [choice]."""


@dataclass
class QuestionRun(StudyRun):
    """One question while it is answered."""

    asked: QuestionStudy
    tell: Callable[[str], None]
    """Receives a line about the search while it runs."""
    started_s: float = field(default_factory=lambda: monotonic())
    _scenarios: dict[tuple[str, ...], Scenario] = field(default_factory=dict)
    _expected: int = 0
    """About how many cells there are, as far as it is known."""
    _late_min: float = math.inf
    """Time after which the search says that it is late [min]."""

    def __post_init__(self) -> None:
        report = self.cache.progress

        def progress(last: str, done: int, planned: int) -> None:
            report(last, done, planned)
            self._tell_if_late(done, max(planned, self._expected))

        self.cache.progress = progress

    def findings(self) -> PlacementFindings:
        """Search, test and compare."""
        asked, study = self.asked, self.plan.study
        races, stepwise = self._search()
        costs = {stations: by_unit for race in races for stations, by_unit in race.costs.items()}
        answered = [race for race in races if race.size in study.sizes and race.best]
        costs_count = bool(asked.station_costs)
        levels = find_front(answered, asked.price) if costs_count and answered else [race.best for race in answered]
        tested = list(dict.fromkeys([*(race.best for race in answered), *levels]))
        compared = [(min(len(race.finalists), FINALISTS), race.rounds[-1].units) for race in answered]
        self._expected = self._forecast(self.cache.planned, len(tested), compared).total
        held = self.measure_held_out(tested)
        errors = {names: self._error(names, by_unit) for names, by_unit in held.items()}
        steps = compare_levels(levels, held)
        advice = advise(levels, steps, errors, {race.size: race for race in answered})
        stations = count_noun(len(self.plan.places), "station")
        return self.findings_of(
            costs,
            best=tuple(_best_set(race, errors[race.best]) for race in answered),
            rankings=tuple(race.ranking(f"{race.size} of {stations}") for race in races if race.rounds),
            contributions=tuple(self._contributions(races, stepwise)),
            notes=tuple(self._notes(races, stepwise)),
            power=self._power(answered),
            effort=asked.question.search_effort,
            split="new" if asked.question.split == "subject" else "" if asked.clips.note else "known",
            base=tuple(place.name for group in asked.base for place in group),
            station_costs=dict(asked.station_costs),
            rounds=tuple(one for race in races for one in race.rounds),
            advice=advice,
            size_steps=steps,
            front=tuple(errors[names] for names in levels) if costs_count else (),
            second=self._second(answered, advice),
        )

    def _search(self) -> tuple[list[Race], bool]:
        """The races of the search, and whether one station after another was added."""
        asked, groups, sizes = self.asked, self.plan.groups, self.plan.study.sizes
        limits = SearchLimits(len(asked.clips.pool), self._clips_of_unit, asked.question.budget.cells, asked.price)
        counts = [count_sets(size, groups, asked.base) for size in sizes]
        ladder = plan_rounds(counts, limits.units, limits.clips, limits.cells)
        chosen, units = (
            last_round(counts, ladder, limits.clips, limits.cells) if ladder else (limits.cells, limits.units)
        )
        levels = sum(min(count, FINALISTS if asked.station_costs else 1) for count in counts)
        compared = [(min(count, FINALISTS), units) for count in counts]
        forecast = self._forecast(chosen, levels, compared)
        self._expected = forecast.total
        self._tell_plan(sum(counts), forecast)
        if ladder:
            sets = {size: list_sets(size, groups, asked.base) for size in sizes}
            return race_all(sets, self.measure, limits), False
        return add_stations(groups, asked.base, sizes[-1], self.measure, limits), True

    def _forecast(self, chosen: int, tested: int, compared: Sequence[tuple[int, int]]) -> CellForecast:
        """The cells of a search, of so many tested sets, and of (sets, units) that the second method measures."""
        held_out = sum(map(len, self.asked.clips.held_out.values()))
        again = sum(sets * units for sets, units in compared) * self._clips_of_unit
        return CellForecast(chosen, tested * held_out, again if self.asked.question.second else 0)

    @property
    def _clips_of_unit(self) -> int:
        """Clips of a unit, rounded up where units have different numbers of them."""
        return -(-len(self.asked.clips.test) // len(self.asked.clips.pool))

    def measure(self, sets: Sequence[StationSet], units: int) -> Mapping[StationSet, Costs]:
        """Measure sets on the first so many units of the pool."""
        return self.measure_on(self.plan.scenario, self._first_units(units), sets)

    def measure_held_out(self, sets: Sequence[StationNames]) -> dict[StationNames, Costs]:
        """Measure sets on the held-out units."""
        return costs_by_name(self.measure_on(self.plan.scenario, self.asked.clips.held_out, self._places(sets)))

    def measure_on(self, scenario: Scenario, units: Units, sets: Sequence[StationSet]) -> dict[StationSet, Costs]:
        """Set -> unit -> error. The units of a request are computed together, so that workers share them."""
        scenarios = [self._unit_scenario(scenario, unit, clips) for unit, clips in units.items()]
        self.cache.run_missing([(one, tuple(sets)) for one in scenarios])
        errors: dict[StationSet, Costs] = {stations: {} for stations in sets}
        for one in scenarios:
            for stations, by_unit in self.measure_in(one, sets).items():
                errors[stations] = {**errors[stations], **by_unit}
        return errors

    def _first_units(self, units: int) -> Units:
        return dict(list(self.asked.clips.pool.items())[:units])

    def _places(self, sets: Sequence[StationNames]) -> list[StationSet]:
        """The sets of these names."""
        places = {place.name: place for place in self.plan.places}
        return [tuple(places[name] for name in names) for names in sets]

    def _unit_scenario(self, scenario: Scenario, unit: str, clips: Sequence[str]) -> Scenario:
        """The scenario with the clips of one unit, which learns from the common examples and its own."""
        key = (*scenario.methods, *clips)
        if key not in self._scenarios:
            source = open_scenario_motion(scenario.motion, self.cache.folder, scenario.seed)
            behaviours = tuple(map(source.behaviour, clips))
            examples = (*self.asked.clips.examples, *self.asked.clips.own_examples.get(unit, ()))
            motion = replace(scenario.motion, test=tuple(clips), behaviours=behaviours, examples=examples)
            self._scenarios[key] = replace(scenario, motion=motion)
        return self._scenarios[key]

    def _error(self, names: StationNames, costs: Costs) -> SetError:
        return set_error(names, costs, self.asked.price(names) if self.asked.station_costs else None)

    def _contributions(self, races: Sequence[Race], stepwise: bool) -> Iterator[MarginalContribution]:
        """What each place contributes, on the units on which every set was measured."""
        free = [group for group in self.plan.groups if group not in self.asked.base]
        measured = [race for race in races if race.rounds]
        if not measured:
            return
        first = {race.size: self._first_units(race.rounds[0].units) for race in measured}
        if stepwise:
            yield from _contributions_of_last(measured, list(first[measured[-1].size]))
            return
        costs = {
            stations: {unit: value for unit, value in by_unit.items() if unit in first[race.size]}
            for race in measured
            for stations, by_unit in race.costs.items()
        }
        yield from shapley_contributions(free, self.plan.groups, costs)

    def _power(self, races: Sequence[Race]) -> StatisticalPower | None:
        """What the units of the largest size can show, by the spread of its finalists."""
        if not races:
            return None
        race = races[-1]
        finalists = {stations: race.costs[stations] for stations in race.live}
        return estimate_power(finalists, units=race.rounds[-1].units, sets=len(finalists), unit=self.plan.unit)

    def _second(self, races: Sequence[Race], advice: PlacementAdvice | None) -> SecondMethod | None:
        """The answer by the second method, on the clips of each race's last round."""
        method, choices, errors = self.asked.question.second, list[SecondChoice](), list[SetError]()
        if not method:
            return None
        scenario = replace(self.plan.scenario, methods=(method,))
        for race in races:
            order = sort_by_cost(race.finalists)
            chosen = advice.best.stations if advice and advice.best.stations in order else race.best
            places = self._places(list(dict.fromkeys([*order[:FINALISTS], chosen])))
            costs = costs_by_name(self.measure_on(scenario, self._first_units(race.rounds[-1].units), places))
            if choice := compare_second(chosen, costs, race.ties if chosen == race.best else ()):
                choices.append(choice)
            errors += [self._error(names, by_unit) for names, by_unit in costs.items()]
        for at, choice in enumerate(choices):
            if choice.shared:
                (costs_of_shared,) = self.measure_held_out([choice.shared.stations]).values()
                choices[at] = replace(choice, shared=self._error(choice.shared.stations, costs_of_shared))
        return SecondMethod(method, tuple(choices), tuple(errors))

    def _notes(self, races: Sequence[Race], stepwise: bool) -> Iterator[str]:
        used = self._first_units(max((one.rounds[-1].units for one in races), default=0))
        yield choice_note(used, self.asked.clips.held_out)
        if stepwise:
            yield "Stations were added one after another, because not every set could be measured."
        yield from filter(None, (self.asked.clips.note, self.cache.line_loss))

    def _tell_plan(self, sets: int, cells: CellForecast) -> None:
        """Say what is searched, before it begins, and how many cells come on top."""
        question, budget = self.asked.question, self.asked.question.budget
        what, usual = f"A search on {question.clips} clips", ""
        if question.search_effort:
            what, usual = f"A {question.search_effort} search", f"; about {budget.minutes:g} min on two quiet cores"
            self._late_min = LATE * budget.minutes
        parts = [f"at most {cells.choose:,} cells to choose on", f"about {cells.test:,} on held-out clips"]
        parts += [f"{cells.repeat:,} with {question.second}"] if cells.repeat else []
        self.tell(f"{what} of {count_noun(sets, 'set')}: {', '.join(parts[:-1])} and {parts[-1]}{usual}.")

    def _tell_if_late(self, done: int, expected: int) -> None:
        """Say that the search goes on when it takes longer than usual, and again whenever the time has doubled."""
        minutes = (monotonic() - self.started_s) / 60.0
        if not done or minutes < self._late_min:
            return
        self._late_min = 2.0 * minutes
        more = max(minutes * (expected - done) / done, 1.0)
        self.tell(
            f"The search goes on after {minutes:.0f} min: this computer is slower or busy. About {more:.0f} min more; "
            "the answer does not depend on it."
        )


def _best_set(race: Race, error: SetError) -> BestSet:
    """The best set of a race, with its ties among the finalists and its error on held-out units."""
    (best,) = best_by_size(race.finalists)
    return replace(add_held_out_error(best, error), of=len(race.sets))


def _contributions_of_last(races: Sequence[Race], units: Sequence[str]) -> Iterator[MarginalContribution]:
    """What each station adds to the best set before the last, where stations were added one after another."""
    if len(races) < 2:
        return
    before, last = races[-2:]
    base = next(costs for stations, costs in before.costs.items() if names_of_places(stations) == before.best)
    for stations, costs in last.costs.items():
        added = [name for name in names_of_places(stations) if name not in before.best]
        if len(added) == last.size - before.size:
            shared = [unit for unit in units if unit in base and unit in costs]
            gain = compare_paired({unit: base[unit] for unit in shared}, {unit: costs[unit] for unit in shared})
            yield from (contribution(name, "add", before.best, gain) for name in added)
