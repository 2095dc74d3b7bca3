"""The planned set-ups, and their statements on planted errors: reference, units, worse clips and sigma."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from harness.bench.accuracy.clip_errors import ANGLE, CELL_METRICS, COVERAGES, POSITION, ClipErrors, ErrorsByCondition
from harness.bench.accuracy.conditions import SEEDS
from harness.bench.accuracy.measurement import collect_errors, condition_of
from harness.bench.accuracy.setup_targets import ANGLE_LIMITS, evaluate_setups, setup_rows
from harness.bench.accuracy.setups import SETUP_CONDITIONS, SETUPS, plan_setups
from harness.errors import BadInput
from harness.results.findings import BenchmarkStatement

COMMIT = "23b301b" + "0" * 33
CLIPS = {
    "accuracy_builtin": {"walking_p36_01": "known", "boxing_p40_01": "known", "walking_p48_01": "new"},
    "accuracy_cmu_known": {"02_01": "known", "14_08": "known", "14_02@0.20-0.40": "new"},
    "accuracy_cmu_new": {"06_01": "new", "02_04": "new"},
}


def planted(degrees: float, changed: Mapping[str, float] = {}, **more: Any) -> ErrorsByCondition:
    """Errors of every set-up: `degrees` on each clip but those of `changed`; the position error is ten times that."""
    return {
        str(condition): {
            clip: ClipErrors(
                "walking" if clip.startswith(("walking", "0")) else "boxing",
                performer,
                {ANGLE: (changed.get(clip, degrees),), POSITION: (10.0 * changed.get(clip, degrees),), **more},
            )
            for clip, performer in CLIPS[condition.scenario].items()
        }
        for condition in SETUP_CONDITIONS
    }


def statement(found: list[BenchmarkStatement], text: str) -> BenchmarkStatement:
    (one,) = [one for one in found if one.text == text]
    return one


def test_every_set_up_is_planned_with_its_values_seeds_and_motion() -> None:
    planned = plan_setups(["ours"], SEEDS)
    found = {condition_of(_row(scenario)) for scenario in planned}
    assert found == set(SETUP_CONDITIONS)
    assert len(planned) == sum(len(condition.seeds(SEEDS)) for condition in SETUP_CONDITIONS)
    slow = next(s for s in planned if s.name == "accuracy_cmu_new.baud_9600_at_4_hz")
    ((_, variant),) = slow.variants()
    assert (variant.tracker.baud, variant.tracker.rate_hz, variant.tracker.overload) == (9600, 4.0, True)
    assert slow.methods == ("ours",)
    ((_, one),) = next(s for s in planned if s.name == "accuracy_builtin.one_hand").variants()
    assert list(one.worn_stations) == ["right_hand"]


def _row(scenario: Any) -> dict[str, Any]:
    (noise,) = scenario.vary["noise"]
    (inputs,) = scenario.inputs
    return {"scenario": scenario.name, "noise": noise, "inputs": inputs, "varied": {}}


def test_cells_of_set_components_and_their_sigma_are_collected(tmp_path: Path) -> None:
    """A cell whose dropout is set has the noise "default*"; scores of sigma are one entry of its row."""
    row: dict[str, Any] = {"scenario": "accuracy_builtin.dropout_30", "noise": "default*", "inputs": "pos+ori"}
    row["varied"] = {}
    assert condition_of(row) in SETUP_CONDITIONS
    row |= dict.fromkeys(CELL_METRICS, 1.0) | {"method": "m", "clip": "c", "behaviour": "b", "performer": "new"}
    shares = {name: 0.5 + 0.25 * at for at, name in enumerate(COVERAGES)}
    rows = [{**row, "seed": seed, "sigma_scores": shares} for seed in (2, 1)]
    found = collect_errors(rows, tmp_path)["m"][str(condition_of(row))]["c"]
    assert [found.mean(name) for name in COVERAGES] == [0.5, 0.75]


def test_a_set_up_without_cells_is_refused() -> None:
    last = str(SETUP_CONDITIONS[-1])
    measured = {condition: by_clip for condition, by_clip in planted(1.0).items() if condition != last}
    with pytest.raises(BadInput, match="no cell was measured"):
        evaluate_setups("ours", measured, {"a": planted(1.0)}, COMMIT)


def test_every_set_up_has_limits_or_none() -> None:
    assert ANGLE_LIMITS.keys() == SETUPS.keys()


def test_the_reference_is_the_best_stored_method_of_the_row() -> None:
    stored = {"a": planted(4.0, {"06_01": 2.0, "02_04": 2.0}), "b": planted(3.0)}
    found = evaluate_setups("ours", planted(2.4), stored, COMMIT)
    known = statement(found, "baud 9600, known, CMU: joint angle")
    assert known.value == pytest.approx(0.8)
    assert (known.verdict, known.reference) == ("missed", "2.40 deg, b of 23b301b 3.00")
    new = statement(found, "baud 9600, new, CMU: joint angle")
    assert new.value == pytest.approx(1.2)
    assert new.more["reference"] == "a"
    assert statement(found, "baud 9600, new, CMU: position").target == ""
    assert statement(found, "head hands, new, CMU: position").target == "<= 0.87 (goal 0.78)"


def test_clips_of_one_performer_count_once() -> None:
    ours = planted(1.0, {"14_08": 2.0, "14_02@0.20-0.40": 4.0})
    row = statement(evaluate_setups("ours", ours, {"a": planted(1.0)}, COMMIT), "one hand, known, CMU: joint angle")
    assert row.value == pytest.approx((1.0 + 3.0) / 2)
    assert row.clips == 2  # 02, and the mean of 14's two clips


def test_real_clips_are_known_by_their_scenario_and_built_in_ones_by_their_performer() -> None:
    rows = {(row.group, row.motion): set(row.ours) for row in setup_rows(planted(1.0), {"a": planted(1.0)})}
    assert rows["known", "CMU"] == set(CLIPS["accuracy_cmu_known"])
    assert rows["new", "built-in"] == {"walking_p48_01"}
    assert rows["new walkers", "CMU"] == {"06_01", "02_04"}


@pytest.mark.parametrize(("degrees", "verdict"), [(1.04, "met"), (1.06, "missed")])
def test_a_clip_is_worse_from_five_percent_on(degrees: float, verdict: str) -> None:
    ours = planted(1.0, {"06_01": degrees})
    found = evaluate_setups("ours", ours, {"a": planted(1.0)}, COMMIT)
    worse = statement(found, "all set-ups, new, CMU: clips worse by more than 5 %")
    assert (worse.verdict, worse.clips) == (verdict, 2 * len(SETUPS))


@pytest.mark.parametrize(("share", "verdict"), [(0.59, "missed"), (0.62, "met"), (0.77, "missed")])
def test_sigma_is_held_to_a_range(share: float, verdict: str) -> None:
    shares: dict[str, Any] = {COVERAGES[0]: (share,), COVERAGES[1]: (0.95,)}
    ours = planted(1.0, {}, **shares)
    found = evaluate_setups("ours", ours, {"a": planted(1.0)}, COMMIT)
    assert statement(found, "dropout 30, new, built-in: ours within 1 sigma").verdict == verdict
    assert statement(found, "dropout 30, new, built-in: ours within 95 % region").verdict == "met"
    without = evaluate_setups("ours", planted(1.0), {"a": planted(1.0)}, COMMIT)
    assert not [one for one in without if "sigma" in one.text]


def test_other_clips_than_the_stored_ones_are_refused() -> None:
    stored = planted(1.0)
    fewer = {name: dict(list(by_clip.items())[:-1]) for name, by_clip in stored.items()}
    with pytest.raises(BadInput, match="other clips than those of a"):
        evaluate_setups("ours", planted(1.0), {"a": fewer}, COMMIT)


def test_no_clip_of_a_set_up_is_in_the_examples_of_new_performers() -> None:
    for scenario in plan_setups(["ik"], (1,))[:1]:
        new = {clip.split("_")[1] for clip in scenario.motion.test} - {
            e.split("_")[1] for e in scenario.motion.examples
        }
        assert len(new) == 12
        assert scenario.motion.database == "behaviour"
