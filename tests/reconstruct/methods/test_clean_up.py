"""The final inverse kinematics weighs readings by their noise against what the other method knows."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
import pytest

from harness.body import build_body
from harness.core.arrays import Floats
from harness.core.estimate import Estimate, Status
from harness.core.humanoid24 import QPOS_OF_DOF
from harness.core.motion import BodyMotion
from harness.core.split import ClipPart
from harness.experiment import ClipEvaluation, prepare_playback
from harness.experiment.scenarios import load_scenario
from harness.mocap import open_motion_source
from harness.reconstruct import registry
from harness.reconstruct.features.station_increments import StationIncrements
from harness.reconstruct.methods.clean_up import CleanUp, FittedCleanUp
from harness.reconstruct.methods.mean_pose import MeanPose
from harness.score import wrap_difference
from harness.testing.frames import swaying_motion
from tests.experiment.late_methods import SIGMA_RAD, Late


def _errors_deg(noise: Literal["clean", "default"], names: list[str]) -> Floats:
    """D1 of methods on a synthetic bout of boxing under another seed than that of any table [deg]."""
    scenario = replace(load_scenario("recovery"), seed=11, vary={}, noise=noise)
    source = open_motion_source("builtin", None, seed=scenario.seed, rate_hz=None)
    evaluation = ClipEvaluation(scenario, source, ClipPart.parse("boxing_p1_01"), "boxing")
    simulation = evaluation.simulation
    truth = simulation.truth_qpos[simulation.frame_index][40:, 7:]
    errors = []
    for name in names:
        session = evaluation.fit_method(registry.make_method(name), name).begin(simulation.calibration)
        qpos = np.array([session.step(frame).qpos for frame in simulation.frames])
        errors.append(np.rad2deg(np.abs(wrap_difference(qpos[40:, 7:] - truth))).mean())
    return np.array(errors)


@pytest.mark.long
@pytest.mark.parametrize("name", ["local_pca", "dynamic_map", "weighted_blend", "kernel_cca"])
def test_methods_that_fit_the_readings_lose_little_under_noise(name: str) -> None:
    alone, cleaned = _errors_deg("default", [name, f"{name}+ik"])
    assert cleaned < alone + 0.15


@pytest.mark.long
@pytest.mark.parametrize("noise", ["clean", "default"])
def test_methods_that_do_not_fit_the_readings_gain(noise: Literal["clean", "default"]) -> None:
    alone, cleaned = _errors_deg(noise, ["best_match", "best_match+ik"])
    assert cleaned < alone - 0.3


def test_the_prior_is_a_share_of_the_spread_over_the_examples() -> None:
    body = build_body()
    qpos = np.tile(swaying_motion(body, 1), (400, 1))
    knee, hip = (7 + int(QPOS_OF_DOF[body.skeleton.dof_names.index(name)]) for name in ("ltibia.rx", "lfemur.rz"))
    course = np.sin(np.linspace(0.0, 20.0 * np.pi, 400, endpoint=False))  # its RMS is 1 / sqrt(2)
    qpos[:, knee] = 1.0 + 0.4 * course
    qpos[:, hip] = 0.1 * course
    example = BodyMotion("sway", "p1", "builtin", "swaying", 40.0, qpos)
    fitted = CleanUp(MeanPose(), spread_share=0.25).fit(body, [example], np.random.default_rng(1))
    sigma_rad = fitted.hinge_sigma_rad
    assert sigma_rad[knee - 7] == pytest.approx(0.25 * 0.4 / math.sqrt(2.0), rel=1e-6)
    assert sigma_rad[hip - 7] == pytest.approx(0.25 * 0.1 / math.sqrt(2.0), rel=1e-6)
    assert np.delete(sigma_rad, [knee - 7, hip - 7]) == pytest.approx(0.25 * math.radians(1.0))


def test_without_examples_all_hinges_have_one_width() -> None:
    method = CleanUp(registry.make_method("ik:previous"), prior_sigma_rad=0.3)
    assert not method.needs_examples
    sigma_rad = method.fit(build_body(), [], np.random.default_rng(1)).hinge_sigma_rad
    np.testing.assert_array_equal(sigma_rad, np.full(48, 0.3))


@pytest.mark.parametrize("wait", [0, 2])
def test_a_late_answer_is_fitted_to_the_readings_of_its_frame(wait: int) -> None:
    """The performer walks on while the answer waits: fitted to later readings, the root would be 5 cm ahead."""
    simulation = prepare_playback("demo", stations=6).simulation
    body, frames = build_body(), simulation.frames[:80]
    late, prompt = (
        CleanUp(Late(wait=w)).fit(body, [], np.random.default_rng(1)).begin(simulation.calibration) for w in (wait, 0)
    )
    answers, expected = ([session.step(frame) for frame in frames] for session in (late, prompt))
    assert [answer.lag for answer in answers] == [min(n, wait) for n in range(80)]
    sigma_rad = answers[5].angle_sigma_rad
    assert sigma_rad is not None
    np.testing.assert_array_equal(sigma_rad, SIGMA_RAD)
    for found, prompt_answer in zip(answers[wait + 10 :], expected[10 : 80 - wait], strict=True):
        np.testing.assert_allclose(found.qpos, prompt_answer.qpos, atol=1e-6)
        assert found.status is prompt_answer.status


def test_an_answer_to_a_frame_that_was_never_received_is_refused() -> None:
    simulation = prepare_playback("demo", stations=4).simulation
    inner: Any = SimpleNamespace(
        begin=lambda calibration: SimpleNamespace(step=lambda frame: Estimate(np.ones(55), Status.SOLVED, lag=1))
    )
    body = build_body()
    fitted = FittedCleanUp(CleanUp(MeanPose()), body, inner, np.ones(48), StationIncrements(body, ()))
    with pytest.raises(ValueError, match="a lag of 1 frames, but an answer may go back 0 at most"):
        fitted.begin(simulation.calibration).step(simulation.frames[0])
