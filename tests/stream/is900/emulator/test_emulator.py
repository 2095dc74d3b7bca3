"""The line's schedule, compared with that of the simulation and with arithmetic."""

import numpy as np
import pytest

from harness.simulate import TrackerConfig, transmit
from harness.stream.polhemus.emulator.device_state import Message
from harness.stream.polhemus.emulator.emulator import MAX_QUEUED_REPLIES, SerialLine

RECORD = bytes(38)


def sent_times(line: SerialLine, ready_s: list[float], poll_times_s: list[float]) -> list[float]:
    """Return when records that are ready at these times have left a line that is polled at other times [s]."""
    out, waiting = [], [Message(at, RECORD, "1") for at in ready_s]
    for now_s in [*poll_times_s, 1e6]:
        while waiting and waiting[0].ready_s <= now_s:
            line.add(waiting.pop(0))
        out += [due_s for due_s, _ in line.pop_sent(now_s)]
    return out


@pytest.mark.parametrize("rate_hz", [40.0, 75.0, 90.0, 180.0])
def test_records_leave_when_the_simulated_line_delivers_them(rate_hz: float, rng: np.random.Generator) -> None:
    tracker = TrackerConfig(rate_hz=rate_hz)
    ready_s = np.sort(np.arange(800) / (4 * rate_hz) + rng.uniform(0.0, 0.002, 800)) + 0.004
    sent, arrived_s = transmit(ready_s, tracker)
    line = SerialLine(tracker.baud, tracker.queue_records)
    sent_times_s = sent_times(line, ready_s.tolist(), np.sort(rng.uniform(0.0, 4.0, 300)).tolist())
    np.testing.assert_allclose(sent_times_s, arrived_s[sent], atol=1e-9)
    assert line.dropped == np.sum(~sent)
    assert (line.dropped > 0) == (4 * rate_hz * 380 > 115200)


def test_late_polling_does_not_shift_the_schedule() -> None:
    ready_s = [0.01 * k for k in range(100)]
    assert sent_times(SerialLine(115200, 12), ready_s, []) == sent_times(
        SerialLine(115200, 12), ready_s, [0.003 * k for k in range(400)]
    )


def test_an_overload_drops_records_of_all_stations_alike() -> None:
    line = SerialLine(115200, 12)
    stations: list[str] = []
    for k in range(4000):
        line.add(Message(k / 480.0, RECORD, "1234"[k % 4]))
        stations += [message.station for _, message in line.pop_sent(k / 480.0)]
    assert line.dropped > 1000
    assert min(map(stations.count, "1234")) > 0.2 * len(stations)


def test_replies_wait_between_records_and_are_not_displaced_by_them() -> None:
    line = SerialLine(9600, 2)
    for k in range(6):
        line.add(Message(0.0, bytes([k]) * 38, "1"))
    line.add(Message(0.0, b"reply\r\n"))
    sent = [message.data[:1] for _, message in line.pop_sent(10.0)]
    assert sent == [b"\x04", b"\x05", b"r"]
    assert line.dropped == 4


def test_the_queue_of_replies_is_bounded() -> None:
    line = SerialLine(9600, 12)
    for _ in range(MAX_QUEUED_REPLIES + 10):
        line.add(Message(0.0, b"reply\r\n"))
    assert line.dropped_replies == 10
    assert len(line.pop_sent(1e6)) == MAX_QUEUED_REPLIES


def test_a_halt_drops_waiting_records_but_not_started_ones() -> None:
    line = SerialLine(9600, 12)
    line.add(Message(0.0, RECORD, "1"))
    line.add(Message(0.0, RECORD, "2"))
    line.add(Message(0.01, b"", halts=True))
    line.add(Message(0.01, b"reply\r\n"))
    assert [message.station for _, message in line.pop_sent(10.0)] == ["1", ""]


def test_an_unpaced_line_sends_all_at_once_after_a_hold() -> None:
    line = SerialLine(115200, 12, paced=False)
    line.hold(0.0, 1.0)
    for k in range(20):
        line.add(Message(0.1 + k / 100, RECORD, "1"))
    assert line.pop_sent(0.99) == []
    assert line.next_s == 1.0
    assert [due_s for due_s, _ in line.pop_sent(1.0)] == [1.0] * 12
    assert line.dropped == 8
    assert line.next_s == float("inf")
