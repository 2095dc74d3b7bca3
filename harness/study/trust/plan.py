"""Plan of a trust study: what is compared and within which margins, fixed before anything is captured.

`harness record --plan` writes the digest of the plan into the capture, so that a plan which was changed afterwards is
recognised. The digest covers the plan and the file of its scenario. It does not cover the unit file: that is often
fitted to captures of the same day, after the plan. The digest of the unit file is reported beside it.
"""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from harness.compare import MARGINS, TIME_METRICS
from harness.core.fields import build
from harness.core.file_kind import check_toml_kind
from harness.core.files import read_toml
from harness.core.options import expand_alternatives
from harness.core.ranges import MethodName, Name, Range, Text, check_fields
from harness.errors import BadFile, BadInput, UnknownName, name_file
from harness.experiment.scenarios import Scenario, dotted_keys, find_scenario, load_scenario

PLAN_SCHEMA = 1
KIND = "trust plan"
ALL_STATIONS = "all"
"""Name of the set of all stations, where a plan names no sets."""
COMPARED_METRICS = tuple(metric for metric in MARGINS if metric not in TIME_METRICS)
"""Metrics that a plan may name: errors, of which lower values are better."""
TRAINING_KEYS = ("motion.thin_to", "motion.example_share", "motion.database", "motion.withheld")
"""Scenario keys that a plan may vary: what methods learn from. All others describe the device or its motion."""
_EXPECTED = "a trust plan"
_ADVICE = "docs/hil.md shows one."


@dataclass(frozen=True)
class Plan:
    """One trust study: arms are methods with sets of stations and parameters; each runs on both sides."""

    kind: Literal["trust plan"]
    scenario: Text
    """Scenario by name or path beside the plan: examples, split, body and stations."""
    methods: tuple[MethodName, ...]
    """Methods by name, with options and alternatives in brackets."""
    margins: dict[Name, Annotated[float, Range(1e-9, 1e9)]]
    """Metric -> largest difference of simulation and device without practical importance, in the metric's unit."""
    schema: int = PLAN_SCHEMA
    title: Text = ""
    unit: Text = ""
    """Unit file beside the plan that `harness characterize` wrote; "" simulates the scenario's own noise."""
    stations: dict[Name, tuple[Name, ...]] = field(default_factory=dict)
    """Name of a set -> the stations that methods see; without sets, all stations of the scenario."""
    parameters: dict[Text, Any] = field(default_factory=dict)
    """Scenario key -> list of values, as in the key `vary` of a scenario; one of `TRAINING_KEYS`."""
    rank_by: Text = ""
    """Metric by which arms are ranked; by default the first one with a margin."""
    level: Annotated[float, Range(0.001, 0.2)] = 0.05
    """Level of each one-sided test of equivalence, and of the ranks after Holm's correction."""
    performers: dict[Name, Text] = field(default_factory=dict)
    """Clip -> who performs it. Clips of one performer are then one unit of statistics; any other clip is its own."""
    seeds: tuple[Annotated[int, Range(0, 2**63 - 1)], ...] = (1, 2, 3, 4, 5)
    """Seeds of the simulated errors; their errors are averaged clip by clip."""

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def ranked_metric(self) -> str:
        """Metric by which arms are ranked."""
        return self.rank_by or next(iter(self.margins))


def load_plan(path: Path) -> Plan:
    """Read a plan and check it against its scenario, which sets of stations and parameters have to fit.

    Sets of stations are never empty afterwards. BadFile, BadInput and UnknownName name the place.
    """
    content = read_toml(path, _EXPECTED, _ADVICE)
    check_toml_kind(path, content, _EXPECTED, _ADVICE, needs_kind=KIND)
    if not content.get("margins"):
        raise BadFile(path, "no margins", "a table [margins], metric = margin", _ADVICE)
    with name_file(path):
        try:
            plan = build(Plan, content, "plan")
            plan = replace(plan, methods=tuple(name for text in plan.methods for name in expand_alternatives(text)))
            _check_plan(path, plan)
            scenario = load_scenario(scenario_file(plan, path))
            sets = plan.stations or {ALL_STATIONS: tuple(scenario.worn_stations)}
            plan = replace(plan, stations={name: _in_order(scenario, stations) for name, stations in sets.items()})
            parameter_variants(plan, scenario)
        except (TypeError, ValueError) as error:
            raise BadFile(path, str(error), "", _ADVICE) from error
    return plan


def scenario_file(plan: Plan, path: Path) -> Path:
    """The file of the plan's scenario: beside the plan at `path`, or a shipped one. BadFile, UnknownName."""
    beside = path.parent / plan.scenario
    return beside if beside.is_file() else find_scenario(plan.scenario)


def unit_file(plan: Plan, path: Path) -> Path | None:
    """The unit file of the plan at `path`; None if it names none."""
    return path.parent / plan.unit if plan.unit else None


def parameter_variants(plan: Plan, scenario: Scenario) -> list[tuple[dict[str, Any], Scenario]]:
    """Combinations of the plan's parameters with the scenario of each; one empty combination without parameters."""
    return replace(scenario, vary=plan.parameters).variants()


def plan_digest(path: Path) -> str:
    """SHA-256 of a plan, 64 hex digits. BadFile, BadInput and UnknownName as `load_plan`.

    It covers what the plan and the file of its scenario say, in canonical JSON: neither layout nor comments.
    """
    plan = load_plan(path)
    content = {
        "plan": read_toml(path, _EXPECTED, _ADVICE),
        "scenario": read_toml(scenario_file(plan, path), "a scenario", ""),
    }
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def _check_plan(path: Path, plan: Plan) -> None:
    if plan.schema != PLAN_SCHEMA:
        raise BadFile(path, f"schema {plan.schema}", f"schema {PLAN_SCHEMA}", "This version reads no other schema.")
    for name in plan.margins:
        if name not in COMPARED_METRICS:
            raise UnknownName("metric with a margin", name, COMPARED_METRICS)
    if plan.ranked_metric not in plan.margins:
        raise UnknownName("metric with a margin", plan.ranked_metric, plan.margins)
    for key, _ in dotted_keys(plan.parameters):
        if key not in TRAINING_KEYS:
            raise UnknownName("parameter that both sides share", key, TRAINING_KEYS)
    for key, entries in (("methods", plan.methods), ("seeds", plan.seeds)):
        if not entries or len(set(entries)) < len(entries):
            raise BadFile(path, f"{key} is empty or names something twice", "each once, at least one", _ADVICE)


def _in_order(scenario: Scenario, stations: Sequence[str]) -> tuple[str, ...]:
    """Stations of a set in the order of the scenario; UnknownName, BadInput."""
    worn = scenario.worn_stations
    for name in stations:
        if name not in worn:
            raise UnknownName("station", name, worn)
    if not stations or len(set(stations)) < len(stations):
        raise BadInput(f"A set of stations {list(stations)}.", "Name each station once, at least one.")
    return tuple(name for name in worn if name in stations)
