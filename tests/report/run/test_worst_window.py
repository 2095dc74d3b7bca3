"""The worst two seconds of given errors."""

import numpy as np
import pytest

from harness.report.run.worst_window import WorstWindow, find_worst_window, group_overlapping

RATE_HZ = 50.0


def bump(start_s: float, end_s: float, height: float = 10.0, length_s: float = 20.0) -> tuple[np.ndarray, np.ndarray]:
    """Times and errors: the error is 1 everywhere, and `height` between two times."""
    time_s = np.arange(round(length_s * RATE_HZ)) / RATE_HZ
    return time_s, np.where((time_s >= start_s - 1e-9) & (time_s < end_s - 1e-9), height, 1.0)


def found(time_s: np.ndarray, values: np.ndarray, scored: np.ndarray | None = None) -> WorstWindow:
    window = find_worst_window(
        "cell", "mpjpe_mm", time_s, values, np.ones(len(values), bool) if scored is None else scored
    )
    assert window is not None
    return window


@pytest.mark.parametrize("start_s", [0.0, 7.5, 18.0])
def test_two_bad_seconds_are_found_where_they_are(start_s: float) -> None:
    window = found(*bump(start_s, start_s + 2.0))
    assert window.start_s == pytest.approx(start_s)
    assert window.end_s == pytest.approx(start_s + 1.98)
    assert window.stop - window.first == 100
    assert window.mean == pytest.approx(10.0)


def test_a_short_peak_counts_by_its_share_of_the_window() -> None:
    window = found(*bump(5.0, 5.5))
    assert window.start_s <= 5.0
    assert window.end_s >= 5.48
    assert window.mean == pytest.approx((25 * 10.0 + 75 * 1.0) / 100)


def test_what_is_not_scored_is_no_part_of_it() -> None:
    time_s, values = bump(0.0, 1.0, height=1000.0)
    window = found(time_s, values, time_s >= 1.0)
    assert window.start_s >= 1.0
    assert window.mean == pytest.approx(1.0)


def test_one_bad_frame_beside_a_gap_is_no_bad_two_seconds() -> None:
    time_s, values = bump(12.0, 14.0, height=5.0)
    kept = (time_s < 4.0) | (time_s >= 9.0)
    values[np.argmax(time_s >= 3.98)] = 400.0
    window = found(time_s[kept], values[kept])
    assert window.start_s <= 3.0
    assert np.sum((time_s[kept] >= window.start_s) & (time_s[kept] < window.start_s + 2.0)) >= 50


def test_undefined_frames_are_left_out_of_the_mean() -> None:
    time_s, values = bump(6.0, 8.0)
    values[::2] = np.nan
    assert found(time_s, values).mean == pytest.approx(10.0)


def test_a_clip_shorter_than_two_seconds_is_its_own_window() -> None:
    window = found(*bump(0.0, 0.5, length_s=1.0))
    assert (window.first, window.stop) == (0, 50)
    assert window.mean == pytest.approx(5.5)


@pytest.mark.parametrize("frames", [0, 1, 100])
def test_nothing_scored_or_defined_has_no_worst(frames: int) -> None:
    time_s, nothing = np.arange(frames) / RATE_HZ, np.full(frames, np.nan)
    assert find_worst_window("cell", "mpjpe_mm", time_s, nothing, np.ones(frames, bool)) is None
    assert find_worst_window("cell", "mpjpe_mm", time_s, np.ones(frames), np.zeros(frames, bool)) is None


def test_the_worst_of_several_and_what_belongs_together() -> None:
    a = WorstWindow("one", "mpjpe_mm", 0, 100, 4.0, 5.98, 3.0)
    b = WorstWindow("one", "mpjre_deg", 25, 125, 4.5, 6.48, 2.0)
    c = WorstWindow("one", "jitter_m_s3", 100, 200, 6.0, 7.98, 5.0)
    d = WorstWindow("two", "mpjre_deg", 0, 100, 4.0, 5.98, 9.0)
    assert group_overlapping([a, b, c, d]) == [(a, b), (c,), (d,)]
