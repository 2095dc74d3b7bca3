"""How far a constellation reaches."""

import pytest

from harness.stream.codec.capacity import emitter_reach_m
from harness.stream.codec.replies import Emitter
from harness.stream.emulator.settings import DEFAULT_EMITTERS

DOWN = (0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("position_m", "normal", "reach_m"),
    [
        ((0.5, -3.5, 0.0), DOWN, 3.5),  # beside the origin
        ((0.5, -1.0, 0.2), DOWN, 1.0),  # at the ceiling, as the origin
        ((0.5, -1.0, -3.2), DOWN, 1.0),  # at the ceiling, the origin at the floor
        ((0.5, -1.0, -9.0), DOWN, 5.0),  # too high to be heard at the origin
        ((3.2, 0.0, 0.0), (-1.0, 0.0, 0.0), 0.0),  # at a wall, towards the origin
        ((3.2, 0.0, 0.0), (1.0, 0.0, 0.0), 3.2),  # at a wall, away from it
    ],
)
def test_stations_stand_before_an_emitter(
    position_m: tuple[float, float, float], normal: tuple[float, float, float], reach_m: float
) -> None:
    far = Emitter(1, position_m, normal, 5001)
    near = Emitter(2, (0.0, 0.0, 0.0), DOWN, 5002)
    assert emitter_reach_m([far]) == pytest.approx(reach_m)
    assert emitter_reach_m([near, far, near]) == pytest.approx(reach_m)


def test_the_largest_emitter_counts() -> None:
    assert emitter_reach_m(DEFAULT_EMITTERS) == pytest.approx(0.9144)
    assert emitter_reach_m([]) == 0.0
