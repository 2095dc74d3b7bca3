"""Errors of readings against the ideal ones, and the health of streams."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.experiment.observed_take import ObservedTake, simulated_take
from harness.experiment.playback import prepare_playback
from harness.score.loops import LoopFrames
from harness.stream.frame import TrackerFrame
from harness.study.trust.reading_errors import HealthCounts, count_health, reading_errors


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
