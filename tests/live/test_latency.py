"""Latencies of many frames: quantiles to 0.01 ms, exact maxima, and counts of missed deadlines."""

import threading

import numpy as np
import pytest

from harness.live.capture import DroppingQueue
from harness.live.latency import DurationHistogram, StageLatencies


def test_quantiles_are_those_of_the_values(rng: np.random.Generator) -> None:
    values_s, durations = rng.exponential(0.004, size=5000), DurationHistogram()
    for value_s in values_s.tolist():
        durations.add(value_s)
    for share in (0.5, 0.9, 0.99):
        exact_s = np.quantile(values_s, share, method="inverted_cdf")
        assert durations.quantile_s(share) == pytest.approx(exact_s, abs=1e-5)
    assert durations.longest_s == values_s.max()


def test_few_none_and_long_ones() -> None:
    durations = DurationHistogram()
    assert np.isnan(durations.quantile_s(0.5))
    assert durations.as_dict() == {"p50_ms": None, "p99_ms": None, "max_ms": None}
    durations.add(0.00301)
    assert durations.quantile_s(0.01) == durations.quantile_s(1.0) == pytest.approx(0.00301, abs=1e-5)
    durations.add(7.5)
    assert durations.quantile_s(0.99) == 7.5
    durations.add(-1e-9)  # clocks of two threads
    assert durations.count == 3


def test_stages_add_up_and_only_the_late_are_late() -> None:
    stages = StageLatencies(deadline_s=0.010)
    stages.add(1.000, 1.001, 1.004, 1.006)
    stages.add(2.000, 2.003, 2.0101, 2.011)
    assert stages.missed == 1
    maxima_ms = {name: durations.as_dict()["max_ms"] for name, durations in stages.by_name().items()}
    wanted_ms = {"last byte to taken": 3.0, "taken to pose": 7.1, "pose to outputs": 2.0, "last byte to pose": 10.1}
    assert maxima_ms == pytest.approx(wanted_ms, abs=1e-6)


def test_the_oldest_gives_way_and_is_counted() -> None:
    queue: DroppingQueue[int] = DroppingQueue(3)
    for number in range(10):
        queue.put(number)
    queue.end()
    assert [queue.take() for _ in range(4)] == [7, 8, 9, None]
    assert queue.dropped == 7
    assert queue.take() is None  # for ever


def test_between_threads_nothing_is_lost_but_what_is_counted() -> None:
    queue: DroppingQueue[int] = DroppingQueue(5)
    taken: list[int] = []

    def take() -> None:
        while (item := queue.take()) is not None:
            taken.append(item)

    thread = threading.Thread(target=take)
    thread.start()
    for number in range(20_000):
        queue.put(number)
        assert len(queue) <= 5
    queue.end()
    thread.join()
    assert taken == sorted(set(taken))
    assert taken[-1] == 19_999
    assert len(taken) + queue.dropped == 20_000
