"""Frames are read by one stage: what stays as measured, what is predicted, and what its variance changes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.estimate import Status
from harness.reconstruct.contract import Method
from harness.reconstruct.features.station_increments import StationIncrements
from harness.reconstruct.methods.expert_map import ExpertMap
from harness.reconstruct.methods.ik import Ik
from harness.reconstruct.solver.frame_reader import SURE_M, SessionReader
from harness.reconstruct.solver.outlier_gate import OutlierGate
from harness.reconstruct.solver.reading_prediction import IncrementMoments, ReadingPrediction, unlearnt_moments
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.stream import TrackerFrame
from harness.testing.frames import drop_stations
from tests.reconstruct.conftest import Scene

PERIOD_S = 0.025


def begin(walk: Scene, moments: IncrementMoments | None = None, *, align: bool = False) -> SessionReader:
    return SessionReader(Residuals(walk.body, walk.calibration, Loss()), moments or unlearnt_moments(6), align=align)


def follow(reader: SessionReader, frames: Sequence[TrackerFrame]) -> SessionReader:
    for frame in frames:
        reader.read(frame)
    return reader


def targets(reader: SessionReader) -> tuple[Floats, Floats]:
    """Positions (S, 3) and orientations (S, 4) of the frame read last, copied."""
    return reader.residuals.target_m.copy(), reader.residuals.world_from_target.copy()


def delayed(frame: TrackerFrame, station: int, by_s: float) -> TrackerFrame:
    """The frame with another sampling time of a station."""
    measured_s = frame.measured_s.copy()
    measured_s[station] += by_s
    return replace(frame, measured_s=measured_s)


def changed(frame: TrackerFrame, station: int, by_m: float) -> TrackerFrame:
    position_m = frame.position_m.copy()
    position_m[station] += by_m
    return replace(frame, position_m=position_m)


def test_fresh_readings_stay_to_the_bit(walk: Scene) -> None:
    """Beside predicted ones, too."""
    reader, plain = begin(walk), Residuals(walk.body, walk.calibration, Loss())
    frames = [drop_stations(f, [0, 3] if i % 2 else []) for i, f in enumerate(walk.frames[:20])]
    for i, frame in enumerate(frames):
        reader.read(frame)
        plain.read(frame)
        fresh = np.flatnonzero(plain.measured[:6])
        assert reader.residuals.measured.all()
        np.testing.assert_array_equal(reader.residuals.fresh, plain.measured)
        for found, wanted in zip(targets(reader), (plain.target_m, plain.world_from_target), strict=True):
            np.testing.assert_array_equal(found[fresh], wanted[fresh])
        rows = plain.measured
        for name in ("precision", "twice_scale_squared"):
            found, wanted = getattr(reader.residuals.targets, name), getattr(plain.targets, name)
            np.testing.assert_array_equal(found[rows], wanted[rows])
            assert (found != wanted)[~rows].all()
        assert (reader.residuals.variance > 0.0).tolist() == (~rows).tolist()
        assert i % 2 == 1 or rows.all()


def test_a_silent_station_is_predicted_near_its_true_place(walk: Scene) -> None:
    """With the moments of examples, within a few of the standard deviations that it states."""
    reader = begin(walk, StationIncrements(walk.body, walk.examples).moments(walk.calibration))
    truth = Residuals(walk.body, walk.calibration, Loss())
    ratios: list[float] = []
    for i, frame in enumerate(walk.frames):
        reader.read(drop_stations(frame, [s for s in range(6) if s != i % 6]))
        truth.read(frame)
        if i > 20:
            silent = np.flatnonzero(~reader.residuals.fresh[:6])
            away_m = np.linalg.norm(reader.residuals.target_m - truth.target_m, axis=1) / np.sqrt(3.0)
            ratios.extend(away_m[silent] / np.sqrt(reader.residuals.variance[silent]))
            angle_rad = rotations.angle_between_rad(reader.residuals.world_from_target, truth.world_from_target)
            ratios.extend(angle_rad[silent] / np.sqrt(3.0 * reader.residuals.variance[6 + silent]))
    assert 0.2 < np.sqrt(np.mean(np.square(ratios))) < 1.2


def test_a_station_is_predicted_for_0_6_s_with_a_growing_variance(walk: Scene) -> None:
    reader, known, variance = follow(begin(walk), walk.frames[:3]), list[bool](), list[Floats]()
    for frame in walk.frames[3:40]:
        reader.read(drop_stations(frame, [0]))
        known.append(bool(reader.residuals.measured[[0, 6]].all()))
        variance.append(reader.residuals.variance[[0, 6]].copy())
    assert known[:23] == [True] * 23
    assert known[24:] == [False] * 13  # the last reading is exactly 0.6 s old in between
    assert (np.diff(np.array(variance)[:23], axis=0) > 0.0).all()
    np.testing.assert_array_equal(variance[30], 0.0)


@pytest.mark.parametrize(("by_s", "predicted"), [(0.046, False), (-0.046, False), (0.05, True), (-0.05, True)])
def test_readings_more_than_40_ms_from_the_instant_predict(walk: Scene, by_s: float, predicted: bool) -> None:
    """The instant moves by a sixth of the delay."""
    reader, plain = begin(walk), Residuals(walk.body, walk.calibration, Loss())
    frames = [delayed(frame, 2, by_s) for frame in walk.frames[:6]]
    follow(reader, frames)
    plain.read(frames[-1])
    assert reader.residuals.measured.all()
    assert (reader.residuals.variance[[2, 8]] > 0.0).tolist() == [predicted] * 2
    assert (reader.residuals.target_m[2] != plain.target_m[2]).any() == predicted
    assert not reader.residuals.variance[[0, 1, 3, 4, 5]].any()
    if predicted:
        away_m = walk.frames[5].measured_s[0] - frames[-1].measured_s[2]
        assert abs(away_m) == pytest.approx(0.05)
        assert (reader.residuals.targets.precision[2] < plain.targets.precision[2]).all()


def test_a_frame_that_is_read_twice_changes_nothing(walk: Scene) -> None:
    once, twice = begin(walk), begin(walk)
    for frame in walk.frames[:6]:
        once.read(frame)
        twice.read(frame)
        twice.read(frame)
    silent = drop_stations(walk.frames[7], [1, 4])
    once.read(silent)
    for _ in range(2):
        twice.read(silent)
        for found, wanted in zip(targets(twice), targets(once), strict=True):
            np.testing.assert_array_equal(found, wanted)
        np.testing.assert_array_equal(twice.residuals.variance, once.residuals.variance)


def test_positions_and_orientations_have_histories_of_their_own(walk: Scene) -> None:
    """A station whose positions are hidden is predicted from older positions and measured in orientation."""
    frames = list(walk.frames[:12])
    for i in range(6, 12):
        there = np.arange(6) != 1
        frames[i] = replace(frames[i], position_valid=there)
    reader = follow(begin(walk), frames)
    plain = Residuals(walk.body, walk.calibration, Loss())
    plain.read(frames[-1])
    assert reader.residuals.fresh.tolist() == [row != 1 for row in range(12)]
    assert reader.residuals.measured.all()
    np.testing.assert_array_equal(reader.residuals.world_from_target, plain.world_from_target)
    back = follow(
        begin(walk),
        [replace(f, orientation_valid=f.position_valid, position_valid=f.orientation_valid) for f in frames],
    )
    assert back.residuals.fresh.tolist() == [row != 7 for row in range(12)]


def test_the_three_newest_readings_predict(walk: Scene) -> None:
    """Older ones are forgotten: a history that differs before them predicts the same."""
    silent, moments = drop_stations(walk.frames[7], [2]), unlearnt_moments(6)
    plain = targets(follow(begin(walk, moments), [*walk.frames[:7], silent]))
    for index, same in ((6, False), (5, False), (4, False), (3, True)):
        frames = list(walk.frames[:7])
        frames[index] = changed(frames[index], 2, 0.01)
        found = targets(follow(begin(walk, moments), [*frames, silent]))
        assert (found[0] == plain[0]).all() == same
        np.testing.assert_array_equal(found[1], plain[1])


def test_suspect_records_predict_nothing_and_do_not_move_the_instant(walk: Scene) -> None:
    wrong = delayed(changed(walk.frames[5], 0, 0.05), 0, 100.0)
    wrong = replace(wrong, suspect=np.arange(6) == 0)
    wrong = drop_stations(wrong, [1])
    without = drop_stations(walk.frames[5], [0, 1])
    found, wanted = (follow(begin(walk), [*walk.frames[:5], frame]) for frame in (wrong, without))
    np.testing.assert_array_equal(found.residuals.target_m[1], wanted.residuals.target_m[1])
    np.testing.assert_array_equal(found.residuals.variance[1], wanted.residuals.variance[1])
    silent = drop_stations(walk.frames[6], [0])
    for reader in (found, wanted):
        reader.read(silent)
    for one, other in zip(targets(found), targets(wanted), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_frame_of_suspect_records_alone_predicts_nothing(walk: Scene) -> None:
    """It has no instant that can be believed."""
    doubted = drop_stations(replace(walk.frames[5], suspect=np.ones(6, bool)), [1])
    reader = follow(begin(walk), [*walk.frames[:5], doubted])
    assert reader.residuals.measured.tolist() == [row not in (1, 7) for row in range(12)]
    assert not reader.residuals.variance.any()


def test_after_a_restart_of_the_device_old_readings_predict_nothing(walk: Scene) -> None:
    before = [replace(f, measured_s=f.measured_s + 100.0) for f in walk.frames[:5]]
    reader = follow(begin(walk), [*before, drop_stations(walk.frames[5], [1])])
    assert reader.residuals.measured.tolist() == [row not in (1, 7) for row in range(12)]
    follow(reader, [walk.frames[6], drop_stations(walk.frames[7], [1])])
    assert reader.residuals.measured.all()
    follow(reader, [walk.frames[8], walk.frames[9], walk.frames[10], drop_stations(walk.frames[11], [1])])
    alone = follow(begin(walk), [*walk.frames[8:11], drop_stations(walk.frames[11], [1])])
    np.testing.assert_array_equal(reader.residuals.target_m, alone.residuals.target_m)


def test_a_position_that_the_gate_leaves_out_is_not_predicted(walk: Scene) -> None:
    """It contradicts the history that would predict it. It does not enter the history either."""
    reader = begin(walk)
    for frame, qpos in zip(walk.frames[:10], walk.take.qpos, strict=False):
        reader.read(frame)
        reader.update(qpos)
    _, any_valid = reader.read(changed(walk.frames[10], 3, 0.5))
    assert any_valid
    assert reader.gate.left_out
    assert reader.residuals.measured.tolist() == [row != 3 for row in range(12)]
    assert reader.residuals.targets.precision[3] == reader.residuals.variance[3] == 0.0
    reader.read(drop_stations(walk.frames[11], [3]))
    plain = follow(
        begin(walk), [*walk.frames[:10], drop_stations(walk.frames[10], [3]), drop_stations(walk.frames[11], [3])]
    )
    np.testing.assert_allclose(reader.residuals.target_m[3], plain.residuals.target_m[3], atol=1e-12)


def test_without_any_reading_the_residuals_are_unchanged(walk: Scene) -> None:
    reader = follow(begin(walk), walk.frames[:5])
    before = targets(reader)
    assert reader.read(drop_stations(walk.frames[5], range(6))) == (Status.HELD, False)
    for found, wanted in zip(targets(reader), before, strict=True):
        np.testing.assert_array_equal(found, wanted)


def test_a_predicted_row_has_its_variance_in_precision_and_scale(walk: Scene) -> None:
    """1 / (sigma^2 + v), and 2 sL^2 + 8 v, also when a cold start widens the scale."""
    residuals, loss = Residuals(walk.body, walk.calibration, Loss()), Loss()
    residuals.read(drop_stations(walk.frames[0], [0, 1]))
    predicted, variance = np.isin(np.arange(12), [0, 7]), np.zeros(12)
    variance[[0, 7]] = 0.05**2, 0.2**2
    residuals.add_predictions(predicted, variance)
    assert residuals.measured.tolist() == [row not in (1, 6) for row in range(12)]
    assert residuals.confidence.tolist() == [float(row not in (1, 6)) for row in range(12)]
    sigma, scale = (
        (loss.position_sigma_m, loss.orientation_sigma_rad),
        (loss.position_scale_m, loss.orientation_scale_rad),
    )
    precision = residuals.targets.precision
    assert precision[0] == pytest.approx(1.0 / (sigma[0] ** 2 + 0.05**2))
    assert precision[7] == pytest.approx(1.0 / (sigma[1] ** 2 + 0.2**2))
    assert precision[2] == pytest.approx(sigma[0] ** -2)
    assert precision[1] == precision[6] == 0.0
    for factor in (1.0, 3.0, 1.0):
        residuals.widen(factor)
        twice = residuals.targets.twice_scale_squared
        assert twice[0] == pytest.approx(2.0 * (factor * scale[0]) ** 2 + 8.0 * 0.05**2)
        assert twice[7] == pytest.approx(2.0 * (factor * scale[1]) ** 2 + 8.0 * 0.2**2)
        assert twice[2] == pytest.approx(2.0 * (factor * scale[0]) ** 2)
    residuals.read(walk.frames[1])
    assert not residuals.variance.any()
    assert residuals.targets.twice_scale_squared[0] == pytest.approx(2.0 * scale[0] ** 2)


def test_the_scale_of_a_prediction_is_set_before_any_cold_start(walk: Scene) -> None:
    residuals = Residuals(walk.body, walk.calibration, Loss())
    residuals.read(drop_stations(walk.frames[0], [0]))
    residuals.add_predictions(np.arange(12) == 0, np.full(12, 0.05**2))
    assert residuals.variance.tolist() == [0.05**2, *[0.0] * 11]
    wanted = 2.0 * Loss().position_scale_m ** 2 + np.array([8.0 * 0.05**2, 0.0])
    np.testing.assert_allclose(residuals.targets.twice_scale_squared[:2], wanted)


@pytest.mark.parametrize(("off_m", "out"), [(0.20, False), (0.22, True)])
def test_the_gate_lets_a_station_be_farther_where_it_was_predicted(off_m: float, out: bool) -> None:
    """By three standard deviations: sqrt(0.15^2 + 9 0.05^2) = 0.212 m. Without a prediction 0.2 m is too far."""
    for variance_m2, wanted in ((np.array([0.05**2, 0.0, 0.0]), out), (np.zeros(3), True)):
        gate, place_m = OutlierGate(3), np.zeros((3, 3))
        for index in range(3):
            gate.find_jumps(index * PERIOD_S, place_m, np.ones(3, bool))
            gate.update_stations(index * PERIOD_S, place_m)
        jump_m = np.zeros((3, 3))
        jump_m[0, 2] = off_m
        found = gate.find_jumps(3 * PERIOD_S, jump_m, np.ones(3, bool), None, variance_m2)
        assert found.tolist() == [wanted, False, False]


def test_predicted_stations_count_where_the_gate_asks_whether_all_moved() -> None:
    """One reading of one that jumps is all that reports; with three others that are predicted it is one of four."""
    only = np.arange(4) == 0
    for variance_m2, all_moved in ((np.zeros(4), True), (np.where(only, 0.0, 1e-4), False)):
        gate, place_m = OutlierGate(4), np.zeros((4, 3))
        for index in range(3):
            gate.find_jumps(index * PERIOD_S, place_m, np.ones(4, bool))
            gate.update_stations(index * PERIOD_S, place_m)
        found = gate.find_jumps(3 * PERIOD_S, place_m + 0.5, only, None, variance_m2)
        assert gate.all_moved == all_moved
        assert found.tolist() == [not all_moved, False, False, False]


def test_the_gate_takes_the_variance_of_the_frame_before(walk: Scene) -> None:
    """A station comes back 0.2 m from the body, which a silence of 50 ms explains and no silence does not."""
    out = []
    for silent in (0, 2):
        reader = begin(walk)
        for i, (frame, qpos) in enumerate(zip(walk.frames[:10], walk.take.qpos, strict=False)):
            reader.read(drop_stations(frame, [3] if i >= 10 - silent else []))
            reader.update(qpos)
        sigma_m = np.sqrt(reader.residuals.variance[3])
        assert (sigma_m > 0.0) == (silent > 0)
        reader.read(changed(walk.frames[10], 3, (0.15 + 0.5 * sigma_m) / np.sqrt(3.0) + 0.003))
        out.append(reader.gate.left_out)
    assert out == [True, False]


def test_stations_count_as_sure_by_reading_or_by_deviation(walk: Scene) -> None:
    residuals = Residuals(walk.body, walk.calibration, Loss())
    frame = drop_stations(walk.frames[0], [0, 1, 2, 3])
    residuals.read(replace(frame, position_valid=np.arange(6) == 4))  # station 5 has an orientation only
    variance = np.zeros(12)
    variance[[0, 1, 2]], variance[6:9] = (0.14**2, 0.16**2, 0.01**2), 1e-4
    residuals.add_predictions(variance > 0.0, variance)
    assert residuals.count_sure(0.15) == 4
    assert residuals.count_sure(0.17) == 5
    assert residuals.count_sure(0.001) == 2


def test_an_answer_is_solved_while_half_of_the_stations_report_or_are_sure(walk: Scene) -> None:
    """Two of six report. The others count until the deviation is 0.15 m, and 0.5 s later the answer is lost."""
    assert SURE_M == 0.15
    reader, status, sigma_m = begin(walk), list[Status](), list[float]()
    for i, frame in enumerate(walk.frames[:50]):
        status.append(reader.read(drop_stations(frame, [0, 1, 2, 3] if i >= 5 else []))[0])
        measured = reader.residuals.measured[0]
        sigma_m.append(float(np.sqrt(reader.residuals.variance[0])) if measured else np.inf)
    sure = sum(s < SURE_M for s in sigma_m)
    assert 5 < sure < 20
    assert status[:sure] == [Status.SOLVED] * sure
    assert status[sure : sure + 19] == [Status.HELD] * 19
    assert set(status[sure + 21 :]) == {Status.LOST}


@pytest.mark.parametrize(("method", "motion"), [(Ik(), "walk"), (ExpertMap(), "walk"), (ExpertMap(), "boxing")])
def test_on_a_slow_line_errors_are_less_than_half(
    method: Method, motion: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One station reports per frame, each every 150 ms, after half a second of a fast line."""
    scene: Scene = request.getfixturevalue(motion)
    frames = [
        drop_stations(frame, [s for s in range(6) if i >= 20 and s != i % 6]) for i, frame in enumerate(scene.frames)
    ]
    with_stage = scene.off_m(scene.run(method, frames), scene.take.qpos)[60:].mean()
    monkeypatch.setattr(ReadingPrediction, "complete", lambda *_: None)
    without = scene.off_m(scene.run(method, frames), scene.take.qpos)[60:].mean()
    assert with_stage < 0.5 * without
