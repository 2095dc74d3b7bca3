"""Guided capture of a device: stretches with an instruction each, marked in the recording.

A stretch begins when the person is ready and the stations rest or move as it needs. The recording is only appended to.
A capture that was stopped goes on where it stopped: whole stretches are kept, one that was cut is recorded again.
"""

import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadFile
from harness.stream.frame import TrackerFrame
from harness.stream.line_events import EventCounter
from harness.stream.ports import TrackerConfig, open_tracker_at
from harness.stream.recording.pose_writer import open_writer
from harness.stream.recording.recorder import tracked_text
from harness.stream.recording.recording import read_marks
from harness.stream.recording.recording_writer import RecordingWriter
from harness.stream.tracker import OpenTracker

WATCHED_S = 2.0
"""Time over which the stations are watched for rest and motion [s]."""
_REST_M, _REST_RAD = 0.06, float(np.deg2rad(3.0))
"""Largest change of the median pose from the first part of that time to another at rest; excursions stay below it."""
_PARTS = 5
"""Parts of that time. Two would not do: a motion is at the same place before and after its turning point."""
_FEWEST_FRAMES = 2 * _PARTS


@dataclass(frozen=True)
class Stretch:
    """One stretch of a guided capture."""

    name: str
    seconds: float
    instruction: str
    """What the person is asked to do."""
    at_rest: bool
    """Whether the stations rest in it; otherwise it begins with their motion."""


def finished_stretches(path: Path) -> set[str]:
    """Names of the stretches that a recording has in full; empty without a file. BadFile for another file."""
    if not path.exists():
        return set()
    return {
        str(begin["stretch"])
        for begin, end in pairwise(read_marks(path))
        if begin.get("stretch") and end.get("stretch") == "" and end.get("finished") == begin["stretch"]
    }


def capture_stretches(
    port: str,
    config: TrackerConfig,
    path: Path,
    stretches: Sequence[Stretch],
    note: dict[str, object],
    *,
    ready: Callable[[], bool],
    log: Callable[[str], None] = lambda line: None,
    progress: Callable[[str], None] = lambda line: None,
) -> None:
    """Record the stretches that the file at `path` does not have yet.

    `ready` waits for the person, in a thread of its own, and returns False to stop. Records keep coming meanwhile.
    Raises BadInput without a device, and BadFile for a file that cannot be continued or where the capture is stopped.
    KeyboardInterrupt leaves a recording that can be continued.
    """
    done = finished_stretches(path)
    missing = [stretch for stretch in stretches if stretch.name not in done]
    for stretch in stretches:
        if stretch.name in done:
            log(f"{stretch.name}: recorded already")
    if not missing:
        return
    events = EventCounter(log)
    with (
        open_writer(path, note, config) as writer,
        open_tracker_at(port, config, observer=writer, on_event=events) as device,
        closing(_frames(device, path)) as frames,
    ):
        log(f"{device.identification} at {port}; stations {device.station_list}")
        writer.on_mark({"stretch": ""})  # ends one that was cut
        for stretch in missing:
            _record_stretch(frames, device, writer, stretch, ready, log, progress)
        progress("")


def _frames(device: OpenTracker, path: Path) -> Generator[TrackerFrame, None, None]:
    """Yield the frames of the device; where they end, the capture is unfinished and BadFile is raised."""
    yield from device
    raise _unfinished(path)


def _unfinished(path: Path) -> BadFile:
    return BadFile(path, "an unfinished capture", "all stretches", "Give the same command to go on with it.")


def _record_stretch(
    frames: Iterator[TrackerFrame],
    device: OpenTracker,
    writer: RecordingWriter,
    stretch: Stretch,
    ready: Callable[[], bool],
    log: Callable[[str], None],
    progress: Callable[[str], None],
) -> None:
    log(f"{stretch.name}, {_duration_text(stretch.seconds)}: {stretch.instruction}")
    for frame in _until_ready(frames, ready, writer.path):
        progress(f"{stretch.name}: waiting ({tracked_text(frame)})")
    watch = _RestWatch()
    for frame in frames:
        watch.add(frame)
        moving = watch.moving(device.stations)
        if moving is not None and bool(moving) != stretch.at_rest:
            break
        hint = f"{', '.join(moving)} move" if moving else "move the stations"
        progress(f"{stretch.name}: waiting ({hint if moving is not None else tracked_text(frame)})")
    writer.on_mark({"stretch": stretch.name, "seconds": stretch.seconds})
    began_s: float | None = None
    for frame in frames:
        began_s = frame.received_s if began_s is None else began_s
        left_s = stretch.seconds - (frame.received_s - began_s)
        if left_s <= 0.0:
            break
        progress(f"{stretch.name}: {left_s:.0f} s left ({tracked_text(frame)})")
    writer.on_mark({"stretch": "", "finished": stretch.name})
    log(f"{stretch.name}: recorded")


def _until_ready(frames: Iterable[TrackerFrame], ready: Callable[[], bool], path: Path) -> Iterator[TrackerFrame]:
    """Yield the frames that come until the person is ready; BadFile when the person ends the capture."""
    answers: list[bool] = []
    waiting = threading.Thread(target=lambda: answers.append(ready()), daemon=True)
    waiting.start()
    for frame in frames:
        yield frame
        if not waiting.is_alive():
            break
    if answers == [False]:
        raise _unfinished(path)


class _RestWatch:
    """Tells from the latest frames which stations move."""

    def __init__(self) -> None:
        self._recent: deque[TrackerFrame] = deque()

    def add(self, frame: TrackerFrame) -> None:
        self._recent.append(frame)
        while frame.received_s - self._recent[0].received_s > WATCHED_S:
            self._recent.popleft()

    def moving(self, stations: Sequence[str]) -> list[str] | None:
        """Stations whose pose changes; None while there are too few frames to tell."""
        frames = list(self._recent)
        if len(frames) < _FEWEST_FRAMES or frames[-1].received_s - frames[0].received_s < 0.9 * WATCHED_S:
            return None
        place = np.array([frame.position_m for frame in frames])
        turn = np.array([frame.tracker_from_station for frame in frames])
        return [name for row, name in enumerate(stations) if _changes(place[:, row], turn[:, row])]


def _changes(place_m: Floats, turn: Floats) -> bool:
    """Whether the pose differs between parts of the time, (N, 3) and (N, 4); a station that is lost does not move."""
    tracked = np.isfinite(place_m[:, 0]) & np.isfinite(turn[:, 0])
    parts = [rows[tracked[rows]] for rows in np.array_split(np.arange(len(place_m)), _PARTS)]
    parts = [rows for rows in parts if len(rows)]
    if len(parts) < 2:
        return False
    middle_m = np.array([np.median(place_m[rows], axis=0) for rows in parts])
    middle = turn[[rows[len(rows) // 2] for rows in parts]]
    step_m, angle = np.linalg.norm(middle_m - middle_m[0], axis=1), rotations.angle_between_rad(middle, middle[0])
    return bool((step_m > _REST_M).any() or (angle > _REST_RAD).any())


def _duration_text(seconds: float) -> str:
    return f"{seconds / 60.0:.3g} min" if seconds >= 120.0 else f"{seconds:.3g} s"
