"""Limits of a hold, from readings of one station that are computed by hand."""

import numpy as np
import pytest

from harness.calibrate.hold import HoldReadings, UnusableHold, measure_hold, median_rotation, span_s
from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.stream import split_frames


def measured(
    position_m: Floats, turn: Floats | None = None, seconds: float = 2.0, usable: Bools | None = None
) -> HoldReadings:
    """The hold of a station with readings (F, 3) and (F, 4), evenly in time."""
    count = len(position_m)
    turn = np.tile(rotations.IDENTITY, (count, 1)) if turn is None else turn
    valid = np.ones(count, bool) if usable is None else usable
    time_s = np.linspace(0.0, seconds, count)
    frames = split_frames(
        time_s.tolist(),
        time_s[:, None],
        position_m[:, None],
        turn[:, None],
        valid[:, None],
        valid[:, None],
        np.ones((count, 1)),
        np.zeros((count, 1), bool),
    )
    assert span_s(frames) == seconds
    return measure_hold(frames, ["head"])


def line(end: float, count: int = 81) -> Floats:
    """A steady way along x from -end to end."""
    return np.linspace(-end, end, count)[:, None] * [1.0, 0.0, 0.0]


@pytest.mark.parametrize(("count", "seconds", "fits"), [(10, 2.0, True), (9, 2.0, False), (10, 1.99, False)])
def test_the_shortest_hold(count: int, seconds: float, fits: bool) -> None:
    if fits:
        assert measured(np.zeros((count, 3)), seconds=seconds).seconds == seconds
    else:
        with pytest.raises(UnusableHold, match=f"{count} frames in 2.0 s are too few"):
            measured(np.zeros((count, 3)), seconds=seconds)


def test_half_of_the_readings_are_enough() -> None:
    usable = np.arange(20) % 2 == 0
    assert measured(np.zeros((20, 3)), usable=usable).moved_m == 0.0
    usable[0] = False
    with pytest.raises(UnusableHold, match="silent or lost: 45% of its readings are usable, not 50%"):
        measured(np.zeros((20, 3)), usable=usable)


def test_three_quarters_of_the_readings_count_as_sway() -> None:
    hold = measured(line(0.039), rotations.exp(np.deg2rad(6.6 / 0.039) * line(0.039)))
    np.testing.assert_allclose(hold.moved_m, 0.75 * 0.039)
    np.testing.assert_allclose(hold.turned_rad, 0.75 * np.deg2rad(6.6), rtol=1e-6)
    np.testing.assert_allclose(hold.position_m, 0.0, atol=1e-12)
    with pytest.raises(UnusableHold, match="moved by 31 mm and 0 deg; sway and noise explain 30 mm and 5 deg"):
        measured(line(0.041))
    with pytest.raises(UnusableHold, match="moved by 0 mm and 5 deg"):
        measured(np.zeros((81, 3)), rotations.exp(np.deg2rad(6.8) * line(1.0)))


def test_noise_widens_the_limit() -> None:
    """Readings that alternate by a have second differences of 4 a: a standard deviation of 1.4826 x 4 a / sqrt(6)."""
    noise_m = 1e-3 * np.where(np.arange(81) % 2, 1.0, -1.0)[:, None] * np.ones(3)
    measured(line(0.054) + noise_m)
    with pytest.raises(UnusableHold, match="explain 42 mm and 5 deg"):
        measured(line(0.060) + noise_m)


def test_the_median_rotation_has_the_least_sum_of_angles() -> None:
    """About one axis it is the median angle; three readings far apart in a plane meet at the Fermat point."""
    about_z = np.deg2rad([-40.0, -1.0, 2.0, 3.0, 70.0])[:, None] * [0.0, 0.0, 1.0]
    assert rotations.angle_between_rad(median_rotation(rotations.exp(about_z)), rotations.exp(about_z[2])) < 1e-6
    corners = 1e-3 * np.array([[1.0, 0.0, 0.0], [-0.5, 0.75**0.5, 0.0], [-0.5, -(0.75**0.5), 0.0]])
    assert rotations.angle_between_rad(median_rotation(rotations.exp(corners)), rotations.IDENTITY) < 1e-7
