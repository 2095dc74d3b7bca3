"""The product of local experts on known motion, inside and outside its examples."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.estimate import Estimate, Origin, Status
from harness.reconstruct.features.moment_table import condition, local_gaussian
from harness.reconstruct.methods import expert_map
from harness.reconstruct.methods.expert_map import ExpertMap, ExpertMapSession, FittedExpertMap
from harness.reconstruct.methods.ik import Ik
from harness.reconstruct.solver.ground_frame import HINGES, ground_and_posture, posture_from_qpos
from harness.reconstruct.solver.ik_session import POSTURE_PRIOR_SIGMA_RAD
from harness.reconstruct.solver.ik_solver import IKSolution
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.self_calibration import posterior
from harness.reconstruct.solver.subspace_minimiser import Subspace
from harness.stream import TrackerFrame
from harness.testing.frames import drop_stations, exact_frames
from tests.reconstruct.conftest import Scene, moved, scene

FEW = ExpertMap(neighbours=60, history_neighbours=60)
"""Options for one take of three seconds."""
TORSO = 4


def angles_deg(estimates: list[Estimate], truth: Floats) -> Floats:
    """(T,) mean absolute hinge error [deg]."""
    away = np.array([e.qpos[7:] for e in estimates]) - truth[:, 7:]
    out: Floats = np.rad2deg(np.abs((away + np.pi) % (2 * np.pi) - np.pi).mean(axis=1))
    return out


@pytest.fixture(scope="module")
def fitted(walk: Scene) -> FittedExpertMap:
    return ExpertMap().fit(walk.body, walk.examples, np.random.default_rng(1))


def follow(session: ExpertMapSession, frames: list[TrackerFrame]) -> list[Estimate]:
    return [session.step(frame) for frame in frames]


def begin(fitted: FittedExpertMap, worn_by: Scene) -> ExpertMapSession:
    session = fitted.begin(worn_by.calibration)
    assert isinstance(session, ExpertMapSession)
    return session


def warm(
    walk: Scene, fitted: FittedExpertMap, broad_weight: float = 0.15, history_weight: float = 0.5
) -> ExpertMapSession:
    """A session that has followed ten frames and has read the next one."""
    options = replace(fitted.options, broad_weight=broad_weight, history_weight=history_weight)
    changed = replace(fitted, options=options)
    session = begin(changed, walk)
    follow(session, walk.frames[:10])
    session.residuals.read(walk.frames[10])
    return session


@pytest.mark.parametrize("motion", ["walk", "boxing"])
def test_a_take_of_the_examples_comes_back(motion: str, request: pytest.FixtureRequest) -> None:
    shown: Scene = request.getfixturevalue(motion)
    estimates = shown.run(FEW, examples=[shown.take])
    assert angles_deg(estimates, shown.take.qpos)[20:].mean() < 0.6
    assert shown.off_m(estimates, shown.take.qpos)[20:].max() < 0.006


@pytest.mark.parametrize("motion", ["walk", "boxing"])
@pytest.mark.parametrize("inputs", ["pos+ori", "pos"])
def test_known_motion_is_better_than_by_inverse_kinematics(
    motion: str, inputs: str, request: pytest.FixtureRequest
) -> None:
    shown: Scene = request.getfixturevalue(motion)
    ours, by_ik = (
        angles_deg(shown.run(method, shown.only(inputs)), shown.take.qpos)[10:].mean() for method in (ExpertMap(), Ik())
    )
    assert ours < 0.8 * by_ik


@pytest.mark.parametrize("behaviour", ["boxing", "jumping"])
def test_behaviour_unlike_the_examples_is_little_worse_than_by_inverse_kinematics(walk: Scene, behaviour: str) -> None:
    """Examples of walking alone still serve."""
    other = scene(behaviour)
    ours, by_ik = (
        angles_deg(other.run(method, examples=walk.examples if method.needs_examples else []), other.take.qpos)[10:]
        for method in (ExpertMap(), Ik())
    )
    assert ours.mean() < 1.7 * by_ik.mean()


def test_a_behaviour_unlike_the_examples_is_recognised_as_new(walk: Scene, fitted: FittedExpertMap) -> None:
    other, own = scene("boxing"), ExpertMap().fit(walk.body, [*walk.examples, walk.take], np.random.default_rng(1))
    known = begin(own, walk)
    follow(known, walk.frames)
    session = begin(fitted, replace(walk, calibration=other.calibration))
    follow(session, other.frames)
    assert known._trust.newness < 0.7
    assert session._trust.newness == 1.0
    assert session._trust.inflation > 4.0 * known._trust.inflation


def test_a_performer_unlike_the_examples_is_not_worse_than_by_inverse_kinematics(walk: Scene) -> None:
    ours, by_ik = (
        angles_deg(walk.run(method, examples=walk.examples[2:] if method.needs_examples else []), walk.take.qpos)[10:]
        for method in (ExpertMap(), Ik())
    )
    assert ours.mean() < by_ik.mean()


def test_the_room_does_not_matter_with_positions_alone(walk: Scene) -> None:
    qpos = moved(walk.take.qpos, np.deg2rad(170.0), (4.0, -3.0, 0.0))
    elsewhere = replace(walk, frames=exact_frames(walk.body, walk.calibration, qpos))
    here, there = (shown.run(ExpertMap(), shown.only("pos")) for shown in (walk, elsewhere))
    angles = [np.array([e.qpos[7:] for e in estimates[5:]]) for estimates in (here, there)]
    np.testing.assert_allclose(angles[1], angles[0], atol=1e-3)


def test_another_calibration_has_its_own_tables(walk: Scene, fitted: FittedExpertMap) -> None:
    worn = replace(walk.calibration, mount_m=walk.calibration.mount_m + 0.05)
    one, two = begin(fitted, walk), begin(fitted, walk)
    assert one._experts is two._experts
    assert begin(fitted, replace(walk, calibration=worn))._experts is not one._experts


def test_sessions_with_positions_alone_share_tables_of_their_own(walk: Scene, fitted: FittedExpertMap) -> None:
    sessions = [begin(fitted, walk) for _ in range(3)]
    for session, inputs in zip(sessions, ("pos", "pos", "pos+ori"), strict=True):
        follow(session, walk.only(inputs)[:6])
    one, two, usual = (session._experts for session in sessions)
    assert one is two
    assert one is not usual
    assert one.regression.heading is not None
    assert one.regression is sessions[0]._query.regression


@pytest.mark.parametrize("lost", [[0], [TORSO], [0, 1], [0, 1, 2, 3, 4, 5]])
def test_back_after_stations_were_silent_for_two_seconds(walk: Scene, lost: list[int]) -> None:
    longer = scene("walking", seconds=5.0)
    frames = [drop_stations(f, lost) if 40 <= i < 120 else f for i, f in enumerate(longer.frames)]
    estimates = longer.run(ExpertMap(), frames)
    plain = longer.off_m(longer.run(ExpertMap()), longer.take.qpos)
    off_m = longer.off_m(estimates, longer.take.qpos)
    assert (estimates[118].status is Status.LOST) == (len(lost) == 6)
    assert off_m[140:].mean() < 1.5 * plain[140:].mean() + 1e-3
    if len(lost) < 6:
        assert off_m[40:120].mean() < 0.03
        assert angles_deg(estimates, longer.take.qpos)[40:120].mean() < 4.0


def test_silent_stations_cost_less_than_by_inverse_kinematics(walk: Scene) -> None:
    frames = [drop_stations(f, [1]) if i >= 30 else f for i, f in enumerate(walk.frames)]
    ours, by_ik = (walk.off_m(walk.run(method, frames), walk.take.qpos)[40:].mean() for method in (ExpertMap(), Ik()))
    assert ours < 0.5 * by_ik


def test_with_positions_alone_the_anchor_may_fall_silent(walk: Scene) -> None:
    frames = [drop_stations(f, [TORSO]) if 40 <= i < 60 else f for i, f in enumerate(walk.only("pos"))]
    assert walk.off_m(walk.run(ExpertMap(), frames), walk.take.qpos)[40:60].max() < 0.03


def test_a_station_that_is_off_for_a_while_moves_the_pose_little(walk: Scene) -> None:
    frames = []
    for i, frame in enumerate(walk.frames):
        position_m = np.array(frame.position_m)
        position_m[0, 1] += 0.3 * (40 <= i < 48)
        frames.append(replace(frame, position_m=position_m))
    off_m = walk.off_m(walk.run(ExpertMap(), frames), walk.take.qpos)
    assert off_m[40:48].max() < 0.04
    assert off_m[70:].max() < 0.012


def test_frames_that_are_missing_or_early(walk: Scene) -> None:
    """The history keeps the examples' rate: short gaps are bridged, long ones reset it."""
    dropped = {40, 41, 60, *range(70, 90)}
    kept = [i for i in range(len(walk.frames)) if i not in dropped]
    off_m = walk.off_m(walk.run(ExpertMap(), [walk.frames[i] for i in kept]), walk.take.qpos[kept])
    assert off_m[20:].max() < 0.03
    doubled = [f for frame in walk.frames for f in (frame, replace(frame, received_s=frame.received_s + 0.005))]
    off_m = walk.off_m(walk.run(ExpertMap(), doubled)[::2], walk.take.qpos)
    assert off_m[20:].mean() < 0.006


@pytest.mark.parametrize("inputs", ["pos+ori", "pos"])
def test_the_first_answers_are_those_of_the_examples_by_the_readings_alone(walk: Scene, inputs: str) -> None:
    frames = walk.only(inputs)[:10]
    ours, by_ik = (walk.run(method, frames) for method in (ExpertMap(), Ik()))
    assert [estimate.origin for estimate in ours] == [Origin.MODEL] * 10
    first, ik_first = (angles_deg(estimates, walk.take.qpos[:10])[0] for estimates in (ours, by_ik))
    assert first < 0.8 * ik_first
    assert angles_deg(ours, walk.take.qpos[:10]).max() < 4.0


def test_a_cold_start_without_the_anchor_falls_back(walk: Scene, fitted: FittedExpertMap) -> None:
    frames = [drop_stations(frame, [TORSO]) if i < 6 else frame for i, frame in enumerate(walk.frames[:12])]
    session = begin(fitted, walk)
    estimates = follow(session, frames)
    origins = [estimate.origin for estimate in estimates]
    assert origins == [Origin.FALLBACK] * 3 + [Origin.MODEL] * 9
    sigmas = np.array([estimate.angle_sigma_rad for estimate in estimates])
    np.testing.assert_array_equal(sigmas[:3], POSTURE_PRIOR_SIGMA_RAD)
    assert (sigmas[3:] != POSTURE_PRIOR_SIGMA_RAD).all()


def test_a_cold_start_with_the_anchor_of_a_performer_who_faces_elsewhere(walk: Scene) -> None:
    """Several starts are tried; the best one has the right heading."""
    for yaw in (1.5, 3.0, -2.0):
        qpos = moved(walk.take.qpos[:3], yaw, (1.0, 2.0, 0.0))
        estimates = walk.run(ExpertMap(), exact_frames(walk.body, walk.calibration, qpos))
        assert walk.off_m(estimates, qpos).max() < 0.03


def test_deviations_of_a_fallback_after_a_cold_start_are_those_of_inverse_kinematics(
    walk: Scene, fitted: FittedExpertMap
) -> None:
    session = begin(fitted, walk)
    first, second = session.step(walk.frames[0]), session.step(drop_stations(walk.frames[30], [TORSO]))
    assert (first.origin, second.origin) == (Origin.MODEL, Origin.FALLBACK)
    assert (sigma_of(first) != POSTURE_PRIOR_SIGMA_RAD).all()
    np.testing.assert_array_equal(sigma_of(second), POSTURE_PRIOR_SIGMA_RAD)


@pytest.mark.parametrize("costs", [(2.0, 1.0), (1.0, 2.0)])
def test_of_two_starts_that_do_not_converge_the_cheaper_solution_counts(
    walk: Scene, fitted: FittedExpertMap, costs: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    session = warm(walk, fitted)
    planted = [IKSolution(walk.take.qpos[k], cost, 3, False) for k, cost in enumerate(costs)]
    waiting = iter(planted)
    monkeypatch.setattr(session._solver, "solve", lambda *_: next(waiting))
    assert session.solve_next() is planted[int(np.argmin(costs))]


def test_of_the_starts_of_a_cold_start_the_cheapest_solution_counts(
    walk: Scene, fitted: FittedExpertMap, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = begin(fitted, walk)
    session.residuals.read(walk.frames[0])
    solve, found = session._solver.solve, list[IKSolution]()

    def noted(prior: Subspace, ground: Floats, posture: Floats) -> IKSolution:
        found.append(solve(prior, ground, posture)._replace(cost=abs(0.7 - len(found))))
        return found[-1]

    monkeypatch.setattr(session._solver, "solve", noted)
    best = session.solve_cold()
    assert len(found) >= 2
    assert best is min(found, key=lambda solution: solution.cost)


def test_scales_follow_the_readings_but_not_a_cold_start(walk: Scene, fitted: FittedExpertMap) -> None:
    session = begin(fitted, walk)
    start = session._scales.position_sigma_m, session._scales.orientation_sigma_rad
    trust = session._trust.inflation, session._trust.newness
    session.step(walk.frames[0])
    scales = session._scales
    assert (scales.position_sigma_m, scales.orientation_sigma_rad) == start
    assert (session._trust.inflation, session._trust.newness) == trust
    follow(session, walk.frames[1:])
    assert session._trust.inflation != trust[0]
    assert scales.position_sigma_m < 0.6 * start[0], "the readings are exact"
    assert scales.orientation_sigma_rad < 0.6 * start[1]


def test_the_readings_are_weighed_by_the_scales(walk: Scene, fitted: FittedExpertMap) -> None:
    session = begin(fitted, walk)
    follow(session, walk.frames[:10])
    session._scales.position_sigma_m, session._scales.orientation_sigma_rad = 0.002, 0.003
    session.step(walk.frames[10])
    np.testing.assert_allclose(session.residuals.targets.precision, np.repeat([0.002**-2.0, 0.003**-2.0], 6))


def test_the_scale_of_the_loss_follows_the_residuals(walk: Scene, fitted: FittedExpertMap) -> None:
    session, found_m = begin(fitted, walk), []
    for frame in walk.frames[:40]:
        scale_m = session._loss_scale.position_m
        session.step(frame)
        found_m.append(float(np.sqrt(session.residuals.targets.twice_scale_squared[0] / 2.0)))
        assert found_m[-1] == pytest.approx(scale_m)
    assert found_m[0] == pytest.approx(Loss().position_scale_m)
    assert found_m[-1] < 0.5 * found_m[0]


def test_the_scale_of_the_loss_knows_the_rate_of_the_frames(walk: Scene, fitted: FittedExpertMap) -> None:
    assert begin(fitted, walk)._loss_scale._weight == 0.05
    object.__setattr__(fitted.examples.windows.database, "rate_hz", 80.0)
    try:
        assert begin(fitted, walk)._loss_scale._weight == 0.025
    finally:
        object.__setattr__(fitted.examples.windows.database, "rate_hz", 40.0)


def sigma_of(estimate: Estimate) -> Floats:
    assert estimate.angle_sigma_rad is not None
    return estimate.angle_sigma_rad


@pytest.mark.parametrize(("inputs", "rows"), [("pos+ori", 12), ("pos", 6)])
def test_deviations_grow_with_fewer_numbers_and_by_a_calibration_that_errs(
    walk: Scene, fitted: FittedExpertMap, inputs: str, rows: int
) -> None:
    frames, found = walk.only(inputs)[:12], []
    for kind in ("exact", "tpose", "poses", "liu2011", "kim2012"):
        session = begin(fitted, replace(walk, calibration=replace(walk.calibration, kind=kind)))
        stated = sigma_of(follow(session, frames)[-1])
        residuals, z = session.residuals, ground_and_posture(session.qpos)
        assert session._prior is not None
        at = posterior(residuals.tree, residuals.targets, residuals.state, session._prior, session._product, z)
        found.append(float((stated / np.sqrt(at.variance[HINGES])).mean()))
        np.testing.assert_allclose(stated, found[-1] * np.sqrt(at.variance[HINGES]), rtol=0.02)
    assert found[0] == pytest.approx(0.92 * (12 / rows) ** 0.4, rel=0.02)
    assert np.array(found[1:]) / found[0] == pytest.approx([1.5, 1.27, 1.45, 2.0], rel=0.02)


def test_deviations_grow_where_stations_fall_silent(walk: Scene, fitted: FittedExpertMap) -> None:
    session = begin(fitted, walk)
    told = sigma_of(follow(session, walk.frames[:30])[-1])
    assert told.shape == (48,)
    assert (told > 0.0).all()
    silent = [sigma_of(session.step(drop_stations(frame, [0, 1, 2, 3]))).mean() for frame in walk.frames[30:60]]
    assert silent[-1] > 1.3 * told.mean()
    assert told.mean() < silent[5], "predicted readings are less sure than readings"


def test_the_true_error_is_within_a_few_deviations(walk: Scene, fitted: FittedExpertMap) -> None:
    estimates = follow(begin(fitted, walk), walk.frames)
    away = np.array([e.qpos[7:] for e in estimates]) - walk.take.qpos[:, 7:]
    ratios = np.abs((away + np.pi) % (2 * np.pi) - np.pi)[10:] / np.array([sigma_of(e) for e in estimates])[10:]
    assert 0.3 < np.mean(ratios < 1.0) < 0.95
    assert np.mean(ratios < 4.0) > 0.9


@pytest.mark.parametrize("lag", [1, 2])
def test_a_lag_answers_earlier_frames_more_smoothly(walk: Scene, lag: int) -> None:
    causal, late = walk.run(ExpertMap()), walk.run(ExpertMap(lag=lag))
    assert [estimate.lag for estimate in late] == [min(n, lag) for n in range(len(late))]
    plain, smooth = (np.array([e.qpos[7:] for e in estimates])[10:] for estimates in (causal, late))
    jitter = [np.abs(np.diff(angles, n=3, axis=0)).mean() for angles in (plain, smooth)]
    assert jitter[1] < jitter[0]
    assert (
        angles_deg(late[lag:], walk.take.qpos[:-lag])[10:].mean() < 1.1 * angles_deg(causal, walk.take.qpos)[10:].mean()
    )


def mode_of(session: ExpertMapSession, history: bool = True) -> Floats:
    return session._predict(history).mean


def by_definition(session: ExpertMapSession, power: float, broad: float) -> tuple[Floats, Floats]:
    """Precision (52, 52) and mean (52,) of the product of all three priors, written out, with the terms of contact."""
    query, experts, scales = session._query, session._experts, session._scales
    predictors = query.predictors(session.past)
    to_z = experts.feature_map(session.residuals.measured, True)
    z = predictors @ to_z.matrix - to_z.origin
    local = local_gaussian(experts.table, z, session._options.neighbours, session._options.width)
    variance = session.residuals.variance
    noise = to_z.error_covariance(scales.position_sigma_m, scales.orientation_sigma_rad, variance)
    mean, covariance = condition(local, z, noise, expert_map._RIDGE)
    mean[HINGES] = session.limits.clip(mean[HINGES])
    u = predictors[: len(experts.history_axes)] @ experts.history_axes - experts.history_origin
    around = local_gaussian(experts.history_table, u, session._options.history_neighbours, expert_map._HISTORY_WIDTH)
    other_mean, other = condition(around, u, np.zeros((len(u), len(u))), expert_map._HISTORY_RIDGE)
    floor = np.append([0.003**2, *[0.01**2] * 3], [0.005**2] * 48)
    extra = np.append(np.zeros(4), np.full(48, np.deg2rad(6.0) ** 2))
    factor = session._trust.inflation
    first = np.linalg.inv(covariance + np.diag(floor)) / factor
    second = power / np.sqrt(factor) * np.linalg.inv(other + np.diag(floor + extra))
    broad_mean, broad_variance = session._broad
    third = np.diag(broad / broad_variance)
    precision = first + second + third
    pulled = first @ mean + second @ other_mean + third @ broad_mean
    zero = np.zeros(52)
    product = Subspace(np.linalg.solve(precision, pulled), np.zeros((0, 52)), precision, zero, zero)
    found = session._contact.constrain(product, session._next_ground(), True)
    return found.curvature, found.mean


@pytest.mark.parametrize(
    ("newness", "broad", "power"), [(0.0, 0.3, 0.0), (0.5, 0.3, 0.5), (1.0, 2.0, 0.8), (1.0, 0.0, 0.5)]
)
def test_the_prior_is_the_product_of_all_experts_written_out(
    walk: Scene, fitted: FittedExpertMap, newness: float, broad: float, power: float
) -> None:
    session = warm(walk, fitted, broad_weight=broad, history_weight=power)
    session._trust.inflation, session._trust.newness = 5.0, newness
    precision, mean = by_definition(session, power, newness * broad)
    prior = session._predict(history=True)
    np.testing.assert_allclose(prior.curvature, precision, rtol=1e-5, atol=1e-5 * np.abs(precision).max())
    np.testing.assert_allclose(mode_of(session), mean, atol=1e-5)
    assert not prior.normals.size
    assert not prior.spring.any()
    assert not prior.linear.any()


def test_the_distance_is_from_the_experts_without_the_broad_gaussian(walk: Scene, fitted: FittedExpertMap) -> None:
    session = warm(walk, fitted, broad_weight=5.0)
    session._trust.newness = 1.0
    broad = session._predict(history=True).mean
    with_broad = [part.copy() for part in session._product]
    session._trust.newness = 0.0
    assert np.abs(session._predict(history=True).mean - broad).max() > 0.01
    for one, two in zip(with_broad, session._product, strict=True):
        np.testing.assert_allclose(one, two)


def test_the_trust_is_measured_from_the_experts_alone(
    walk: Scene, fitted: FittedExpertMap, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, spy = warm(walk, fitted, broad_weight=5.0), Mock(wraps=posterior)
    monkeypatch.setattr(expert_map, "posterior", spy)
    session._trust.newness = 1.0
    session.step(walk.frames[10])
    _, _, _, prior, (mean, _), _ = spy.call_args.args
    assert np.abs(prior.mean - mean).max() > 0.01


def test_without_a_history_the_past_postures_do_not_matter(walk: Scene, fitted: FittedExpertMap) -> None:
    session = warm(walk, fitted)
    before = mode_of(session, history=False), mode_of(session)
    session.past = session.past + np.append(np.zeros(7), np.full(48, 0.05))
    np.testing.assert_allclose(mode_of(session, history=False), before[0], atol=1e-6)
    assert np.abs(mode_of(session) - before[1]).max() > 1e-3


def test_a_gap_is_bridged_by_the_mode_of_the_prior_at_the_same_speed(walk: Scene, fitted: FittedExpertMap) -> None:
    session = warm(walk, fitted)
    qpos = session.predict_gap()
    mean = mode_of(session)
    mean[HINGES] = session.limits.clip(mean[HINGES])
    np.testing.assert_allclose(posture_from_qpos(qpos), mean, atol=1e-9)
    step = session.past[0, :2] - session.past[1, :2]
    np.testing.assert_allclose(qpos[:2], session.past[0, :2] + step, atol=1e-9)


def test_the_next_heading_continues_across_half_a_turn(walk: Scene, fitted: FittedExpertMap) -> None:
    session = warm(walk, fitted)
    for yaw in (np.pi - 0.01, -np.pi + 0.03, 0.0):
        session.past = np.concatenate(
            [moved(walk.take.qpos[:1], turn, (0.0, 0.0, 0.0)) for turn in (yaw + 0.02, yaw, yaw - 0.02)]
        )
        newest = moved(walk.take.qpos[:1], yaw + 0.04, (0.0, 0.0, 0.0))[0]
        found = session._next_ground()[2]
        wanted = 2.0 * np.arctan2(newest[6], newest[3])
        assert abs((found - wanted + np.pi) % (2 * np.pi) - np.pi) < 1e-9


def test_readings_of_several_moments_are_brought_to_one(walk: Scene, fitted: FittedExpertMap) -> None:
    """Stations that are read up to 16 ms after the first one distort the pose, unless they are aligned."""
    qpos, delay_s = walk.take.qpos, 0.0032 * np.arange(6)
    late = [
        exact_frames(walk.body, walk.calibration, qpos[:-1] + 40.0 * delay * (qpos[1:] - qpos[:-1]))
        for delay in delay_s
    ]
    frames = [
        replace(
            rows[0],
            measured_s=rows[0].measured_s + delay_s,
            position_m=np.array([row.position_m[s] for s, row in enumerate(rows)]),
            tracker_from_station=np.array([row.tracker_from_station[s] for s, row in enumerate(rows)]),
        )
        for rows in zip(*late, strict=True)
    ]
    judge, moment = Residuals(walk.body, walk.calibration, Loss()), 40
    away_m = []
    for align in (True, False):
        session = begin(replace(fitted, options=replace(fitted.options, align=align)), walk)
        follow(session, frames[: moment + 1])
        away_m.append(min(_mean_distance_m(judge, rows[moment], session.residuals.target_m) for rows in late))
    assert away_m[0] < 0.6 * away_m[1]


def _mean_distance_m(judge: Residuals, frame: TrackerFrame, target_m: Floats) -> float:
    judge.read(frame)
    return float(np.linalg.norm(judge.target_m - target_m, axis=1).mean())


def test_a_jump_is_gated_by_its_option(walk: Scene, fitted: FittedExpertMap) -> None:
    position_m = np.array(walk.frames[30].position_m)
    position_m[0] += 0.06
    jump = replace(walk.frames[30], position_m=position_m)
    left_out = []
    for jump_m in (0.05, 0.5):
        session = begin(replace(fitted, options=replace(fitted.options, jump_m=jump_m)), walk)
        follow(session, walk.frames[:30])
        session.step(jump)
        left_out.append(not session.residuals.fresh[0])
    assert left_out == [True, False]


def test_the_prior_holds_a_toe_that_is_still_and_lifts_one_from_below_the_floor(
    walk: Scene, fitted: FittedExpertMap
) -> None:
    """A floor far above the toes raises both, unless it is another floor."""
    session = warm(walk, fitted)
    with_contact = session._predict(history=True)
    at_the_floor = warm(walk, replace(fitted, floor_m=fitted.floor_m + 0.05))._predict(history=True)
    feet = [44, 45, 50, 51]
    assert np.abs(at_the_floor.mean[feet] - with_contact.mean[feet]).max() > np.deg2rad(2.0)
    session._contact.record(np.array(session.qpos) + 0.05 * np.isin(np.arange(55), np.array(feet) + 3))
    moved = session._predict(history=True)
    assert np.abs(moved.mean[feet] - with_contact.mean[feet]).max() > np.deg2rad(0.2)
    cold = session._predict(history=False)
    session._contact.record(session.qpos)
    np.testing.assert_array_equal(session._predict(history=False).mean, cold.mean)
