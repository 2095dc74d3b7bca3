"""The contract suite passes a correct stream and names the faults of others."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from harness.stream import TrackerFrame, TrackerStream
from harness.testing.stream_checks import StreamContractError, check_stream

RATE_HZ = 40.0
Frames = list[TrackerFrame]


def sound_frames() -> Frames:
    """Three stations; the second is lost in frames 3 and 4, the third silent in frame 6, suspect in frame 8."""
    frames = []
    for i in range(12):
        measured_s = 5.0 + i / RATE_HZ + np.array([0.0, 0.004, 0.008])
        valid = np.array([True, i not in (3, 4), i != 6])
        if i == 6:
            measured_s[2] = np.nan
        if i == 8:
            measured_s[2] = 4.0
        frames.append(
            TrackerFrame(
                received_s=100.0 + i / RATE_HZ,
                measured_s=measured_s,
                position_m=np.where(valid[:, None], np.full((3, 3), 0.1 * i), np.nan),
                tracker_from_station=np.where(valid[:, None], [0.6, 0.0, 0.8, 0.0], np.nan),
                position_valid=valid,
                orientation_valid=valid,
                quality=valid.astype(float),
                suspect=np.array([False, False, i == 8]),
            )
        )
    return frames


class Listed:
    """A stream over ready-made frames."""

    def __init__(self, frames: Frames, stations: tuple[str, ...] = ("head", "torso", "left_hand")) -> None:
        self.frames, self.names, self.closed = frames, stations, False

    @property
    def stations(self) -> tuple[str, ...]:
        return self.names

    def __iter__(self) -> Iterator[TrackerFrame]:
        for frame in self.frames:
            if self.closed:
                return
            yield frame

    def close(self) -> None:
        self.closed = True


def changed(at: int, **fields: Any) -> Frames:
    """Correct frames, one of them changed."""
    frames = sound_frames()
    frames[at] = replace(frames[at], **fields)
    return frames


def test_a_sound_stream_passes_and_its_frames_are_given_back() -> None:
    assert len(check_stream(lambda: Listed(sound_frames()), rate_hz=RATE_HZ)) == 12
    assert len(check_stream(lambda: Listed(sound_frames()), rate_hz=RATE_HZ, at_most=5)) == 5


def writable() -> Frames:
    frames = sound_frames()
    changeable = frames[2].position_m.copy()
    object.__setattr__(frames[2], "position_m", changeable)
    return frames


def without_a_station() -> Frames:
    frames = sound_frames()
    two = {name: getattr(frames[1], name)[:2] for name in TrackerFrame.__slots__ if name != "received_s"}
    return [frames[0], replace(frames[1], **two), *frames[2:]]


def repeated() -> Frames:
    frames = sound_frames()
    frames[10] = replace(frames[9], received_s=frames[10].received_s)
    return frames


def filled(value: float, *shape: int) -> np.ndarray:
    return np.full(shape, value)


NAN = float("nan")
YES, NO = np.ones(3, bool), np.zeros(3, bool)
BROKEN: dict[str, tuple[Callable[[], Frames], str]] = {
    "empty": (list, "two are needed"),
    "one frame": (lambda: sound_frames()[:1], "two are needed"),
    "host time stands": (lambda: changed(5, received_s=100.0 + 4 / RATE_HZ), "received_s does not strictly increase"),
    "host time is NaN": (lambda: changed(5, received_s=NAN), "received_s does not strictly increase"),
    "device time steps back": (lambda: changed(5, measured_s=np.array([5.09, 5.129, 5.133])), "station 0 steps back"),
    "a frame is sent twice": (repeated, "repeats the reading of station 0"),
    "a frame is too long": (lambda: changed(11, measured_s=5.275 + np.array([0.0, 0.02, 0.04])), "spans 40.0 ms"),
    "a station is missing": (without_a_station, "2 rows for 3 stations"),
    "frames can be changed": (writable, "position_m is writable"),
    "a valid position is NaN": (lambda: changed(0, position_m=filled(NAN, 3, 3)), "valid position is not finite"),
    "a valid position is infinite": (lambda: changed(0, position_m=filled(np.inf, 3, 3)), "position is not finite"),
    "an invalid position has numbers": (lambda: changed(3, position_m=filled(0.1, 3, 3)), "position is not NaN"),
    "a quaternion is long": (lambda: changed(0, tracker_from_station=filled(0.6, 3, 4)), "not of unit length"),
    "a valid quaternion is NaN": (lambda: changed(0, tracker_from_station=filled(NAN, 3, 4)), "not of unit length"),
    "an invalid quaternion has numbers": (
        lambda: changed(3, tracker_from_station=filled(0.5, 3, 4)),
        "invalid orientation is not NaN",
    ),
    "quality is 255": (lambda: changed(0, quality=filled(255.0, 3)), "quality is outside 0 to 1"),
    "quality is NaN": (lambda: changed(0, quality=filled(NAN, 3)), "quality is outside 0 to 1"),
    "a lost station is valid": (lambda: changed(0, quality=np.array([1.0, 0.0, 1.0])), "quality 0 is marked valid"),
    "a valid row has no time": (lambda: changed(0, measured_s=np.array([NAN, 5.004, 5.008])), "has no time"),
    "a frame of silence": (
        lambda: changed(
            0,
            measured_s=filled(NAN, 3),
            position_m=filled(NAN, 3, 3),
            tracker_from_station=filled(NAN, 3, 4),
            position_valid=NO,
            orientation_valid=NO,
            quality=filled(0.0, 3),
        ),
        "no station reported anything",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_frames_are_found(name: str) -> None:
    frames, complaint = BROKEN[name]
    with pytest.raises(StreamContractError, match=complaint):
        check_stream(lambda: Listed(frames()), rate_hz=RATE_HZ)


class Renaming(Listed):
    @property
    def stations(self) -> tuple[str, ...]:
        self.names = self.names[1:] + self.names[:1]
        return self.names


class Deaf(Listed):
    def close(self) -> None:
        """Goes on."""


class Loud(Listed):
    def __iter__(self) -> Iterator[TrackerFrame]:
        for frame in self.frames:
            if self.closed:
                raise OSError("bad file descriptor")
            yield frame


class Once(Listed):
    def close(self) -> None:
        if self.closed:
            raise ValueError("closed twice")
        self.closed = True


@pytest.mark.parametrize(
    ("kind", "complaint"),
    [
        (Renaming, "stations were"),
        (Deaf, "2 more frames came after the stream was closed at frame 0"),
        (Loud, "closing after 1 frames raised OSError"),
        (Once, "closing after 0 frames raised ValueError"),
    ],
)
def test_faults_of_closing_are_found(kind: type[Listed], complaint: str) -> None:
    with pytest.raises(StreamContractError, match=complaint):
        check_stream(lambda: kind(sound_frames()), rate_hz=RATE_HZ)


def test_stations_of_the_same_name_are_found() -> None:
    with pytest.raises(StreamContractError, match="distinct"):
        check_stream(lambda: Listed(sound_frames(), ("head", "head", "torso")), rate_hz=RATE_HZ)


def test_all_faults_are_reported_at_once() -> None:
    def open_stream() -> TrackerStream:
        return Deaf(changed(5, received_s=0.0, quality=filled(2.0, 3)))

    with pytest.raises(StreamContractError, match=r"(?s)received_s.*frame 5: quality.*after the stream was closed"):
        check_stream(open_stream, rate_hz=RATE_HZ)
