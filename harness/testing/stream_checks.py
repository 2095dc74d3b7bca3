"""What every `TrackerStream` must keep to, as a check that anybody can run on their own.

    from harness.testing.stream_checks import check_stream

    def test_my_stream():
        check_stream(lambda: MyStream(...), rate_hz=40.0)

Each rule is one function that returns what it found amiss, so that a stream is told everything at once.
"""

from collections.abc import Callable, Sequence
from dataclasses import fields
from itertools import islice, pairwise

import numpy as np

from harness.core.arrays import Floats
from harness.stream.frame import TrackerFrame, TrackerStream

MAX_SPAN_PERIODS = 1.5
"""A frame spans no more than this many periods."""


class StreamContractError(AssertionError):
    """A stream that breaks the contract; the message lists how."""


def check_stream(opened: Callable[[], TrackerStream], *, rate_hz: float, at_most: int = 1000) -> list[TrackerFrame]:
    """Open the stream as often as needed, read up to `at_most` frames, raise BrokenStream; the frames that were read.

    Of a live source two frames must come in reasonable time, and `opened` must give it anew.
    """
    stream = opened()
    stations = stream.stations
    frames = list(islice(iter(stream), at_most))
    broken = [] if len(frames) >= 2 else [f"gave {len(frames)} frames, two are needed to judge it"]
    if stream.stations != stations or len(set(stations)) < len(stations):
        broken.append(f"stations were {stations}, became {stream.stations}, and must be distinct and never change")
    stream.close()
    broken += _check_row_count(frames, len(stations))
    whole = [frame for frame in frames if len(frame.measured_s) == len(stations)]
    for rule in (_check_read_only, _check_times, _check_spans, _check_validity, _check_repeats):
        broken += rule(whole, len(stations), 1.0 / rate_hz)
    broken += _check_closing(opened)
    if broken:
        raise StreamContractError("\n".join(broken))
    return frames


def _check_row_count(frames: Sequence[TrackerFrame], stations: int) -> list[str]:
    """Every frame has a row for every station."""
    return [
        f"frame {i} has {len(frame.measured_s)} rows for {stations} stations"
        for i, frame in enumerate(frames)
        if len(frame.measured_s) != stations
    ][:1]


def _check_read_only(frames: Sequence[TrackerFrame], stations: int, period_s: float) -> list[str]:
    """Nobody can change a frame after the fact."""
    names = [field.name for field in fields(TrackerFrame) if field.name != "received_s"]
    return [
        f"frame {i}: {name} can be written to"
        for i, frame in enumerate(frames)
        for name in names
        if getattr(frame, name).flags.writeable
    ][:1]


def _check_times(frames: Sequence[TrackerFrame], stations: int, period_s: float) -> list[str]:
    """Host times strictly increase; no station's device time steps back, suspect rows apart."""
    received = np.array([frame.received_s for frame in frames])
    broken = []
    if not np.isfinite(received).all() or np.any(np.diff(received) <= 0.0):
        broken.append("received_s does not strictly increase")
    for row in range(stations):
        stamps_s = np.array([f.measured_s[row] for f in frames if _has_device_time(f, row)])
        if np.any(np.diff(stamps_s) < 0.0):
            broken.append(f"measured_s of station {row} steps back")
    return broken


def _check_spans(frames: Sequence[TrackerFrame], stations: int, period_s: float) -> list[str]:
    """A frame is one instant: its stations were measured within 1.5 periods."""
    spans_s = [
        _span_s(f.measured_s[~f.suspect & ~np.isnan(f.measured_s)]) for f in frames if len(f.suspect) == stations
    ]
    worst_s = max(spans_s, default=0.0)
    if worst_s > MAX_SPAN_PERIODS * period_s:
        return [f"a frame spans {1e3 * worst_s:.1f} ms, more than 1.5 periods of {1e3 * period_s:.1f} ms"]
    return []


def _check_validity(frames: Sequence[TrackerFrame], stations: int, period_s: float) -> list[str]:
    """What is valid can be used, what is not is NaN, and quality tells the same."""
    broken = []
    for i, f in enumerate(frames):
        position, turn = f.position_m, f.tracker_from_station
        length = np.sqrt(np.sum(turn[f.orientation_valid] ** 2, axis=1))
        either = f.position_valid | f.orientation_valid
        for amiss, what in (
            (not np.isfinite(position[f.position_valid]).all(), "a valid position is not finite"),
            (not np.isnan(position[~f.position_valid]).all(), "an invalid position is not NaN"),
            (not np.all(np.abs(length - 1.0) < 1e-9), "a valid quaternion is not of unit length"),
            (not np.isnan(turn[~f.orientation_valid]).all(), "an invalid orientation is not NaN"),
            (not np.all((f.quality >= 0.0) & (f.quality <= 1.0)), "quality is outside 0 to 1"),
            (bool(np.any(either & (f.quality == 0.0))), "a station of quality 0 is called valid"),
            (bool(np.any(either & np.isnan(f.measured_s) & ~f.suspect)), "a valid row has no time and is not suspect"),
            (not either.any() and bool(np.isnan(f.measured_s).all()), "no station said anything"),
        ):
            if amiss:
                broken.append(f"frame {i}: {what}")
        if broken:
            break
    return broken


def _check_repeats(frames: Sequence[TrackerFrame], stations: int, period_s: float) -> list[str]:
    """A silent station is an invalid row, never the one before once more: device times strictly increase."""
    for i, (before, now) in enumerate(pairwise(frames)):
        for row in range(stations):
            if (
                _has_device_time(before, row)
                and _has_device_time(now, row)
                and before.measured_s[row] == now.measured_s[row]
            ):
                return [f"frame {i + 1} repeats station {row} of the frame before"]
    return []


def _check_closing(opened: Callable[[], TrackerStream]) -> list[str]:
    """Closing ends the iteration quietly, before the first frame and amidst, and may be done twice."""
    broken = []
    for read in (0, 1):
        stream = opened()
        iteration = iter(stream)
        try:
            seen = len(list(islice(iteration, read)))
            stream.close()
            stream.close()
            left = len(list(islice(iteration, 2)))
        except Exception as error:  # whatever it raises, that is the finding
            broken.append(f"closing after {read} frames raised {error!r}")
            continue
        if seen < read or left:
            broken.append(f"after closing at {seen} frames, {left} more came")
    return broken


def _has_device_time(frame: TrackerFrame, row: int) -> bool:
    return bool(not frame.suspect[row] and not np.isnan(frame.measured_s[row]))


def _span_s(stamps_s: Floats) -> float:
    return float(np.ptp(stamps_s)) if len(stamps_s) else 0.0
