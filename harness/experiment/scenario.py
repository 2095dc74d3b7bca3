"""Scenarios: TOML files read into frozen dataclasses. Keys name their units, and unknown keys are refused."""

import fnmatch
import itertools
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from harness.compare.run_summary.expected_orders import ExpectedOrder
from harness.core.fields import NONE, build, replace_fields
from harness.core.files import MAX_TOML_BYTES, read_toml
from harness.core.input_file import check_input_file, names_input_file
from harness.core.options import expand_alternatives
from harness.core.package_data import data_folder
from harness.core.ranges import FileName, MethodName, Name, Range, Text, check_fields, check_words
from harness.core.split import ClipPart, StatisticalUnit
from harness.errors import BadFile, BadInput, UnknownName, name_file
from harness.experiment.fitted_unit import merge_fitted_unit
from harness.mocap.library import LibraryFolders
from harness.mocap.sources import open_motion_source
from harness.results.cell import varied_text
from harness.simulate.disturbance import Disturbance
from harness.simulate.link import TrackerConfig
from harness.simulate.physics.constellation import ConstellationSettings
from harness.simulate.physics.settings import Physics
from harness.stream.is900.emulator.faults import Fault

SCHEMA = 1
MOST_VARIANTS = 1_000_000
"""Most combinations of varied values [choice]."""
_STATION_SETS_FILE = "stations.toml"
_NOT_VARIABLE = ("schema", "name", "methods", "inputs", "vary", "expected_order", "left_out", "fault", "fitted", "unit")


@dataclass(frozen=True)
class ScenarioMotion:
    """The test clips of a scenario, and the clips that methods may learn from.

    Clip lists take patterns: "13_*" stands for every clip that matches (see `expand_clips`).
    """

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {"protocol": "split"}

    source: Literal["builtin", "cmu"]
    """`builtin` is the motion generator; `cmu` is the library that --mocap or HARNESS_MOCAP names."""
    test: tuple[Name, ...]
    """Test clips by name; "13_17@0.20-0.40" is that part of the take (for split `block`)."""
    behaviours: tuple[Name, ...]
    """Behaviour of the test clips: one word for all of them, or one word for each."""
    examples: tuple[Name, ...] = ()
    """Clips that methods may learn from, except those that the split forbids for a test clip."""
    withheld: tuple[Name, ...] = ()
    """Clips and parts of clips that are no examples under any split, with 1 s around them: for example the test clips
    of the tables, while constants are chosen on other clips."""
    thin_to: Annotated[int, Range(0, 100_000_000)] = 0
    """Number of frames that all examples together keep, evenly spaced, for a sparse database (Kim et al. 2012); 0 keeps
    all."""
    example_share: Annotated[float, Range(1e-06, 1.0)] = 1.0
    """Share of the frames of all examples that is kept, in pieces of 0.5 s drawn by the scenario's seed; smaller
    shares are subsets of larger ones (see `harness.experiment.example_subset`)."""
    database: Literal["all", "behaviour"] = "all"
    """Learn from all examples, or only from those of the test clip's behaviour (Liu et al. 2011)."""
    split: Literal["block", "sequence", "subject"] = "sequence"
    """Frames that are no examples: those of the test block, of the test take, or of the test subject."""
    body: Literal["own", "standard", "common"] = "own"
    """Body of the test: `own` has the performer's proportions, the others are the mean skeleton. On `standard` the
    bones point as the performer's do; on `common` the recorded angles are kept and the root's path is scaled by the
    legs."""
    longest_s: Annotated[float, Range(0.0, 1e5)] = 0.0
    """Length of each test clip that is used, from its start [s]; 0 is all of it."""
    rate_hz: Annotated[float, Range(0.0, 1e4)] = 0.0
    """Frame rate of files that record none and that no index lists [Hz]; 0 refuses such files."""

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def tested(self) -> list[tuple[str, str]]:
        """Each test clip with its behaviour."""
        repeated = self.behaviours * (len(self.test) if len(self.behaviours) == 1 else 1)
        return list(zip(self.test, repeated, strict=True))


@dataclass(frozen=True)
class Station:
    """One station and its nominal mount (see `harness.body.mounts.Mount`)."""

    bone: str
    """Name of the bone that carries the station."""
    along: Annotated[float, Range(0.0, 1.0)] = 0.5
    """Position along the bone, 0 at its joint to 1 at its far end."""
    around_deg: Annotated[float, Range(-360.0, 360.0)] = 0.0
    """Angle around the bone [deg]."""
    stand_off_m: Annotated[float, Range(0.0, 0.5)] = 0.01
    """Distance of the station's origin from the skin [m]."""

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class CalibrationSettings:
    """Errors of a simulated performer who holds calibration poses, and of the true mounts."""

    miss_deg: Annotated[float, Range(0.0, 45.0)] = 2.5
    """Standard deviation of each hinge, and of the body's lean, from each pose [deg]."""
    hold_s: Annotated[float, Range(2.0, 60.0)] = 3.0
    """Time that each pose is held [s]."""
    beside_m: Annotated[float, Range(0.0, 1.0)] = 0.0
    """Standard deviation of the stations' positions from their nominal mounts, along each axis [m]. It is part of the
    simulated world: the calibration `exact` knows it, the others estimate it."""
    turned_deg: Annotated[float, Range(0.0, 360.0)] = 0.0
    """Standard deviation of the stations' orientations about each axis [deg]; 180 is nearly random."""

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class Scenario:
    """One experiment: every test clip with every method and every choice of inputs."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {"order": "expected_order"}

    name: FileName
    motion: ScenarioMotion
    stations: dict[Name, Station]
    """The stations by name; in a file also the name of a set, such as "liu2011" (see `expand_station_set`)."""
    methods: tuple[MethodName, ...]
    """Methods by name, with options and alternatives in brackets (see `harness.core.options`)."""
    schema: int = SCHEMA
    seed: Annotated[int, Range(0, 2**63 - 1)] = 1
    """Seed of all random draws."""
    inputs: tuple[MethodName, ...] = ("pos+ori",)
    """Which of position and orientation each station delivers; every method runs with each choice."""
    worn: tuple[Name, ...] = ()
    """Names of the stations that are worn; all of them if empty. Vary "worn" to compare sets of stations. The stream
    has no other stations, so that a station that is not worn is not a lost one."""
    calibration: Literal["exact", "tpose", "poses", "liu2011", "kim2012"] = "exact"
    """Source of the mounts, room and body that methods get: `exact` is the truth, `tpose` estimates mounts and room
    from a T-pose (bone lengths are known), `poses` estimates all three from eight poses. `liu2011` and `kim2012` are
    the papers' equations as printed: eight poses, and a T-pose. Vary it to measure the cost of calibration."""
    calibrating: CalibrationSettings = field(default_factory=CalibrationSettings)
    """Errors of the simulated calibration."""
    mount: Text = "tibia"
    """Name of the mounting in tables, such as tibia or foot: the place of the ankle stations."""
    tracker: TrackerConfig = field(default_factory=TrackerConfig)
    """The device and its line."""
    noise: Literal["clean", "noise", "default"] = "default"
    """Noise preset."""
    profile: Text = ""
    """Name of changed noise in tables; without it the preset's name and an asterisk."""
    fitted: Text = ""
    """Unit file of a measured device (`harness characterize`), in the scenario's folder. Its components and tracker
    replace those of the preset `default`; the scenario's own tables take precedence."""
    components: dict[str, Any] = field(default_factory=dict)
    """Changes to the noise preset (see `harness.simulate.noise.Noise`), such as components.echo.share = 0.05."""
    physics: Physics | None = None
    """Errors from their causes instead of the statistical ones (docs/is900.md 16): the table [physics], which may be
    empty. The noise preset then selects the causes."""
    disturbance: Disturbance = field(default_factory=Disturbance)
    """A fault that ends; vary "disturbance.kind" to measure how methods recover (see `harness.compare.run_summary`)."""
    vary: dict[Text, Any] = field(default_factory=dict)
    """Scenario key -> list of values, such as "components.echo.share" = [0.0, 0.05]. Everything runs with each value,
    or with each combination of values when there are several keys."""
    expected_order: tuple[ExpectedOrder, ...] = ()
    """Rankings that papers state (see `harness.compare.run_summary.expected_orders`)."""
    unit: StatisticalUnit = "performer"
    """What statistics of the results count. Clips of one performer are not independent. `clip` is for test clips of too
    few performers: every page then says that its statements hold for these performers only."""
    left_out: dict[Text, Text] = field(default_factory=dict)
    """Clips, behaviours or experiments that a reader might miss -> the reason why they are left out."""
    fault: tuple[Fault, ...] = ()
    """Faults of the line when an emulator plays the scenario (see `stream.is900.emulator`); runs ignore them."""

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def noise_label(self) -> str:
        """Name of the noise in tables: the profile, or the preset, with an asterisk if components change it."""
        physical = " physics" if self.physics else ""
        return self.profile or self.noise + physical + ("*" if self.components else "")

    def content(self) -> dict[str, Any]:
        """The fields as a dictionary, without a table [physics] that is not there, and without the name of a unit file.

        The values of the unit are in the tables.
        """
        content = {**asdict(self), "tracker": self.tracker.as_dict()}
        del content["fitted"]
        if self.physics is None:
            del content["physics"]  # as before the key existed
        return content

    @property
    def worn_stations(self) -> dict[str, Station]:
        """The stations that are worn, in the order of the table."""
        return {name: self.stations[name] for name in self.stations if not self.worn or name in self.worn}


def load_scenario(path: Path | str) -> Scenario:
    """Load the scenario in a TOML file, or the shipped scenario of that name.

    Raises BadFile, UnknownName and RenamedKey, which name the place. Patterns in clip lists stay (see `expand_clips`).
    """
    path = find_scenario(path)
    content = read_toml(path, "a scenario", "`harness list` names the shipped ones.")
    if content.get("kind") == "placement":
        raise BadFile(path, "a placement study", "a scenario", "Run it with `harness placement`.")
    content.setdefault("name", path.stem)
    with name_file(path):
        try:
            if "stations" in content:
                content["stations"] = expand_station_set(content["stations"])
            if "fitted" in content:
                content = merge_fitted_unit(content, path.parent)
            scenario = build(Scenario, content, "scenario")
            methods = tuple(name for text in scenario.methods for name in expand_alternatives(text))
            scenario = _read_constellation(replace(scenario, methods=methods), path.parent)
        except (TypeError, ValueError) as error:
            raise BadFile(path, str(error), "a scenario", "See the shipped ones in scenarios/.") from error
        check_scenario(path, scenario)
        check_expected_orders(path, scenario)
    return scenario


def _read_constellation(scenario: Scenario, folder: Path) -> Scenario:
    """The scenario with the emitters of its file, if it names one; BadFile."""
    if scenario.physics is None:
        return scenario
    constellation = scenario.physics.constellation.with_file_read(folder)
    return replace(scenario, physics=replace(scenario.physics, constellation=constellation))


def expand_station_set(stations: Any) -> Any:
    """The table of stations that a scenario means by `stations`: the name of a set, or a table.

    A table whose key `set` names a set starts from that set: a table of a station changes the values it names, or adds
    the station after the others; "none" leaves the station out. UnknownName for a set or a station that is not there.
    """
    if isinstance(stations, str):
        stations = {"set": stations}
    if not isinstance(stations, Mapping) or not isinstance(stations.get("set"), str):
        return stations
    sets = read_station_sets()
    if stations["set"] not in sets:
        raise UnknownName("set of stations", stations["set"], sets)
    expanded = {name: dict(station) for name, station in sets[stations["set"]].items()}
    for name, change in stations.items():
        if change == NONE and name not in expanded:
            raise UnknownName(f"station of {stations['set']}", name, expanded)
        if change == NONE:
            del expanded[name]
        elif name != "set":
            expanded[name] = {**expanded.get(name, {}), **change} if isinstance(change, Mapping) else change
    return expanded


@cache
def read_station_sets() -> dict[str, dict[str, Any]]:
    """The shipped sets of stations: set -> station -> its table (see `Station`)."""
    return read_toml(data_folder("scenarios") / _STATION_SETS_FILE, "sets of stations", "Install the package again.")


def expand_clips(scenario: Scenario, folder: LibraryFolders | None) -> Scenario:
    """The scenario with every pattern in its clip lists, such as "13_*", replaced by the clips that match it.

    Clips are the takes of the motion generator, or those of the library in `folder` (by default HARNESS_MOCAP), sorted
    by name. "13_*@0.20-0.40" is that part of each. A clip that the list also names itself is not repeated. BadInput for
    a pattern that matches nothing.
    """
    motion = scenario.motion
    if not any(map(_is_pattern, (*motion.test, *motion.examples, *motion.withheld))):
        return scenario
    source = open_motion_source(motion.source, folder, seed=scenario.seed, rate_hz=motion.rate_hz or None)
    test, examples, withheld = (
        _match_clips(key, getattr(motion, key), source.names()) for key in ("test", "examples", "withheld")
    )
    scenario = replace(scenario, motion=replace(motion, test=test, examples=examples, withheld=withheld))
    check_scenario(Path(scenario.name), scenario)
    return scenario


def _is_pattern(text: str) -> bool:
    return any(sign in text.partition("@")[0] for sign in "*?[")


def _match_clips(key: str, texts: Sequence[str], names: Collection[str]) -> tuple[str, ...]:
    """The entries of one clip list with its patterns expanded."""
    entries: list[str] = []
    for text in texts:
        if not _is_pattern(text):
            entries.append(text)
            continue
        pattern, at, part = text.partition("@")
        matches = sorted(
            name for name in names if any(fnmatch.fnmatchcase(one, pattern) for one in {name, name.rpartition("/")[2]})
        )
        if not matches:
            raise BadInput(f"motion.{key}: no clip matches {text!r}.", "`harness mocap list` names those of a library.")
        entries += [f"{name}{at}{part}" for name in matches if f"{name}{at}{part}" not in (*texts, *entries)]
    return tuple(entries)


def variants(scenario: Scenario, chosen: Collection[int] = ()) -> list[tuple[dict[str, Any], Scenario]]:
    """Every combination of varied values with the scenario that it gives; one empty combination if nothing varies.

    `chosen` selects combinations by index. UnknownName for a key that does not exist, BadInput for a key that cannot be
    varied and for a value that does not fit.
    """
    choices = dict(dotted_keys(scenario.vary))
    for key, values in choices.items():
        if key.split(".")[0] in _NOT_VARIABLE or key in ("motion.test", "motion.behaviours"):
            raise BadInput(
                f"vary: {key} cannot be varied.", "Name several methods, inputs or clips in their own lists."
            )
        if not isinstance(values, list) or not values or any(values.count(value) > 1 for value in values):
            raise BadInput(f"vary: {key} = {values!r} is not a list of different values.", "Write it as [0.0, 0.05].")
    count_variants(scenario)
    found = []
    for place, combination in enumerate(itertools.product(*choices.values())):
        if chosen and place not in chosen:
            continue
        varied = dict(zip(choices, combination, strict=True))
        variant = replace(scenario, vary={})
        try:
            for key, value in varied.items():
                content: Any = value
                for name in reversed(key.split(".")):
                    content = {name: content}
                variant = change_scenario(variant, content, "scenario")
        except (TypeError, ValueError) as error:
            raise BadInput(f"vary: {error}.", "A value must be one that the scenario's own key may have.") from error
        found.append((varied, variant))
    return found


def change_scenario(scenario: Scenario, content: Mapping[str, Any], where: str) -> Scenario:
    """The scenario with some fields changed, as `core.fields.replace_fields` does it.

    BadInput for a change of `physics.constellation.file`, which is read with the scenario, and for a change of
    `physics.constellation.name` beside a file, which would have no effect.
    """
    changed = replace_fields(scenario, content, where)
    before, after = (s.physics.constellation if s.physics else ConstellationSettings() for s in (scenario, changed))
    if after.file != before.file:
        found = f"{where}: a change of physics.constellation.file."
        raise BadInput(found, "Write a scenario for each file; physics.constellation.name can be changed.")
    if after.file and after.name != before.name:
        found = f"{where}: physics.constellation.name = {after.name!r} beside physics.constellation.file."
        raise BadInput(found, "The file replaces the name: start from a scenario without it.")
    return changed


def count_variants(scenario: Scenario) -> int:
    """Number of combinations of varied values, as `variants` lists them; BadInput for more than `MOST_VARIANTS`."""
    count = math.prod(len(values) for _, values in dotted_keys(scenario.vary))
    if count > MOST_VARIANTS:
        raise BadInput(f"vary: {count:,} combinations.", f"At most {MOST_VARIANTS:,}: vary fewer keys at a time.")
    return count


def dotted_keys(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Entries of a table under dotted keys, whether TOML read these as one text or as nested tables."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from dotted_keys(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def find_scenario(path: Path | str, beside: Path | None = None) -> Path:
    """The path of a scenario: a file, or a shipped scenario by its bare name. UnknownName, BadFile.

    With a folder `beside`, a file there comes first, then one in the folder of shipped scenarios, both with or without
    `.toml` in their names.
    """
    for folder in (beside, data_folder("scenarios")) if beside is not None else ():
        for file in (folder / path, folder / f"{path}.toml"):
            if names_input_file(file):
                return file
    return find_config(
        path, "scenario", Path("scenarios"), shipped_scenarios(), "`harness list` names the shipped ones."
    )


def find_config(path: Path | str, kind: str, folder: Path, shipped: Sequence[Path], advice: str) -> Path:
    """The path of a file in TOML of a kind, such as "sweep": a file, or a shipped one by its bare name.

    A shipped one is also found by its name in the `folder` of the repository. UnknownName, BadFile with this advice.
    """
    given = Path(path)
    check_words(given)
    if names_input_file(given):
        return given
    by_name = {file.stem: file for file in shipped}
    if given.suffix in ("", ".toml") and given.stem in by_name and given.parent in (Path(), folder):
        return by_name[given.stem]
    if given.parent == Path() and not given.suffix:
        raise UnknownName(kind, str(path), by_name)
    check_input_file(given, f"a {kind} in TOML", MAX_TOML_BYTES, advice)
    return given


def shipped_scenarios() -> list[Path]:
    """The files of the shipped scenarios that a bare name finds."""
    return sorted(path for path in data_folder("scenarios").glob("*.toml") if path.name != _STATION_SETS_FILE)


def check_scenario(path: Path, scenario: Scenario) -> None:
    """Check the rules that types cannot express; BadFile names `path`."""

    def refuse(found: str, expected: str, advice: str) -> None:
        raise BadFile(path, found, expected, advice)

    if scenario.schema != SCHEMA:
        refuse(f"schema {scenario.schema}", f"schema {SCHEMA}", "This version of the harness reads no other schema.")
    if not scenario.motion.test:
        refuse("no test clips", "names in motion.test", "`harness mocap list` names what a library holds.")
    if not scenario.stations:
        refuse("no stations", "a table [stations] with at least one", "For example: head = { bone = 'head' }.")
    if not scenario.methods:
        refuse("no methods", "names in methods", "`harness list` names them.")
    if not scenario.inputs:
        refuse("no inputs", "names in inputs", "`harness list` names them.")
    counted = not any(map(_is_pattern, scenario.motion.test))  # else `expand_clips` checks it
    if counted and len(scenario.motion.behaviours) not in (1, len(scenario.motion.test)):
        refuse(
            f"{len(scenario.motion.behaviours)} behaviours for {len(scenario.motion.test)} test clips",
            "one word for all, or one for each",
            "Give motion.behaviours one word.",
        )
    for varied, variant in variants(scenario) if scenario.vary else ():
        try:
            check_scenario(path, variant)
        except BadFile as error:
            refuse(f"{error.found} with {varied_text(varied)}", error.expected, error.advice)
    for what, repeated in (
        ("motion.test", scenario.motion.test),
        ("methods", scenario.methods),
        ("inputs", scenario.inputs),
        ("worn", scenario.worn),
    ):
        if len(set(repeated)) < len(repeated):
            refuse(f"{what} names something twice", "each name once", "Remove the second.")
    parts = sorted(map(ClipPart.parse, scenario.motion.test), key=lambda part: (part.clip, part.start))
    for one, other in pairwise(parts):
        if one.clip == other.clip and other.start < one.end:
            refuse(f"motion.test has {one} and {other}, which overlap", "parts without common frames", "Shorten one.")
    for name in scenario.worn:
        if name not in scenario.stations:
            refuse(f"worn names {name!r}", "names of [stations]", f"They are: {', '.join(scenario.stations)}.")
    _check_settings_of_stations(scenario)


def _check_settings_of_stations(scenario: Scenario) -> None:
    """UnknownName for prediction or enhancement of a station that is not there."""
    fusion = scenario.physics.fusion if scenario.physics else None
    for key in ("prediction_ms", "enhancement"):
        for name in getattr(fusion, key, ()):
            if name not in scenario.stations:
                raise UnknownName(f"station in physics.fusion.{key}", name, scenario.stations)


def check_expected_orders(path: Path, scenario: Scenario) -> None:
    """Check that expected orders name the scenario's methods or inputs; BadFile.

    The command line skips the check where it replaces the methods.
    """
    for order in scenario.expected_order:
        where, what, known = f"the order of {order.source!r}", "methods", scenario.methods
        if order.inputs:
            what, known = "inputs", scenario.inputs
        strange = [name for name in order.names if name not in known]
        if order.inputs and order.method not in scenario.methods:
            strange, what, known = [order.method], "methods", scenario.methods
        faults = {
            "has no source": not order.source,
            "names neither or both of methods and inputs": bool(order.methods) == bool(order.inputs),
            "names a method whose inputs it does not compare": bool(order.method) > bool(order.inputs),
            "names fewer than two": len(order.names) < 2,
            "names something twice": len(set(order.names)) < len(order.names),
            f"names {', '.join(map(repr, strange))}, none of the scenario's {what}": bool(strange),
            "gives a reason for a step that it does not have": not set(order.why_not) <= set(order.steps),
        }
        for fault in (text for text, found in faults.items() if found):
            advice = f"Known {what}: {', '.join(known)}. Reasons belong to {', '.join(map(repr, order.steps))}."
            raise BadFile(path, f"{where} {fault}", "two or more methods, or inputs and their method", advice)
