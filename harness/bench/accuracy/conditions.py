"""Conditions of the accuracy benchmark: which scenario, noise preset, inputs and silent station make one set of cells.

The clips, examples and stations are those of the shipped scenarios. The preset `clean` draws nothing at random, so its
cells have one seed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Literal, get_args

from harness.core.options import parse_name, split_outside_brackets
from harness.errors import BadInput
from harness.experiment.scenarios import Scenario, load_scenario

Preset = Literal["clean", "noise", "default"]
PRESETS: tuple[Preset, ...] = get_args(Preset)
DEFAULT_METHOD = "expert_map"
"""Method that the benchmark measures unless another is named."""
COMPARED_METHODS = ("dynamic_map", "local_pca", "kernel_cca", "ik")
"""Methods that the measured method is compared with, on the same cells."""
LIMITING_METHODS = ("dynamic_map", "ik")
"""Methods that the measured method must not exceed by more than 5 % on any clip."""
SEEDS = (1, 2, 3, 4, 5)
TABLE_SCENARIOS = ("boxing", "walking", "jumping", "new_performers")
"""Scenarios whose clips are pooled by performer, with every noise preset."""
RESTRICTED_INPUTS = ("pos+torso_ori", "pos", "mixed")
SILENT_STATIONS = ("right_hand", "torso")
"""Stations that are lost from 3 s to 5 s, each in cells of its own."""
LAG_FRAMES = 2
"""Fixed lag of the additional cells, in frames of 40 Hz."""
QUICK_CLIPS = {"boxing": ("13_17@0.20-0.40",), "walking": ("16_22", "07_05")}
"""Scenario -> test clips of the quick form, which has one seed and no other scenario."""


@dataclass(frozen=True)
class Condition:
    """Cells of one scenario that differ only in clip, seed and method."""

    scenario: str
    """Name of a shipped scenario."""
    noise: Preset
    """Noise preset."""
    inputs: str = "pos+ori"
    """Which of position and orientation each station delivers."""
    silent: str = ""
    """Station that is lost from 3 s to 5 s; "" for none."""
    setup: str = ""
    """Name of a set-up (see `setups`); "" for six stations on a fast line."""

    def __str__(self) -> str:
        """Name of the condition, such as "boxing, default" or "recovery_boxing, default, torso silent"."""
        inputs = "" if self.inputs == "pos+ori" else f", {self.inputs}"
        more = (f"{self.silent} silent" if self.silent else "", self.setup)
        return f"{self.scenario}, {self.noise}{inputs}" + "".join(f", {text}" for text in more if text)

    def seeds(self, seeds: Sequence[int]) -> tuple[int, ...]:
        """The seeds of its cells: the first one under `clean`, else all."""
        return tuple(seeds[:1] if self.noise == "clean" else seeds)


CONDITIONS: tuple[Condition, ...] = (
    *(Condition(name, preset) for name in TABLE_SCENARIOS for preset in PRESETS),
    *(Condition("boxing_inputs", "clean", inputs) for inputs in RESTRICTED_INPUTS),
    *(Condition("recovery_boxing", "default", silent=station) for station in SILENT_STATIONS),
)
"""Every condition of the benchmark, in the order of its tables."""


def quick_conditions() -> tuple[Condition, ...]:
    """The conditions of the quick form."""
    return tuple(c for c in CONDITIONS if c.scenario in QUICK_CLIPS and c.noise != "noise")


def plan_scenarios(
    conditions: Sequence[Condition], method: str, seeds: Sequence[int], *, quick: bool = False
) -> list[Scenario]:
    """The scenarios whose cells measure `method` and the compared methods under some conditions.

    The compared methods that set no limit on a clip run where clips are pooled only.
    """
    planned = []
    for name, group in groupby(conditions, key=lambda condition: condition.scenario):
        alike = list(group)
        pooled = name in TABLE_SCENARIOS
        scenario = load_scenario(name)
        others = COMPARED_METHODS if pooled else LIMITING_METHODS
        scenario = replace(scenario, methods=tuple(dict.fromkeys((method, *others))), expected_order=())
        if quick:
            scenario = keep_clips(scenario, QUICK_CLIPS[name])
        for seed in seeds:
            here = [condition for condition in alike if seed in condition.seeds(seeds)]
            if here:
                planned.append(_with_conditions(replace(scenario, seed=seed), here))
    return planned


def plan_lagged(method: str, seeds: Sequence[int], *, quick: bool = False) -> list[Scenario]:
    """The scenarios of the cells with a fixed lag: boxing with the preset `default`."""
    scenario = replace(load_scenario("boxing"), name="boxing_lagged", methods=(with_lag(method),), expected_order=())
    if quick:
        scenario = keep_clips(scenario, QUICK_CLIPS["boxing"])
    return [replace(scenario, seed=seed, vary={"noise": ["default"]}) for seed in seeds]


def _with_conditions(scenario: Scenario, conditions: Sequence[Condition]) -> Scenario:
    """A scenario that runs exactly these conditions of one scenario, for one seed."""
    inputs, silent = (tuple(dict.fromkeys(getattr(c, name) for c in conditions)) for name in ("inputs", "silent"))
    vary = {"noise": list(dict.fromkeys(condition.noise for condition in conditions))}
    if any(silent):
        scenario = replace(scenario, disturbance=replace(scenario.disturbance, kind="one_lost"))
        vary["disturbance.station"] = list(silent)
    return replace(scenario, inputs=inputs, vary=vary)


def keep_clips(scenario: Scenario, clips: Sequence[str]) -> Scenario:
    """The scenario with some of its test clips; BadInput for a clip that it does not test."""
    motion = scenario.motion
    behaviours = motion.behaviours * (1 if len(motion.behaviours) > 1 else len(motion.test))
    by_clip = dict(zip(motion.test, behaviours, strict=True))
    if strange := [clip for clip in clips if clip not in by_clip]:
        raise BadInput(f"{scenario.name} does not test {strange[0]}.", f"It tests {', '.join(motion.test)}.")
    kept = tuple(by_clip[clip] for clip in clips)
    return replace(scenario, motion=replace(motion, test=tuple(clips), behaviours=kept))


def with_lag(method: str, frames: int = LAG_FRAMES) -> str:
    """The name of a method with the option `lag`; BadInput where the name has a lag already."""
    refuse_lag(method)
    base, *suffixes = split_outside_brackets(method, "+")
    base = f"{base[:-1]},lag={frames}]" if base.endswith("]") else f"{base}[lag={frames}]"
    return "+".join((base, *suffixes))


def refuse_lag(method: str) -> None:
    """BadInput for a method with a lag: it is never ranked with causal ones."""
    if "lag" in parse_name(split_outside_brackets(method, "+")[0])[1]:
        advice = "Name the causal method; its cells with a lag are added where it supports one."
        raise BadInput(f"{method} has a lag, and is not compared with causal methods.", advice)
