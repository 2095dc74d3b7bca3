"""Sets of trackers tried: each becomes cells like any other, which the next question finds again.

A set is the same scenario with other stations, so that motion and what was learnt are shared; on a line of so many bits
per second it also has a rate of its own. A cell's key holds where every station sits, so that no set is tried twice,
whichever mode asks, in this run or the next.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.cells import Ended, Job, Progress, run_job
from harness.config import Scenario
from harness.core.protocol import Part
from harness.errors import BadInput
from harness.score.files import content_key, plain
from harness.study.candidates import Worn, station_name
from harness.study.executors import Each


@dataclass(frozen=True)
class Cells:
    """What came of the cells of several scenarios."""

    rows: tuple[Mapping[str, Any], ...]
    failures: Mapping[str, str]
    planned: int


def run_cells(
    scenarios: Sequence[Scenario], out: Path, *, folder: Path | None, each: Each, command: str, progress: Progress
) -> Cells:
    """Every cell that is not finished yet; what was is kept."""
    jobs = [
        Job(scenario, Part.parse(text), behaviour, folder, command)
        for scenario in scenarios
        for text, behaviour in zip(
            scenario.motion.test,
            scenario.motion.behaviours * (len(scenario.motion.test) // len(scenario.motion.behaviours)),
            strict=True,
        )
    ]
    planned, done = sum(len(job.cells()) for job in jobs), 0
    rows, failures = list[Mapping[str, Any]](), dict[str, str]()
    for which, future in each(_all_of, [(job, out) for job in jobs]):
        for ended in future.result():
            done += 1
            progress(ended.cell, done, planned)
            if ended.row is None:
                failures[f"{jobs[which].scenario.name}: {ended.cell}"] = ended.failure
            else:
                rows.append({**ended.row, "scenario": jobs[which].scenario.name})
    return Cells(tuple(rows), failures, planned)


def _all_of(job: Job, out: Path) -> list[Ended]:
    return list(run_job(job, out))


FASTEST_HZ = 180.0
"""Of an IS-900 (docs/is900.md)."""


def rate_hz(scenario: Scenario, stations: int, link: bool) -> float:
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
    return min(tracker.rate_hz, FASTEST_HZ, carried_hz)


@dataclass(frozen=True)
class Asked:
    """Sets of trackers in one scenario, whose stations are all the candidates."""

    scenario: Scenario
    sets: tuple[Worn, ...]
    link: bool = False


Run = Callable[..., Cells]


@dataclass
class Trying:
    """Runs what was not tried yet, and remembers what came of it."""

    out: Path
    """An opened folder of a study."""
    folder: Path | None
    """The library of real motion."""
    each: Each
    command: str
    progress: Progress
    run: Run = run_cells
    failures: dict[str, str] = field(default_factory=dict)
    """Cell -> why it has no result."""
    planned: int = 0
    """Cells that were asked for."""
    finished: int = 0
    _rows: dict[tuple[str, str, str, str], Mapping[str, Any]] = field(default_factory=dict)
    """(scenario, what is varied, method, clip) -> row."""
    _known: dict[str, set[str]] = field(default_factory=dict)
    """Scenario -> what was varied."""

    def try_all(self, asked: Iterable[Asked]) -> None:
        """All at once, so that they share the workers."""
        todo: dict[str, Scenario] = {}
        values: dict[str, dict[str, Any]] = {}
        for one in asked:
            for worn in one.sets:
                scenario, varied = self._as_varied(one, worn)
                if _text(varied) not in self._known.get(scenario.name, ()):
                    todo[scenario.name] = scenario
                    values.setdefault(scenario.name, {})[_text(varied)] = next(iter(varied.values()))
        scenarios = []
        for name, scenario in todo.items():
            key = "worn" if not scenario.worn else "stations"
            scenarios.append(replace(scenario, vary={key: list(values[name].values())}))
            self._known.setdefault(name, set()).update(values[name])
        if scenarios:
            self._take(
                self.run(
                    scenarios,
                    self.out,
                    folder=self.folder,
                    each=self.each,
                    command=self.command,
                    progress=lambda last, done, planned: self.progress(
                        last, self.finished + done, self.finished + planned
                    ),
                )
            )

    def errors(self, asked: Asked, metric: str, methods: tuple[str, ...] = ()) -> dict[Worn, dict[str, float | None]]:
        """Of each set, by clip: the mean over the scenario's methods, or over some of them; None where one of them was
        not measured."""
        self.try_all([asked])
        return {worn: self._errors(asked, worn, metric, methods) for worn in asked.sets}

    def _errors(self, asked: Asked, worn: Worn, metric: str, methods: tuple[str, ...]) -> dict[str, float | None]:
        scenario, varied = self._as_varied(asked, worn)
        found: dict[str, float | None] = {}
        for clip in scenario.motion.test:
            rows = [
                self._rows.get((scenario.name, _text(varied), method, clip)) for method in methods or scenario.methods
            ]
            values = [row[metric] if row is not None else None for row in rows]
            measured = [float(value) for value in values if value is not None]
            found[clip] = float(np.mean(measured)) if len(measured) == len(values) else None
        return found

    def _take(self, cells: Cells) -> None:
        self.planned += cells.planned
        self.finished += cells.planned
        self.failures |= cells.failures
        for row in cells.rows:
            self._rows[row["scenario"], _text(row["varied"]), row["method"], row["clip"]] = row

    def _as_varied(self, asked: Asked, worn: Worn) -> tuple[Scenario, dict[str, Any]]:
        """The scenario that the set is a variant of, and what makes it that: which candidates are worn, or, for places
        that were moved, also where."""
        rate = rate_hz(asked.scenario, len(worn), asked.link)
        scenario = replace(asked.scenario, tracker=replace(asked.scenario.tracker, rate_hz=rate), vary={})
        names = [station_name(one) for one in worn]
        moved = {
            station_name(one): {"along": one.along, "around_deg": one.around_deg} for one in worn if one.moved_from
        }
        if moved:
            scenario = replace(scenario, worn=tuple(names))
        called = f"{scenario.name}_{content_key(asdict(scenario))[:8]}"  # rows tell by it what they are of
        return replace(scenario, name=called), {"stations": moved} if moved else {"worn": names}


def _text(varied: Mapping[str, Any]) -> str:
    return json.dumps(plain(varied), sort_keys=True)
