"""Commands to a running session, from any thread: its heading, its calibration and its recordings.

The solving thread carries out what concerns poses, between two frames and in constant time. What takes longer is
prepared in the thread that asks.
"""

import time
from collections import deque
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NoAnswer
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

from harness.core.calibration import Calibration
from harness.errors import BadInput
from harness.reconstruct import Reconstructor, Session
from harness.stream.recording import RecordingSwitch

_MOST_WAITING = 4
_ANSWER_TIMEOUT_S = 2.0


@dataclass(frozen=True, eq=False)
class SessionRequest:
    """A command that waits for the solving thread: to use another calibration, or to reset the heading."""

    calibration: Calibration | None = None
    session: Session | None = None
    """The method's session with that calibration."""
    answer: "Future[float]" = field(default_factory=Future)
    """Angle by which the heading was reset [rad]; 0 for a calibration."""


class SessionControl:
    """What can be asked of a running session. Commands that are asked wait for their answer."""

    def __init__(self, recorder: RecordingSwitch | None = None) -> None:
        """`recorder` observes the line of the session; None for a session that cannot be recorded."""
        self.recorder = RecordingSwitch() if recorder is None else recorder
        self.reconstructor: Reconstructor | None = None
        """The method, which the session sets when it begins."""
        self._requests: deque[SessionRequest] = deque()

    def reset_heading(self) -> float:
        """Turn the world so that the performer faces forward (x), and return the angle [rad].

        BadInput while no frame arrives or the performer is lost.
        """
        return self._ask(SessionRequest())

    def use_calibration(self, calibration: Calibration) -> None:
        """Go on with other mounts and another room, on the same body. BadInput while no frame arrives."""
        if self.reconstructor is None:
            raise BadInput("The session has not begun.", "Wait until poses arrive.")
        self._ask(SessionRequest(calibration, self.reconstructor.begin(calibration)))

    def start_recording(self, folder: Path) -> Path:
        """Record into a new file of a folder; returns it. BadInput and BadFile as `RecordingSwitch.start`."""
        path = new_path(folder, "live", ".rec")
        self.recorder.start(path)
        return path

    def next_request(self) -> SessionRequest | None:
        """The next request that nobody has given up, for the solving thread; None without one. It never waits."""
        while self._requests:
            request = self._requests.popleft()
            if request.answer.set_running_or_notify_cancel():
                return request
        return None

    def _ask(self, request: SessionRequest) -> float:
        if len(self._requests) >= _MOST_WAITING:
            raise BadInput(f"{_MOST_WAITING} commands wait already.", "Try again when frames arrive.")
        self._requests.append(request)
        try:
            return request.answer.result(_ANSWER_TIMEOUT_S)
        except NoAnswer:
            if not request.answer.cancel():  # the solving thread has just taken it
                return request.answer.result()
            with suppress(ValueError):
                self._requests.remove(request)
            raise BadInput("No frame arrives, so nothing was changed.", "Check the line, then try again.") from None


def new_path(folder: Path, stem: str, suffix: str) -> Path:
    """A path of a folder where nothing is, named by the time of day."""
    name = time.strftime(f"{stem}_%Y%m%d_%H%M%S")
    names = (f"{name}{suffix}" if number == 1 else f"{name}_{number}{suffix}" for number in count(1))
    return next(path for path in map(folder.joinpath, names) if not path.exists())
