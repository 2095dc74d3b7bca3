"""The output `live --view browser`: a page on loopback that shows the body, the stations and the line.

The session writes each frame to shared memory and waits for nobody. A process of its own serves the page.
"""

import os
import time
from contextlib import suppress
from pathlib import Path
from threading import Thread
from typing import Any

from harness.core.child_process import SPAWN, FunctionProcess
from harness.core.interrupts import shield_children
from harness.errors import BadInput, HarnessError
from harness.live.pose import LivePose, SessionSetup
from harness.live.shared_memory import PoseRing, first_message
from harness.stream.recording import RecordingSwitch

_END_TIMEOUT_S = 2.0


class BrowserOutput:
    """An `Output` that shows poses on a page, from which a recording can be started and stopped."""

    name = "--view browser"

    def __init__(self, setup: SessionSetup, recorder: RecordingSwitch, folder: Path) -> None:
        """Start the process and wait until it serves the page.

        `recorder` records into new files of `folder`, which is made. BadInput when the page cannot be served.
        """
        folder.mkdir(parents=True, exist_ok=True)
        self._recorder, self._folder = recorder, folder
        with shield_children():  # a signal ends the session, and the session ends the viewer
            self._ring = PoseRing(SPAWN, len(setup.stations))
            self._process = FunctionProcess(_run_process, setup, self._ring)
        try:
            message = first_message(self._process)
            if isinstance(message, OSError):
                raise BadInput(f"{self.name} cannot be shown: {message}.", "Leave the option out.")
        except BaseException:
            self.close()
            raise
        self.url = str(message)
        self.description = f"view: {self.url}"
        self._thread = Thread(target=self._carry_out, name="page commands", daemon=True)
        self._thread.start()

    def send(self, pose: LivePose) -> None:
        """Show a pose; OSError when the viewer's process has ended."""
        if not self._thread.is_alive():
            raise OSError("its process ended")
        self._ring.put(pose)

    def _carry_out(self) -> None:
        """Start and stop recordings as the page asks, until the pipe closes."""
        try:
            while True:
                self._process.pipe.send({"answer": True, **self._record(self._process.receive())})
        except (EOFError, OSError):
            return

    def _record(self, on: bool) -> dict[str, Any]:
        answer: dict[str, Any] = {}
        try:
            if on:
                self._recorder.start(self._folder / time.strftime("live_%Y%m%d_%H%M%S.rec"))
            else:
                answer["saved"] = str(self._recorder.stop())
        except HarnessError as error:
            answer["error"] = self._recorder.failure or str(error)
        path = self._recorder.path
        return answer | {"recording": "" if path is None else str(path)}

    def close(self) -> None:
        """End the page and the recording."""
        self._recorder.close()
        self._process.close(_END_TIMEOUT_S)


def _run_process(pipe: Any, setup: SessionSetup, ring: PoseRing) -> None:
    """Entry point of the viewer's process, which runs at low priority. It reports its errors through the pipe."""
    if hasattr(os, "nice"):
        os.nice(10)
    try:
        from harness.live.browser_process import run_browser

        run_browser(setup, ring, pipe)
    except OSError as error:
        with suppress(OSError):  # the session has been killed
            pipe.send(OSError(str(error)))
