"""Jumps that are left out, and those that are not."""

from dataclasses import replace

import numpy as np
import pytest

from harness.body import build_body
from harness.core.arrays import Bools, Floats
from harness.reconstruct.solver.outlier_gate import OutlierGate
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.testing.frames import drop_stations, exact_calibration, exact_frames

PERIOD_S = 0.025
SPEED_M_S = np.array([4.0, 0.0, 0.0])
EVERY = np.ones(4, bool)


def at(frame: int) -> Floats:
    """Four stations that all travel at 4 m/s."""
    return np.arange(4.0)[:, None] + SPEED_M_S * PERIOD_S * frame


def watched(frames: int) -> OutlierGate:
    gate = OutlierGate(4, jump_m=0.15, patience_s=0.25)
    for frame in range(frames):
        assert not gate.find_jumps(frame * PERIOD_S, at(frame), EVERY).any()
        gate.update_stations(frame * PERIOD_S, at(frame))
    return gate


def jumped(gate: OutlierGate, frame: int, by_m: float, stations: list[int], measured: Bools = EVERY) -> list[int]:
    target_m = at(frame)
    target_m[stations, 2] += by_m
    return np.flatnonzero(gate.find_jumps(frame * PERIOD_S, target_m, measured)).tolist()


@pytest.mark.parametrize(("by_m", "out"), [(0.0, []), (0.14, []), (0.16, [2]), (3.0, [2])])
def test_a_jump_is_told_from_motion(by_m: float, out: list[int]) -> None:
    assert jumped(watched(2), 2, by_m, [2]) == out


@pytest.mark.parametrize(("by_m", "out", "as_if_at_once"), [(0.14, [], [2]), (-0.16, [2], [])])
def test_a_station_is_predicted_at_its_own_sampling_time(by_m: float, out: list[int], as_if_at_once: list[int]) -> None:
    """It travels 3.2 cm in the 8 ms between the instant and its sampling time."""
    offset_s = np.array([0.0, 0.0, 0.008, 0.0])
    target_m = at(2) + SPEED_M_S * offset_s[:, None]
    target_m[2, 0] += by_m
    for times_s, wanted in ((offset_s, out), (None, as_if_at_once)):
        found = watched(2).find_jumps(2 * PERIOD_S, target_m, EVERY, times_s)
        assert np.flatnonzero(found).tolist() == wanted


def test_nothing_is_said_before_a_velocity_is_known_or_after_a_gap() -> None:
    assert jumped(watched(0), 0, 1.0, [2]) == []
    assert jumped(watched(1), 1, 1.0, [2]) == []
    assert jumped(watched(9), 14, 1.0, [2]) == []


def test_when_half_of_them_jump_the_performer_moved() -> None:
    gate = watched(2)
    assert jumped(gate, 2, 1.0, [0, 1]) == []
    assert gate.all_moved
    assert jumped(gate, 2, 1.0, [0]) == [0]
    assert not gate.all_moved
    assert jumped(gate, 2, 1.0, [0], np.array([True, True, False, False])) == []


def test_what_lasts_is_believed() -> None:
    gate, out = watched(2), []
    for frame in range(2, 30):
        out.append(jumped(gate, frame, 0.5, [1]) == [1])
        gate.update_stations(frame * PERIOD_S, at(frame))
    assert out == [True] * 10 + [False] * 18


def run_gate(target_m: Floats, body_m: Floats, measured: Bools | None = None) -> Bools:
    """(T, S) what the gate leaves out of positions (T, S, 3) when the answers have stations at `body_m` (T, S, 3)."""
    gate = OutlierGate(target_m.shape[1], jump_m=0.15, patience_s=0.25)
    measured = np.ones(target_m.shape[:2], bool) if measured is None else measured
    out = []
    for frame, (target, body, valid) in enumerate(zip(target_m, body_m, measured, strict=True)):
        out.append(gate.find_jumps(frame * PERIOD_S, target, valid))
        gate.update_stations(frame * PERIOD_S, body)
    return np.array(out)


def still(frames: int) -> Floats:
    return np.array(np.broadcast_to(np.arange(12.0).reshape(4, 3), (frames, 4, 3)))


def test_readings_that_move_steadily_are_kept_when_the_body_is_off() -> None:
    readings, body = still(40), still(40)
    readings[:, 2, 0] += 4.0 * PERIOD_S * np.arange(40)
    body[20:, 2, 1] += 0.5
    assert not run_gate(readings, body).any()


def test_a_punch_costs_one_reading_when_the_body_does_not_follow() -> None:
    readings, body = still(30), still(30)
    readings[10:, 1, 0] += 0.3 * np.arange(1, 21)  # from rest to 12 m/s in one period
    out = run_gate(readings, body)
    assert np.argwhere(out).tolist() == [[10, 1]]


@pytest.mark.parametrize("length", range(1, 9))
@pytest.mark.parametrize("speed_m_s", [0.0, 5.0])
def test_a_burst_of_echoes_is_left_out_to_its_last_reading(length: int, speed_m_s: float) -> None:
    body = still(40)
    body[:, 3, 0] += speed_m_s * PERIOD_S * np.arange(40)
    readings = body.copy()
    readings[10 : 10 + length, 3] += [0.2, 0.0, 0.1]
    out = run_gate(readings, body)
    assert np.argwhere(out).tolist() == [[frame, 3] for frame in range(10, 10 + length)]


def test_a_burst_ends_although_the_body_has_drifted() -> None:
    """A body that is 16 cm off is beyond the jump, but nearer to the reading than with the offset of the burst."""
    readings, body = still(30), still(30)
    readings[10:15, 0, 2] += 0.5
    body[:, 0, 2] += np.clip(0.04 * (np.arange(30) - 9), 0.0, 0.16)
    assert np.argwhere(run_gate(readings, body)).tolist() == [[frame, 0] for frame in range(10, 15)]


def test_the_offset_of_a_burst_is_that_of_the_readings() -> None:
    """The body is 13 cm off on one side when the burst begins, and 10 cm on the other when it ends."""
    readings, body = still(30), still(30)
    readings[10:18, 0, 2] += 0.3
    body[:, 0, 2] += np.clip(0.13 - 0.06 * (np.arange(30) - 10), -0.1, 0.13)
    assert np.argwhere(run_gate(readings, body)).tolist() == [[frame, 0] for frame in range(10, 18)]


def test_after_a_gap_the_body_s_velocity_predicts_the_reading() -> None:
    """The station was at 5 m/s before the gap and rests after it; the body is 16 cm off in one frame."""
    body = still(20)
    body[:, 1, 0] += 5.0 * PERIOD_S * np.minimum(np.arange(20), 10)
    readings, measured = body.copy(), np.ones((20, 4), bool)
    measured[10, 1] = False
    body[11:, 1, 1] += 0.08  # at this velocity it is expected at 0.16 m in the next frame
    assert not run_gate(readings, body, measured).any()


def test_a_slow_body_is_believed_after_a_lost_reading() -> None:
    """Without a reading in the last frame, only the body predicts."""
    readings, body = still(20), still(20)
    measured = np.ones((20, 4), bool)
    measured[10, 2] = False
    readings[11, 2] += [0.0, 0.2, 0.0]
    assert np.argwhere(run_gate(readings, body, measured)).tolist() == [[11, 2]]


@pytest.mark.parametrize("seed", range(10))
def test_random_bursts_are_found_in_random_motion(seed: int) -> None:
    """Bursts of 25 to 30 cm in motion of up to 60 m/s^2, with a body that is up to 1 cm off."""
    rng = np.random.default_rng(seed)
    phase, rate = rng.uniform(0.0, 6.0, (4, 3)), rng.uniform(3.0, 10.0, (4, 3))
    seconds = PERIOD_S * np.arange(400.0)[:, None, None]
    truth = 0.35 * np.sin(rate * seconds + phase)
    body = truth + rng.uniform(-0.006, 0.006, truth.shape)
    hit = np.zeros((400, 4), bool)
    readings = truth.copy()
    for begin in range(10, 380, 20):
        station, length = rng.integers(4), rng.integers(1, 9)
        direction = rng.normal(size=3)
        readings[begin : begin + length, station] += rng.uniform(0.25, 0.3) * direction / np.linalg.norm(direction)
        hit[begin : begin + length, station] = True
    np.testing.assert_array_equal(run_gate(readings, body), hit)


def test_readings_and_rejections_are_counted() -> None:
    body = build_body()
    calibration, qpos = exact_calibration(body), np.zeros((20, 55))
    qpos[:, [2, 3]] = 1.0
    frames = exact_frames(body, calibration, qpos)
    position_m = np.array(frames[10].position_m)
    position_m[1, 0] += 0.4
    frames[10] = replace(frames[10], position_m=position_m)
    frames[12] = drop_stations(frames[12], [0, 3])
    residuals, gate = Residuals(body, calibration, Loss()), OutlierGate(6)
    for frame in frames:
        gate.read(frame, residuals)
        gate.update(residuals, qpos[0])
    assert (gate.readings, gate.rejected) == (118, 1)
