"""The time of a frame is the device's, whenever the host received it."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.reconstruct.solver.status_monitor import DeviceTime
from harness.stream import TrackerFrame

PERIOD_S, SLOT_S = 0.025, 0.0033


def frame(index: int, came_s: float, missing: tuple[int, ...] = (), suspect: tuple[int, ...] = ()) -> TrackerFrame:
    stamps_s: Floats = 7.0 + index * PERIOD_S + SLOT_S * np.arange(4, dtype=float)
    stamps_s[list(missing)] = np.nan
    doubted = np.zeros(4, bool)
    doubted[list(suspect)] = True
    there = ~np.isnan(stamps_s)
    return TrackerFrame(
        came_s, stamps_s, np.zeros((4, 3)), np.tile([1.0, 0, 0, 0], (4, 1)), there, there, there * 1.0, doubted
    )


def times_s(frames: list[TrackerFrame]) -> list[float]:
    clock = DeviceTime()
    return [clock.frame_time_s(f) for f in frames]


def test_a_host_that_is_late_changes_nothing(rng: np.random.Generator) -> None:
    late_s = np.sort(rng.uniform(0.0, 2.0, 40))
    found = times_s([frame(i, 500.0 + late_s[i]) for i in range(40)])
    assert found == times_s([frame(i, i * PERIOD_S) for i in range(40)]), "bit by bit"
    np.testing.assert_allclose(found, PERIOD_S * np.arange(40), atol=1e-12)


def test_any_station_will_do() -> None:
    silent = [(), (0,), (0, 1, 2), (3,), (0, 1), (1, 2, 3), ()]
    found = times_s([frame(i, 3.0 + i, missing) for i, missing in enumerate(silent)])
    np.testing.assert_allclose(found, PERIOD_S * np.arange(len(silent)), atol=1e-12)


def test_a_suspect_stamp_is_not_believed() -> None:
    frames = [frame(i, i * PERIOD_S) for i in range(5)]
    wrong = frame(2, 2 * PERIOD_S, suspect=(0,))
    stamps_s = wrong.measured_s.copy()
    stamps_s[0] += 100.0
    frames[2] = replace(wrong, measured_s=stamps_s)
    np.testing.assert_allclose(times_s(frames), PERIOD_S * np.arange(5), atol=1e-12)


def test_without_stamps_the_host_is_asked() -> None:
    came_s = [10.0, 10.02, 10.07, 10.1]
    found = times_s([frame(i, t, missing=(0, 1, 2, 3)) for i, t in enumerate(came_s)])
    np.testing.assert_allclose(found, np.array(came_s) - 10.0)


def test_time_never_steps_back() -> None:
    found = times_s([frame(i, 1.0 + k) for k, i in enumerate([0, 1, 2, 1, 0, 3])])
    assert found == sorted(found)
    assert found[-1] == pytest.approx(3 * PERIOD_S + found[4])


def test_every_part_of_a_session_may_ask_for_the_same_frame() -> None:
    clock, frames = DeviceTime(), [frame(i, 9.0 + i, missing) for i, missing in enumerate([(), (0, 1, 2, 3), ()])]
    asked = [(clock.frame_time_s(f), clock.frame_time_s(f)) for f in frames]
    assert [first for first, _ in asked] == [again for _, again in asked] == times_s(frames)


def test_stamps_count_again_once_their_stations_are_back() -> None:
    """Without stamps the host's clock continues from the last frame that had one."""
    missing = [(), (), (0, 1, 2, 3), (0, 1, 2, 3), (), ()]
    frames = [frame(i, 50.0 + 0.03 * i, without) for i, without in enumerate(missing)]
    expected_s = [0.0, PERIOD_S, PERIOD_S + 0.03, PERIOD_S + 0.06, 4 * PERIOD_S, 5 * PERIOD_S]
    np.testing.assert_allclose(times_s(frames), expected_s, atol=1e-12)


def test_a_frame_of_other_stations_is_timed_by_the_host() -> None:
    four = frame(0, 1.0)
    fields = {name: getattr(four, name)[:2] for name in TrackerFrame.__slots__ if name != "received_s"}
    two = replace(four, received_s=1.5, **fields)
    assert times_s([four, two]) == [0.0, 0.5]


def test_a_station_that_takes_over_counts_from_the_time_of_its_first_frame() -> None:
    """That frame is timed by the host: no station of it has an earlier stamp."""
    missing = [(1, 2, 3), (0, 2, 3), (0, 2, 3)]
    found = times_s([frame(i, 20.0 + 0.03 * i, without) for i, without in enumerate(missing)])
    np.testing.assert_allclose(found, [0.0, 0.03, 0.03 + PERIOD_S], atol=1e-12)
