"""What the project gates its own methods on: all of them, on enough clips, against a baseline of this very scenario."""

from dataclasses import replace
from pathlib import Path

import pytest

from harness.compare.margins import GATED_METRICS
from harness.compare.significance import SIGNIFICANCE
from harness.core.split import ClipPart
from harness.errors import RenamedKey
from harness.experiment import ClipEvaluation
from harness.experiment.scenarios import Scenario, load_scenario
from harness.mocap import open_motion_source
from harness.mocap.synthetic import BEHAVIOURS
from harness.reconstruct import list_methods
from harness.results import load_results
from harness.testing.regression_gate import scenario_from_manifest

BASELINE = Path(__file__).parents[2] / "results" / "baselines" / "gate"


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load_scenario("gate")


def test_every_family_of_methods_is_gated(scenario: Scenario) -> None:
    families = {name for name in list_methods() if ":" not in name}
    assert families <= set(scenario.methods)
    assert any(name.endswith("+ik") for name in scenario.methods)
    assert {behaviour for behaviour in scenario.motion.behaviours if behaviour} == {
        *("walking", "boxing", "jumping", "golf", "table_tennis")
    }


def test_the_clips_are_enough_to_show_a_change_among_all_lines(scenario: Scenario) -> None:
    """All clips on one side are the least p that sign flips can give, and Holm multiplies it by the lines."""
    lines = len(scenario.methods) * len(GATED_METRICS)
    assert lines * 2.0 ** (1 - len(scenario.motion.test)) <= SIGNIFICANCE


def test_each_clip_is_of_another_performer_and_half_of_them_are_known(scenario: Scenario) -> None:
    """Counted as a run counts them: `known` if the examples of the clip's behaviour hold another of his takes."""
    source = open_motion_source("builtin", None, seed=scenario.seed, rate_hz=None)
    pairs = zip(scenario.motion.test, scenario.motion.behaviours, strict=True)
    groups = [
        ClipEvaluation(scenario, source, ClipPart(clip), behaviour).subject.performer for clip, behaviour in pairs
    ]
    performers = {source.performer(clip) for clip in scenario.motion.test}
    assert len(performers) == len(groups) >= 24
    assert groups.count("known") == groups.count("new") == len(groups) / 2
    for behaviour in BEHAVIOURS:
        of_it = [group for group, each in zip(groups, scenario.motion.behaviours, strict=True) if each == behaviour]
        assert of_it.count("known") == of_it.count("new") >= 2
    assert scenario.motion.longest_s == 4.0


def test_the_baseline_is_small_and_of_this_scenario(scenario: Scenario) -> None:
    kept = load_results(BASELINE)
    assert scenario_from_manifest(kept.manifest) == replace(scenario, methods=())
    found = {(cell.method, cell.clip) for cell in kept.cells}
    assert found == {(method, clip) for method in scenario.methods for clip in scenario.motion.test}
    assert all(cell.metrics[metric] is not None for cell in kept.cells for metric in GATED_METRICS)
    assert sum(path.stat().st_size for path in BASELINE.iterdir()) < 450_000


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (
            "protocol",
            "split",
            '[motion]\nsource = "builtin"\nprotocol = "block"\ntest = ["walking_p1_01"]\nbehaviours = ["w"]',
        ),
        ("wobble", "soft_tissue", "components.wobble = {}"),
        ("order", "expected_order", "[[order]]\n"),
    ],
)
def test_an_old_key_is_refused_with_its_new_name(old: str, new: str, text: str, tmp_path: Path) -> None:
    file = tmp_path / "old.toml"
    rest = 'schema = 1\nmethods = ["ik"]\nstations.head.bone = "head"\n'
    motion = '\n[motion]\nsource = "builtin"\ntest = ["walking_p1_01"]\nbehaviours = ["walking"]\n'
    file.write_text(rest + text + ("" if "[motion]" in text else motion), encoding="utf-8")
    with pytest.raises(RenamedKey, match=f"'{old}' is now called '{new}'"):
        _ = load_scenario(file).noise_model
