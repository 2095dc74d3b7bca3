"""Sessions of a line as one stream."""

import numpy as np

from harness.stream.codec.continuous_reader import ContinuousFrameReader
from harness.stream.frame import TrackerFrame
from tests.stream.wire import FOUR, RATE_HZ, RECORD, frames_of, received, same, sent, stamps_s

ROUNDS = 5


def fed(sessions: ContinuousFrameReader, begin_s: float) -> list[TrackerFrame]:
    """Five rounds of a device whose clock is at 12 s, received record by record from this moment on."""
    stamp_s = stamps_s(ROUNDS)
    data, frames = sent(stamp_s), []
    for i, now_s in enumerate((stamp_s - stamp_s[0] + begin_s).tolist()):
        frames += sessions.feed(data[i * RECORD : (i + 1) * RECORD], now_s)
    return frames


def test_one_session_is_what_its_reader_says() -> None:
    sessions = ContinuousFrameReader()
    assert sessions.begin_session(FOUR, 99.0) == []
    frames = fed(sessions, 100.005) + sessions.finish()
    assert all(same(a, b) for a, b in zip(frames, frames_of(received(sent(stamps_s(5)), stamps_s(5))), strict=True))
    assert sessions.device_zero_s == 0.0
    expected = {"frames": 5, "sessions": 1, "records": 20, "garbage_bytes": 0, "clock_resets": 0}
    assert sessions.counts == expected


def test_nothing_is_read_before_a_set_up_or_after_the_end() -> None:
    sessions = ContinuousFrameReader()
    assert fed(sessions, 1.0) == []
    sessions.begin_session(FOUR, 2.0)
    sessions.finish()
    assert fed(sessions, 3.0) == sessions.finish() == sessions.expire(9.0) == []


def test_device_time_goes_on_by_the_hosts_clock() -> None:
    sessions = ContinuousFrameReader()
    sessions.begin_session(FOUR, 99.0)
    before = fed(sessions, 100.0)
    sessions.begin_session(FOUR, 109.0)
    after = fed(sessions, 110.0)
    assert len(before) == len(after) == ROUNDS
    gap_s = after[0].measured_s[0] - before[-1].measured_s[-1]
    assert gap_s - 12.0 == np.float64(110.0 - before[-1].received_s)
    assert sessions.device_zero_s == after[0].measured_s[0] - 12.0
    assert sessions.counts["sessions"] == 2
    assert sessions.counts["records"] == 2 * 4 * ROUNDS


def test_a_set_up_gives_what_was_unfinished() -> None:
    sessions = ContinuousFrameReader()
    sessions.begin_session(FOUR, 99.0)
    data = sent(stamps_s(1))
    assert sessions.feed(data[: 2 * RECORD], 100.0) == []
    (frame,) = sessions.begin_session(FOUR, 100.01)
    assert frame.position_valid.tolist() == [True, True, False, False]


def test_host_times_rise_from_one_session_to_the_next() -> None:
    """Even if both are read at one moment."""
    sessions = ContinuousFrameReader()
    frames = []
    for _ in range(3):
        frames += sessions.begin_session(FOUR, 100.0)
        frames += sessions.feed(sent(stamps_s(2)), 100.0)
    received_s = [frame.received_s for frame in frames]
    assert len(received_s) == 6
    assert (np.diff(received_s) > 0.0).all()
    assert (np.diff([frame.measured_s[0] for frame in frames]) > 0.0).all()


def test_only_who_sees_silence_gives_up_a_frame() -> None:
    """Bytes that are read late were sent in time: the rest of a frame is still welcome."""
    sessions = ContinuousFrameReader()
    sessions.begin_session(FOUR, 99.0)
    data = sent(stamps_s(3))
    sessions.feed(data[:RECORD], 100.0)
    (late,) = sessions.feed(data[RECORD : 4 * RECORD], 100.0 + 5.0 / RATE_HZ)
    assert late.position_valid.all()
    sessions.feed(data[4 * RECORD : 5 * RECORD], 101.0)
    assert sessions.silent_from_s == 101.0 + 2.0 / RATE_HZ
    assert sessions.expire(101.0 + 1.4 / RATE_HZ) == []
    (given_up,) = sessions.expire(sessions.silent_from_s)
    assert given_up.position_valid.tolist() == [True, False, False, False]
