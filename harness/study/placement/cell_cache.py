"""Sets of trackers tried: each becomes cells like any other, which the next question finds again.

A set is the same scenario with other stations, so that motion and what was learnt are shared; on a line of so many bits
per second it also has a rate of its own. A cell's key holds where every station sits, so that no set is tried twice,
whichever mode asks, in this run or the next.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.files import content_key, to_json_types
from harness.errors import BadInput
from harness.experiment.cells import ProgressCallback
from harness.experiment.engine import CellResults, run_cells
from harness.experiment.executors import TaskExecutor
from harness.experiment.planning import cell_names
from harness.experiment.scenario import Scenario, variants
from harness.study.placement.candidates import StationSet, station_name

MAX_RATE_HZ = 180.0
"""Of an IS-900 (docs/is900.md)."""


def link_rate_hz(scenario: Scenario, stations: int, link: bool) -> float:
    """At which so many stations run: the scenario's, and no more than the line carries when that is a constraint.

    BadInput when the line cannot carry so many once a second.
    """
    tracker = scenario.tracker
    if not link:
        return tracker.rate_hz
    carried_hz = 1.0 / (tracker.record_s * stations)
    if carried_hz < 1.0:
        raise BadInput(
            f"A line of {tracker.baud} baud carries {stations} stations at {carried_hz:.2f} Hz.", "Wear fewer."
        )
    return min(tracker.rate_hz, MAX_RATE_HZ, carried_hz)


@dataclass(frozen=True)
class SetRequest:
    """Sets of trackers in one scenario, whose stations are all the candidates."""

    scenario: Scenario
    sets: tuple[StationSet, ...]
    link: bool = False


RunCells = Callable[..., CellResults]


@dataclass
class CellCache:
    """Runs what was not tried yet, and remembers what came of it."""

    out: Path
    """An opened folder of a study."""
    folder: Path | None
    """The library of real motion."""
    executor: TaskExecutor
    command: str
    progress: ProgressCallback
    run: RunCells = run_cells
    failures: dict[str, str] = field(default_factory=dict)
    """Cell -> why it has no result."""
    planned: int = 0
    """Cells that were asked for."""
    _rows: dict[tuple[str, str, str, str], Mapping[str, Any]] = field(default_factory=dict)
    """(scenario, what is varied, method, clip) -> row."""
    _known: dict[str, set[str]] = field(default_factory=dict)
    """Scenario -> what was varied."""

    def run_missing(self, asked: Iterable[SetRequest]) -> None:
        """All at once, so that they share the workers."""
        todo: dict[str, Scenario] = {}
        values: dict[str, dict[str, Any]] = {}
        for one in asked:
            for worn in one.sets:
                scenario, varied = self._as_varied(one, worn)
                if _variant_key(varied) not in self._known.get(scenario.name, ()):
                    todo[scenario.name] = scenario
                    values.setdefault(scenario.name, {})[_variant_key(varied)] = next(iter(varied.values()))
        scenarios = []
        for name, scenario in todo.items():
            key = "worn" if not scenario.worn else "stations"
            scenarios.append(replace(scenario, vary={key: list(values[name].values())}))
            self._known.setdefault(name, set()).update(values[name])
        if not scenarios:
            return
        before = self.planned

        def told(last: str, done: int, planned: int) -> None:
            self.progress(last, before + done, before + planned)

        asked_for = {"folder": self.folder, "executor": self.executor, "command": self.command, "progress": told}
        self._take(scenarios, self.run(scenarios, self.out, **asked_for))

    def errors(
        self, asked: SetRequest, metric: str, methods: tuple[str, ...] = ()
    ) -> dict[StationSet, dict[str, float | None]]:
        """Of each set, by clip: the mean over the scenario's methods, or over some of them; None where one of them was
        not measured."""
        self.run_missing([asked])
        return {worn: self._errors(asked, worn, metric, methods) for worn in asked.sets}

    def _errors(
        self, asked: SetRequest, worn: StationSet, metric: str, methods: tuple[str, ...]
    ) -> dict[str, float | None]:
        scenario, varied = self._as_varied(asked, worn)
        found: dict[str, float | None] = {}
        for clip in scenario.motion.test:
            rows = [
                self._rows.get((scenario.name, _variant_key(varied), method, clip))
                for method in methods or scenario.methods
            ]
            values = [row[metric] if row is not None else None for row in rows]
            measured = [float(value) for value in values if value is not None]
            found[clip] = float(np.mean(measured)) if len(measured) == len(values) else None
        return found

    def _take(self, scenarios: Iterable[Scenario], cells: CellResults) -> None:
        """Rows come in planned order, without those of cells that failed."""
        rows = iter(cells.rows)
        for scenario in scenarios:
            each = [
                (scenario.name, _variant_key(varied), method, clip)
                for varied, made in variants(scenario)
                for clip in made.motion.test
                for method in made.methods
            ]
            for cell, called in zip(each, cell_names(scenario), strict=True):
                if called not in cells.failures:
                    self._rows[cell] = next(rows)
        self.planned += cells.planned
        self.failures |= cells.failures

    def _as_varied(self, asked: SetRequest, worn: StationSet) -> tuple[Scenario, dict[str, Any]]:
        """The scenario that the set is a variant of, and what makes it that: which candidates are worn, or, for places
        that were moved, also where."""
        rate = link_rate_hz(asked.scenario, len(worn), asked.link)
        scenario = replace(asked.scenario, tracker=replace(asked.scenario.tracker, rate_hz=rate), vary={})
        names = [station_name(one) for one in worn]
        moved = {
            station_name(one): {"along": one.along, "around_deg": one.around_deg} for one in worn if one.moved_from
        }
        if moved:
            scenario = replace(scenario, worn=tuple(names))
        called = f"{scenario.name}_{content_key(asdict(scenario))[:8]}"  # no two of other content may have one name
        return replace(scenario, name=called), {"stations": moved} if moved else {"worn": names}


def _variant_key(varied: Mapping[str, Any]) -> str:
    return json.dumps(to_json_types(varied), sort_keys=True)
