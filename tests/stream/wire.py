"""Bytes of a device for tests: rounds of stations that stand still, each at its own position."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Floats
from harness.stream.frame import TrackerFrame
from harness.stream.polhemus.codec.items import STANDARD_LIST, STATION_CHARACTERS, record_size
from harness.stream.polhemus.codec.reader import ByteCapture, FrameReader, WireFormat
from harness.stream.polhemus.codec.records import RecordFormat, RecordValues, encode_records

RATE_HZ, SLOT_S = 40.0, 0.0033
RECORD = record_size(STANDARD_LIST)
FOUR = WireFormat(("head", "torso", "left_wrist", "right_wrist"), RATE_HZ)


def stamps_s(rounds: int, stations: int = 4, begin_s: float = 12.0) -> Floats:
    """Return the device time (rounds * stations,) of each record, in the order of the wire [s]."""
    out: Floats = (begin_s + np.arange(rounds)[:, None] / RATE_HZ + SLOT_S * np.arange(stations)).ravel()
    return out


def device_bytes(stamp_s: Floats, stations: int = 4, seed: int = 1) -> bytes:
    """Return records of stations that sway a little about their own pose; no two records are equal."""
    rng = np.random.default_rng(seed)
    number = np.arange(len(stamp_s)) % stations
    quaternions = np.random.default_rng(seed + 1).normal(size=(12, 4))[number] + 0.05 * rng.normal(
        size=(len(stamp_s), 4)
    )
    values = RecordValues(
        measured_s=stamp_s,
        position_m=number[:, None] + 0.01 * rng.normal(size=(len(stamp_s), 3)),
        tracker_from_station=quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True),
        quality=rng.uniform(0.1, 1.0, len(stamp_s)),
    )
    return encode_records(
        STANDARD_LIST, np.frombuffer(STATION_CHARACTERS, np.uint8)[number], values, RecordFormat()
    ).tobytes()


def in_chunks(data: bytes, stamp_s: Floats, chunk: int = RECORD) -> ByteCapture:
    """Return the bytes in chunks. Each arrives 5 ms after the stamp of the record that its last byte belongs to."""
    ends = np.append(np.arange(chunk, len(data), chunk), len(data))
    record = np.minimum((ends - 1) // RECORD, len(stamp_s) - 1)
    return ByteCapture(data, ends, stamp_s[record] - stamp_s[0] + 100.005)


def decode_frames(capture: ByteCapture, wire: WireFormat = FOUR) -> list[TrackerFrame]:
    reader = FrameReader(wire)
    return [*reader.feed_all(capture), *reader.finish()]


def station_columns(frame: TrackerFrame) -> tuple[NDArray[Any], ...]:
    """Return everything that a frame contains about its stations."""
    return (
        frame.measured_s,
        frame.position_m,
        frame.tracker_from_station,
        frame.position_valid,
        frame.orientation_valid,
        frame.quality,
        frame.suspect,
    )


def frames_equal(first: TrackerFrame, second: TrackerFrame) -> bool:
    return first.received_s == second.received_s and all(
        np.array_equal(a, b, equal_nan=True)
        for a, b in zip(station_columns(first), station_columns(second), strict=True)
    )
