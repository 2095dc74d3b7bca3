"""The complete path from bytes to frames."""

import re
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.stream.frame import TrackerFrame
from harness.stream.polhemus.codec.items import STANDARD_LIST
from harness.stream.polhemus.codec.reader import (
    LEAST_RATE_HZ,
    MOST_RATE_HZ,
    ByteCapture,
    ContinuousFrameReader,
    FrameReader,
    WireFormat,
)
from harness.stream.polhemus.codec.records import RecordFormat, RecordValues, encode_records, to_bytes
from harness.stream.polhemus.codec.replies import TrackingStatus
from tests.stream.wire import (
    FOUR,
    RATE_HZ,
    RECORD,
    decode_frames,
    device_bytes,
    frames_equal,
    in_chunks,
    stamps_s,
    station_columns,
)

ROUNDS = 12


@pytest.mark.parametrize(
    ("stations", "rate_hz", "characters", "complaint"),
    [
        ((), 40.0, b"", "0 stations are not possible"),
        (tuple("abcdefghijklm"), 40.0, b"", "13 stations are not possible"),
        (("a",), 0.9 * LEAST_RATE_HZ, b"", "records per second"),
        (("a",), 1.1 * MOST_RATE_HZ, b"", "records per second"),
        (("a",), np.nan, b"", "nan records per second"),
        (("a", "a"), 40.0, b"", "a name occurs twice"),
        (("a\x1b[2J",), 40.0, b"", "cannot be used. Give it a text of 1 to 100 characters in one line"),
        (("",), 40.0, b"", "cannot be used"),
        (("a" * 101,), 40.0, b"", "cannot be used"),
        (("a", "b"), 40.0, b"21", "do not fit 2 names"),
        (("a",), 40.0, b"D", "do not fit 1 names"),
        (("a",), 40.0, b"12", "do not fit 1 names"),
        (("a", "b"), 40.0, b"11", "ascending"),
        (("a", "b"), 40.0, b"1 ", "ascending"),
    ],
)
def test_the_limits_of_a_wire_format(
    stations: tuple[str, ...], rate_hz: float, characters: bytes, complaint: str
) -> None:
    with pytest.raises(BadInput, match=re.escape(complaint)):
        WireFormat(stations, rate_hz, characters=characters)
    for allowed_hz in (LEAST_RATE_HZ, MOST_RATE_HZ):
        WireFormat(tuple("abcdefghijkl"), allowed_hz)
    WireFormat(("=1+1", "../a", "C" * 100), 40.0, characters=b"19C")


def clean_capture() -> ByteCapture:
    stamp_s = stamps_s(ROUNDS)
    return in_chunks(device_bytes(stamp_s), stamp_s)


def reading_rows(frames: list[TrackerFrame]) -> set[tuple[float, ...]]:
    """Return the content of valid readings, without the frame that they are in."""
    return {
        (float(f.measured_s[s]), *f.position_m[s].tolist(), float(f.quality[s]), float(s))
        for f in frames
        for s in np.flatnonzero(f.position_valid)
    }


def test_frames_contain_what_was_sent() -> None:
    frames = decode_frames(clean_capture())
    stamp_s = stamps_s(ROUNDS).reshape(-1, 4)
    assert len(frames) == ROUNDS
    np.testing.assert_allclose([f.measured_s for f in frames], stamp_s, atol=1e-6)
    np.testing.assert_allclose([f.received_s for f in frames], stamp_s[:, 3] - 12.0 + 100.005)
    assert all(f.position_valid.all() and f.orientation_valid.all() and not f.suspect.any() for f in frames)
    lengths = np.linalg.norm([f.tracker_from_station for f in frames], axis=2)
    np.testing.assert_allclose(lengths, 1.0, atol=1e-12)


@pytest.mark.parametrize("chunk", [1, 7, 37, 39, 200])
def test_chunks_change_only_the_times_of_reception(chunk: int) -> None:
    stamp_s = stamps_s(ROUNDS)
    capture = in_chunks(device_bytes(stamp_s), stamp_s, chunk)
    all_at_once, reader, begin = decode_frames(capture), FrameReader(FOUR), 0
    piecemeal = []
    for end, received_s in zip(capture.ends.tolist(), capture.received_s.tolist(), strict=True):
        piecemeal += reader.feed(capture.data[begin:end], received_s)
        begin = end
    piecemeal += reader.finish()
    assert len(piecemeal) == len(all_at_once) == ROUNDS
    assert all(frames_equal(first, second) for first, second in zip(piecemeal, all_at_once, strict=True))
    for first, second in zip(all_at_once, decode_frames(clean_capture()), strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(station_columns(first), station_columns(second), strict=True))


def test_replies_and_garbage_are_counted_and_not_mistaken_for_records() -> None:
    stamp_s = stamps_s(ROUNDS)
    data = device_bytes(stamp_s)
    cut = 10 * RECORD
    mixed = data[:cut] + b"31Sg00\r\n" + b"\xfe\xff" + data[cut:]
    reader = FrameReader(FOUR)
    frames = [*reader.feed_all(in_chunks(mixed, stamp_s)), *reader.finish()]
    assert reading_rows(frames) == reading_rows(decode_frames(clean_capture()))
    assert [reply.line for reply in reader.replies] == [b"31Sg00"]
    assert (reader.records, reader.garbage_bytes, reader.clock_resets) == (4 * ROUNDS, 2, 0)


def test_stamps_after_an_hour_are_still_in_sequence() -> None:
    """A float32 of milliseconds has steps of 0.25 ms then (docs/is900.md 8)."""
    stamp_s = stamps_s(40, begin_s=3600.0)
    frames = decode_frames(in_chunks(device_bytes(stamp_s), stamp_s))
    assert len(frames) == 40
    assert not any(f.suspect.any() for f in frames)
    assert np.abs([f.measured_s for f in frames] - stamp_s.reshape(-1, 4)).max() <= 0.125e-3 + 1e-9


def check_sound(frames: list[TrackerFrame]) -> None:
    """Check that valid numbers are usable, whatever was received, and that invalid ones are NaN."""
    for f in frames:
        assert np.isfinite(f.position_m[f.position_valid]).all()
        assert np.isnan(f.position_m[~f.position_valid]).all()
        assert np.allclose(np.linalg.norm(f.tracker_from_station[f.orientation_valid], axis=1), 1.0)
        assert np.isnan(f.tracker_from_station[~f.orientation_valid]).all()
        assert ((f.quality >= 0.0) & (f.quality <= 1.0)).all()
        assert (f.suspect | ~(np.isnan(f.measured_s) & f.position_valid)).all(), "valid without a time, unmarked"
    received_s = [f.received_s for f in frames]
    assert all(a < b for a, b in pairwise(received_s)), "host times strictly increase"


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_frames_are_sound_whatever_records_contain(choose: st.DataObject) -> None:
    """Well-formed records with any bytes in them: signalling NaN, infinities, erratic times, any sequence."""
    records = choose.draw(
        st.lists(st.tuples(st.sampled_from(b"1234"), st.binary(min_size=33, max_size=33)), min_size=1, max_size=20)
    )
    data = b"".join(b"0" + bytes([station]) + b" " + body + b"\r\n" for station, body in records)
    reader = FrameReader(FOUR)
    frames = [
        frame
        for k in range(0, len(data), RECORD)
        for frame in reader.feed(data[k : k + RECORD], 100.0 + 0.005 * k / RECORD)
    ]
    check_sound([*frames, *reader.finish()])


@pytest.mark.parametrize("share", [0.001, 0.01, 0.1])
def test_frames_stay_sound_with_many_damaged_bytes(share: float) -> None:
    for trial in range(30):
        stamp_s, rng = stamps_s(100), np.random.default_rng(trial)
        data = np.frombuffer(device_bytes(stamp_s, seed=trial), np.uint8).copy()
        is_damaged = rng.random(len(data)) < share
        data[is_damaged] ^= rng.integers(1, 256, int(is_damaged.sum()), dtype=np.uint8)
        capture = in_chunks(data.tobytes(), stamp_s)
        frames = decode_frames(capture)
        check_sound(frames)
        intact = 400 - len(np.unique(np.flatnonzero(is_damaged) // RECORD))
        assert sum(int(f.position_valid.sum()) for f in frames) >= 0.9 * intact


@pytest.mark.parametrize("trials", [200, pytest.param(100_000, marks=pytest.mark.slow)])
def test_a_record_with_a_wrong_station_is_always_marked(trials: int) -> None:
    """Among sound records, sequence or time reveals it.

    Each station is at its own number, so a wrong one is noticed.
    """
    rng, stamp_s = np.random.default_rng(5), stamps_s(12)
    for trial in range(trials):
        data, record = bytearray(device_bytes(stamp_s, seed=trial % 50)), int(rng.integers(4, 44))
        at = record * RECORD + 1
        data[at] = int(rng.choice([station for station in b"1234" if station != data[at]]))
        for frame in decode_frames(in_chunks(bytes(data), stamp_s)):
            for row in np.flatnonzero(frame.position_valid & ~frame.suspect):
                assert np.abs(frame.position_m[row] - row).max() < 0.3, (trial, record, row)


def record_chunks(wire: WireFormat, rounds: int = ROUNDS) -> list[bytes]:
    """Return the records of stations that stand still, in the order of the wire."""
    count = rounds * len(wire.stations)
    number = np.arange(count) % len(wire.stations)
    position_m: Floats = np.full((count, 3), 0.3)
    position_m *= number[:, None]
    values = RecordValues(
        stamps_s(rounds, len(wire.stations)), position_m, np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)), np.ones(count)
    )
    table = encode_records(wire.items, np.frombuffer(wire.characters, np.uint8)[number], values, wire.settings)
    data = to_bytes(wire.items, table, wire.settings)
    return [data[k : k + len(data) // count] for k in range(0, len(data), len(data) // count)]


def feed_chunks(wire: WireFormat, chunks: list[bytes]) -> list[TrackerFrame]:
    """Return the frames of chunks that arrive 5 ms apart."""
    reader, out = FrameReader(wire), []
    for k, chunk in enumerate(chunks):
        out += reader.feed(chunk, 100.0 + 0.005 * k)
    return [*out, *reader.finish()]


@pytest.mark.parametrize(
    "items", [STANDARD_LIST, (40, 18, 19, 21, 1), (2, 4, 21, 1), (5, 6, 7, 2, 21, 76, 1), (2, 11, 21)]
)
@pytest.mark.parametrize("binary", [True, False])
def test_every_format_gives_the_same_frames(items: tuple[int, ...], binary: bool) -> None:
    wire = WireFormat(("head", "torso", "wrist"), RATE_HZ, items, RecordFormat(binary=binary))
    frames = feed_chunks(wire, record_chunks(wire))
    assert len(frames) == ROUNDS
    for number, frame in enumerate(frames):
        assert frame.position_valid.all()
        assert frame.orientation_valid.all()
        assert not frame.suspect.any()
        np.testing.assert_allclose(frame.position_m, 0.3 * np.arange(3)[:, None] * np.ones(3), atol=1e-3)
        np.testing.assert_allclose(np.abs(frame.tracker_from_station[:, 0]), 1.0, atol=1e-6)
        np.testing.assert_allclose(frame.measured_s, stamps_s(ROUNDS, 3).reshape(-1, 3)[number], atol=6e-4)


def test_any_stations_of_the_device_may_be_active() -> None:
    wire = WireFormat(("head", "torso", "wrist"), RATE_HZ, characters=b"25C")
    chunks = record_chunks(wire)
    assert [chunk[1:2] for chunk in chunks[:3]] == [b"2", b"5", b"C"]
    frames = feed_chunks(wire, chunks)
    assert len(frames) == ROUNDS
    assert all(frame.position_valid.all() and not frame.suspect.any() for frame in frames)


def test_records_of_unknown_stations_are_garbage() -> None:
    chunks = record_chunks(WireFormat(("head", "torso", "wrist"), RATE_HZ, characters=b"25C"))
    reader = FrameReader(WireFormat(("head", "torso"), RATE_HZ))
    frames = [*reader.feed(b"".join(chunks), 100.0), *reader.finish()]
    assert (reader.records, reader.garbage_bytes) == (ROUNDS, 2 * ROUNDS * RECORD)
    assert all(frame.position_valid.tolist() == [False, True] for frame in frames)


def tracking_reply(states: str) -> bytes:
    return TrackingStatus(f"{states:X<12}", (0,) * 12, (0,) * 12, RATE_HZ).line()


def test_replies_to_mp_mark_lost_stations_where_records_have_no_quality() -> None:
    wire = WireFormat(("head", "torso", "wrist"), RATE_HZ, (2, 11, 21, 1))
    chunks = record_chunks(wire, 8)
    chunks.insert(6, tracking_reply("TLT"))
    chunks.insert(16, tracking_reply("TTT"))
    frames = feed_chunks(wire, chunks)
    assert [frame.position_valid.tolist() for frame in frames] == [
        [True, not 2 <= number < 5, True] for number in range(8)
    ]
    assert [frame.quality[1] for frame in frames] == [1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
    all_at_once = feed_chunks(wire, [b"".join(chunks)])
    assert all(
        np.array_equal(a, b, equal_nan=True)
        for first, second in zip(frames, all_at_once, strict=True)
        for a, b in zip(station_columns(first), station_columns(second), strict=True)
    )


def test_a_reply_to_mp_does_not_overrule_item_40() -> None:
    chunks = record_chunks(FOUR)
    chunks.insert(8, tracking_reply("LLLL"))
    assert all(frame.position_valid.all() for frame in feed_chunks(FOUR, chunks))


def test_deferred_records_are_returned_when_a_frame_expires() -> None:
    """Three of four stations arrive one by one; the frame is closed after 1.5 periods."""
    reader, chunks = FrameReader(FOUR), record_chunks(FOUR)
    for k in range(3):
        assert reader.feed(chunks[k], 100.0 + 0.001 * k) == []
    assert reader.records == 3
    assert reader.expire(100.0 + 1.4 / RATE_HZ) == []
    (frame,) = reader.expire(100.0 + 1.6 / RATE_HZ)
    assert frame.position_valid.tolist() == [True, True, True, False]
    assert frame.received_s == 100.002


@pytest.mark.parametrize(("row", "off_s"), [(0, 0.005), (1, 0.005), (2, 0.005), (1, -0.005), (2, -0.005), (3, -0.005)])
def test_times_of_frames_increase_after_a_stamp_that_is_a_little_wrong(row: int, off_s: float) -> None:
    """The wrong stamp may be believed at first. It costs its record and the next one, and no time steps back."""
    sent_s = stamps_s(ROUNDS)
    true_s, sent_s[20 + row] = sent_s.copy(), sent_s[20 + row] + off_s
    frames = decode_frames(in_chunks(device_bytes(sent_s), true_s))
    assert len(frames) == ROUNDS
    latest_s = -np.inf
    for frame in frames:
        stamps = frame.measured_s[~np.isnan(frame.measured_s)]
        assert (np.diff(stamps, prepend=latest_s) > 0.0).all()
        latest_s = float(stamps[-1])
        assert (frame.suspect | ~np.isnan(frame.measured_s)).all()
    assert sum(int(np.isnan(frame.measured_s).sum()) for frame in frames) == 1
    assert sum(int(frame.suspect.sum()) for frame in frames) <= 2


SESSION_ROUNDS, CLOCK_S = 5, 1.0
"""The sessions begin a second before the first record, and so does the device's clock."""
STAMPS_S = stamps_s(SESSION_ROUNDS, begin_s=CLOCK_S)


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
    assert len(before) == len(after) == SESSION_ROUNDS
    gap_s = after[0].measured_s[0] - before[-1].measured_s[-1]
    assert gap_s - CLOCK_S == np.float64(110.0 - before[-1].received_s)
    assert reader.device_zero_s == after[0].measured_s[0] - CLOCK_S
    assert reader.counts["sessions"] == 2
    assert reader.counts["records"] == 2 * 4 * SESSION_ROUNDS


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
    assert reader.expire(101.0 + 1.4 / RATE_HZ) == []
    (expired,) = reader.expire(101.0 + 2.0 / RATE_HZ)
    assert expired.position_valid.tolist() == [True, False, False, False]
