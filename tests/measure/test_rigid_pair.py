"""Two stations on a simulated bar whose errors are known."""

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.measure.rigid_pair import RigidPair, measure_rigid_pair

LEVER_M = np.array([0.1, 0.38, -0.05])
B_FROM_A = rotations.exp(np.array([0.4, -0.2, 0.1]))


def sweep(time_s: Floats) -> tuple[Floats, Floats, Floats]:
    """Position, velocity and orientation of the first station on the bar, which turns about all axes."""
    phase = np.array([0.0, 1.0, 2.0])
    angle = 0.8 * np.sin(np.array([1.9, 1.3, 2.4]) * time_s[:, None] + phase)
    place = 0.4 * np.sin(np.array([1.1, 1.7, 0.9]) * time_s[:, None] + phase)
    velocity = 0.4 * np.array([1.1, 1.7, 0.9]) * np.cos(np.array([1.1, 1.7, 0.9]) * time_s[:, None] + phase)
    return place, velocity, rotations.exp(angle)


def measure(
    ahead_s: float, noise_m: float = 0.0, seconds: float = 60.0, seed: int = 1, echo: bool = False
) -> RigidPair:
    rng = np.random.default_rng(seed)
    times = np.arange(round(40.0 * seconds)) / 40.0, np.arange(round(40.0 * seconds)) / 40.0 + 0.004
    positions, turns = [], []
    for number, time_s in enumerate(times):
        at = [time_s + shift for shift in (0.0, ahead_s)]
        place, _, turn = sweep(at[1])
        lever = LEVER_M if number else np.zeros(3)
        measured = place + rotations.rotate(turn, lever) + noise_m * rng.normal(size=(len(time_s), 3))
        if echo and number:
            measured[::50] += 0.2
        positions.append(measured)
        mount = B_FROM_A if number else rotations.IDENTITY
        turns.append(rotations.multiply(sweep(at[0])[2], mount))
    return measure_rigid_pair(("left", "right"), times, (positions[0], positions[1]), (turns[0], turns[1]))


def test_a_perfect_pair_has_no_error() -> None:
    pair = measure(0.0)
    assert pair.length_m.value == pytest.approx(float(np.linalg.norm(LEVER_M)), abs=1e-4)
    assert abs(pair.ahead_s.value) < 1e-5
    assert pair.rotation_rad.value < 2e-4  # a great arc between readings 25 ms apart
    assert all(speed.rms_m.value < 1e-4 for speed in pair.speeds)
    assert len(pair.speeds) >= 3


def test_positions_that_run_ahead_are_found_without_a_reference() -> None:
    pair = measure(0.002, noise_m=0.002)
    assert pair.ahead_s.contains(0.002)
    assert pair.ahead_s.high - pair.ahead_s.low < 0.001
    assert measure(-0.01).ahead_s.value == pytest.approx(-0.01, rel=0.02)


def test_errors_have_their_size_in_every_class_of_speed() -> None:
    for speed in measure(0.0, noise_m=0.002).speeds:
        expected_m = 0.002 * np.sqrt(6.0)  # two stations, three axes; interpolation lowers that of one of them
        assert 0.8 * expected_m < speed.rms_m.value < 1.05 * expected_m


@pytest.mark.long
def test_the_interval_of_the_time_covers_it() -> None:
    covered = [measure(0.002, noise_m=0.003, seconds=60.0, seed=seed).ahead_s.contains(0.002) for seed in range(80)]
    assert 0.88 <= np.mean(covered) <= 0.99


def test_echoes_are_left_out() -> None:
    assert measure(0.002, noise_m=0.001, echo=True).ahead_s.value == pytest.approx(0.002, abs=0.0006)


def test_a_bar_at_rest_shows_no_time_and_a_short_capture_nothing() -> None:
    time_s = np.arange(2400) / 40.0
    still = np.tile(rotations.IDENTITY, (2400, 1))
    place = np.zeros((2400, 3)) + 1e-6 * np.random.default_rng(0).normal(size=(2400, 3))
    pair = measure_rigid_pair(("a", "b"), (time_s, time_s + 0.004), (place, place + LEVER_M), (still, still))
    assert "hardly turned" in pair.ahead_s.reason
    with pytest.raises(BadInput, match="common readings"):
        measure(0.0, seconds=20.0)
