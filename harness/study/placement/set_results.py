"""Cells of sets of stations: each set is run once and cached in the folder of the study.

A set is a variant of the scenario with other stations, so that motion and fitted methods are shared. Where the serial
line limits the rate, the set also has a rate of its own. The key of a cell contains the places of the set's stations,
and no other candidates. So no set is run twice, in whichever mode, in this run or a later one.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.compare import Sampling
from harness.core.files import content_key, to_json_types
from harness.core.progress import ProgressCallback
from harness.core.split import ClipPart
from harness.core.stream_health import BAUD, describe_line_loss
from harness.errors import BadInput
from harness.experiment import BatchResults, cell_names, run_cells
from harness.experiment.scenarios import Scenario, open_scenario_motion
from harness.experiment.workers import TaskExecutor
from harness.mocap import LibraryFolders
from harness.study.placement.candidates import StationSet, station_name

MAX_RATE_HZ = 180.0
"""Highest rate of an IS-900 (docs/is900.md)."""


def link_rate_hz(scenario: Scenario, stations: int, link: bool) -> float:
    """Rate of a number of stations: the scenario's, with `link` at most what the serial line carries.

    BadInput when the line cannot carry them once a second.
    """
    tracker = scenario.tracker
    if not link:
        return tracker.rate_hz
    link_hz = 1.0 / (tracker.record_s * stations)
    if link_hz < 1.0:
        raise BadInput(
            f"A line of {tracker.baud} baud carries {stations} stations at {link_hz:.2f} Hz.", "Use fewer stations."
        )
    return min(tracker.rate_hz, MAX_RATE_HZ, link_hz)


SetRequest = tuple[Scenario, tuple[StationSet, ...]]
"""A scenario, whose stations are all candidates, and the sets of stations to measure in it."""
RunCells = Callable[..., BatchResults]


@dataclass
class SetResults:
    """Runs sets that were not measured yet, and caches their results."""

    out: Path
    """Folder of the study, as made by `open_study`."""
    folder: LibraryFolders | None
    """Motion library; None for synthetic motion."""
    executor: TaskExecutor
    command: str
    progress: ProgressCallback
    link: bool = False
    """Whether the rate of each set is limited to what the serial line carries."""
    run: RunCells = run_cells
    failures: dict[str, str] = field(default_factory=dict)
    """Cell -> why it has no result."""
    planned: int = 0
    """Number of cells that were requested."""
    seconds: list[float] = field(default_factory=list)
    """Duration of each cell on its worker [s], also of those of an earlier run."""
    _rows: dict[tuple[str, str, str, str], Mapping[str, Any]] = field(default_factory=dict)
    """(scenario, variant, method, clip) -> row."""
    _variants: dict[tuple[str, str], set[str]] = field(default_factory=dict)
    """(scenario, clip) -> variants that were run."""
    _named: dict[tuple[int, float], tuple[Scenario, Scenario]] = field(default_factory=dict)
    """(identity of a scenario, rate) -> that scenario, and the one with the rate and with the name of its cells."""

    @property
    def line_loss(self) -> str:
        """A sentence on cells whose line let nothing be measured; "" if there are none (see `core.stream_health`)."""
        return describe_line_loss(row for row in self._rows.values() if BAUD in row["health"])

    def run_missing(self, requests: Iterable[SetRequest]) -> None:
        """Run all sets that were not run yet, together, so that they share the workers."""
        values: dict[tuple[str, tuple[str, ...]], dict[str, Any]] = {}
        todo: dict[tuple[str, tuple[str, ...]], Scenario] = {}
        for asked, sets in requests:
            for stations in sets:
                scenario, setting = self._variant(asked, stations)
                variant, motion = _variant_key(setting), scenario.motion
                missing = [
                    pair for pair in motion.tested if variant not in self._variants.get((scenario.name, pair[0]), ())
                ]
                if not missing:
                    continue
                clips, behaviours = zip(*missing, strict=True)
                if (scenario.name, clips) not in todo:
                    motion = replace(motion, test=clips, behaviours=behaviours)
                    todo[scenario.name, clips] = replace(scenario, motion=motion)
                values.setdefault((scenario.name, clips), {})[variant] = next(iter(setting.values()))
                for clip in clips:
                    self._variants.setdefault((scenario.name, clip), set()).add(variant)
        scenarios = []
        for key, scenario in todo.items():
            varied = "worn" if not scenario.worn else "stations"
            scenarios.append(replace(scenario, vary={varied: list(values[key].values())}))
        if not scenarios:
            return
        before = self.planned

        def report(last: str, done: int, planned: int) -> None:
            self.progress(last, before + done, before + planned)

        options = {"folder": self.folder, "executor": self.executor, "command": self.command, "progress": report}
        self._add(scenarios, self.run(scenarios, self.out, **options))

    def errors(
        self, request: SetRequest, metric: str, methods: tuple[str, ...] = ()
    ) -> dict[StationSet, dict[str, float | None]]:
        """Set -> unit -> mean error over its clips and `methods`, by default those of the scenario.

        The error is None where one of the methods was not measured on one of the clips. Sets are run where necessary.
        """
        self.run_missing([request])
        scenario, sets = request
        units = clips_of_units(scenario, self.folder)
        errors = {stations: self._errors(scenario, stations, metric, methods) for stations in sets}
        return {
            stations: {unit: _mean([by_clip[clip] for clip in clips]) for unit, clips in units.items()}
            for stations, by_clip in errors.items()
        }

    def _errors(
        self, asked: Scenario, stations: StationSet, metric: str, methods: tuple[str, ...]
    ) -> dict[str, float | None]:
        scenario, setting = self._variant(asked, stations)
        by_clip: dict[str, float | None] = {}
        for clip in scenario.motion.test:
            rows = [
                self._rows.get((scenario.name, _variant_key(setting), method, clip))
                for method in methods or scenario.methods
            ]
            by_clip[clip] = _mean([row[metric] if row is not None else None for row in rows])
        return by_clip

    def _add(self, scenarios: Iterable[Scenario], cells: BatchResults) -> None:
        """Add results; rows are in planned order, without those of failed cells."""
        rows = iter(cells.rows)
        for scenario in scenarios:
            planned = [
                (scenario.name, _variant_key(setting), method, clip)
                for setting, variant in scenario.variants()
                for clip in variant.motion.test
                for method in variant.methods
            ]
            for cell, name in zip(planned, cell_names(scenario), strict=True):
                if name not in cells.failures:
                    self._rows[cell] = next(rows)
                    if duration_s := self._rows[cell].get("seconds"):
                        self.seconds.append(duration_s)
        self.planned += cells.planned
        self.failures |= cells.failures

    def _variant(self, asked: Scenario, stations: StationSet) -> tuple[Scenario, dict[str, Any]]:
        """The scenario that a set is a variant of, and the values that make it: stations, or moved places."""
        rate = link_rate_hz(asked, len(stations), self.link)
        names = [station_name(place) for place in stations]
        moved = {
            station_name(place): {"along": place.along, "around_deg": place.around_deg}
            for place in stations
            if place.moved_from
        }
        if moved:
            return _name_by_content(asked, rate, worn=tuple(names)), {"stations": moved}
        if (id(asked), rate) not in self._named:
            self._named[id(asked), rate] = asked, _name_by_content(asked, rate)
        return self._named[id(asked), rate][1], {"worn": names}


def _name_by_content(asked: Scenario, rate_hz: float, worn: tuple[str, ...] = ()) -> Scenario:
    """The scenario at a rate, with a name that is unique by content.

    Test clips and candidates are no part of it, and so no part of the key of a cell: a set on a clip is one cell, with
    whichever other clips and candidates it is asked for. The places of its own stations are among its conditions.
    """
    scenario = replace(asked, tracker=replace(asked.tracker, rate_hz=rate_hz), vary={}, worn=worn or asked.worn)
    content = scenario.content()
    del content["motion"]["test"], content["motion"]["behaviours"], content["stations"]
    return replace(scenario, name=f"{scenario.name}_{content_key(content)[:8]}")


def clips_of_units(scenario: Scenario, folder: LibraryFolders | None) -> dict[str, list[str]]:
    """Unit of statistics -> its test clips in a scenario, sorted (see `compare.units`)."""
    source = open_scenario_motion(scenario.motion, folder, scenario.seed)
    takes = {clip: ClipPart.parse(clip).clip for clip in scenario.motion.test}
    performers = {take: known for take in takes.values() if (known := source.performer(take))}
    sampling, units = Sampling(performers, scenario.unit), dict[str, list[str]]()
    for clip in sorted(takes):
        units.setdefault(sampling.unit_of(clip), []).append(clip)
    return dict(sorted(units.items()))


def _mean(values: Sequence[float | None]) -> float | None:
    """The mean; None where a value is missing."""
    measured = [float(value) for value in values if value is not None]
    return float(np.mean(measured)) if len(measured) == len(values) else None


def _variant_key(setting: Mapping[str, Any]) -> str:
    return json.dumps(to_json_types(setting), sort_keys=True)
