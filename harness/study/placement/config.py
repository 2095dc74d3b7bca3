"""A study of where trackers go, as its TOML file has it: candidates, what is tried, where else, and what papers say."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from harness.compare.margins import MARGINS
from harness.core.fields import build, replace_fields
from harness.core.files import read_toml
from harness.core.options import expand_alternatives
from harness.core.package_data import data_folder
from harness.errors import BadFile, BadInput, UnknownName
from harness.experiment.scenario import SCHEMA, Scenario, check_scenario, load_scenario
from harness.score.metrics import DEFINITIONS
from harness.study.placement.candidates import (
    Candidate,
    CandidateGrid,
    CandidateGroup,
    make_candidate_groups,
    select_groups,
)

MAX_STATIONS = 12
"""Of an IS-900 (docs/is900.md)."""
_OLD_PREFIX = "placement_"
"""What names of shipped studies began with."""


@dataclass(frozen=True)
class AblateOptions:
    """Each unit left out of a set."""

    full: tuple[str, ...] = ()
    """Names of candidates, or of pairs; all of them by default."""


@dataclass(frozen=True)
class AddOptions:
    """Each unit added to a set."""

    base: tuple[str, ...] = ()
    of: tuple[str, ...] = ()
    """What is added; by default every candidate."""


@dataclass(frozen=True)
class GreedyOptions:
    """One unit after another, each time the one that helps most."""

    most: int
    """Stations at the end."""
    base: tuple[str, ...] = ()
    of: tuple[str, ...] = ()


@dataclass(frozen=True)
class ExhaustiveOptions:
    """Every set."""

    most: int
    """Stations."""
    fewest: int = 1
    of: tuple[str, ...] = ()
    most_cells: int = 5000
    """More are refused."""


@dataclass(frozen=True)
class RefineOptions:
    """The stations of a set moved along and around their bones, step by step."""

    set: tuple[str, ...] = ()
    """By default the best set of `size` stations that was tried."""
    size: int = 0
    along: tuple[float, ...] = (0.2, 0.1)
    """Steps, the largest first, as shares of the bone's length."""
    around_deg: tuple[float, ...] = (45.0, 22.5)
    """As many [deg]."""
    most_moves: int = 6


@dataclass(frozen=True)
class ConditionOptions:
    """The same sets of trackers elsewhere."""

    name: str
    scenario: str = ""
    """Another one, to which the study's own changes are not made; by default the study's with its changes."""
    methods: tuple[str, ...] = ()
    changes: dict[str, Any] = field(default_factory=dict)
    """See `PlacementStudy`."""


@dataclass(frozen=True)
class PublishedClaim:
    """That a set suffices: that none of its size serves better, and that all candidates serve hardly better."""

    text: str
    """Such as "walking: both ankles and the pelvis suffice"."""
    source: str
    set: tuple[str, ...]
    among: tuple[str, ...] = ()
    """The candidates that the source knows, from which sets of as many are formed; by default all."""
    margin: float = 0.1
    """All of them err less by no more than this share of their error."""
    why_not: str = ""
    """What is known where it does not hold."""


@dataclass(frozen=True)
class PlacementStudy:
    """What `harness placement` reads."""

    name: str
    kind: Literal["placement"]
    title: str
    scenario: str
    """A file beside the study without its `.toml`, or a shipped scenario: motion, body, calibration, noise, tracker and
    seed are its. Its stations, methods, inputs and what it varies are not used."""
    methods: tuple[str, ...]
    """What is minimised is the mean of their errors."""
    schema: int = SCHEMA
    metric: str = "joint_angle_mean_deg"
    inputs: str = "pos+ori"
    held_out: tuple[str, ...] = ()
    """Clips on which nothing is chosen: what was chosen on the scenario's test clips is judged on these."""
    link: bool = False
    """So many stations run at the rate that the line carries them, at most the scenario's."""
    changes: dict[str, Any] = field(default_factory=dict)
    """To the scenario, such as changes.noise = "clean"; changes.components switches on slipping straps and flesh that
    wobbles."""
    candidate: tuple[Candidate, ...] = ()
    grid: tuple[CandidateGrid, ...] = ()
    ablate: AblateOptions | None = None
    add: AddOptions | None = None
    greedy: GreedyOptions | None = None
    exhaustive: ExhaustiveOptions | None = None
    refine: RefineOptions | None = None
    condition: tuple[ConditionOptions, ...] = ()
    condition_size: int = 3
    """The sets of so many stations that every condition ranks."""
    claim: tuple[PublishedClaim, ...] = ()

    def groups(self) -> tuple[CandidateGroup, ...]:
        return make_candidate_groups((*self.candidate, *self.grid))


def find_placement_study(path: Path | str) -> Path:
    """A file as named, or a shipped study by its bare name."""
    given = Path(path)
    if given.is_file():
        return given
    shipped = {file.stem: file for file in shipped_placements()}
    folders = (Path(), Path("scenarios/placement"))
    if given.suffix in ("", ".toml") and given.stem in shipped and given.parent in folders:
        return shipped[given.stem]
    if given.stem.removeprefix(_OLD_PREFIX) in shipped:
        new = given.stem.removeprefix(_OLD_PREFIX)
        raise BadInput(f"The placement study {given.stem} is now called {new}.", f"Type: harness placement {new}")
    if given.parent == Path() and not given.suffix:
        raise UnknownName("placement study", str(path), shipped)
    raise BadFile(given, "no such file", "a placement study in TOML", "Shipped ones are in scenarios/placement/.")


def shipped_placements() -> list[Path]:
    """The files of the shipped placement studies."""
    return sorted(data_folder("scenarios").glob("placement/*.toml"))


def load_placement_study(path: Path | str) -> PlacementStudy:
    """BadFile and UnknownName name the place."""
    path = find_placement_study(path)
    expected, advice = "a placement study", "See scenarios/placement/walking.toml."
    content = read_toml(path, expected, advice)
    if content.get("kind") != "placement":
        raise BadFile(path, f"kind = {content.get('kind', 'scenario')!r}", f'{expected}, kind = "placement"', advice)
    content.setdefault("name", path.stem)
    try:
        study = build(PlacementStudy, content, "study")
        study = replace(study, methods=tuple(name for text in study.methods for name in expand_alternatives(text)))
    except (TypeError, ValueError) as error:
        raise BadFile(path, str(error), expected, advice) from error
    if fault := _find_fault(study):
        raise BadFile(path, *fault)
    _check_names(study)
    return study


def _find_fault(study: PlacementStudy) -> tuple[str, str, str] | None:
    """What types cannot say: what was found, what is expected, what to try."""
    if study.schema != SCHEMA:
        return f"schema {study.schema}", f"schema {SCHEMA}", "This version of the harness reads no other."
    if study.name != Path(study.name).name:
        return f"name = {study.name!r}", "a plain name", "Results are written to a folder of that name."
    if not study.methods:
        return "no methods", "names in methods", "`harness list` names them."
    if study.metric not in DEFINITIONS:
        raise UnknownName("metric", study.metric, MARGINS)
    if study.metric not in MARGINS:
        return f"metric = {study.metric!r}", "one that says how good an estimate is", f"Such are {', '.join(MARGINS)}."
    if not (study.ablate or study.add or study.greedy or study.exhaustive or study.refine):
        return "nothing to try", "[ablate], [add], [greedy], [exhaustive] or [refine]", "docs/studies.md explains them."
    if study.refine and (not study.refine.along or len(study.refine.along) != len(study.refine.around_deg)):
        return "refine: steps along and around", "as many of both, one at least", "They are taken in pairs."
    if study.refine and min(*study.refine.along, *study.refine.around_deg) <= 0.0:
        return "refine: a step that is not above 0", "steps above 0", "Leave `refine` out, or name larger steps."
    for mode, table in (("greedy", study.greedy), ("exhaustive", study.exhaustive)):
        if table and not 1 <= table.most <= MAX_STATIONS:
            return f"{mode}.most = {table.most}", f"1 to {MAX_STATIONS} stations", "An IS-900 has no more."
    names = [condition.name for condition in study.condition]
    if len(set(names)) < len(names) or not all(names):
        return f"conditions called {', '.join(names)}", "names of their own", "Rename one."
    if len(set(study.held_out)) < len(study.held_out):
        return "held_out names a clip twice", "each clip once", "Remove the second."
    return None


def _check_names(study: PlacementStudy) -> None:
    """That every set is of candidates, and can be worn."""
    units = study.groups()
    asked: list[tuple[str, tuple[str, ...]]] = [("ablate.full", study.ablate.full)] if study.ablate else []
    for mode, table in (("add", study.add), ("greedy", study.greedy)):
        asked += [(f"{mode}.base", table.base), (f"{mode}.of", table.of)] if table else []
    asked += [("exhaustive.of", study.exhaustive.of)] if study.exhaustive else []
    asked += [("refine.set", study.refine.set)] if study.refine else []
    for claim in study.claim:
        asked += [(f"the claim {claim.text!r}", claim.set), (f"the claim {claim.text!r}", claim.among)]
    for where, names in asked:
        found = select_groups(names, units, where)
        if where in ("ablate.full", "add.base", "refine.set") and names:
            check_station_count(sum(map(len, found)), where)


def check_station_count(stations: int, where: str) -> None:
    """BadInput when nobody can wear so many."""
    if not 1 <= stations <= MAX_STATIONS:
        raise BadInput(f"{where}: {stations} stations.", f"An IS-900 has 1 to {MAX_STATIONS}: name some candidates.")


def base_scenario(study: PlacementStudy, beside: Path, condition: ConditionOptions | None = None) -> Scenario:
    """What the trackers are tried in: the scenario with the changes, all candidates as its stations, nothing varied."""
    elsewhere = condition is not None and bool(condition.scenario)
    named = condition.scenario if condition is not None and elsewhere else study.scenario
    scenario = load_scenario(_scenario_file(named, beside))
    methods = (condition.methods if condition is not None else ()) or study.methods
    stations = {}
    for unit in study.groups():
        for one in unit:
            stations[one.name] = {"bone": one.bone, "along": one.along, "around_deg": one.around_deg}
            stations[one.name]["stand_off_m"] = one.stand_off_m
    scenario = replace(
        scenario, vary={}, expected_order=(), worn=(), stations={}, inputs=(study.inputs,), methods=methods
    )
    for where, content in (
        ("stations", {"stations": stations}),
        ("changes", {} if elsewhere else study.changes),
        (f"changes of {condition.name!r}" if condition else "", condition.changes if condition else {}),
    ):
        scenario = _apply_changes(scenario, content, where)
    check_scenario(Path(named), scenario)
    return scenario


def _apply_changes(scenario: Scenario, content: Mapping[str, Any], where: str) -> Scenario:
    if strange := [key for key in ("name", "methods", "inputs", "vary", "worn", "expected_order") if key in content]:
        raise BadInput(f"{where}: {', '.join(strange)}.", "The study has its own.")
    try:
        return replace_fields(scenario, content, where)
    except (TypeError, ValueError) as error:
        raise BadInput(f"{error}.", "Values are those that the scenario's own keys may have.") from error


def _scenario_file(name: str, beside: Path) -> Path | str:
    """Beside the study, or shipped."""
    for folder in (beside, data_folder("scenarios")):
        file = folder / (name if name.endswith(".toml") else f"{name}.toml")
        if file.is_file():
            return file
    return name
