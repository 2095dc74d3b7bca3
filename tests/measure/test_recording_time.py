"""Length of recordings against the arithmetic of counts."""

import numpy as np
import pytest

from harness.errors import BadInput
from harness.measure.recording_time import events_for_precision, recording_minutes


def test_a_rate_to_20_percent_takes_about_100_events_and_17_minutes() -> None:
    assert events_for_precision(0.2) == 97
    assert recording_minutes(0.2, 1.0, 6) == pytest.approx(97 / 6)


def test_95_percent_of_counts_are_within_the_precision() -> None:
    events = events_for_precision(0.1)
    counts = np.random.default_rng(1).poisson(events, 100_000)
    assert np.mean(np.abs(counts / events - 1.0) <= 0.1) == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize("wrong", [(0.0, 1.0, 6), (1.0, 1.0, 6), (0.2, 0.0, 6), (0.2, 1.0, 0)])
def test_impossible_wishes_are_refused(wrong: tuple[float, float, int]) -> None:
    with pytest.raises(BadInput):
        recording_minutes(*wrong)
