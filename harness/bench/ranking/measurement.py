"""Run the cells of both sides, and compare the rankings of methods and of places for stations."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from harness.bench.common import fresh_methods, run_benchmark_cells
from harness.bench.ranking.agreement import ErrorsByUnit, RankingAgreement, compare_rankings
from harness.core.package_data import data_folder
from harness.core.split import performer_of
from harness.errors import Outcome
from harness.experiment.scenarios import Scenario, load_scenario
from harness.mocap import synthetic
from harness.results import PRIMARY_METRIC

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
METHODS, SETS, LIMB_PAIRS, THIRD_STATIONS = "methods", "sets of three", "limb pairs", "third stations"
"""What is ranked; a pair on limbs is averaged over the third stations, and a third station over the pairs."""
_BUILTIN, _REAL = "builtin", "cmu"


@dataclass(frozen=True)
class RankingReport:
    """Agreement by behaviour, and what failed."""

    rankings: Mapping[tuple[str, str], RankingAgreement] = field(default_factory=dict)
    """(behaviour, what is ranked) -> agreement."""
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
            name = f"{behaviour}_methods_{scenario.motion.source}"
            planned.append(replace(scenario, name=name))
            places = {"worn": [list(stations) for stations in station_sets().values()]}
            name = f"{behaviour}_places_{scenario.motion.source}"
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


def measure_rankings(scenarios: Sequence[Scenario], out: Path, **options: Any) -> RankingReport:
    """Run or resume the cells of planned scenarios in `out`, and compare the sides.

    `options` are those of `run_benchmark_cells`, whose errors are raised.
    """
    with fresh_methods():
        results = run_benchmark_cells("ranking", scenarios, out, **options)
    return RankingReport(rank_rows(results.rows, scenarios), results.failures)


def rank_rows(
    rows: Iterable[Mapping[str, Any]], scenarios: Sequence[Scenario]
) -> dict[tuple[str, str], RankingAgreement]:
    """(behaviour, kind) -> agreement, from the rows of finished cells.

    An item is the mean over its cells of a performer, and is not measured where one of them has no result.
    """
    measured = {
        (row["scenario"], row["method"], frozenset(row["stations"]), row["clip"]): row[PRIMARY_METRIC] for row in rows
    }
    values: dict[tuple[str, str], dict[str, dict[str, dict[str, list[float | None]]]]] = {}
    for scenario in scenarios:
        behaviour, _, source = scenario.name.rsplit("_", 2)
        for _, variant in scenario.variants():
            worn = frozenset(variant.worn_stations)
            for method, clip in product(variant.methods, variant.motion.test):
                for kind, item in _ranked_items(scenario, method, worn).items():
                    by_item = values.setdefault((behaviour, kind), {}).setdefault(source, {})
                    cell = measured.get((scenario.name, method, worn, clip))
                    by_item.setdefault(item, {}).setdefault(_performer(clip), []).append(cell)
    return {
        key: compare_rankings(*(_mean_errors(sides[s]) for s in (_BUILTIN, _REAL))) for key, sides in values.items()
    }


def _ranked_items(scenario: Scenario, method: str, worn: frozenset[str]) -> dict[str, str]:
    """Kind of ranking -> the item that a cell belongs to."""
    if "worn" not in scenario.vary:
        return {METHODS: method}
    name = next(name for name, stations in station_sets().items() if set(stations) == worn)
    limbs, third = name.split(" + ")
    return {SETS: name, LIMB_PAIRS: limbs, THIRD_STATIONS: third}


def _mean_errors(side: Mapping[str, Mapping[str, Sequence[float | None]]]) -> ErrorsByUnit:
    """Item -> performer -> mean; None where a value is missing."""
    return {
        item: {
            performer: None if None in values else float(np.mean([v for v in values if v is not None]))
            for performer, values in by_performer.items()
        }
        for item, by_performer in side.items()
    }


def _performer(clip: str) -> str:
    take = clip.partition("@")[0]
    return performer_of(take) or take
