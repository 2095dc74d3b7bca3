"""The planned cells: which clips, presets, inputs, stations, seeds and methods, and names with a lag."""

import pytest

from harness.bench.accuracy.conditions import (
    COMPARED_METHODS,
    CONDITIONS,
    SEEDS,
    keep_clips,
    plan_lagged,
    plan_scenarios,
    quick_conditions,
    refuse_lag,
    with_lag,
)
from harness.bench.accuracy.measurement import condition_of
from harness.errors import BadInput
from harness.experiment import cell_names, plan_tasks
from harness.experiment.scenarios import load_scenario

PLANNED = plan_scenarios(CONDITIONS, "ours", SEEDS)


def test_every_condition_is_planned_once_with_its_clips_seeds_and_methods() -> None:
    found: dict[str, list[tuple[str, str, int]]] = {}
    for task in plan_tasks(PLANNED, None, "", 1):
        for cell in task.cells():
            scenario = cell.scenario
            row = {"scenario": scenario.name, "noise": scenario.noise, "inputs": cell.inputs, "varied": cell.varied}
            found.setdefault(str(condition_of(row)), []).append((str(cell.part), cell.method, scenario.seed))
    assert found.keys() == {str(condition) for condition in CONDITIONS}
    for condition in CONDITIONS:
        pooled = condition.scenario in ("boxing", "walking", "jumping", "new_performers")
        methods = ("ours", *COMPARED_METHODS) if pooled else ("ours", "dynamic_map", "ik")
        seeds = (1,) if condition.noise == "clean" else SEEDS
        clips = load_scenario(condition.scenario).motion.test
        expected = [(clip, method, seed) for clip in clips for method in methods for seed in seeds]
        assert sorted(found[str(condition)]) == sorted(expected)


def test_no_two_cells_have_one_name() -> None:
    names = [name for scenario in [*PLANNED, *plan_lagged("ours", SEEDS)] for name in cell_names(scenario)]
    assert len(set(names)) == len(names)


def test_a_silent_station_is_lost_for_two_seconds() -> None:
    (scenario,) = [s for s in PLANNED if s.name == "recovery_boxing" and s.seed == 1]
    fault = scenario.disturbance
    assert (fault.kind, fault.begins_s, fault.ends_s) == ("one_lost", 3.0, 5.0)
    assert scenario.vary == {"noise": ["default"], "disturbance.station": ["right_hand", "torso"]}


def test_known_performers_have_12_clips_and_new_ones_at_least_8() -> None:
    clips = {s.name: s.motion.test for s in PLANNED}
    new = {"07_05", "29_01", "49_01", "01_01", "02_04", *clips["new_performers"]}
    known = {*clips["boxing"], *clips["walking"], *clips["jumping"]} - new
    assert (len(known), len(new)) == (12, 11)
    assert len({clip.split("_")[0] for clip in new}) == len(new)  # one clip for each performer


def test_the_compared_method_is_planned_once_when_it_is_the_measured_one() -> None:
    assert plan_scenarios(CONDITIONS, "ik", SEEDS)[0].methods == ("ik", "dynamic_map", "local_pca", "kernel_cca")


def test_the_quick_form_has_few_clips_and_the_behaviour_of_each() -> None:
    planned = plan_scenarios(quick_conditions(), "ours", (1,), quick=True)
    assert {s.name: s.motion.test for s in planned} == {"boxing": ("13_17@0.20-0.40",), "walking": ("16_22", "07_05")}
    assert [s.vary for s in planned] == [{"noise": ["clean", "default"]}] * 2
    assert planned[1].motion.behaviours == ("walking", "walking")


def test_a_clip_keeps_its_behaviour_and_an_unknown_one_is_refused() -> None:
    scenario = load_scenario("new_performers")
    kept = keep_clips(scenario, ["86_01@0.00-0.25", "06_01"]).motion
    assert (kept.test, kept.behaviours) == (("86_01@0.00-0.25", "06_01"), ("boxing", "walking"))
    with pytest.raises(BadInput, match="16_22"):
        keep_clips(scenario, ["16_22"])


@pytest.mark.parametrize(
    ("method", "lagged"),
    [
        ("ours", "ours[lag=2]"),
        ("ours[a=1]", "ours[a=1,lag=2]"),
        ("ours+ik", "ours[lag=2]+ik"),
        ("ours[a=[1,2]]+ik[b=3]", "ours[a=[1,2],lag=2]+ik[b=3]"),
    ],
)
def test_the_name_of_a_method_with_a_lag(method: str, lagged: str) -> None:
    refuse_lag(method)
    assert with_lag(method) == lagged
    with pytest.raises(BadInput, match="has a lag"):
        refuse_lag(lagged)
    (scenario, *_) = plan_lagged(method, SEEDS)
    assert (scenario.methods, scenario.vary) == ((lagged,), {"noise": ["default"]})
