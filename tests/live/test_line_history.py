"""Summaries of the seconds of a session, for the charts of the live page."""

import numpy as np
import pytest

from harness.live.line_history import LineHistory


def run(seconds: float, valid: tuple[float, float] = (1.0, 1.0)) -> LineHistory:
    """A session of 40 frames a second with a latency of 1 to 40 ms."""
    history = LineHistory(2, 0.0)
    for number in range(round(40 * seconds)):
        at_s = (number + 1) / 40
        history.add(at_s, 1e-3 * (1 + number % 40), np.array([1.0, 0.5]), np.array(valid))
        history.update(at_s)
    return history


def test_a_second_has_its_rate_latency_loss_and_quality() -> None:
    (second,) = run(1.0).content(1.0)["seconds"]
    assert second["rate_hz"] == 40.0
    assert second["p50_ms"] == pytest.approx(20.5)
    assert second["p99_ms"] == pytest.approx(39.61)
    assert second["loss"] == 0.0
    assert second["quality"] == [1.0, 0.5]


def test_readings_that_are_not_valid_are_lost() -> None:
    content = run(2.0, (1.0, 0.0)).content(2.0)
    assert content["seconds"][-1]["loss"] == 0.5
    assert content["seconds"][-1]["quality"] == [1.0, 0.0]
    assert content["lost"] == [False, True]
    assert content["silent_s"] == 0.0


def test_a_station_is_lost_after_half_a_second() -> None:
    history = run(1.0)
    assert history.content(1.49)["lost"] == [False, False]
    assert history.content(1.51)["lost"] == [True, True]
    assert history.content(1.9)["silent_s"] == 0.9


def test_a_silent_second_has_no_latency_and_all_is_lost() -> None:
    history = run(1.0)
    history.update(1.9)
    assert len(history.content(1.9)["seconds"]) == 1
    history.update(2.0)
    silent = history.content(2.0)["seconds"][-1]
    assert silent == {"rate_hz": 0.0, "p50_ms": None, "p99_ms": None, "loss": 1.0, "quality": [0.0, 0.0]}


def test_the_last_minute_is_kept() -> None:
    assert len(run(70.0).content(70.0)["seconds"]) == 60
