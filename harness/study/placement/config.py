"""Configuration of a placement study (TOML): candidates, search modes, further conditions, papers' claims."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from harness.compare import MARGINS
from harness.core.fields import build
from harness.core.file_kind import check_toml_kind
from harness.core.files import read_toml
from harness.core.input_file import names_input_file
from harness.core.options import expand_alternatives
from harness.core.package_data import data_folder
from harness.core.ranges import FileName, MethodName, Name, Range, Text
from harness.errors import BadFile, BadInput, UnknownName, name_file
from harness.experiment.scenarios import SCHEMA, Scenario, check_scenario, find_config
from harness.score import DEFINITIONS
from harness.study.placement.candidates import (
    Candidate,
    CandidateGrid,
    CandidateGroup,
    make_candidate_groups,
    select_groups,
)

MAX_STATIONS = 12
"""Most stations of an IS-900 (docs/is900.md)."""
_OLD_PREFIX = "placement_"
"""Prefix that names of shipped studies once had."""


@dataclass(frozen=True)
class AblateOptions:
    """Leave each unit out of a set."""

    full: tuple[str, ...] = ()
    """The full set: names of candidates or pairs; all by default."""


@dataclass(frozen=True)
class AddOptions:
    """Add each unit to a set."""

    base: tuple[str, ...] = ()
    of: tuple[str, ...] = ()
    """The units to add; all candidates by default."""


@dataclass(frozen=True)
class GreedyOptions:
    """Add one unit after another, each time the one that reduces the error most."""

    most: Annotated[int, Range(1, 12)]
    """Number of stations at the end."""
    base: tuple[str, ...] = ()
    of: tuple[str, ...] = ()


@dataclass(frozen=True)
class ExhaustiveOptions:
    """Measure every set."""

    most: Annotated[int, Range(1, 12)]
    """Most stations of a set."""
    fewest: Annotated[int, Range(1, 12)] = 1
    of: tuple[str, ...] = ()
    most_cells: Annotated[int, Range(1, 100_000_000)] = 5000
    """Limit of the number of cells; a study with more is refused."""


@dataclass(frozen=True)
class RefineOptions:
    """Move the stations of a set along and around their bones, step by step."""

    set: tuple[str, ...] = ()
    """The initial set; by default the best measured set of `size` stations."""
    size: Annotated[int, Range(0, 12)] = 0
    along: Annotated[tuple[float, ...], Range(0.0, 1.0)] = (0.2, 0.1)
    """Steps along the bone, the largest first, as shares of its length."""
    around_deg: Annotated[tuple[float, ...], Range(0.0, 360.0)] = (45.0, 22.5)
    """Steps around the bone, as many as in `along` [deg]."""
    most_moves: Annotated[int, Range(1, 1000)] = 6


@dataclass(frozen=True)
class ConditionOptions:
    """A further condition under which the same sets are measured."""

    name: Name
    scenario: str = ""
    """Another scenario, without the study's `changes`; by default the study's scenario with its `changes`."""
    methods: tuple[str, ...] = ()
    changes: dict[str, Any] = field(default_factory=dict)
    """Changes to the scenario, as in `PlacementStudy`."""


@dataclass(frozen=True)
class PublishedClaim:
    """A claim that a set suffices: no other of its size errs less, and all candidates together err hardly less."""

    text: str
    """Such as "walking: both ankles and the pelvis suffice"."""
    source: str
    set: tuple[str, ...]
    among: tuple[str, ...] = ()
    """The candidates that the source considers; the other sets of the same size consist of these. All by default."""
    margin: Annotated[float, Range(0.0, 10.0)] = 0.1
    """Largest relative difference between the error of the set and that of all candidates together."""
    why_not: str = ""
    """An explanation for a claim that is not reproduced."""


@dataclass(frozen=True)
class PlacementStudy:
    """The configuration that `harness placement` reads."""

    name: FileName
    kind: Literal["placement"]
    title: Text
    scenario: str
    """A file in the folder of the study (without `.toml`), or a shipped scenario. It defines motion, body, calibration,
    noise, tracker and seed; its stations, methods, inputs and `vary` are not used."""
    methods: tuple[MethodName, ...]
    """Methods; the mean of their errors is minimised."""
    schema: int = SCHEMA
    metric: str = "joint_angle_mean_deg"
    inputs: MethodName = "pos+ori"
    held_out: tuple[Name, ...] = ()
    """Held-out clips: sets that were chosen on the scenario's test clips are tested on these."""
    link: bool = False
    """Limit the rate of each set to what the serial line carries, at most the scenario's rate."""
    changes: dict[str, Any] = field(default_factory=dict)
    """Changes to the scenario, such as changes.noise = "clean"; changes.components adds error components such as strap
    slip and soft tissue."""
    candidate: tuple[Candidate, ...] = ()
    grid: tuple[CandidateGrid, ...] = ()
    ablate: AblateOptions | None = None
    add: AddOptions | None = None
    greedy: GreedyOptions | None = None
    exhaustive: ExhaustiveOptions | None = None
    refine: RefineOptions | None = None
    condition: tuple[ConditionOptions, ...] = ()
    sizes: Annotated[tuple[int, ...], Range(1, 12)] = ()
    """The numbers of stations that are asked about, which the first sentence answers; by default it recommends the
    smallest number that suffices."""
    condition_size: Annotated[int, Range(1, 12)] = 3
    """Size of the sets that every condition ranks."""
    claim: tuple[PublishedClaim, ...] = ()

    def groups(self) -> tuple[CandidateGroup, ...]:
        """The candidates of all tables."""
        return make_candidate_groups((*self.candidate, *self.grid))


def find_placement_study(path: Path | str) -> Path:
    """Find a study by path, or a shipped one by name; BadFile, UnknownName."""
    shipped, old = shipped_placements(), Path(path).stem
    new = old.removeprefix(_OLD_PREFIX)
    if old != new and new in {file.stem for file in shipped} and not names_input_file(Path(path)):
        raise BadInput(f"The placement study {old} is now called {new}.", f"Type: harness placement {new}")
    folder, advice = Path("scenarios/placement"), "Shipped ones are in scenarios/placement/."
    return find_config(path, "placement study", folder, shipped, advice)


def shipped_placements() -> list[Path]:
    """The files of the shipped placement studies."""
    return sorted(data_folder("scenarios").glob("placement/*.toml"))


def load_placement_study(path: Path | str) -> PlacementStudy:
    """Read and check a study; BadFile and UnknownName name the fault."""
    path = find_placement_study(path)
    expected, advice = "a placement study", "See scenarios/placement/walking.toml."
    content = read_toml(path, expected, advice)
    check_toml_kind(path, content, expected, advice, needs_kind="placement")
    content.setdefault("name", path.stem)
    with name_file(path):
        try:
            study = build(PlacementStudy, content, "study")
            study = replace(study, methods=tuple(name for text in study.methods for name in expand_alternatives(text)))
        except (TypeError, ValueError) as error:
            raise BadFile(path, str(error), "", advice) from error
        if fault := _find_fault(study):
            raise BadFile(path, *fault)
        _check_names(study)
    return study


def _find_fault(study: PlacementStudy) -> tuple[str, str, str] | None:
    """Check what types cannot express; returns what was found, what is expected and advice."""
    if study.schema != SCHEMA:
        return f"schema {study.schema}", f"schema {SCHEMA}", "This version of the harness reads only that schema."
    if not study.methods:
        return "no methods", "names in methods", "`harness list` names them."
    if study.metric not in DEFINITIONS:
        raise UnknownName("metric", study.metric, MARGINS)
    if study.metric not in MARGINS:
        return (
            f"metric = {study.metric!r}",
            "a metric of accuracy, smoothness or time",
            f"Use one of {', '.join(MARGINS)}.",
        )
    if not (study.ablate or study.add or study.greedy or study.exhaustive or study.refine):
        return "no search mode", "[ablate], [add], [greedy], [exhaustive] or [refine]", "docs/studies.md explains them."
    if study.refine and (not study.refine.along or len(study.refine.along) != len(study.refine.around_deg)):
        return "refine: steps along and around", "equally many of both, at least one", "The steps are used in pairs."
    if study.refine and min(*study.refine.along, *study.refine.around_deg) <= 0.0:
        return "refine: a step that is not above 0", "steps above 0", "Leave `refine` out, or name larger steps."
    for mode, table in (("greedy", study.greedy), ("exhaustive", study.exhaustive)):
        if table and not 1 <= table.most <= MAX_STATIONS:
            return f"{mode}.most = {table.most}", f"1 to {MAX_STATIONS} stations", "An IS-900 has no more."
    if len(set(study.sizes)) < len(study.sizes):
        return "sizes has a number twice", "each number once", "Remove the duplicate."
    names = [condition.name for condition in study.condition]
    if len(set(names)) < len(names) or not all(names):
        return f"conditions named {', '.join(names)}", "distinct names", "Rename one of them."
    if len(set(study.held_out)) < len(study.held_out):
        return "held_out has a clip twice", "each clip once", "Remove the duplicate."
    return None


def _check_names(study: PlacementStudy) -> None:
    """Check that every named set consists of candidates and has a valid number of stations."""
    units = study.groups()
    named_sets: list[tuple[str, tuple[str, ...]]] = [("ablate.full", study.ablate.full)] if study.ablate else []
    for mode, table in (("add", study.add), ("greedy", study.greedy)):
        named_sets += [(f"{mode}.base", table.base), (f"{mode}.of", table.of)] if table else []
    named_sets += [("exhaustive.of", study.exhaustive.of)] if study.exhaustive else []
    named_sets += [("refine.set", study.refine.set)] if study.refine else []
    for claim in study.claim:
        named_sets += [(f"the claim {claim.text!r}", claim.set), (f"the claim {claim.text!r}", claim.among)]
    for where, names in named_sets:
        groups = select_groups(names, units, where)
        if where in ("ablate.full", "add.base", "refine.set") and names:
            check_station_count(sum(map(len, groups)), where)


def check_station_count(stations: int, where: str) -> None:
    """BadInput for a number of stations that an IS-900 does not support."""
    if not 1 <= stations <= MAX_STATIONS:
        raise BadInput(
            f"{where}: {stations} stations.", f"An IS-900 has 1 to {MAX_STATIONS} stations; name fewer candidates."
        )


def base_scenario(
    study: PlacementStudy, load: Callable[[str], Scenario], condition: ConditionOptions | None = None
) -> Scenario:
    """The scenario of the study or of a condition: with its changes, all candidates as stations, and an empty `vary`.

    `load` gives the scenario that the study or the condition names.
    """
    other_scenario = condition is not None and bool(condition.scenario)
    named = condition.scenario if condition is not None and other_scenario else study.scenario
    scenario = load(named)
    methods = (condition.methods if condition is not None else ()) or study.methods
    stations = {}
    for unit in study.groups():
        for place in unit:
            stations[place.name] = {"bone": place.bone, "along": place.along, "around_deg": place.around_deg}
            stations[place.name]["stand_off_m"] = place.stand_off_m
    scenario = replace(
        scenario, vary={}, expected_order=(), worn=(), stations={}, inputs=(study.inputs,), methods=methods
    )
    for where, content in (
        ("stations", {"stations": stations}),
        ("changes", {} if other_scenario else study.changes),
        (f"changes of {condition.name!r}" if condition else "", condition.changes if condition else {}),
    ):
        scenario = _apply_changes(scenario, content, where)
    check_scenario(Path(named), scenario)
    return scenario


def _apply_changes(scenario: Scenario, content: Mapping[str, Any], where: str) -> Scenario:
    if fixed := [key for key in ("name", "methods", "inputs", "vary", "worn", "expected_order") if key in content]:
        raise BadInput(f"{where}: {', '.join(fixed)}.", "The study defines these keys.")
    try:
        return scenario.change(content, where)
    except (TypeError, ValueError) as error:
        raise BadInput(f"{error}.", "Use keys and values as in a scenario.") from error
