"""The contract suite for streams: rules that every `TrackerStream` must satisfy, for use in your own tests.

    from harness.testing.stream_checks import check_stream

    def test_my_stream():
        check_stream(lambda: MyStream(...), rate_hz=40.0)

Each rule is a function that returns the faults it found. All faults are reported at once.
"""

from collections.abc import Callable, Sequence
from dataclasses import fields
from itertools import islice, pairwise

import numpy as np

from harness.core.arrays import Floats
from harness.stream import TrackerFrame, TrackerStream

MAX_SPAN_PERIODS = 1.5
"""Longest time between the measurements of one frame, in periods."""


class StreamContractError(AssertionError):
    """A stream violates the contract; the message lists all faults."""


def check_stream(
    open_stream: Callable[[], TrackerStream], *, rate_hz: float, at_most: int = 1000
) -> list[TrackerFrame]:
    """Check a stream against the contract and return its frames; StreamContractError lists all violations.

    `open_stream` is called several times and must return a new stream each time. Up to `at_most` frames are read. A
    live source must deliver two frames in reasonable time.
    """
    stream = open_stream()
    stations = stream.stations
    frames = list(islice(iter(stream), at_most))
    faults = [] if len(frames) >= 2 else [f"the stream gave {len(frames)} frames; at least two are needed"]
    if stream.stations != stations or len(set(stations)) < len(stations):
        faults.append(f"stations were {stations} and became {stream.stations}; they must be distinct and never change")
    stream.close()
    faults += _check_row_count(frames, len(stations))
    complete = [frame for frame in frames if len(frame.measured_s) == len(stations)]
    for rule in (_check_read_only, _check_times, _check_spans, _check_validity, _check_repeats):
        faults += rule(complete, len(stations), 1.0 / rate_hz)
    faults += _check_closing(open_stream)
    if faults:
        raise StreamContractError("\n".join(faults))
    return frames


def _check_row_count(frames: Sequence[TrackerFrame], stations: int) -> list[str]:
    """Every frame has a row for every station."""
    return [
        f"frame {i} has {len(frame.measured_s)} rows for {stations} stations"
        for i, frame in enumerate(frames)
        if len(frame.measured_s) != stations
    ][:1]


def _check_read_only(frames: Sequence[TrackerFrame], stations: int, period_s: float) -> list[str]:
    """The arrays of a frame are read-only."""
    names = [field.name for field in fields(TrackerFrame) if field.name != "received_s"]
    return [
        f"frame {i}: {name} is writable"
        for i, frame in enumerate(frames)
        for name in names
        if getattr(frame, name).flags.writeable
    ][:1]


def _check_times(frames: Sequence[TrackerFrame], stations: int, period_s: float) -> list[str]:
    """Host times strictly increase; no station's device time steps back, suspect rows excepted."""
    received = np.array([frame.received_s for frame in frames])
    faults = []
    if not np.isfinite(received).all() or np.any(np.diff(received) <= 0.0):
        faults.append("received_s does not strictly increase")
    for row in range(stations):
        stamps_s = np.array([f.measured_s[row] for f in frames if _has_device_time(f, row)])
        if np.any(np.diff(stamps_s) < 0.0):
            faults.append(f"measured_s of station {row} steps back")
    return faults


def _check_spans(frames: Sequence[TrackerFrame], stations: int, period_s: float) -> list[str]:
    """The stations of a frame were measured within 1.5 periods."""
    spans_s = [
        _span_s(f.measured_s[~f.suspect & ~np.isnan(f.measured_s)]) for f in frames if len(f.suspect) == stations
    ]
    worst_s = max(spans_s, default=0.0)
    if worst_s > MAX_SPAN_PERIODS * period_s:
        return [f"a frame spans {1e3 * worst_s:.1f} ms, more than 1.5 periods of {1e3 * period_s:.1f} ms"]
    return []


def _check_validity(frames: Sequence[TrackerFrame], stations: int, period_s: float) -> list[str]:
    """Valid readings are usable, invalid ones are NaN, and quality agrees."""
    faults = []
    for i, f in enumerate(frames):
        position, turn = f.position_m, f.tracker_from_station
        length = np.sqrt(np.sum(turn[f.orientation_valid] ** 2, axis=1))
        either = f.position_valid | f.orientation_valid
        for violated, fault in (
            (not np.isfinite(position[f.position_valid]).all(), "a valid position is not finite"),
            (not np.isnan(position[~f.position_valid]).all(), "an invalid position is not NaN"),
            (not np.all(np.abs(length - 1.0) < 1e-9), "a valid quaternion is not of unit length"),
            (not np.isnan(turn[~f.orientation_valid]).all(), "an invalid orientation is not NaN"),
            (not np.all((f.quality >= 0.0) & (f.quality <= 1.0)), "quality is outside 0 to 1"),
            (bool(np.any(either & (f.quality == 0.0))), "a station of quality 0 is marked valid"),
            (bool(np.any(either & np.isnan(f.measured_s) & ~f.suspect)), "a valid row has no time and is not suspect"),
            (not either.any() and bool(np.isnan(f.measured_s).all()), "no station reported anything"),
        ):
            if violated:
                faults.append(f"frame {i}: {fault}")
        if faults:
            break
    return faults


def _check_repeats(frames: Sequence[TrackerFrame], stations: int, period_s: float) -> list[str]:
    """A station that does not report gives an invalid row; the previous reading is never repeated."""
    for i, (before, now) in enumerate(pairwise(frames)):
        for row in range(stations):
            if (
                _has_device_time(before, row)
                and _has_device_time(now, row)
                and before.measured_s[row] == now.measured_s[row]
            ):
                return [f"frame {i + 1} repeats the reading of station {row} from the frame before"]
    return []


def _check_closing(open_stream: Callable[[], TrackerStream]) -> list[str]:
    """Closing ends the iteration without an error, before the first frame and later, and may be repeated."""
    faults = []
    for read in (0, 1):
        stream = open_stream()
        iteration = iter(stream)
        try:
            count = len(list(islice(iteration, read)))
            stream.close()
            stream.close()
            left = len(list(islice(iteration, 2)))
        except Exception as error:  # any exception is a fault
            faults.append(f"closing after {read} frames raised {error!r}")
            continue
        if count < read or left:
            faults.append(f"{left} more frames came after the stream was closed at frame {count}")
    return faults


def _has_device_time(frame: TrackerFrame, row: int) -> bool:
    return bool(not frame.suspect[row] and not np.isnan(frame.measured_s[row]))


def _span_s(stamps_s: Floats) -> float:
    return float(np.ptp(stamps_s)) if len(stamps_s) else 0.0
