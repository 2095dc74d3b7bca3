"""Statistics of the last minute of a live session."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core.estimate import Status
from harness.live.live_statistics import SECONDS_KEPT, LiveStatistics
from harness.stream import TrackerFrame
from tests.live.posing import frame


class Clock:
    """A clock that the test sets."""

    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def add(statistics: LiveStatistics, valid: list[bool], status: Status = Status.SOLVED, latency_s: float = 1e-3) -> None:
    seen, turn = np.array(valid), np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    where, quality = np.where(seen[:, None], np.zeros((2, 3)), np.nan), np.where(seen, 0.8, 0.3)
    frame = TrackerFrame(0.0, np.zeros(2), where, turn, seen, seen, quality, np.zeros(2, dtype=bool))
    statistics.add(frame, status, latency_s)


def test_a_second_has_its_rate_latency_loss_and_quality() -> None:
    clock = Clock()
    statistics = LiveStatistics(("head", "hand"), clock)
    for k in range(50):
        clock.now_s += 0.02
        status = Status.LOST if k < 3 else Status.HELD if k < 5 else Status.SOLVED
        add(statistics, [True, k % 2 == 0], status, 1e-3 * (k + 1))
        assert statistics.update(dropped=7) == []
    clock.now_s += 0.021
    statistics.update(dropped=7)
    (second,) = statistics.summaries()
    np.testing.assert_allclose(second.rate_hz, 50.0, rtol=0.03)
    assert (second.held, second.lost, second.dropped) == (2, 3, 7)
    latency_ms = np.array([second.latency_p50_ms, second.latency_p99_ms], dtype=float)
    np.testing.assert_allclose(latency_ms, [25.5, 49.5], atol=0.6)
    np.testing.assert_allclose(second.quality, [0.8, 0.4], atol=0.01)
    np.testing.assert_allclose(second.loss, [0.0, 0.5], atol=0.02)
    assert "held 2, lost 3, dropped 7, head 80% hand 40%" in statistics.status_line()
    shown = statistics.page_content()
    assert (shown["session"], shown["why"], shown["stations"]) == ("OK", "", ["OK", "HELD"])
    (chart,) = shown["seconds"]
    assert chart == {"rate_hz": 49.95, "p50_ms": 25.5, "p99_ms": 49.51, "loss": 0.25, "quality": [0.8, 0.4]}


def test_a_lost_station_is_reported_once_and_so_is_its_return() -> None:
    clock = Clock()
    statistics = LiveStatistics(("head", "hand"), clock)
    said, words = list[str](), list[str]()
    for k in range(300):
        clock.now_s += 1 / 64
        add(statistics, [True, not 64 <= k < 192])
        said += [f"{k}: {text}" for text in statistics.update()]
        words.append(statistics.page_content()["stations"][1])
    assert words == ["OK"] * 64 + ["HELD"] * 32 + ["LOST"] * 96 + ["OK"] * 108
    assert said == ["96: station hand lost at 1.0 s", "192: station hand back at 3.0 s"]


def test_silence_shows_and_is_not_the_fault_of_a_station() -> None:
    clock = Clock()
    statistics = LiveStatistics(("head", "hand"), clock)
    clock.now_s += 9.0
    assert statistics.update() == []
    assert statistics.status_line() == ""  # frames may serve a calibration first
    for _ in range(100):
        clock.now_s += 0.01
        add(statistics, [True, True])
        statistics.update()
    clock.now_s += 0.7
    assert statistics.update() == []
    assert statistics.status_line() == "no data for 0.7 s"
    shown = statistics.page_content()
    assert (shown["session"], shown["why"]) == ("LOST", "no data for 0.7 s")
    assert shown["stations"] == ["LOST", "LOST"]


@pytest.mark.parametrize(
    ("status", "word", "why"),
    [
        (Status.SOLVED, "OK", "no reading of hand"),
        (Status.HELD, "HELD", "too few readings: the pose is extrapolated; no reading of hand"),
        (Status.LOST, "LOST", "fewer than half of the stations have readings; no reading of hand"),
    ],
)
def test_a_session_is_what_its_newest_pose_is(status: Status, word: str, why: str) -> None:
    clock = Clock()
    statistics = LiveStatistics(("head", "hand"), clock)
    shown = statistics.page_content()
    assert (shown["session"], shown["why"]) == ("LOST", "no pose yet")
    for _ in range(100):
        clock.now_s += 0.01
        add(statistics, [True, False], status)
        statistics.update()
    shown = statistics.page_content()
    assert (shown["session"], shown["why"], shown["stations"]) == (word, why, ["OK", "LOST"])


def test_a_station_is_whole_with_all_that_it_delivers() -> None:
    """A station that never has a position is OK without one; one that had a position and loses it is held."""
    clock = Clock()
    statistics = LiveStatistics(("head", "hand"), clock)
    whole = frame(0.0)
    turned = replace(whole, position_valid=np.array([True, False]))
    statistics.add(turned, Status.SOLVED, 0.001)
    assert statistics.page_content()["stations"] == ["OK", "OK"]
    statistics.add(whole, Status.SOLVED, 0.001)
    statistics.add(turned, Status.SOLVED, 0.001)
    assert statistics.page_content()["stations"] == ["OK", "HELD"]


def test_a_minute_is_kept() -> None:
    clock = Clock()
    statistics = LiveStatistics(("head", "hand"), clock)
    add(statistics, [True, True])
    for _ in range(SECONDS_KEPT + 5):
        clock.now_s += 1.0
        statistics.update()
    kept = statistics.summaries()
    assert (len(kept), kept[0].end_s, kept[-1].end_s) == (SECONDS_KEPT, 6.0, SECONDS_KEPT + 5.0)
    assert kept[0].latency_p50_ms is None
    assert kept[0].loss == (1.0, 1.0)
    silent = {"rate_hz": 0.0, "p50_ms": None, "p99_ms": None, "loss": 1.0, "quality": [0.0, 0.0]}
    assert statistics.page_content()["seconds"][-1] == silent
