"""Run the cells of both sides, and compare the rankings of methods and of places for stations."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.bench.ranking.agreement import ErrorsByUnit, RankingAgreement, compare_rankings
from harness.core.package_data import data_folder
from harness.core.progress import ProgressCallback
from harness.core.split import performer_of
from harness.errors import Outcome
from harness.experiment.cells import check_names, clear_caches
from harness.experiment.engine import run_cells
from harness.experiment.executors import TaskExecutor
from harness.experiment.remote_method import close_methods
from harness.experiment.scenario import Scenario, load_scenario
from harness.mocap import synthetic
from harness.mocap.library import LibraryFolders
from harness.results.expected_orders import METRIC
from harness.study.papers.paper_study import open_study

BEHAVIOURS = ("walking", "boxing", "jumping")
MOST_BUILTIN = 12
"""Most built-in performers; there are no more than the generator names."""
PLACES_METHOD = "expert_map"
"""Method that measures places, as in placement studies."""
LIMBS = ("hand", "ankle", "upper_arm", "thigh")
TRUNK = ("pelvis", "torso", "head")
"""Places of the third station of a set, beside a pair on limbs."""
QUICK_BEHAVIOURS, QUICK_METHODS = BEHAVIOURS[:1], ("ik", "kernel_cca", "mean_pose")
QUICK_SETS, QUICK_CLIPS, QUICK_S = 3, 2, 2.0
METHODS, PLACES = "methods", "places"
_BUILTIN, _REAL = "builtin", "cmu"


@dataclass(frozen=True)
class RankingReport:
    """Agreement by behaviour, and what failed."""

    rankings: Mapping[tuple[str, str], RankingAgreement] = field(default_factory=dict)
    """(behaviour, "methods" or "places") -> agreement."""
    failures: Mapping[str, str] = field(default_factory=dict)
    """Cell -> why it has no result."""

    @property
    def outcome(self) -> Outcome:
        """INCOMPLETE when a cell failed, else PASS: a reversed pair is a result."""
        return Outcome.INCOMPLETE if self.failures else Outcome.PASS


def station_sets() -> dict[str, tuple[str, ...]]:
    """Sets of three stations by name: a pair on limbs, and one place of the trunk or the head."""
    return {
        f"{limb}s + {place}".replace("_", " "): (f"left_{limb}", f"right_{limb}", place)
        for limb in LIMBS
        for place in TRUNK
    }


def plan_rankings(*, quick: bool = False) -> list[Scenario]:
    """The scenarios of both sides: for each behaviour the methods, and one method with each set of stations."""
    planned = []
    for behaviour in QUICK_BEHAVIOURS if quick else BEHAVIOURS:
        real = load_scenario(data_folder("scenarios") / "ranking" / f"cmu_{behaviour}.toml")
        for scenario in (_builtin_side(real, behaviour), real):
            name = f"{behaviour}_{METHODS}_{scenario.motion.source}"
            planned.append(replace(scenario, name=name))
            places = {"worn": [list(stations) for stations in station_sets().values()]}
            name = f"{behaviour}_{PLACES}_{scenario.motion.source}"
            planned.append(replace(scenario, name=name, methods=(PLACES_METHOD,), worn=(), vary=places))
    return [_shorten(scenario) for scenario in planned] if quick else planned


def _builtin_side(real: Scenario, behaviour: str) -> Scenario:
    """The scenario with the first take of built-in performers, each of whom learns from the takes of the others."""
    takes = tuple(f"{behaviour}_{performer}_01" for performer in synthetic.performer_names()[:MOST_BUILTIN])
    motion = replace(real.motion, source="builtin", rate_hz=0.0, test=takes, examples=takes)
    return replace(real, motion=motion)


def _shorten(scenario: Scenario) -> Scenario:
    """The quick form: few short clips, methods and sets."""
    motion = replace(scenario.motion, test=scenario.motion.test[:QUICK_CLIPS], longest_s=QUICK_S)
    methods = tuple(method for method in scenario.methods if method in QUICK_METHODS) or scenario.methods
    vary = {key: values[:QUICK_SETS] for key, values in scenario.vary.items()}
    return replace(scenario, motion=motion, methods=methods, vary=vary)


def measure_rankings(
    scenarios: Sequence[Scenario],
    out: Path,
    *,
    folder: LibraryFolders | None = None,
    executor: TaskExecutor,
    workers: int = 1,
    command: str = "",
    progress: ProgressCallback = lambda cell, done, planned: None,
) -> RankingReport:
    """Run or resume the cells of planned scenarios in `out`, and compare the sides.

    `folder` is the library of real motion, by default HARNESS_MOCAP. BadInput without one, and for a folder that holds
    something else.
    """
    clear_caches()  # files may have changed since the last run
    try:
        check_names(scenarios, folder)
        with open_study(out, {"benchmark": "ranking"}):
            (out / "cells").mkdir(exist_ok=True)
            results = run_cells(
                scenarios,
                out,
                folder=folder,
                executor=executor,
                command=command,
                progress=progress,
                workers=workers,
            )
    finally:
        close_methods()
    return RankingReport(rank_rows(results.rows, scenarios), results.failures)


def rank_rows(
    rows: Iterable[Mapping[str, Any]], scenarios: Sequence[Scenario]
) -> dict[tuple[str, str], RankingAgreement]:
    """(behaviour, kind) -> agreement, from the rows of finished cells. A cell without a row counts as not measured."""
    found: dict[str, dict[tuple[str, str], list[float]]] = {}
    names = {frozenset(stations): name for name, stations in station_sets().items()}
    for row in rows:
        kind = row["scenario"].split("_")[-2]
        item = row["method"] if kind == METHODS else names[frozenset(row["stations"])]
        if row[METRIC] is not None:
            found.setdefault(row["scenario"], {}).setdefault((item, _performer(row["clip"])), []).append(row[METRIC])
    agreements = {}
    for scenario in scenarios:
        behaviour, kind, source = scenario.name.rsplit("_", 2)
        if source == _REAL:
            sides = [
                _errors(side, kind, found.get(side.name, {}))
                for side in scenarios
                if side.name in (f"{behaviour}_{kind}_{_BUILTIN}", scenario.name)
            ]
            agreements[behaviour, kind] = compare_rankings(sides[0], sides[1])
    return agreements


def _errors(scenario: Scenario, kind: str, values: Mapping[tuple[str, str], Sequence[float]]) -> ErrorsByUnit:
    """Item -> performer -> mean over the performer's clips, of every item and performer that was planned."""
    worn = {frozenset(stations): name for name, stations in station_sets().items()}
    items = scenario.methods if kind == METHODS else [worn[frozenset(names)] for names in scenario.vary["worn"]]
    performers = list(dict.fromkeys(_performer(clip) for clip in scenario.motion.test))
    return {
        item: {p: float(np.mean(values[item, p])) if (item, p) in values else None for p in performers}
        for item in items
    }


def _performer(clip: str) -> str:
    take = clip.partition("@")[0]
    return performer_of(take) or take
