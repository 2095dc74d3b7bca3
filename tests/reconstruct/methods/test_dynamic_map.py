"""The local dynamic model on known motion, inside and outside its database."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from harness.body import retarget_to_common_body
from harness.core.arrays import Floats
from harness.core.estimate import Estimate, Origin, Status
from harness.core.motion import BodyMotion
from harness.mocap import synthetic
from harness.reconstruct import registry
from harness.reconstruct.contract import Method
from harness.reconstruct.methods.dynamic_map import LITERAL, DynamicMap, FittedDynamicMap, Prediction
from harness.reconstruct.methods.ik import Ik
from harness.reconstruct.methods.local_pca import LocalPca
from harness.score import wrap_difference
from harness.stream import TrackerFrame
from harness.testing.frames import drop_stations, exact_frames
from tests.reconstruct.conftest import Scene, moved, scene

BOTH = [DynamicMap(), LocalPca()]
FEW = [DynamicMap(neighbours=30), LocalPca(neighbours=60)]
"""Options for one take of three seconds."""


def angles_deg(scene: Scene, estimates: list[Estimate], truth: Floats) -> Floats:
    """(T,) mean absolute hinge error [deg]."""
    away = np.array([e.qpos[7:] for e in estimates]) - truth[:, 7:]
    out: Floats = np.rad2deg(np.abs((away + np.pi) % (2 * np.pi) - np.pi).mean(axis=1))
    return out


def shifted(frame: TrackerFrame, station: int, by_m: float) -> TrackerFrame:
    position_m = np.array(frame.position_m)
    position_m[station, 1] += by_m
    return replace(frame, position_m=position_m)


@pytest.mark.parametrize("method", FEW)
@pytest.mark.parametrize("motion", ["walk", "boxing"])
def test_a_take_of_the_database_comes_back(motion: str, method: Method, request: pytest.FixtureRequest) -> None:
    scene: Scene = request.getfixturevalue(motion)
    estimates = scene.run(method, examples=[scene.take])
    assert angles_deg(scene, estimates, scene.take.qpos)[20:].mean() < 0.5
    assert scene.off_m(estimates, scene.take.qpos)[20:].max() < 0.005


@pytest.mark.parametrize("method", BOTH)
@pytest.mark.parametrize("lost", [[0], [4], [0, 1, 2, 3, 4, 5]])
def test_back_after_stations_were_lost(walk: Scene, method: Method, lost: list[int]) -> None:
    frames = [drop_stations(f, lost) if 30 <= i < 60 else f for i, f in enumerate(walk.frames)]
    estimates = walk.run(method, frames)
    plain = walk.off_m(walk.run(method), walk.take.qpos)
    off_m = walk.off_m(estimates, walk.take.qpos)
    assert (estimates[58].status is Status.LOST) == (len(lost) == 6)
    assert off_m[80:].mean() < 1.5 * plain[80:].mean() + 1e-4


@pytest.mark.parametrize("method", BOTH)
def test_a_station_that_is_off_for_a_while_moves_the_pose_little(walk: Scene, method: Method) -> None:
    frames = [shifted(f, 0, 0.3) if 40 <= i < 48 else f for i, f in enumerate(walk.frames)]
    off_m = walk.off_m(walk.run(method, frames), walk.take.qpos)
    assert off_m[40:48].max() < 0.04
    assert off_m[70:].max() < 0.01


@pytest.mark.parametrize("method", BOTH)
def test_frames_that_are_missing_or_early(walk: Scene, method: Method) -> None:
    """The history keeps the examples' rate: short gaps are bridged, long ones reset it."""
    dropped = {40, 41, 60, *range(70, 90)}
    kept = [i for i in range(len(walk.frames)) if i not in dropped]
    frames = [walk.frames[i] for i in kept]
    off_m = walk.off_m(walk.run(method, frames), walk.take.qpos[kept])
    assert off_m[20:].max() < 0.03
    doubled = [f for frame in walk.frames for f in (frame, replace(frame, received_s=frame.received_s + 0.005))]
    off_m = walk.off_m(walk.run(method, doubled)[::2], walk.take.qpos)
    assert off_m[20:].mean() < 0.005


def test_what_is_far_from_all_examples_is_believed_less(walk: Scene) -> None:
    """The covariance grows by 1 + (widening d^2)^2, and the prior of `ik` then counts."""
    predictions, past = list[Prediction](), np.zeros((3, 55))
    for widening in (0.0, 40.0):
        fitted = DynamicMap(widening=widening).fit(walk.body, walk.examples, np.random.default_rng(0))
        session = fitted.begin(walk.calibration)
        for frame in walk.frames[:5]:
            session.step(frame)
        if not predictions:
            past = session.past + np.append(np.zeros(7), np.full(48, 0.3))
        session.past = past
        predictions.append(session.predict())
    narrow, wide = predictions
    factor = wide.covariance[10, 10] / narrow.covariance[10, 10]
    assert factor > 1.01
    np.testing.assert_allclose(wide.covariance, factor * narrow.covariance, atol=1e-6)
    assert narrow.ik_prior_weight == 0.0
    assert wide.ik_prior_weight == pytest.approx(1.0 - 1.0 / factor, rel=1e-3)


def test_the_answer_is_the_most_probable_posture_under_both_priors(walk: Scene) -> None:
    """Without readings the solver's minimum is the mode of the product of both Gaussians, written out."""
    session = DynamicMap().fit(walk.body, walk.examples, np.random.default_rng(0)).begin(walk.calibration)
    for frame in walk.frames[:10]:
        session.step(frame)
    prediction = session.predict()._replace(ik_prior_weight=0.7)
    prior, ik_prior = session.joint_prior(prediction), session.ik_prior()
    assert ik_prior.precision is not None
    precision = np.linalg.inv(prediction.covariance[:52, :52])
    other, mean = np.diag([0.0] * 4 + [*(0.7 * ik_prior.precision[6:])]), np.append([0.0] * 4, ik_prior.qpos[7:])
    mode = np.linalg.solve(precision + other, precision @ prediction.mean[:52] + other @ mean)
    np.testing.assert_allclose(prior.mean + np.linalg.solve(prior.curvature, prior.linear), mode, atol=1e-6)


def test_with_positions_alone_the_heading_of_the_last_answers_does_not_matter(walk: Scene) -> None:
    """A heading from the last estimate would feed its error back (docs/notes/traps.md F5)."""
    for inputs in ("pos", "pos+ori"):
        session = DynamicMap().fit(walk.body, walk.examples, np.random.default_rng(0)).begin(walk.calibration)
        for frame in walk.only(inputs)[:20]:
            session.step(frame)
        before = session.predict().mean[4:52]
        session.past = moved(session.past, 0.3, (0.0, 0.0, 0.0))
        np.testing.assert_allclose(session.predict().mean[4:52], before, atol=1e-4)


def test_positions_are_asked_for_the_heading_only_where_no_orientation_and_enough_of_them_tell_it(walk: Scene) -> None:
    regression = DynamicMap().fit(walk.body, walk.examples, np.random.default_rng(0)).regression(walk.calibration)
    torso, count = walk.calibration.stations.index("torso"), len(walk.calibration.stations)
    positions = np.repeat([True, False], count)
    assert regression.with_usual_heading(positions).heading is not None
    assert regression.with_usual_heading(positions) is regression.with_usual_heading(positions)
    with_torso, without_torso, lone = np.array(positions), np.array(positions), np.zeros(2 * count, bool)
    with_torso[count + torso], without_torso[torso] = True, False
    lone[torso] = True
    for usual in (with_torso, without_torso, lone):
        assert regression.with_usual_heading(usual) is regression


def test_the_room_does_not_matter_with_positions_alone(walk: Scene) -> None:
    elsewhere = replace(
        walk, frames=exact_frames(walk.body, walk.calibration, moved(walk.take.qpos, 2.3, (4.0, -3.0, 0.0)))
    )
    here, there = (scene.run(DynamicMap(), scene.only("pos")) for scene in (walk, elsewhere))
    angles = [np.array([e.qpos[7:] for e in estimates[5:]]) for estimates in (here, there)]
    np.testing.assert_allclose(angles[1], angles[0], atol=1e-3)


def test_with_positions_alone_the_anchor_may_fall_silent(walk: Scene) -> None:
    torso = walk.calibration.stations.index("torso")
    frames = [drop_stations(f, [torso]) if 40 <= i < 60 else f for i, f in enumerate(walk.only("pos"))]
    off_m = walk.off_m(walk.run(DynamicMap(neighbours=30), frames), walk.take.qpos)
    assert off_m[40:60].max() < 0.03


@pytest.mark.parametrize("inputs", ["pos+ori", "pos"])
def test_the_first_answers_are_those_of_the_examples_by_the_readings_alone(walk: Scene, inputs: str) -> None:
    """There is no history yet. Inverse kinematics knows only the mean posture and errs more."""
    frames = walk.only(inputs)[:10]
    found, by_ik = (walk.run(method, frames) for method in (DynamicMap(), Ik()))
    assert [estimate.origin for estimate in found] == [Origin.MODEL] * 10
    truth = walk.take.qpos[:10]
    first, ik_first = (angles_deg(walk, estimates, truth)[0] for estimates in (found, by_ik))
    assert first < 0.8 * ik_first
    assert angles_deg(walk, found, truth).max() < 4.0


def test_a_cold_start_without_the_anchor_falls_back(walk: Scene) -> None:
    """Readings are compared relative to the torso's station; without it inverse kinematics begins."""
    torso = walk.calibration.stations.index("torso")
    frames = [drop_stations(frame, [torso]) if i < 6 else frame for i, frame in enumerate(walk.frames[:12])]
    origins = [estimate.origin for estimate in walk.run(DynamicMap(), frames)]
    assert origins[:3] == [Origin.FALLBACK] * 3
    assert origins[3:] == [Origin.MODEL] * 9


def test_a_session_learns_from_the_stations_that_report_until_there_is_a_history(walk: Scene) -> None:
    """A station that is silent in the first frame alone takes part in the search from the second on."""
    fitted = DynamicMap().fit(walk.body, walk.examples, np.random.default_rng(1))
    complete, late = fitted.begin(walk.calibration), fitted.begin(walk.calibration)
    for i, frame in enumerate(walk.frames[:30]):
        whole, part = complete.step(frame), late.step(drop_stations(frame, [0]) if i == 0 else frame)
    np.testing.assert_allclose(part.qpos, whole.qpos, atol=1e-3)


def test_the_factor_comes_before_the_floors_and_the_mean_is_within_the_limits(walk: Scene) -> None:
    predictions = []
    for spread, sigma_rad in ((1.0, 0.0), (2.0, 0.2)):
        method = DynamicMap(
            spread=spread, least_sigma_rad=sigma_rad, tilt_sigma_rad=0.1, height_sigma_m=0.03, widening=0.0
        )
        session = method.fit(walk.body, walk.examples, np.random.default_rng(0)).begin(walk.calibration)
        for frame in walk.frames[:5]:
            session.step(frame)
        session.past = np.array(walk.take.qpos[4:1:-1])
        session.limits.high_rad[7] = session.limits.low_rad[7] + 1e-3
        predictions.append(session.predict())
        assert session.limits.low_rad[7] <= predictions[-1].mean[11] <= session.limits.high_rad[7]
    plain, wide = predictions
    added = wide.covariance - 4.0 * plain.covariance
    floors = np.array([0.03**2, *[0.1**2] * 3, *[0.0] * 48])
    expected = np.diag(np.append(np.zeros(4), np.full(48, 0.2**2)) + floors - 4.0 * floors)
    np.testing.assert_allclose(added[:52, :52], expected, atol=1e-7)


BEHAVIOURS = ("walking", "boxing")
STARTED = 20
"""Frames of the start, which are not compared: 0.5 s."""


@cache
def unseen(behaviour: str) -> tuple[Scene, list[BodyMotion]]:
    """A take, and other takes of its performer and of another one as examples."""
    shown, names = scene(behaviour, take=1, seconds=6.0), synthetic.performer_names()
    clips = [
        synthetic.generate(behaviour, names[performer], take, seed=1, duration_s=12.0, rate_hz=40.0)
        for performer, take in ((0, 2), (0, 3), (1, 1))
    ]
    return shown, [retarget_to_common_body(clip, shown.body.skeleton)[0] for clip in clips]


@cache
def answers(name: str, behaviour: str) -> list[Estimate]:
    shown, examples = unseen(behaviour)
    fitted = registry.make_method(name).fit(shown.body, examples, np.random.default_rng(1))
    session = fitted.begin(shown.calibration)
    return [session.step(frame) for frame in shown.frames][STARTED:]


def hinges(name: str, behaviour: str) -> Floats:
    return np.array([estimate.qpos[7:] for estimate in answers(name, behaviour)])


def mean_deg(first: Floats, second: Floats) -> float:
    return float(np.rad2deg(np.abs(wrap_difference(first - second))).mean())


def test_the_preset_has_no_addition_to_the_paper() -> None:
    """No ridge, factor, floor, widening, gate or weight by quality, and one start."""
    assert (LITERAL.width, LITERAL.ridge, LITERAL.spread) == (0.0, 0.0, 1.0)
    assert (LITERAL.widening, LITERAL.ik_prior_weight) == (0.0, 0.0)
    assert (LITERAL.search, LITERAL.start, LITERAL.jump_m) == ("history", "closest", np.inf)
    assert (LITERAL.loss.robust, LITERAL.loss.quality, LITERAL.loss.suspect_weight) == (True, False, 1.0)
    assert np.rad2deg(max(LITERAL.least_sigma_rad, LITERAL.tilt_sigma_rad)) <= 0.011


@pytest.mark.parametrize("behaviour", BEHAVIOURS)
def test_the_model_answers_and_beats_inverse_kinematics(behaviour: str) -> None:
    """It answers 95 % of the frames, errs less than `ik`, and differs from `ik:mean` by 0.3 deg or more."""
    truth = unseen(behaviour)[0].take.qpos[STARTED:, 7:]
    own = [estimate.origin is Origin.MODEL for estimate in answers("dynamic_map:literal", behaviour)]
    assert np.mean(own) >= 0.95
    literal = hinges("dynamic_map:literal", behaviour)
    assert mean_deg(literal, truth) < mean_deg(hinges("ik", behaviour), truth)
    assert mean_deg(literal, hinges("ik:mean", behaviour)) >= 0.3


@pytest.mark.parametrize(("width", "spread", "neighbours"), [(0.0, 1.0, 200), (0.5, 1.0, 40), (0.0, 3.0, 200)])
def test_the_prediction_is_that_of_equations_5_to_8(width: float, spread: float, neighbours: int) -> None:
    """All windows are compared, weighted and regressed by the printed formulas, in double precision.

    The other two cases have the factors that the paper lacks: on the weights' variance, and on sigma_d.
    """
    shown, examples = unseen("walking")
    method = replace(LITERAL, width=width, spread=spread, neighbours=neighbours)
    fitted = method.fit(shown.body, examples, np.random.default_rng(1))
    session = fitted.begin(shown.calibration)
    for frame in shown.frames[:40]:
        session.step(frame)
    prior = session.independent_prior(session.predict())
    mean, variance = printed_prediction(fitted, session.past)
    np.testing.assert_allclose(prior.qpos[7:], mean, atol=1e-3)
    assert prior.precision is not None
    np.testing.assert_allclose(prior.precision[6:] ** -0.5, spread * np.sqrt(variance), rtol=0.02, atol=2e-4)


def printed_prediction(fitted: FittedDynamicMap, past: Floats) -> tuple[Floats, Floats]:
    """Mean and variance (48,) of the hinges by eq. 2 to 8, for the last estimates (m, 55), newest first."""
    windows, options = fitted.examples.windows, fitted.options
    query = windows.query(past).astype(float)
    x, y = windows.gather(slice(None)).astype(float), windows.successors(np.arange(len(windows)))[:, 4:52].astype(float)
    squared = np.sum((x - query) ** 2, axis=1)
    nearest = np.argsort(squared)[: options.neighbours]
    scale = options.width * np.sort(squared)[options.neighbours // 2] if options.width else 1.0  # D_w = 1 as printed
    x, y, weight = x[nearest], y[nearest], np.exp(-0.5 * squared[nearest] / scale)  # eq. 6
    weight /= weight.sum()
    x_mean, y_mean = weight @ x, weight @ y
    x, y = x - x_mean, y - y_mean
    eigenvalue, vector = np.linalg.eigh(x.T @ (weight[:, None] * x))
    eigenvalue, vector = eigenvalue[::-1], vector[:, ::-1]
    count = 1 + int(np.searchsorted(np.cumsum(eigenvalue), options.variance_kept * eigenvalue.sum()))
    u, inverse = vector[:, :count], 1.0 / eigenvalue[:count]
    beta = u @ (inverse[:, None] * (u.T @ (x.T @ (weight[:, None] * y))))  # eq. 7
    residual = y - x @ beta
    return y_mean + (query - x_mean) @ beta, weight @ residual**2  # eq. 8
