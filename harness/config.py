"""Scenarios: TOML files read into frozen dataclasses, with units in the keys and unknown keys refused."""

import dataclasses
import math
import tomllib
import types
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from harness.core.share import share_folder
from harness.errors import BadFile, HarnessError, UnknownName
from harness.simulate.link import TrackerConfig

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T = TypeVar("T", bound="DataclassInstance")

SCHEMA = 1


@dataclass(frozen=True)
class Motion:
    """Which clips are judged, and which may be learnt from."""

    source: Literal["builtin", "cmu"]
    """`cmu` is looked up below --mocap or HARNESS_MOCAP and refused without it."""
    test: tuple[str, ...]
    """Clip names; "13_17@0.20-0.40" is that share of the take (protocol block)."""
    behaviours: tuple[str, ...]
    """What the clips show: one word for all of them, or one for each."""
    examples: tuple[str, ...] = ()
    """Clips that methods may learn from; what the protocol forbids is left out clip by clip."""
    withheld: tuple[str, ...] = ()
    """Clips and parts of clips that nothing is learnt from under any protocol, nor within 1 s of them: the test clips,
    while constants are chosen on others."""
    database: Literal["all", "behaviour"] = "all"
    """Learn from every example, or from those of the test clip's behaviour only (Liu et al. 2011)."""
    protocol: Literal["block", "sequence", "subject"] = "sequence"
    body: Literal["own", "standard", "common"] = "own"
    """Judge on the performer's own proportions; or on the mean skeleton, `standard` with bones that point as the
    performer's do, `common` with the recorded angles kept and the root's path scaled by the legs."""
    longest_s: float = 0.0
    """Only the first so many seconds of each test clip [s]; 0 is all of it."""
    rate_hz: float = 0.0
    """Rate of files that record none and that no index names [Hz]; 0 refuses them."""


@dataclass(frozen=True)
class Station:
    """One tracker and where it is worn (see `harness.body.mounts.Mount`)."""

    bone: str
    along: float = 0.5
    """Position along the bone, 0 at its joint to 1 at its far end."""
    around_deg: float = 0.0
    """Angle around the bone [deg]."""
    stand_off_m: float = 0.01
    """Distance of the tracker's origin from the skin [m]."""


@dataclass(frozen=True)
class Scenario:
    """One experiment: every test clip, with every method and every choice of inputs."""

    name: str
    motion: Motion
    stations: dict[str, Station]
    methods: tuple[str, ...]
    schema: int = SCHEMA
    seed: int = 1
    inputs: tuple[str, ...] = ("pos+ori",)
    calibration: Literal["exact"] = "exact"
    mount: str = "tibia"
    """Name of the mounting in tables, such as tibia or foot (where the ankle trackers sit)."""
    tracker: TrackerConfig = field(default_factory=TrackerConfig)
    """The device and its line."""
    noise: Literal["clean", "noise", "default"] = "default"
    profile: str = ""
    """What tables call the noise when components are changed; "default*" and so on without a name."""
    components: dict[str, Any] = field(default_factory=dict)
    """Changes to the noise level (see `harness.simulate.noise.Noise`), such as components.echo.share = 0.05."""


def load_scenario(path: Path | str) -> Scenario:
    """The scenario in a TOML file, or the shipped one of that name. BadFile and UnknownName name the place."""
    path = find_scenario(path)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadFile(path, f"not TOML: {error}", "a scenario", "`harness list` names the shipped ones.") from error
    content.setdefault("name", path.stem)
    try:
        scenario = build(Scenario, content, "scenario")
    except (TypeError, ValueError) as error:
        raise BadFile(path, str(error), "a scenario", "See the shipped ones in scenarios/.") from error
    check_scenario(path, scenario)
    return scenario


def find_scenario(path: Path | str) -> Path:
    """A file as named, or a shipped scenario by its bare name."""
    given = Path(path)
    if given.is_file():
        return given
    shipped = {p.stem: p for p in shipped_scenarios()}
    if given.suffix in ("", ".toml") and given.stem in shipped and given.parent in (Path(), Path("scenarios")):
        return shipped[given.stem]
    if given.parent == Path() and not given.suffix:
        raise UnknownName("scenario", str(path), shipped)
    raise BadFile(given, "no such file", "a scenario in TOML", "`harness list` names the shipped ones.")


def shipped_scenarios() -> list[Path]:
    return sorted(share_folder("scenarios").glob("*.toml"))


def check_scenario(path: Path, scenario: Scenario) -> None:
    """What types cannot say."""

    def refuse(found: str, expected: str, advice: str) -> None:
        raise BadFile(path, found, expected, advice)

    if scenario.schema != SCHEMA:
        refuse(f"schema {scenario.schema}", f"schema {SCHEMA}", "This version of the harness reads no other.")
    if not scenario.motion.test:
        refuse("no test clips", "names in motion.test", "`harness mocap list` names what a library holds.")
    if not scenario.stations:
        refuse("no stations", "a table [stations] with at least one", "For example: head = { bone = 'head' }.")
    if not scenario.methods:
        refuse("no methods", "names in methods", "`harness list` names them.")
    if not scenario.inputs:
        refuse("no inputs", "names in inputs", "`harness list` names them.")
    if scenario.name != Path(scenario.name).name:
        refuse(f"name = {scenario.name!r}", "a plain name", "Results are written to a folder of that name.")
    if len(scenario.motion.behaviours) not in (1, len(scenario.motion.test)):
        refuse(
            f"{len(scenario.motion.behaviours)} behaviours for {len(scenario.motion.test)} test clips",
            "one for all of them, or one for each",
            "Give motion.behaviours one word.",
        )
    for what, repeated in (
        ("motion.test", scenario.motion.test),
        ("methods", scenario.methods),
        ("inputs", scenario.inputs),
    ):
        if len(set(repeated)) < len(repeated):
            refuse(f"{what} names something twice", "each name once", "Remove the second.")
    if not 1.0 <= scenario.tracker.rate_hz <= 1000.0:
        refuse(f"tracker.rate_hz = {scenario.tracker.rate_hz}", "1 to 1000", "An IS-900 delivers up to 180 Hz.")
    for key, value in (("longest_s", scenario.motion.longest_s), ("rate_hz", scenario.motion.rate_hz)):
        if value < 0.0:
            refuse(f"motion.{key} = {value}", "0 or more", "0 stands for all of it, or for none recorded.")
    for name, station in scenario.stations.items():
        if not 0.0 <= station.along <= 1.0:
            refuse(f"stations.{name}.along = {station.along}", "0 to 1", "0 is the bone's joint, 1 its far end.")
        if station.stand_off_m < 0.0:
            refuse(f"stations.{name}.stand_off_m = {station.stand_off_m}", "0 or more", "Trackers sit on the skin.")


def build(kind: type[T], content: Any, where: str) -> T:
    """A dataclass from a mapping, by its annotations; UnknownName for keys, TypeError for values."""
    if not isinstance(content, Mapping):
        raise TypeError(f"{where}: expected a table, found {content!r}")
    hints = get_type_hints(kind)
    fields = {f.name: f for f in dataclasses.fields(kind) if f.init}
    for key in content:
        if key not in fields:
            raise UnknownName(f"key in {where}", str(key), fields)
    missing = [
        f.name
        for f in fields.values()
        if f.name not in content and f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING
    ]
    if missing:
        raise TypeError(f"{where}: missing {', '.join(missing)}")
    return kind(**{key: convert(hints[key], value, f"{where}.{key}") for key, value in content.items()})


def changed(instance: T, content: Mapping[str, Any], where: str) -> T:
    """A copy of a dataclass with the given fields replaced, checked as `build` does."""
    hints = get_type_hints(type(instance))
    fields = [f.name for f in dataclasses.fields(instance) if f.init]
    for key in content:
        if key not in fields:
            raise UnknownName(f"key in {where}", str(key), fields)
    values = {}
    for key, value in content.items():
        now = getattr(instance, key)
        if dataclasses.is_dataclass(now) and not isinstance(now, type) and isinstance(value, Mapping):
            values[key] = changed(now, value, f"{where}.{key}")
        else:
            values[key] = convert(hints[key], value, f"{where}.{key}")
    return dataclasses.replace(instance, **values)


def convert(hint: Any, value: Any, where: str) -> Any:
    """`value` as the annotation wants it; TypeError says where and what was expected."""
    origin, args = get_origin(hint), get_args(hint)
    if hint is Any:
        return value
    if origin in (Union, types.UnionType):
        return _first_that_fits(args, value, where)
    if origin is Literal:
        if value not in args:
            raise UnknownName(where, str(value), [str(a) for a in args])
        return value
    if origin is tuple:
        if not isinstance(value, list):
            raise TypeError(f"{where}: expected a list, found {value!r}")
        if args[-1] is not Ellipsis and len(args) != len(value):
            raise TypeError(f"{where}: expected {len(args)} values, found {len(value)}")
        kinds = [args[0]] * len(value) if args[-1] is Ellipsis else args
        pairs = enumerate(zip(kinds, value, strict=True))
        return tuple(convert(kind, item, f"{where}[{i}]") for i, (kind, item) in pairs)
    if origin is dict:
        if not isinstance(value, Mapping):
            raise TypeError(f"{where}: expected a table, found {value!r}")
        return {str(key): convert(args[1], item, f"{where}.{key}") for key, item in value.items()}
    if dataclasses.is_dataclass(hint):
        return build(cast("type[DataclassInstance]", hint), value, where)
    if hint is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, hint) or (isinstance(value, bool) and hint is not bool):
        raise TypeError(f"{where}: expected {hint.__name__}, found {value!r}")
    if isinstance(value, float) and not math.isfinite(value):
        raise TypeError(f"{where}: expected a finite number, found {value}")
    return value


def _first_that_fits(kinds: tuple[Any, ...], value: Any, where: str) -> Any:
    if value is None and type(None) in kinds:
        return None
    complaints: list[Exception] = []
    for kind in kinds:
        if kind is not type(None):
            try:
                return convert(kind, value, where)
            except (TypeError, HarnessError) as complaint:
                complaints.append(complaint)
    raise complaints[0]
