"""Sweeps: their TOML files, and the scenarios that they expand to (scenario x clip x method x seed x any key)."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

from harness.core.fields import build
from harness.core.file_kind import check_toml_kind
from harness.core.files import read_toml
from harness.core.options import expand_alternatives
from harness.core.package_data import data_folder
from harness.core.ranges import FileName, MethodName, Name, Range, Text
from harness.errors import BadFile, BadInput, UnknownName, name_file
from harness.experiment.scenarios.motion_source import expand_clips
from harness.experiment.scenarios.scenario import SCHEMA, Scenario, dotted_keys
from harness.experiment.scenarios.scenario_checks import check_scenario
from harness.experiment.scenarios.scenario_reader import find_config, find_scenario, load_scenario
from harness.mocap import LibraryFolders

_EXPECTED, _ADVICE = "a sweep", "See the shipped ones in scenarios/sweeps/."


@dataclass(frozen=True)
class Sweep:
    """Content of a sweep's file; keys that it leaves out are those of the scenarios."""

    name: FileName
    scenarios: tuple[Text, ...]
    """Names of shipped scenarios, or of files in the sweep's folder without `.toml`."""
    schema: int = SCHEMA
    methods: tuple[MethodName, ...] = ()
    inputs: tuple[MethodName, ...] = ()
    clips: tuple[Name, ...] = ()
    """Subset of the scenarios' test clips, () for all."""
    seeds: Annotated[tuple[int, ...], Range(0, 2**63 - 1)] = ()
    vary: dict[Text, Any] = field(default_factory=dict)
    """Varied keys as in a scenario, in addition to those that the scenarios vary."""


def load_sweep(path: Path | str) -> tuple[Sweep, Path]:
    """Load the sweep of a TOML file or the shipped one of that name; the sweep and its path. BadFile, UnknownName."""
    advice = "Shipped ones are in scenarios/sweeps/."
    path = find_config(path, "sweep", Path("scenarios/sweeps"), shipped_sweeps(), advice)
    content = read_toml(path, _EXPECTED, _ADVICE)
    check_toml_kind(path, content, _EXPECTED, _ADVICE)
    content.setdefault("name", path.stem)
    try:
        with name_file(path):
            sweep = build(Sweep, content, "sweep")
    except (TypeError, ValueError) as error:
        raise BadFile(path, str(error), "", _ADVICE) from error
    if sweep.schema != SCHEMA:
        advice = "This version of the harness reads no other."
        raise BadFile(path, f"schema {sweep.schema}", f"schema {SCHEMA}", advice)
    if not sweep.scenarios:
        raise BadFile(path, "no scenarios", "names in scenarios", "`harness list` names the shipped ones.")
    for key in ("scenarios", "methods", "inputs", "clips", "seeds"):
        named = getattr(sweep, key)
        if len(set(named)) < len(named):
            raise BadFile(path, f"{key} names something twice", "each name once", "Remove the second.")
    return sweep, path


def shipped_sweeps() -> list[Path]:
    """The files of the shipped sweeps."""
    return sorted(data_folder("scenarios").glob("sweeps/*.toml"))


def expand_sweep(
    sweep: Sweep, path: Path, seed: int | None = None, folder: LibraryFolders | None = None
) -> list[Scenario]:
    """Scenarios of a sweep, one for each named scenario and seed, whose cells are the sweep's cells.

    `seed` replaces all seeds; `folder` is the library whose clips patterns match. BadFile, BadInput and UnknownName
    for values that do not fit.
    """
    with name_file(path):
        loaded = [expand_clips(load_scenario(find_scenario(name, path.parent)), folder) for name in sweep.scenarios]
        clips = dict.fromkeys(clip for scenario in loaded for clip in scenario.motion.test)
        for clip in sweep.clips:
            if clip not in clips:
                raise UnknownName("test clip of these scenarios", clip, clips)
        out = []
        for scenario in loaded:
            seeds = sweep.seeds or (scenario.seed,)
            for number in seeds if seed is None else (seed,):
                expanded = replace(_apply_sweep(scenario, sweep), seed=number)
                check_scenario(path, expanded)
                out.append(expanded)
    names = [scenario.name for scenario in loaded]
    if len(set(names)) < len(names):
        raise BadFile(path, f"scenarios called {', '.join(names)}", "names of their own", "Rename one.")
    return out


def _apply_sweep(scenario: Scenario, sweep: Sweep) -> Scenario:
    motion = scenario.motion
    kept = {clip: behaviour for clip, behaviour in motion.tested if not sweep.clips or clip in sweep.clips}
    if not kept:
        advice = f"Its test clips are: {', '.join(motion.test)}."
        raise BadInput(f"The sweep has none of the clips of {scenario.name}.", advice)
    methods = tuple(name for text in sweep.methods for name in expand_alternatives(text))
    return replace(
        scenario,
        motion=replace(motion, test=tuple(kept), behaviours=tuple(kept.values())),
        methods=methods or scenario.methods,
        inputs=sweep.inputs or scenario.inputs,
        vary=scenario.varied_keys | dict(dotted_keys(sweep.vary)),
        expected_order=(),
        left_out={},
        fault=(),
    )
