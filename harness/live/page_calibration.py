"""A guided calibration that a live page starts. It runs in the page's process, on the frames that the page gets.

The session goes on meanwhile. A thread collects the poses and solves; what it finds is written into a new file.
"""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np

from harness.body import pose_from_qpos
from harness.calibrate import HOLD_S, GuidedPose, write_calibration
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, HarnessError
from harness.live.capture import DroppingQueue
from harness.live.pose import GuidedCalibration, SessionSetup
from harness.live.session_control import new_path
from harness.stream import TrackerFrame

_QUEUE_FRAMES = 1024
"""Frames that wait for the thread: 8 s at 120 Hz [choice]."""


class PageCalibration:
    """The calibrations of a page, one at a time. `publish` receives the state whenever it changes.

    A state has the kind, the stage (`posing`, `solving`, `done` or `failed`), and lines of text. While posing it also
    has number, name and instruction of the wanted pose, wanted and approximate joints [mm], and the share of the hold
    that is complete; when done, the report.
    """

    def __init__(
        self,
        setup: SessionSetup,
        folder: Path,
        use: Callable[[Calibration], None],
        publish: Callable[[Mapping[str, Any]], None],
    ) -> None:
        """`folder` receives the files; `use` hands a calibration of the session's own body to the session."""
        self._setup, self._folder, self._use, self._publish = setup, folder, use, publish
        self._frames: DroppingQueue[TrackerFrame] | None = None
        self._kind, self._stopped = "", False

    def start(self, kind: str) -> None:
        """Begin a calibration. BadInput for an unknown kind, and while another one runs."""
        if kind not in self._setup.calibrations:
            raise BadInput(f"No calibration {kind!r}.", f"There are: {', '.join(self._setup.calibrations)}.")
        if self._frames is not None:
            raise BadInput("A calibration runs.", "Stop it first.")
        self._kind, self._stopped, self._frames = kind, False, DroppingQueue(_QUEUE_FRAMES)
        arguments = (self._setup.calibrations[kind], self._frames)
        Thread(target=self._run, args=arguments, name="calibration", daemon=True).start()

    def stop(self) -> None:
        """End a calibration that runs, without a result. BadInput when none runs."""
        if (frames := self._frames) is None:
            raise BadInput("No calibration runs.", "Start one first.")
        self._stopped = True
        frames.end()

    def add(self, frame: TrackerFrame) -> None:
        """Take a frame of the session; it never waits."""
        if (frames := self._frames) is not None:
            frames.put(frame)

    def _run(self, calibration: GuidedCalibration, frames: DroppingQueue[TrackerFrame]) -> None:
        display = _PageDisplay(calibration, self._show)
        try:
            held = calibration.collect_poses(_take_all(frames), lambda text: None, [display]).holds
            self._show("solving", ["solving"])
            outcome = calibration.solve(held, self._setup.title)
            path = new_path(self._folder, f"calibration_{self._kind}", ".toml")
            write_calibration(path, outcome.file)
            saved = f"Saved {path.name}. {self._apply(outcome.file.calibration, path)}"
            self._show("done", [outcome.lines[-1], saved], report="\n".join(outcome.lines))
        except HarnessError as error:
            self._show("failed", ["stopped before the last pose" if self._stopped else str(error)])
        except Exception as error:  # the page must not wait for a thread that has ended
            self._show("failed", [f"{type(error).__name__}: {error}"])
            raise
        finally:
            self._frames = None

    def _apply(self, calibration: Calibration, path: Path) -> str:
        """Let the session use a calibration of its own body; returns what it uses from now on."""
        if self._kind != "tpose":
            return f"Its bones differ from this session's: begin the next one with --calibration {path.name}."
        try:
            self._use(calibration)
        except HarnessError as error:
            return f"This session does not use it: {error}"
        return "This session uses it from now on."

    def _show(self, stage: str, lines: list[str], **content: Any) -> None:
        self._publish({"kind": self._kind, "stage": stage, "lines": lines, **content})


class _PageDisplay:
    """A `PoseDisplay` that sends the wanted pose and the performer to the page."""

    def __init__(self, calibration: GuidedCalibration, show: Callable[..., None]) -> None:
        self._poses, self._skeleton, self._show = calibration.poses, calibration.body.skeleton, show

    def show(self, guided: GuidedPose) -> None:
        """Send the newest state."""
        pose, performer = self._poses[guided.number - 1], guided.performer
        self._show(
            "posing",
            [f"still for {guided.still_s:.1f} of {HOLD_S:g} s; {guided.distance_text()}", guided.message],
            number=guided.number,
            poses=len(self._poses),
            name=pose.name,
            instruction=pose.instruction,
            wanted_mm=joints_mm(self._skeleton, guided.target),
            performer_mm=None if performer is None else joints_mm(self._skeleton, performer.qpos),
            still_share=round(guided.still_share, 3),
        )


def joints_mm(skeleton: Skeleton, qpos: Floats) -> list[int]:
    """Positions of the root and of each bone's far end in a configuration (55,), in a row [mm]."""
    ends_m = pose_from_qpos(skeleton, qpos[None]).end_m[0]
    return [int(value) for value in np.rint(1e3 * np.concatenate([qpos[None, :3], ends_m])).ravel()]


def _take_all(frames: DroppingQueue[TrackerFrame]) -> Iterator[TrackerFrame]:
    while (frame := frames.take()) is not None:
        yield frame
