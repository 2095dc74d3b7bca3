"""Several sessions of a line as one stream of frames."""

import numpy as np

from harness.stream.codec.continuous_reader import ContinuousFrameReader
from harness.stream.frame import TrackerFrame
from tests.stream.wire import FOUR, RATE_HZ, RECORD, decode_frames, device_bytes, frames_equal, in_chunks, stamps_s

ROUNDS, CLOCK_S = 5, 1.0
"""The sessions begin a second before the first record, and so does the device's clock."""
STAMPS_S = stamps_s(ROUNDS, begin_s=CLOCK_S)


def feed_rounds(reader: ContinuousFrameReader, begin_s: float) -> list[TrackerFrame]:
    """Feed five rounds of a device whose clock is at 1 s, record by record, from this host time on."""
    data, frames = device_bytes(STAMPS_S), []
    for i, now_s in enumerate((STAMPS_S - STAMPS_S[0] + begin_s).tolist()):
        frames += reader.feed(data[i * RECORD : (i + 1) * RECORD], now_s)
    return frames


def test_one_session_equals_its_frame_reader() -> None:
    reader = ContinuousFrameReader()
    assert reader.begin_session(FOUR, 99.0) == []
    frames = feed_rounds(reader, 100.005) + reader.finish()
    assert all(
        frames_equal(a, b)
        for a, b in zip(frames, decode_frames(in_chunks(device_bytes(STAMPS_S), STAMPS_S)), strict=True)
    )
    assert reader.device_zero_s == 0.0
    expected = {"frames": 5, "sessions": 1, "records": 20, "garbage_bytes": 0, "clock_resets": 0, "out_of_range": 0}
    assert reader.counts == expected


def test_nothing_is_read_before_a_configuration_or_after_the_end() -> None:
    reader = ContinuousFrameReader()
    assert feed_rounds(reader, 1.0) == []
    reader.begin_session(FOUR, 2.0)
    reader.finish()
    assert feed_rounds(reader, 3.0) == reader.finish() == reader.expire(9.0) == []


def test_device_time_continues_by_the_hosts_clock() -> None:
    reader = ContinuousFrameReader()
    reader.begin_session(FOUR, 99.0)
    before = feed_rounds(reader, 100.0)
    reader.begin_session(FOUR, 109.0)
    after = feed_rounds(reader, 110.0)
    assert len(before) == len(after) == ROUNDS
    gap_s = after[0].measured_s[0] - before[-1].measured_s[-1]
    assert gap_s - CLOCK_S == np.float64(110.0 - before[-1].received_s)
    assert reader.device_zero_s == after[0].measured_s[0] - CLOCK_S
    assert reader.counts["sessions"] == 2
    assert reader.counts["records"] == 2 * 4 * ROUNDS


def test_a_configuration_returns_the_unfinished_frame() -> None:
    reader = ContinuousFrameReader()
    reader.begin_session(FOUR, 99.0)
    data = device_bytes(stamps_s(1, begin_s=CLOCK_S))
    assert reader.feed(data[: 2 * RECORD], 100.0) == []
    (frame,) = reader.begin_session(FOUR, 100.01)
    assert frame.position_valid.tolist() == [True, True, False, False]


def test_host_times_increase_across_sessions() -> None:
    """Host times increase even if all sessions are read at one moment."""
    reader = ContinuousFrameReader()
    frames = []
    for _ in range(3):
        frames += reader.begin_session(FOUR, 100.0)
        frames += reader.feed(device_bytes(stamps_s(2, begin_s=0.1)), 100.0)
    received_s = [frame.received_s for frame in frames]
    assert len(received_s) == 6
    assert (np.diff(received_s) > 0.0).all()
    assert (np.diff([frame.measured_s[0] for frame in frames]) > 0.0).all()


def test_only_silence_closes_an_unfinished_frame() -> None:
    """Bytes that are read late were sent in time, so the rest of the frame is accepted."""
    reader = ContinuousFrameReader()
    reader.begin_session(FOUR, 99.0)
    data = device_bytes(stamps_s(3, begin_s=CLOCK_S))
    reader.feed(data[:RECORD], 100.0)
    (late_frame,) = reader.feed(data[RECORD : 4 * RECORD], 100.0 + 5.0 / RATE_HZ)
    assert late_frame.position_valid.all()
    reader.feed(data[4 * RECORD : 5 * RECORD], 101.0)
    assert reader.silent_from_s == 101.0 + 2.0 / RATE_HZ
    assert reader.expire(101.0 + 1.4 / RATE_HZ) == []
    (expired,) = reader.expire(reader.silent_from_s)
    assert expired.position_valid.tolist() == [True, False, False, False]
