"""The methods of Kim et al. 2012: common properties, and those of each."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.estimate import Status
from harness.core.humanoid24 import BONES, unpack
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.example_features import ExampleFeatures, FeatureWeights
from harness.reconstruct.features.query_features import QueryFeatures
from harness.reconstruct.methods.kernel_cca import KernelCca
from harness.reconstruct.methods.local_regression import LocalRegression, WeightedBlend
from harness.reconstruct.solver import ground_frame
from harness.reconstruct.solver.ground_frame import anchor_of, step_ground
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.testing.frames import drop_stations, exact_frames
from tests.reconstruct.conftest import Scene, moved


@dataclass(frozen=True)
class EqualBlend(LocalRegression):
    """The mean of the neighbours, without inverse kinematics: an answer that can be worked out by hand."""

    name: str = "equal"
    summary: str = "mean of the neighbours"
    final_ik: bool = False

    def weigh(self, inputs: Floats, query: Floats, outputs: Floats) -> Floats:
        return np.full(len(outputs), 1.0 / len(outputs))


METHODS = [KernelCca(), WeightedBlend()]
IDS = [method.name for method in METHODS]


def angle_error_deg(scene: Scene, qpos: np.ndarray) -> np.ndarray:
    """(T,) mean absolute hinge error [deg]."""
    off = unpack(qpos)[2] - unpack(scene.take.qpos)[2]
    return np.asarray(np.rad2deg(np.abs((off + np.pi) % (2.0 * np.pi) - np.pi)).mean(axis=1))


@pytest.mark.parametrize("method", METHODS, ids=IDS)
@pytest.mark.parametrize("yaw_deg", [0.0, 135.0])
def test_a_take_that_was_learnt_comes_back_wherever_it_is_performed(
    walk: Scene, method: LocalRegression, yaw_deg: float
) -> None:
    qpos = moved(walk.take.qpos, np.deg2rad(yaw_deg), (3.0, -2.0, 0.0))
    exact = replace(method, beta=0.0)
    estimates = walk.run(exact, exact_frames(walk.body, walk.calibration, qpos), [walk.take])
    assert angle_error_deg(walk, np.array([e.qpos for e in estimates])).mean() < 0.2
    assert walk.off_m(estimates, qpos).mean() < 0.002


@pytest.mark.parametrize("method", METHODS, ids=IDS)
@pytest.mark.parametrize("inputs", ["pos", "mixed"])
def test_a_long_walk_on_part_of_the_readings_does_not_run_away(
    walk: Scene, method: LocalRegression, inputs: str
) -> None:
    off_m = walk.off_m(walk.run(method, walk.only(inputs)), walk.take.qpos)
    assert off_m[-20:].mean() < 0.05


@pytest.mark.parametrize("method", METHODS, ids=IDS)
def test_a_lost_station_degrades_and_its_return_mends(walk: Scene, method: LocalRegression) -> None:
    anchor = walk.calibration.stations.index("torso")
    frames = [drop_stations(f, [anchor]) if 30 <= k < 70 else f for k, f in enumerate(walk.frames)]
    estimates = walk.run(method, frames)
    off_m, plain_m = walk.off_m(estimates, walk.take.qpos), walk.off_m(walk.run(method), walk.take.qpos)
    assert all(e.status is Status.SOLVED for e in estimates)
    assert off_m.max() < 0.1
    assert off_m[75:].mean() < 1.5 * plain_m[75:].mean() + 1e-3


@pytest.mark.parametrize("method", METHODS, ids=IDS)
def test_when_all_are_lost_it_says_so_and_goes_on_by_itself(walk: Scene, method: LocalRegression) -> None:
    everyone = range(len(walk.calibration.stations))
    frames = [drop_stations(f, list(everyone)) if 30 <= k < 70 else f for k, f in enumerate(walk.frames)]
    estimates = walk.run(method, frames)
    assert estimates[35].status is Status.HELD
    assert estimates[60].status is Status.LOST
    assert estimates[70].status is Status.SOLVED
    assert walk.off_m(estimates, walk.take.qpos)[72:].max() < 0.02


@pytest.mark.long
@pytest.mark.parametrize("method", METHODS, ids=IDS)
def test_the_closed_form_meets_every_limb_tracker(walk: Scene, method: LocalRegression) -> None:
    estimates = walk.run(replace(method, solve="limbs"))
    position_m, _ = walk.residuals(estimates, walk.frames)
    assert position_m[:, :5].max() < 0.01  # the head's is sixth, and not met


def test_features_tell_what_trackers_read(walk: Scene) -> None:
    database = MotionDatabase.build(walk.body, [walk.take])
    examples = ExampleFeatures(walk.body, database, walk.calibration, FeatureWeights(), "flat", 8)
    row = 20
    residuals = Residuals(walk.body, walk.calibration, Loss())
    outlook = QueryFeatures(residuals, walk.calibration, examples)
    for frame in walk.frames[row - 1 : row + 1]:
        residuals.read(frame)
        query = outlook.compute(frame, walk.take.qpos[row])
    np.testing.assert_allclose(query.features, examples.gather(np.array([row]))[0], atol=5e-4)
    assert examples.nearest(query, 1, examples.index).tolist() == [row]
    inputs, asked, poses = examples.regression_data(np.array([row]), np.array([row]), query.features, query.confidence)
    np.testing.assert_allclose(inputs, asked[None], atol=5e-4)
    stood = ground_frame.qpos_from_postures(poses[0, :52], step_ground(np.array(query.view), poses[0, 52:]))
    np.testing.assert_allclose(stood[:3], walk.take.qpos[row, :3], atol=1e-5)


def test_the_pelvis_is_the_first_choice_of_anchor() -> None:
    assert anchor_of(["head", "thorax", "lhand", "lhipjoint"]) == 3
    assert anchor_of(["lhand", "head", "thorax"]) == 2
    assert anchor_of(["lhand", "rtibia", "ltibia"]) == 1
    assert anchor_of(["lhand", "rhand"]) == 0


@pytest.mark.parametrize("bone", BONES)
def test_any_bone_may_be_the_anchor_and_none_is_better_than_the_pelvis(bone: str) -> None:
    assert anchor_of([bone]) == 0
    assert anchor_of([bone, "lhipjoint"]) == (bone != "lhipjoint")


def test_a_blend_weighs_by_closeness() -> None:
    inputs = np.array([[1.0, 0.0], [0.0, 2.0]])
    np.testing.assert_allclose(WeightedBlend(power=1.0).weigh(inputs, np.zeros(2), inputs), [2 / 3, 1 / 3])
    np.testing.assert_allclose(WeightedBlend(power=2.0).weigh(inputs, np.zeros(2), inputs), [0.8, 0.2])
    np.testing.assert_allclose(WeightedBlend().weigh(inputs, inputs[1], inputs), [0.0, 1.0], atol=1e-9)


def test_neighbours_that_are_all_the_same_count_the_same(rng: np.random.Generator) -> None:
    same = np.tile(rng.normal(size=4), (5, 1))
    np.testing.assert_allclose(KernelCca().weigh(same, same[0], rng.normal(size=(5, 55))), 0.2)
    np.testing.assert_allclose(KernelCca().weigh(rng.normal(size=(5, 4)), same[0], np.tile(same[:1], (5, 1))), 0.2)


def test_the_neighbours_of_the_frame_before_take_part(walk: Scene) -> None:
    """Each frame's nearest example is itself, so with k = 1 the answer is the mean of this frame and the last."""
    estimates = walk.run(EqualBlend(neighbours=1, beta=0.0), examples=[walk.take])
    truth = walk.take.qpos[:, 7:]
    found = np.array([estimate.qpos[7:] for estimate in estimates])
    np.testing.assert_allclose(found[0], truth[0], atol=1e-5)
    np.testing.assert_allclose(found[1:], 0.5 * (truth[1:] + truth[:-1]), atol=1e-5)


def test_an_answer_is_smoothed_with_the_last_two_in_their_order(walk: Scene) -> None:
    """Eq. 6 with the paper's constants: weights 0.60 of y_t, 0.28 of the output at t-1 and 0.12 of that at t-2."""
    plain, smoothed = (
        np.array(
            [estimate.qpos[7:] for estimate in walk.run(EqualBlend(neighbours=1, beta=beta), examples=[walk.take])]
        )
        for beta in (0.0, 0.4)
    )
    expected = plain.copy()
    for t in range(2, len(expected)):
        expected[t] = 0.60 * plain[t] + 0.28 * expected[t - 1] + 0.12 * expected[t - 2]
    np.testing.assert_allclose(smoothed, expected, atol=1e-9)
    assert np.abs(smoothed - plain).max() > 0.01
