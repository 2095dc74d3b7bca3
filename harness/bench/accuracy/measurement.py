"""Run the cells of the accuracy benchmark, and collect their errors by method, condition, clip and seed."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from harness.bench.accuracy.clip_errors import (
    ANGLE,
    CELL_METRICS,
    COVERAGES,
    SILENT_ANGLE,
    ClipErrors,
    ErrorsByCondition,
    StoredErrors,
)
from harness.bench.accuracy.conditions import (
    CONDITIONS,
    SEEDS,
    Condition,
    plan_lagged,
    plan_scenarios,
    quick_conditions,
    refuse_lag,
    with_lag,
)
from harness.bench.accuracy.setup_targets import evaluate_setups
from harness.bench.accuracy.setups import SETUPS, plan_setups, setup_of
from harness.bench.accuracy.statements import compare_methods, find_worse_clips, rank_pooled
from harness.bench.accuracy.targets import LAGGED_CONDITION, evaluate_lag, evaluate_targets
from harness.bench.common import fresh_methods, run_benchmark_cells
from harness.bench.limits import outcome_of
from harness.compare import MethodRanking
from harness.errors import BadInput, Outcome, UnknownName
from harness.experiment.methods import DEFAULT_ISOLATION, resolve_method
from harness.experiment.scenarios import Scenario
from harness.results import cell_folder, current_circumstances, read_cell
from harness.results.findings import BenchmarkStatement

_QUICK = "the quick form has one seed and few clips"
Table = Literal["presets", "setups"]
TABLES: tuple[Table, ...] = get_args(Table)
"""Parts of the benchmark: the noise presets of the accuracy tables, and the set-ups."""


@dataclass(frozen=True)
class AccuracyReport:
    """What one run of the benchmark measured."""

    method: str
    stored_title: str
    """Name of the stored errors, such as "dynamic_map of 40f3d61"."""
    quick: bool
    failures: Mapping[str, str]
    """Cell -> why it has no result; with any, nothing below is evaluated."""
    stored: ErrorsByCondition = field(default_factory=dict)
    """The stored errors of the measured seeds."""
    by_method: Mapping[str, ErrorsByCondition] = field(default_factory=dict)
    """Method -> today's errors."""
    statements: Sequence[BenchmarkStatement] = ()
    """The targets, the comparisons with other methods, and the clips that are worse."""
    no_lag: str = ""
    """Why there are no cells with later frames; "" where there are."""
    rankings: Mapping[tuple[str, str], MethodRanking] = field(default_factory=dict)

    @property
    def outcome(self) -> Outcome:
        """INCOMPLETE when a cell failed, else that of the statements."""
        return Outcome.INCOMPLETE if self.failures else outcome_of(self.statements)


def measure_accuracy(
    method: str,
    stored: StoredErrors,
    out: Path,
    *,
    references: Sequence[StoredErrors] = (),
    tables: Collection[Table] = TABLES,
    seeds: Sequence[int] = SEEDS,
    quick: bool = False,
    **options: Any,
) -> AccuracyReport:
    """Run or resume the cells in `out`, and compare `method` with the stored errors and today's other methods.

    `references` are the errors of several methods of one commit that the set-ups are compared with. The quick form has
    no set-ups. `options` are those of `run_benchmark_cells`, whose errors are raised. BadInput for a method that is not
    causal, and when clips or seeds differ from the stored ones.
    """
    refuse_lag(method)
    seeds = seeds[:1] if quick else seeds
    earlier = stored.first_seeds(seeds)
    by_reference = {one.method: one.first_seeds(seeds) for one in references}
    with fresh_methods():
        scenarios, lagged, no_lag = list[Scenario](), list[Scenario](), ""
        if "presets" in tables:
            scenarios = plan_scenarios(quick_conditions() if quick else CONDITIONS, method, seeds, quick=quick)
            lagged, no_lag = _plan_supported_lag(method, seeds, quick)
        if "setups" in tables and not quick:
            scenarios = [*scenarios, *plan_setups([method], seeds)]
        results = run_benchmark_cells("accuracy", [*scenarios, *lagged], out, **options)
    if results.failures:
        return AccuracyReport(method, stored.title, quick, results.failures)
    by_method = collect_errors(results.rows, out)
    later = by_method.pop(with_lag(method), {}).get(LAGGED_CONDITION, {})
    if quick:
        earlier = _same_clips(earlier, by_method[method])
    statements = list[BenchmarkStatement]()
    if "presets" in tables:
        statements = [
            *evaluate_targets(earlier, by_method[method]),
            *(evaluate_lag(with_lag(method), later, earlier.get(LAGGED_CONDITION, {})) if later else ()),
            *compare_methods(method, by_method),
            *find_worse_clips(method, by_method, stored.title, earlier),
        ]
    if by_reference:
        statements += evaluate_setups(method, by_method[method], by_reference, references[0].commit)
    if quick:
        statements = [replace(statement, verdict="no verdict", why=_QUICK) for statement in statements]
    rankings = rank_pooled(by_method)
    return AccuracyReport(method, stored.title, quick, {}, earlier, by_method, statements, no_lag, rankings)


def clean_commit() -> str:
    """The commit of the running code, 40 hex digits; BadInput outside a checkout and with changes that it lacks."""
    code = current_circumstances()
    if not code["commit"] or code["dirty"]:
        found = "The code differs from its commit." if code["commit"] else "The code is in no checkout of git."
        raise BadInput(found, "Stored errors name their commit: commit first, or leave out --save.")
    return str(code["commit"])


def _plan_supported_lag(method: str, seeds: Sequence[int], quick: bool) -> tuple[list[Scenario], str]:
    """The scenarios with later frames; none, and why, for a method without that option."""
    resolve_method(method, DEFAULT_ISOLATION)
    try:
        resolve_method(with_lag(method), DEFAULT_ISOLATION)
    except (UnknownName, BadInput):
        return [], f"{method} has no option lag"
    return plan_lagged(method, seeds, quick=quick), ""


def _same_clips(errors: ErrorsByCondition, like: ErrorsByCondition) -> ErrorsByCondition:
    """The errors of the conditions and clips that `like` has."""
    return {
        condition: {clip: e for clip, e in errors.get(condition, {}).items() if clip in by_clip}
        for condition, by_clip in like.items()
    }


def collect_errors(rows: Iterable[Mapping[str, Any]], out: Path) -> dict[str, ErrorsByCondition]:
    """Method -> errors of finished cells, whose frames in `out` are read where a station is silent.

    BadInput for a cell whose joint angle error was not measured.
    """
    collected: dict[str, dict[str, dict[str, list[Mapping[str, Any]]]]] = {}
    for row in rows:
        if row[ANGLE] is None:
            raise BadInput(f"{row['method']} on {row['clip']} answered too few frames to measure.", "")
        condition = str(condition_of(row))
        by_clip = collected.setdefault(row["method"], {}).setdefault(condition, {})
        by_clip.setdefault(row["clip"], []).append(row)
    return {
        method: {
            condition: {clip: _clip_errors(cells, out) for clip, cells in by_clip.items()}
            for condition, by_clip in by_condition.items()
        }
        for method, by_condition in collected.items()
    }


def condition_of(row: Mapping[str, Any]) -> Condition:
    """The condition of a cell's row; cells with later frames have the condition of those without."""
    scenario, setup = setup_of("boxing" if row["scenario"] == "boxing_lagged" else row["scenario"])
    noise = SETUPS[setup].noise if setup else row["noise"]  # a cell whose components are set has "default*"
    return Condition(scenario, noise, row["inputs"], row["varied"].get("disturbance.station", ""), setup)


def _clip_errors(rows: Sequence[Mapping[str, Any]], out: Path) -> ClipErrors:
    rows = sorted(rows, key=lambda row: int(row["seed"]))
    by_metric: dict[str, tuple[float | None, ...]] = {name: tuple(row[name] for row in rows) for name in CELL_METRICS}
    if rows[0].get("sigma_scores"):
        by_metric |= {name: tuple(row["sigma_scores"][name] for row in rows) for name in COVERAGES}
    if "disturbance.station" in rows[0]["varied"]:
        by_metric[SILENT_ANGLE] = tuple(_silent_angle_deg(cell_folder(out, row["key"])) for row in rows)
    return ClipErrors(rows[0]["behaviour"], rows[0]["performer"], by_metric)


def _silent_angle_deg(folder: Path) -> float:
    """Mean joint angle error of a cell's frames within its disturbance [deg]; BadInput without such frames."""
    cell = read_cell(folder)
    limits = cell.defined_by["disturbance"]
    during = (cell.time_s > limits["begins_s"] - 1e-9) & (cell.time_s < limits["ends_s"] - 1e-9)
    values = cell.errors[ANGLE][during & cell.scores.scored]
    if not len(values) or not np.isfinite(values).all():
        raise BadInput(f"{cell.method} on {cell.clip} has no errors while a station is silent.", "")
    return float(values.mean())
