"""The serial line: which records get through, when, and the effect of an overload."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.errors import BadInput
from harness.simulate import link
from harness.simulate.link import TrackerConfig, transmit

RECORD_S = 38 * 10 / 115200


def rounds(rate_hz: float, stations: int, seconds: float, slot_s: float) -> np.ndarray:
    """Times at which the records of some stations are ready [s]."""
    return (np.arange(round(seconds * rate_hz))[:, None] / rate_hz + slot_s * np.arange(stations)).ravel()


def test_a_record_takes_ten_bits_a_byte() -> None:
    assert TrackerConfig().record_s == pytest.approx(RECORD_S)
    assert TrackerConfig(baud=9600, items=(2, 11, 21, 0)).record_s == pytest.approx(36 * 10 / 9600)


def test_a_free_line_adds_the_time_of_one_record() -> None:
    ready_s = rounds(40.0, 4, 2.0, 0.005)
    sent, arrived_s = transmit(ready_s, TrackerConfig())
    assert sent.all()
    np.testing.assert_allclose(arrived_s - ready_s, RECORD_S, atol=1e-12)


def test_records_that_are_ready_at_once_follow_each_other() -> None:
    sent, arrived_s = transmit(rounds(40.0, 6, 2.0, 0.0), TrackerConfig())
    assert sent.all()
    np.testing.assert_allclose(arrived_s.reshape(-1, 6)[:, 0], np.arange(80) / 40.0 + RECORD_S, atol=1e-12)
    np.testing.assert_allclose(np.diff(arrived_s.reshape(-1, 6), axis=1), RECORD_S, atol=1e-12)


@pytest.mark.parametrize(("rate_hz", "stations"), [(75.0, 4), (50.0, 6)])
def test_what_the_line_can_carry_gets_through(rate_hz: float, stations: int) -> None:
    """38-byte records: 303 a second."""
    tracker = TrackerConfig(rate_hz=rate_hz)
    ready_s = rounds(rate_hz, stations, 60.0, tracker.station_slot_s(stations))
    sent, arrived_s = transmit(ready_s, tracker)
    assert sent.all()
    assert np.max(arrived_s - ready_s) < 1.2 * RECORD_S


@pytest.mark.parametrize("rate_hz", [60.0, 120.0])
def test_an_overload_drops_the_oldest_and_keeps_the_line_busy(rate_hz: float) -> None:
    tracker = TrackerConfig(rate_hz=rate_hz, queue_records=12)
    ready_s = rounds(rate_hz, 6, 30.0, tracker.station_slot_s(6))
    sent, arrived_s = transmit(ready_s, tracker)
    assert sent.mean() == pytest.approx(1.0 / (RECORD_S * 6 * rate_hz), rel=0.01)
    late_s = (arrived_s - ready_s)[sent]
    assert late_s.max() <= 13.0 * RECORD_S + 1e-9, "no more than the queue and the record on the line"
    np.testing.assert_allclose(np.diff(arrived_s[sent])[100:], RECORD_S, atol=1e-9)
    assert np.isnan(arrived_s[~sent]).all()
    assert sent[-12:].all(), "the newest are never dropped"


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(0.0, 0.02), min_size=1, max_size=60), st.integers(1, 8))
def test_the_quick_way_and_the_simulation_of_the_queue_agree(gaps_s: list[float], queue: int) -> None:
    """Where nothing is dropped; and what gets through keeps its order and never shares the line."""
    ready_s, tracker = np.cumsum(gaps_s), TrackerConfig(queue_records=queue)
    sent, arrived_s = transmit(ready_s, tracker)
    slow_sent, slow_s = link._transmit_overloaded(ready_s, tracker)
    np.testing.assert_array_equal(sent, slow_sent)
    np.testing.assert_allclose(arrived_s, slow_s, atol=1e-12)
    assert np.all(np.diff(arrived_s[sent]) >= RECORD_S - 1e-12)
    assert np.all(arrived_s[sent] >= ready_s[sent] + RECORD_S - 1e-12)


def test_stations_are_sampled_as_fast_as_the_line_takes_them() -> None:
    assert TrackerConfig().station_slot_s(6) == pytest.approx(RECORD_S)
    assert TrackerConfig(rate_hz=120.0).station_slot_s(6) == pytest.approx(1.0 / 720.0)
    assert TrackerConfig(slot_s=0.0).station_slot_s(6) == 0.0


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(BadInput, match="period of 25 ms"):
        TrackerConfig(slot_s=0.005).station_slot_s(6)
    with pytest.raises(BadInput, match="item 21"):
        TrackerConfig(items=(40, 2, 11, 1))
    for wrong in ({"rate_hz": 0.0}, {"baud": 0}, {"latency_s": -0.001}, {"queue_records": 0}):
        with pytest.raises(BadInput):
            TrackerConfig(**wrong)
