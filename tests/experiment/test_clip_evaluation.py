"""What defines a cell is told in numbers, so that results of different days are compared only when they may be."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.humanoid24 import BONES, standard_skeleton, unpack
from harness.core.motion import Clip
from harness.core.split import ClipPart
from harness.errors import BadInput
from harness.experiment.clip_evaluation import ClipEvaluation
from harness.experiment.methods.method_run import run_method
from harness.experiment.scenarios.scenario import Scenario, Station
from harness.experiment.scenarios.scenario_motion import ScenarioMotion
from harness.mocap import open_motion_source
from harness.reconstruct import MeanPose, Method, make_method
from harness.simulate import Noise, WhiteNoise, noise_preset

PREVIOUS = make_method("ik:previous")

SCENARIO = Scenario(
    name="small",
    motion=ScenarioMotion("builtin", ("walking_p1_01",), ("walking",), longest_s=2.5),
    stations={"head": Station("head"), "torso": Station("thorax")},
    methods=("ik",),
)


def inputs(scenario: Scenario = SCENARIO) -> dict[str, object]:
    source = open_motion_source("builtin", None, seed=1, rate_hz=None)
    return ClipEvaluation(scenario, source, ClipPart("walking_p1_01"), "walking").conditions_of(PREVIOUS, "pos+ori")


def test_what_retargeting_cost_is_told() -> None:
    motion = replace(SCENARIO.motion, examples=("walking_p1_02", "walking_p2_01"), body="standard")
    source = open_motion_source("builtin", None, seed=1, rate_hz=None)
    own, common = (
        ClipEvaluation(replace(SCENARIO, motion=m), source, ClipPart("walking_p1_01"), "walking")
        for m in (SCENARIO.motion, motion)
    )
    assert len(own.subject.take) == len(common.subject.take)
    assert own.notes(PREVIOUS) == ()
    assert "1 of 1 clips" in common.notes(PREVIOUS)[0]
    assert len(common.training.examples) == 2
    assert "3 of 3 clips" in common.notes(MeanPose())[0]


def test_the_common_body_keeps_the_angles_of_test_clip_and_examples() -> None:
    motion = replace(SCENARIO.motion, examples=("walking_p1_02", "walking_p2_01"), body="common")
    source = open_motion_source("builtin", None, seed=1, rate_hz=None)
    setting = ClipEvaluation(replace(SCENARIO, motion=motion), source, ClipPart("walking_p1_01"), "walking")
    np.testing.assert_array_equal(setting.body.skeleton.bone_m, standard_skeleton().bone_m)
    np.testing.assert_array_equal(unpack(setting.subject.full_take.qpos)[2], _angles(setting.subject.clip))
    for clip, take in zip(setting.subject.example_clips, setting.training.examples, strict=True):
        np.testing.assert_allclose(unpack(take.qpos)[2][0], _angles(clip)[0], atol=1e-12)
    assert "every angle kept" in setting.notes(MeanPose())[0]
    assert "3 of 3 clips" in setting.notes(MeanPose())[0]


def test_what_is_withheld_is_in_no_example() -> None:
    """Whole takes are gone; of a part, its frames and a second on both sides, exactly."""
    motion = replace(SCENARIO.motion, examples=("walking_p1_02", "walking_p1_03", "walking_p2_01"))
    held = replace(motion, withheld=("walking_p1_02@0.40-0.60", "walking_p2_01", "walking_p3_01"))
    source = open_motion_source("builtin", None, seed=1, rate_hz=None)
    free, closed = (
        ClipEvaluation(replace(SCENARIO, motion=m), source, ClipPart("walking_p1_01"), "walking")
        for m in (motion, held)
    )
    assert [c.name for c in closed.subject.example_clips] == ["walking_p1_02", "walking_p1_03"]
    assert [t.name for t in closed.training.examples] == ["walking_p1_02", "walking_p1_02", "walking_p1_03"]
    whole, (before, after, other) = free.training.examples[0], closed.training.examples
    clip = closed.subject.example_clips[0]
    block, guard = ClipPart("walking_p1_02", 0.4, 0.6).frames(len(clip)), round(clip.rate_hz)
    assert before.qpos[-1, :3] == pytest.approx(whole.qpos[len(before) - 1, :3], abs=1e-9)
    assert (len(before) - 1) / 40.0 == pytest.approx((block.start - guard - 1) / clip.rate_hz, abs=1 / 40.0)
    assert (len(after) - 1) / 40.0 == pytest.approx((len(clip) - block.stop - guard - 1) / clip.rate_hz, abs=1 / 40.0)
    np.testing.assert_array_equal(other.qpos, free.training.examples[1].qpos)
    assert closed.conditions_of(MeanPose(), "pos+ori")["withheld"] == ["walking_p1_02@0.40-0.60"]
    assert closed.conditions_of(PREVIOUS, "pos+ori") == free.conditions_of(PREVIOUS, "pos+ori")


def _angles(clip: Clip) -> Floats:
    return clip.angles_rad[:, clip.skeleton.subset(BONES)[1]]


def test_a_copy_of_the_test_clip_is_no_example() -> None:
    clip = open_motion_source("builtin", None, seed=1, rate_hz=None).load("walking_p1_01")

    class Copying:
        title = "copies"

        def __getattr__(self, asked: str) -> Callable[[str], object]:
            return {"load": lambda name: replace(clip, name=name), "subject": lambda name: name}[asked]

    motion = replace(SCENARIO.motion, examples=("sneaky_01",))
    setting = ClipEvaluation(
        replace(SCENARIO, motion=motion), cast(Any, Copying()), ClipPart("walking_p1_01"), "walking"
    )
    with pytest.raises(BadInput, match="under another name"):
        _ = setting.training.examples


def test_equal_scenarios_have_equal_inputs() -> None:
    assert inputs() == inputs(replace(SCENARIO, name="other", methods=("ik:gaussian",)))


def test_what_is_not_worn_defines_nothing() -> None:
    alone = replace(SCENARIO, stations={"torso": Station("thorax")})
    assert inputs(replace(SCENARIO, worn=("torso",))) == inputs(alone) != inputs()
    assert inputs(replace(SCENARIO, worn=("torso", "head"))) == inputs()
    assert "worn" not in inputs()


@pytest.mark.parametrize(
    ("changed", "key"),
    [
        (replace(SCENARIO, noise="noise"), "components"),
        (replace(SCENARIO, noise="clean"), "tracker"),
        (replace(SCENARIO, stations={"head": Station("head", along=0.9), "torso": Station("thorax")}), "mounts_digest"),
        (replace(SCENARIO, motion=replace(SCENARIO.motion, body="standard")), "body_digest"),
        (replace(SCENARIO, motion=replace(SCENARIO.motion, body="common")), "body_digest"),
    ],
)
def test_what_a_scenario_changes_is_named(changed: Scenario, key: str) -> None:
    assert inputs(changed)[key] != inputs()[key]


def test_a_level_that_the_code_redefines_is_another_input(monkeypatch: pytest.MonkeyPatch) -> None:
    before = inputs()

    def redefined(name: str) -> Noise:
        return replace(noise_preset(name), white=WhiteNoise(position_m=0.001))

    monkeypatch.setattr("harness.experiment.scenarios.scenario.noise_preset", redefined)
    assert inputs()["components"] != before["components"]
    assert {k for k, v in inputs().items() if v != before[k]} == {"components"}


def test_a_part_is_warmed_up_on_what_comes_before_it() -> None:
    """The second before a block is guarded, so no method has learnt from it, and the whole block is scored."""
    source = open_motion_source("builtin", None, seed=1, rate_hz=None)
    scenario = replace(SCENARIO, motion=replace(SCENARIO.motion, longest_s=0.0, split="block"))
    part = ClipPart("walking_p1_01", 0.4, 0.6)
    setting = ClipEvaluation(scenario, source, part, "walking")
    block = part.frames(len(setting.subject.full_take))
    rate_hz = setting.subject.full_take.rate_hz
    assert len(setting.subject.take) == len(block) + round(rate_hz)
    assert (setting.subject.take.qpos[-1] == setting.subject.full_take.qpos[block.stop - 1]).all()


def test_stations_worn_elsewhere_share_the_motion_and_what_was_learnt() -> None:
    """Sets of trackers are compared on one motion with one fit, and come out as if each had been made anew."""
    motion = replace(SCENARIO.motion, examples=("walking_p1_02",), body="common", longest_s=1.5)
    scenario = replace(SCENARIO, motion=motion)
    elsewhere = replace(scenario, stations={"torso": Station("thorax", 0.6, 30.0), "knee": Station("ltibia", 0.1)})
    source, method = open_motion_source("builtin", None, seed=1, rate_hz=None), make_method("dynamic_map")
    first = ClipEvaluation(scenario, source, ClipPart("walking_p1_01"), "walking")
    results = [_estimated(first, method)]
    shared = first.with_conditions(elsewhere)
    assert shared is not None
    assert shared.subject.full_take is first.subject.full_take
    assert shared.fit_method(method, "dynamic_map") is first.fit_method(method, "dynamic_map")
    results.append(_estimated(shared, method))
    anew = ClipEvaluation(elsewhere, source, ClipPart("walking_p1_01"), "walking")
    np.testing.assert_array_equal(results[1], _estimated(anew, method))
    assert shared.conditions_of(method, "pos+ori") == anew.conditions_of(method, "pos+ori")
    assert np.abs(results[0] - results[1]).max() > 1e-3


def _estimated(setting: ClipEvaluation, method: Method) -> Floats:
    fitted = setting.fit_method(method, "dynamic_map")
    return run_method(fitted, setting.performer_calibration.calibration, setting.simulation.frames).qpos
