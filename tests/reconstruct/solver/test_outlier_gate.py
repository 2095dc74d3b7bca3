"""Jumps that are left out, and those that are not."""

import numpy as np
import pytest

from harness.core.arrays import Bools, Floats
from harness.reconstruct.solver.outlier_gate import OutlierGate

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
