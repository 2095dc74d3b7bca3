"""The process of `live --view browser`: serves the live page and sends it frames and the state of the line."""

import secrets
import time
from collections.abc import Mapping
from threading import Event, Lock
from typing import Any

import numpy as np

from harness.core import humanoid24, rotations
from harness.core.arrays import Floats
from harness.core.estimate import Status
from harness.core.skeleton import forward_kinematics
from harness.errors import BadInput
from harness.live.live_statistics import LiveStatistics
from harness.live.pose import SessionSetup
from harness.live.shared_memory import PoseRing
from harness.view import LiveContent, ViewServer

_RATE_HZ = 30.0
"""Most frames per second that are sent to the page."""
_STATUS_PERIOD_S = 0.5
_ANSWER_TIMEOUT_S = 10.0


class RecordingCommands:
    """The page's commands to start and stop a recording, carried out by the session at the other end of a pipe."""

    def __init__(self, pipe: Any) -> None:
        self._pipe, self._lock, self._answered = pipe, Lock(), Event()
        self._answer: Mapping[str, Any] = {}
        self.path = ""

    def record(self, wanted: Mapping[str, Any]) -> Mapping[str, Any]:
        """Start or stop a recording, by the entry "on"; BadInput when the session refuses."""
        with self._lock:
            self._answered.clear()
            self._pipe.send(bool(wanted.get("on")))
            if not self._answered.wait(_ANSWER_TIMEOUT_S):
                raise BadInput("The session does not answer.", "Is it still running?")
            answer = self._answer
        if "error" in answer:
            raise BadInput(str(answer["error"]), "")
        return answer

    def take(self, message: Mapping[str, Any]) -> None:
        """Take a message of the session: the path of the recording, an error, or both."""
        self.path = str(message.get("recording", ""))
        if message.get("answer"):
            self._answer = message
            self._answered.set()


def run_browser(setup: SessionSetup, ring: PoseRing, pipe: Any) -> None:
    """Serve until the pipe closes. The first message to the session is the address of the page."""
    token, commands = secrets.token_urlsafe(24), RecordingCommands(pipe)
    content = LiveContent(setup.title, setup.skeleton, setup.stations, token)
    statistics, seen, status_s = LiveStatistics(setup.stations, time.monotonic), 0, 0.0
    with ViewServer(content.find, {"record": commands.record}, token=token) as server:
        pipe.send(server.url)
        try:
            while True:
                while pipe.poll(1.0 / _RATE_HZ):
                    commands.take(pipe.recv())
                seen, records = ring.read(seen)
                stations = ring.station_columns(records)
                for head, columns in zip(records[:, :4], stations, strict=True):
                    statistics.add(PoseRing.frame(head, columns), Status(int(head[3])), float(head[2]))
                if len(records):
                    server.publish("frame", _frame(setup, records[-1:], stations[-1]))
                statistics.update()
                if (now_s := time.monotonic()) - status_s >= _STATUS_PERIOD_S:
                    status_s = now_s
                    server.publish("status", {**statistics.page_content(), "recording": commands.path})
        except (EOFError, ConnectionError):  # the session has closed the pipe, or was killed
            return


def _frame(setup: SessionSetup, record: Floats, stations: Floats) -> dict[str, Any]:
    """A frame for the page: joints [mm], status, and of each station its pose, quality and state."""
    root_m, quaternion, angles_rad = humanoid24.unpack(PoseRing.qpos(record))
    pose = forward_kinematics(setup.skeleton, root_m, quaternion, angles_rad)
    joints_m = np.concatenate([root_m, pose.end_m[0]])
    worn: list[dict[str, Any]] = []
    for columns in stations:
        valid = columns[8:10] > 0.0
        station = {"quality": round(float(columns[7]), 3), "state": 2 - int(valid.sum()), "pose": None}
        if setup.room is not None and valid.all():
            world_from_tracker, origin_m = setup.room
            at_m = rotations.rotate(world_from_tracker, columns[:3]) + origin_m
            turn = rotations.multiply(world_from_tracker, columns[3:7])
            station["pose"] = np.rint(1e3 * np.concatenate([at_m, turn])).astype(int).tolist()
        worn.append(station)
    return {
        "number": int(record[0, 0]),
        "status": int(record[0, 3]),
        "joints_mm": np.rint(1e3 * joints_m).astype(int).ravel().tolist(),
        "stations": worn,
    }
