"""Episodes against a plain loop, and the cases that a loop hides: ends of the recording, NaN, merging."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.core.arrays import Floats
from harness.errors import BadInput, ShapeError
from harness.measure.episodes import find_episodes, find_excursions, find_gaps


def plain_episodes(
    time_s: Floats, signal: Floats, condition: list[bool], merge_s: float
) -> list[tuple[float, float, float, bool]]:
    """Begin, end, peak and truncation of each episode, sample by sample."""
    period_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    spans: list[list[int]] = []
    for n, holds in enumerate(condition):
        if not holds:
            continue
        if (spans and spans[-1][1] == n) or (spans and time_s[n] - time_s[spans[-1][1]] < merge_s - 1e-9):
            spans[-1][1] = n + 1
        else:
            spans.append([n, n + 1])
    out = []
    for first, end in spans:
        end_s = time_s[end] if end < len(time_s) else time_s[-1] + period_s
        peak = max((v for v in signal[first:end] if not np.isnan(v)), default=float("nan"))
        out.append((time_s[first], end_s, peak, first == 0 or end == len(time_s)))
    return out


samples = st.lists(
    st.tuples(st.floats(0.01, 2.0), st.one_of(st.floats(-5.0, 5.0), st.just(float("nan"))), st.booleans()), max_size=60
)


@given(samples, st.sampled_from([0.0, 0.3, 1.0, 5.0]))
def test_episodes_are_those_of_a_plain_loop(drawn: list[tuple[float, float, bool]], merge_s: float) -> None:
    time_s = np.cumsum([step for step, *_ in drawn]) if drawn else np.zeros(0)
    signal, condition = np.array([value for _, value, _ in drawn]), [holds for *_, holds in drawn]
    found = find_episodes(time_s, signal, np.array(condition, dtype=bool), merge_s=merge_s)
    expected = plain_episodes(time_s, signal, condition, merge_s)
    rows = np.array([row[:3] for row in expected]).reshape(-1, 3)
    np.testing.assert_array_equal(np.stack([found.begin_s, found.end_s, found.peak], axis=1), rows)
    assert found.truncated.tolist() == [row[3] for row in expected]
    assert np.all(found.duration_s > 0.0) or len(time_s) == 1


def test_an_excursion_has_its_duration_and_its_largest_error() -> None:
    time_s = np.arange(10) / 10.0
    error_m = np.array([0.0, 0.01, 0.02, 0.05, 0.02, 0.0, 0.0, 0.0, 0.011, 0.0])
    found = find_excursions(time_s, error_m, 0.01, merge_s=0.0)
    np.testing.assert_allclose(found.begin_s, [0.2, 0.8])
    np.testing.assert_allclose(found.duration_s, [0.3, 0.1])
    np.testing.assert_allclose(found.peak, [0.05, 0.011])
    assert not found.truncated.any()


def test_gaps_are_where_quality_is_zero() -> None:
    quality = np.array([0.0, 0.0, 1.0, 1e-3, 0.0, 1.0, 0.0])
    found = find_gaps(np.arange(7) / 4.0, quality)
    np.testing.assert_allclose(found.duration_s, [0.5, 0.25, 0.25])
    assert found.truncated.tolist() == [True, False, True]


@pytest.mark.parametrize(
    ("time_s", "samples", "merge_s"), [([0.0, 0.0], 2, 0.0), ([1.0, 0.0], 2, 0.0), ([0.0, 1.0], 3, 0.0)]
)
def test_arrays_that_do_not_fit_are_refused(time_s: list[float], samples: int, merge_s: float) -> None:
    with pytest.raises(BadInput):
        find_episodes(np.array(time_s), np.zeros(samples), np.zeros(samples, bool), merge_s=merge_s)


@pytest.mark.parametrize("merge_s", [-0.1, float("nan")])
def test_a_negative_distance_is_refused(merge_s: float) -> None:
    with pytest.raises(BadInput, match="merge_s"):
        find_episodes(np.arange(2.0), np.zeros(2), np.zeros(2, bool), merge_s=merge_s)


def test_without_a_wish_half_a_second_splits_an_excursion() -> None:
    error_m = np.zeros(200)
    error_m[[10, 58, 120, 172]] = 1.0  # 0.47 s and 0.51 s apart at 100 Hz
    assert len(find_excursions(np.arange(200) / 100.0, error_m, 0.5).peak) == 3


def test_records_are_immutable_and_their_arrays_agree() -> None:
    found = find_gaps(np.arange(3.0), np.zeros(3))
    with pytest.raises(ValueError, match="read-only"):
        found.begin_s[0] = 1.0
    with pytest.raises(ShapeError):
        replace(found, peak=np.zeros(2))
