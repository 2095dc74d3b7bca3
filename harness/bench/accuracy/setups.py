"""Set-ups of the accuracy benchmark: stations, inputs, line, faults and calibration, with known and new performers.

Motion is that of three scenarios in `scenarios/accuracy`: built-in performers, and CMU's known and new ones. No
constant was chosen on their clips (`tests/experiment/test_constants.py`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from harness.bench.accuracy.conditions import Condition, Preset
from harness.core.package_data import data_folder
from harness.experiment.scenarios import Scenario, load_scenario

MOTIONS = ("accuracy_builtin", "accuracy_cmu_known", "accuracy_cmu_new")
"""Scenarios whose motion every set-up has."""
_HANDS = ["left_hand", "right_hand"]
_SLOW = {"tracker.baud": 9600, "tracker.overload": True}


@dataclass(frozen=True)
class SetUp:
    """What differs from six stations on a fast line."""

    noise: Preset = "default"
    inputs: str = "pos+ori"
    values: Mapping[str, Any] = field(default_factory=dict)
    """Scenario key -> its value."""


SETUPS: Mapping[str, SetUp] = {
    "six_stations": SetUp(),
    "six_noise": SetUp("noise"),
    "six_clean": SetUp("clean"),
    "six_positions": SetUp("clean", "pos"),
    "head_hands_pelvis": SetUp(values={"worn": [*_HANDS, "head", "pelvis"]}),
    "head_hands_ankles": SetUp(values={"worn": [*_HANDS, "head", "left_ankle", "right_ankle"]}),
    "head_hands": SetUp(values={"worn": [*_HANDS, "head"]}),
    "one_hand": SetUp(values={"worn": ["right_hand"]}),
    "dropout_30": SetUp(values={"components.dropout.share": 0.3}),
    "t_pose": SetUp(values={"calibration": "tpose"}),
    "baud_9600": SetUp(values=_SLOW),
    "baud_19200": SetUp(values={**_SLOW, "tracker.baud": 19200}),
    "baud_9600_at_4_hz": SetUp(values={**_SLOW, "tracker.rate_hz": 4.0}),
}
"""Name -> set-up. At 9600 baud the line carries six stations at 4 Hz."""
SETUP_CONDITIONS: tuple[Condition, ...] = tuple(
    Condition(motion, setup.noise, setup.inputs, setup=name) for name, setup in SETUPS.items() for motion in MOTIONS
)


def plan_setups(methods: Sequence[str], seeds: Sequence[int]) -> list[Scenario]:
    """The scenarios whose cells measure methods under every set-up, one for each condition and seed."""
    return [
        _apply(condition, replace(scenario, seed=seed, methods=tuple(methods)))
        for condition in SETUP_CONDITIONS
        for scenario in [load_scenario(data_folder("scenarios") / "accuracy" / f"{condition.scenario}.toml")]
        for seed in condition.seeds(seeds)
    ]


def _apply(condition: Condition, scenario: Scenario) -> Scenario:
    """The scenario under a condition; its name has the set-up, which `setup_of` reads."""
    values = {key: [value] for key, value in SETUPS[condition.setup].values.items()}
    vary = {"noise": [condition.noise], **values}
    return replace(scenario, name=f"{scenario.name}.{condition.setup}", inputs=(condition.inputs,), vary=vary)


def setup_of(scenario: str) -> tuple[str, str]:
    """The motion and the set-up of a planned scenario's name; ("boxing", "") for one without a set-up."""
    motion, _, setup = scenario.partition(".")
    return motion, setup
