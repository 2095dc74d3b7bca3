"""The process of `live --view browser`: serves the live page, sends it frames, and passes its commands on."""

import secrets
import time
from collections.abc import Mapping
from pathlib import Path
from threading import Event, Lock
from typing import Any

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Status
from harness.errors import BadInput
from harness.live.live_statistics import LiveStatistics
from harness.live.page_calibration import PageCalibration, joints_mm
from harness.live.pose import SessionSetup
from harness.live.shared_memory import PoseRing
from harness.live.stated_uncertainty import bone_reach_m, describe_uncertainty
from harness.view import Command, LiveContent, ViewServer

_RATE_HZ = 30.0
"""Most frames per second that are sent to the page."""
_STATUS_PERIOD_S = 0.5
_ANSWER_TIMEOUT_S = 10.0


class SessionLink:
    """Commands to the session at the other end of a pipe, one at a time, and what it says about its recording."""

    def __init__(self, pipe: Any) -> None:
        self._pipe, self._lock, self._answered = pipe, Lock(), Event()
        self._answer: Mapping[str, Any] = {}
        self.recording: Mapping[str, Any] = {}
        """Name of the file that is being recorded into, "" for none, and why the last recording failed."""

    def ask(self, command: str, content: Any) -> Mapping[str, Any]:
        """Let the session carry out a command; BadInput when it refuses, or is busy."""
        if not self._lock.acquire(timeout=_ANSWER_TIMEOUT_S):
            raise BadInput("The session is busy with other commands.", "Try again.")
        try:
            self._answered.clear()
            self._pipe.send((command, content))
            if not self._answered.wait(_ANSWER_TIMEOUT_S):
                raise BadInput("The session does not answer.", "Is it still running?")
            answer = self._answer
        finally:
            self._lock.release()
        if "error" in answer:
            raise BadInput(str(answer["error"]), "")
        return answer

    def take(self, kind: str, content: Mapping[str, Any]) -> None:
        """Take a message of the session: an answer, or the state of its recording."""
        if kind == "answer":
            self._answer = content
            self._answered.set()
        else:
            self.recording = content


def run_browser(setup: SessionSetup, ring: PoseRing, folder: str, pipe: Any) -> None:
    """Serve until the pipe closes. The first message to the session is the address of the page.

    The address has the token of the page's commands behind `#`, which browsers send to nobody.
    """
    token, link = secrets.token_urlsafe(24), SessionLink(pipe)
    content = LiveContent(setup.title, setup.skeleton, setup.stations, tuple(setup.calibrations))
    statistics, seen, status_s = LiveStatistics(setup.stations, time.monotonic), 0, 0.0
    uncertainty = ""
    commands: dict[str, Command] = {}
    with ViewServer(content.find, commands, token=token) as server:

        def use(calibration: Calibration) -> None:
            link.ask("calibration", calibration)

        calibration = PageCalibration(setup, Path(folder), use, lambda state: server.publish("calibration", state))
        commands["record"] = lambda wanted: link.ask("record", bool(wanted.get("on")))
        commands["heading"] = lambda wanted: link.ask("heading", None)
        commands["calibrate"] = lambda wanted: _calibrate(calibration, wanted)
        pipe.send(f"{server.url}#{token}")
        try:
            while True:
                while pipe.poll(1.0 / _RATE_HZ):
                    link.take(*pipe.recv())
                seen, records = ring.read(seen)
                stations = ring.station_columns(records)
                for head, columns in zip(records[:, :4], stations, strict=True):
                    frame = PoseRing.frame(head, columns)
                    calibration.add(frame)
                    statistics.add(frame, Status(int(head[3])), float(head[2]))
                if len(records):
                    server.publish("frame", _frame(setup, records[-1], stations[-1]))
                    uncertainty = describe_uncertainty(setup.skeleton, PoseRing.sigma(records[-1]))
                statistics.update()
                if (now_s := time.monotonic()) - status_s >= _STATUS_PERIOD_S:
                    status_s = now_s
                    server.publish(
                        "status", {**statistics.page_content(), **link.recording, "uncertainty": uncertainty}
                    )
        except (EOFError, ConnectionError):  # the session has closed the pipe, or was killed
            return


def _calibrate(calibration: PageCalibration, wanted: Mapping[str, Any]) -> Mapping[str, Any]:
    """Start a calibration of the kind that the page wants; without a kind, stop the one that runs."""
    if kind := str(wanted.get("kind", "")):
        calibration.start(kind)
    else:
        calibration.stop()
    return {}


def _frame(setup: SessionSetup, record: Floats, stations: Floats) -> dict[str, Any]:
    """A frame for the page: joints [mm], of each station its pose, and of each bone how far its end may be off [mm]."""
    sigma_rad = PoseRing.sigma(record)
    room, poses = PoseRing.room(record), list[list[int] | None]()
    for columns in stations:
        poses.append(None)
        if room is not None and (columns[8:10] > 0.0).all():
            at_m = rotations.rotate(room[1], columns[:3]) + room[0]
            turn = rotations.multiply(room[1], columns[3:7])
            poses[-1] = np.rint(1e3 * np.concatenate([at_m, turn])).astype(int).tolist()
    return {
        "number": int(record[0]),
        "joints_mm": joints_mm(setup.skeleton, PoseRing.qpos(record[None])[0]),
        "stations": poses,
        "reach_mm": None
        if sigma_rad is None
        else np.rint(1e3 * bone_reach_m(setup.skeleton, sigma_rad)).astype(int).tolist(),
    }
