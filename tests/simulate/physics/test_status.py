"""Quality and counts of ranges."""

import numpy as np
import pytest

from harness.simulate.physics.tracking_state import (
    CONFIRMING,
    DOUBTED,
    LEAST_QUALITY,
    LOST,
    TRACKING,
    quality,
    sum_last,
)


@pytest.mark.parametrize("state", [LOST, CONFIRMING, DOUBTED])
def test_a_station_without_a_confirmed_fix_has_quality_0(state: int) -> None:
    assert quality(state, 0.001, 12, 0, 0.003) == 0.0


@pytest.mark.parametrize(
    ("sigma_m", "received", "rejected", "expected"),
    [
        (0.001, 12, 0, 1.0),
        (0.003, 12, 0, 1.0),
        (0.006, 12, 0, 0.5),
        (0.003, 12, 6, 0.75),
        (0.003, 12, 12, 0.5),
        (0.003, 0, 0, 0.5),
        (0.0, 12, 0, 1.0),
        (100.0, 0, 0, LEAST_QUALITY),
    ],
)
def test_quality_falls_with_sigma_and_rejections(sigma_m: float, received: int, rejected: int, expected: float) -> None:
    assert quality(TRACKING, sigma_m, received, rejected, 0.003) == pytest.approx(expected)


def test_counts_are_summed_over_the_last_slots() -> None:
    ring = np.arange(10)
    assert sum_last(ring, 12, 3) == 2 + 1 + 0
    assert sum_last(ring, -9, 3) == 1 + 0 + 9  # slots before the take are negative
