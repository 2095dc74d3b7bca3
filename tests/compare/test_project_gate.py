"""What the project gates its own methods on: all of them, on enough clips, against a baseline of this very scenario."""

from dataclasses import replace
from pathlib import Path

import pytest

from harness.compare.margins import GATED_METRICS
from harness.compare.significance import SIGNIFICANCE
from harness.experiment.scenario import Scenario, load_scenario
from harness.reconstruct import registry
from harness.results.reader import load_results
from harness.testing.regression_gate import scenario_from_manifest

BASELINE = Path(__file__).parents[2] / "results" / "baselines" / "gate"


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load_scenario("gate")


def test_every_family_of_methods_is_gated(scenario: Scenario) -> None:
    families = {name for name in registry.methods() if ":" not in name}
    assert families <= set(scenario.methods)
    assert any(name.endswith("+ik") for name in scenario.methods)
    assert {behaviour for behaviour in scenario.motion.behaviours if behaviour} == {
        *("walking", "boxing", "jumping", "golf", "table_tennis")
    }


def test_the_clips_are_enough_to_show_a_change_among_all_lines(scenario: Scenario) -> None:
    """All clips on one side are the least p that sign flips can give, and Holm multiplies it by the lines."""
    lines = len(scenario.methods) * len(GATED_METRICS)
    assert lines * 2.0 ** (1 - len(scenario.motion.test)) <= SIGNIFICANCE


def test_the_baseline_is_small_and_of_this_scenario(scenario: Scenario) -> None:
    kept = load_results(BASELINE)
    assert scenario_from_manifest(kept.manifest) == replace(scenario, methods=())
    found = {(cell.method, cell.clip) for cell in kept.cells}
    assert found == {(method, clip) for method in scenario.methods for clip in scenario.motion.test}
    assert all(cell.metrics[metric] is not None for cell in kept.cells for metric in GATED_METRICS)
    assert sum(path.stat().st_size for path in BASELINE.iterdir()) < 200_000
