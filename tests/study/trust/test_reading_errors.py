"""Errors of readings against the ideal ones, and the health of streams."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.seeds import generator
from harness.errors import BadInput
from harness.experiment import ObservedTake, prepare_playback, simulated_take
from harness.score import LoopFrames
from harness.stream import TrackerFrame
from harness.study.trust.reading_errors import (
    CORRELATION_TIMES,
    FEATURES,
    MOST_ROWS,
    HealthCounts,
    compare_errors,
    correlation_samples,
    count_health,
    label_blocks,
    reading_errors,
)
from harness.study.trust.trust_study import _compare_readings


@pytest.fixture(scope="module")
def clean() -> ObservedTake:
    playback = prepare_playback("demo", clip="boxing_p1_01", stations=2, noise="clean")
    return simulated_take(playback.clip_evaluation, "pos+ori")


def with_frames(take: ObservedTake, frames: Sequence[TrackerFrame], rows: Ints) -> ObservedTake:
    """The take with other frames, of which those in these rows have the truth of their row."""
    return replace(take, frames=tuple(frames), loops=(LoopFrames(rows, rows),))


def with_errors(frame: TrackerFrame, offset_m: Floats, turn_rad: Floats) -> TrackerFrame:
    turned = rotations.multiply(rotations.exp(turn_rad), frame.tracker_from_station)
    return replace(frame, position_m=frame.position_m + offset_m, tracker_from_station=turned)


def test_a_clean_simulation_has_hardly_any_errors(clean: ObservedTake) -> None:
    errors = reading_errors(clean)
    assert np.abs(errors["position error"][0]).max() < 2e-4  # rounding on the line
    assert np.abs(errors["orientation error"][0]).max() < 2e-4
    assert errors["position error"][0].shape == (len(clean.sample_s), 2, 3)


def test_planted_errors_are_found_minus_their_median(clean: ObservedTake) -> None:
    offset_m, turn_rad = np.array([0.01, 0.0, -0.02]), np.array([0.0, 0.05, 0.01])
    frames = [
        with_errors(frame, offset_m + (k % 2) * 0.004, turn_rad) if k >= 10 else frame
        for k, frame in enumerate(clean.frames)
    ]
    errors = reading_errors(with_frames(clean, frames, np.arange(10, len(frames))))
    position = errors["position error"][0]
    assert np.abs(np.diff(position, axis=0)).max() == pytest.approx(0.004, abs=3e-4)
    assert np.abs(position).max() < 0.004 + 3e-4
    assert np.abs(errors["orientation error"][0]).max() < 3e-4


def test_the_error_of_orientation_is_in_the_trackers_axes(clean: ObservedTake) -> None:
    count = len(clean.frames) // 2
    turn_rad = np.array([0.0, 0.0, 0.1])
    frames = [with_errors(f, np.zeros(3), turn_rad) if k > count else f for k, f in enumerate(clean.frames)]
    found = reading_errors(with_frames(clean, frames, np.arange(len(frames))))["orientation error"][0]
    steps = found[-1] - found[0]
    assert steps == pytest.approx(np.tile(turn_rad, (2, 1)), abs=1e-3)


def test_lost_suspect_and_missing_readings_are_gaps(clean: ObservedTake) -> None:
    frames = list(clean.frames)
    lost = replace(frames[3], position_m=np.full((2, 3), np.nan))
    suspect = replace(frames[4], suspect=np.array([True, False]))
    frames[3:5] = [lost, suspect]
    rows = np.delete(np.arange(20), 7)
    errors = reading_errors(with_frames(clean, frames, rows))
    missing = np.asarray(np.isnan(errors["position error"][0]).any(axis=2))
    assert np.flatnonzero(missing[:, 0]).tolist() == [3, 4, 7]
    assert np.flatnonzero(missing[:, 1]).tolist() == [3, 7]
    assert np.flatnonzero(np.isnan(errors["orientation error"][0][:, 1, 0])).tolist() == [7]


def test_a_silent_station_has_no_errors(clean: ObservedTake) -> None:
    frames = [replace(f, position_m=f.position_m * [[1.0], [np.nan]]) for f in clean.frames[:20]]
    rows = np.arange(20)
    found = reading_errors(with_frames(clean, frames, rows))["position error"]
    assert np.isfinite(found[0][:, 0]).all()
    assert np.isnan(found[0][:, 1]).all()


def test_health_counts_gaps_losses_and_frames_that_never_came(clean: ObservedTake) -> None:
    frames = list(clean.frames[:40])
    for k in (5, 6, 20):
        valid = np.array([False, True])
        frames[k] = replace(frames[k], position_valid=valid, quality=np.array([0.0, 0.8]))
    frames[30] = replace(frames[30], suspect=np.array([False, True]))
    rows = np.delete(np.arange(40), 10)
    left, right = (counts.as_health() for counts in count_health(with_frames(clean, frames, rows)))
    assert left.lost_share == pytest.approx(4 / 40)
    assert right.lost_share == pytest.approx(1 / 40)
    assert left.gaps_per_min == pytest.approx(3 * 60.0, rel=1e-3)  # in one second
    assert left.gap_s == pytest.approx(4 / 3 / 40.0, rel=0.03)
    assert right.suspect_share == pytest.approx(1 / 40)
    assert left.quality == pytest.approx(1.0)
    assert right.quality == pytest.approx((36 + 3 * 0.8) / 39)
    assert left.rate_hz == pytest.approx(40.0, rel=0.03)


def test_counts_add_up_and_an_empty_stream_is_lost() -> None:
    counts = HealthCounts(40, 4, 1, 2, 1.0, 30.0).add(HealthCounts(40, 0, 0, 0, 1.0, 40.0))
    assert counts == HealthCounts(80, 4, 1, 2, 2.0, 70.0)
    empty = HealthCounts().as_health()
    assert (empty.lost_share, empty.rate_hz, empty.gap_s, empty.quality) == (1.0, 0.0, None, 0.0)


LEVEL = 0.05


def autoregressive(rng: np.random.Generator, count: int, phi: float, axes: int = 2) -> Floats:
    """A stationary first-order series of unit variance."""
    noise = rng.normal(size=(count, axes)) * np.sqrt(1.0 - phi**2)
    series = np.empty((count, axes))
    series[0] = rng.normal(size=axes)
    for k in range(1, count):
        series[k] = phi * series[k - 1] + noise[k]
    return series


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.9])
def test_the_correlation_time_of_a_first_order_series_is_known(phi: float) -> None:
    rng = generator(1, "correlation", str(phi))
    series = [autoregressive(rng, 4000, phi) for _ in range(6)]
    assert correlation_samples(series) == pytest.approx((1.0 + phi) / (1.0 - phi), rel=0.15)


def test_gaps_leave_the_correlation_time_alone() -> None:
    rng = generator(2, "gaps")
    series = [autoregressive(rng, 4000, 0.8) for _ in range(4)]
    whole = correlation_samples(series)
    for each in series:
        each[rng.random(len(each)) < 0.3] = np.nan
    assert correlation_samples(series) == pytest.approx(whole, rel=0.15)


def test_a_slow_part_of_small_variance_counts() -> None:
    rng = generator(3, "slow")
    white = [rng.normal(size=(4000, 1)) for _ in range(6)]
    slow = [np.sqrt(0.15) * autoregressive(rng, 4000, 0.98, 1) for _ in range(6)]
    expected = 1.0 + 2.0 * 0.15 / 1.15 * 0.98 / 0.02
    assert correlation_samples([a + b for a, b in zip(white, slow, strict=True)]) == pytest.approx(expected, rel=0.35)


@pytest.mark.parametrize("series", [[], [np.zeros((1, 2))], [np.ones((50, 2))], [np.full((50, 2), np.nan)]])
def test_series_without_variance_are_refused(series: list[Floats]) -> None:
    with pytest.raises(BadInput, match="variance"):
        correlation_samples(series)


def test_blocks_are_equal_and_never_cross_series() -> None:
    labels = label_blocks([np.zeros((25, 1)), np.zeros((4, 1)), np.zeros((10, 1))], 10)
    assert [np.bincount(each).tolist() for each in (labels[0], labels[1] - 2, labels[2] - 3)] == [[13, 12], [4], [10]]
    with pytest.raises(BadInput):
        label_blocks([np.zeros((5, 1))], 0)


def test_the_distance_of_two_points_is_twice_their_distance() -> None:
    found = compare_errors([np.zeros((20, 1))], [np.full((20, 1), 3.0)], 5)
    assert found.distance == pytest.approx(6.0)
    assert found.split_half == pytest.approx(0.0)
    assert found.blocks == (4, 4)


def test_the_distance_of_shifted_normal_samples_is_known_and_unbiased() -> None:
    """For N(0, 1) and N(d, 1): 2 E|Z sqrt(2) + d| - 4 / sqrt(pi), and 0 where d is 0."""
    rng = generator(4, "normal")
    shift = 1.0
    folded = 2.0 / np.sqrt(np.pi) * np.exp(-(shift**2) / 4.0) + shift * (2.0 * _normal(shift / np.sqrt(2.0)) - 1.0)
    far, near = [], []
    for k in range(60):
        a, b = rng.normal(size=(2, 200, 1))
        far.append(compare_errors([a], [b + shift], 2, seed=k, permutations=9).distance)
        near.append(compare_errors([a], [b], 2, seed=k, permutations=9).distance)
    assert np.mean(far) == pytest.approx(2.0 * folded - 4.0 / np.sqrt(np.pi), rel=0.05)
    assert abs(np.mean(near)) < 3.0 * np.std(near) / np.sqrt(len(near))


def _normal(x: float) -> float:
    from math import erf

    return 0.5 * (1.0 + erf(x / np.sqrt(2.0)))


def test_rows_with_a_gap_are_left_out() -> None:
    rng = generator(5, "missing")
    a, b = rng.normal(size=(2, 100, 3))
    holes = a.copy()
    holes[::3, 1] = np.nan
    kept = [holes[np.isfinite(holes).all(axis=1)]]
    assert compare_errors([holes], [b], 100 // 8).distance == pytest.approx(
        compare_errors(kept, [b], 100 // 8).distance, abs=0.05
    )


def test_too_few_blocks_are_refused() -> None:
    with pytest.raises(BadInput, match="3 blocks"):
        compare_errors([np.zeros((30, 1))], [np.zeros((40, 1))], 10)


def test_many_rows_are_thinned_evenly() -> None:
    rng = generator(6, "thinned")
    a, b = rng.normal(size=(2, 4 * MOST_ROWS, 1))
    a[: 2 * MOST_ROWS] += 2.0  # only half of it, so that the first rows alone would tell another story
    found = compare_errors([a], [b], 200, permutations=99)
    assert found.p == pytest.approx(0.01)
    assert found.blocks == (30, 30)
    assert 0.2 < found.distance < 0.8


@pytest.mark.slow
def test_permuting_blocks_keeps_the_level_on_correlated_noise_and_permuting_samples_does_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("harness.study.trust.reading_errors.MOST_ROWS", 500)
    rng = generator(7, "level")
    studies, blocks, samples, louder = 100, 0, 0, 0
    for k in range(studies):
        a, b = ([autoregressive(rng, 150, 0.7) for _ in range(5)] for _ in range(2))
        length = int(np.ceil(CORRELATION_TIMES * max(correlation_samples(a), correlation_samples(b))))
        blocks += compare_errors(a, b, length, seed=k, permutations=199).p <= LEVEL
        samples += compare_errors(a, b, 1, seed=k, permutations=199).p <= LEVEL
        louder += compare_errors(a, [2.0 * each for each in b], length, seed=k, permutations=199).p <= LEVEL
    assert blocks <= 12  # 5 % of 100, and three standard deviations
    assert samples >= 40
    assert louder >= 90


def test_a_station_with_other_errors_is_told_from_one_with_the_same() -> None:
    """Of two stations the second errs twice as much on the simulated side; Holm's correction is over all four rows."""
    rng = generator(1, "errors of readings")

    def arm() -> Any:
        sides = [
            {name: [rng.normal(size=(300, 2, 3)) * [[1.0], [more]] for _ in "ab"] for name in FEATURES}
            for more in (1.0, 2.0)
        ]
        return SimpleNamespace(stations=("head", "chest"), rate_hz=40.0, readings=sides)

    rows = _compare_readings([arm()])
    assert [(row.station, row.feature, row.unit) for row in rows] == [
        (station, name, unit) for station in ("head", "chest") for name, unit in FEATURES.items()
    ]
    assert [row.p_holm is not None and row.p_holm < 0.05 for row in rows] == [False, False, True, True]
    few: Any = SimpleNamespace(
        stations=("head",), rate_hz=40.0, readings=[{name: [np.zeros((4, 1, 3))] for name in FEATURES}] * 2
    )
    assert all(row.p is None and row.p_holm is None for row in _compare_readings([few]))
