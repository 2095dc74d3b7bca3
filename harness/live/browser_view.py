"""The output `live --view browser`: a page on loopback that shows the body, the stations and the line.

The session writes each frame to shared memory and waits for nobody. A process of its own serves the page. What the
page commands is carried out by a thread here, and by the session's solving thread.
"""

import html
import os
import tempfile
import webbrowser
from contextlib import suppress
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np

from harness.core.child_process import SPAWN, FunctionProcess
from harness.core.interrupts import shield_children
from harness.errors import BadInput, HarnessError
from harness.live.pose import LivePose, SessionSetup
from harness.live.session_control import SessionControl
from harness.live.shared_memory import PoseRing, first_message

_END_TIMEOUT_S = 2.0
_STATE_PERIOD_S = 0.5
"""Time after which the page learns that a recording has failed."""


class BrowserOutput:
    """An `Output` that shows poses on a page, from which the session can be commanded."""

    name = "--view browser"

    def __init__(self, setup: SessionSetup, control: SessionControl, folder: Path) -> None:
        """Start the process and wait until it serves the page.

        Recordings and calibrations that the page starts become new files of `folder`, which is made.
        BadInput when the page cannot be served.
        """
        folder.mkdir(parents=True, exist_ok=True)
        self._control, self._folder = control, folder
        self._start_page: Path | None = None
        with shield_children():  # a signal ends the session, and the session ends the viewer
            self._ring = PoseRing(SPAWN, len(setup.stations))
            self._process = FunctionProcess(_run_process, setup, self._ring, str(folder))
        try:
            message = first_message(self._process)
            if isinstance(message, OSError):
                raise BadInput(f"{self.name} cannot be shown: {message}.", "Leave the option out.")
        except BaseException:
            self.close()
            raise
        self.url = str(message)
        """Address of the page, with the token that its commands need."""
        self.description = f"view: {self.url}\n  Whoever opens it without the part from # on can look, and not command."
        self._thread = Thread(target=self._follow_page, name="page commands", daemon=True)
        self._thread.start()

    def open_browser(self) -> bool:
        """Open the page in the browser; False when there is none.

        The browser opens a file that only this user can read, which leads to the address: the command lines of
        programs are visible to all users of a computer.
        """
        text = f'<!doctype html><meta http-equiv="refresh" content="0;url={html.escape(self.url)}">\n'
        handle, name = tempfile.mkstemp(prefix="harness_live_", suffix=".html")  # mode 0600
        self._start_page = Path(name)
        with open(handle, "w", encoding="utf-8") as file:
            file.write(text)
        return webbrowser.open(self._start_page.as_uri())

    def send(self, pose: LivePose) -> None:
        """Show a pose; OSError when the viewer's process has ended."""
        if not self._thread.is_alive():
            raise OSError("its process ended")
        self._ring.put(pose)

    def _follow_page(self) -> None:
        """Carry out the commands of the page, and tell it of the recording, until the pipe closes."""
        shown, recorder = dict[str, str](), self._control.recorder
        try:
            while True:
                with suppress(TimeoutError):
                    answer = self._carry_out(*self._process.receive(_STATE_PERIOD_S))
                    self._process.pipe.send(("answer", answer))
                path = recorder.path
                state = {"recording": "" if path is None else path.name, "failure": recorder.failure}
                if state != shown:
                    shown = state
                    self._process.pipe.send(("recording", state))
        except (EOFError, OSError):
            return

    def _carry_out(self, command: str, content: Any) -> dict[str, Any]:
        control = self._control
        try:
            if command == "heading":
                return {"turn_deg": round(float(np.rad2deg(control.reset_heading())), 1)}
            if command == "calibration":
                control.use_calibration(content)
                return {}
            if content:
                return {"recording": control.start_recording(self._folder).name}
            return {"recording": "", "saved": str(control.recorder.stop())}
        except HarnessError as error:
            return {"error": control.recorder.failure or str(error)}

    def close(self) -> None:
        """End the page and the recording."""
        self._control.recorder.close()
        self._process.close(_END_TIMEOUT_S)
        if self._start_page is not None:
            self._start_page.unlink(missing_ok=True)


def _run_process(pipe: Any, setup: SessionSetup, ring: PoseRing, folder: str) -> None:
    """Entry point of the viewer's process, which runs at low priority. It reports its errors through the pipe."""
    if hasattr(os, "nice"):
        os.nice(10)
    try:
        from harness.live.browser_process import run_browser

        run_browser(setup, ring, folder, pipe)
    except OSError as error:
        with suppress(OSError):  # the session has been killed
            pipe.send(OSError(str(error)))
