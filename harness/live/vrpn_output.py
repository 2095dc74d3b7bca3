"""Live output as a VRPN server: the stations of the tracker, and the joints of the reconstructed body."""

import time
from collections.abc import Callable

import numpy as np

from harness.core.estimate import Status
from harness.live.pose import LivePose, SessionSetup
from harness.stream import OpenTracker
from harness.stream.vrpn import PoseReport, RelayedStream, describe_sensors, open_server

_JOINTS = "-joints"


class VrpnOutput:
    """An `Output` to VRPN clients. NAME has a sensor a station, NAME-joints one a bone: its joint and its rotation."""

    def __init__(
        self, place: str, setup: SessionSetup, *, anywhere: bool = False, say: Callable[[str], None] = lambda text: None
    ) -> None:
        """Open the server at `NAME[@[HOST:]PORT]`. Raises BadInput."""
        self.name = f"--vrpn {place}"
        self._server = open_server(place, ("", _JOINTS), anywhere=anywhere, log=say)
        self._wall_ahead_s = time.time() - time.monotonic()
        stations, joints = self._server.names
        named = describe_sensors(setup.stations)
        bones = setup.skeleton.names
        self.description = (
            f"VRPN: {stations} with the sensors {named}; {joints} with the joints from 0 {bones[0]} to "
            f"{len(bones) - 1} {bones[-1]}"
        )

    def relay(self, device: OpenTracker) -> RelayedStream:
        """The frames of a tracker, which are served as they arrive."""
        return RelayedStream(device, self._server, self._server.trackers[0], device.measured_unix_s)

    def send(self, pose: LivePose) -> None:
        if pose.estimate.status is Status.LOST:
            return
        time_us = round(1e6 * (pose.measured_s + self._wall_ahead_s))
        joints_m, world_from_bone = (np.asarray(values).tolist() for values in pose.bones)
        pairs = enumerate(zip(joints_m, world_from_bone, strict=True))
        reports = [PoseReport(bone, time_us, tuple(place), tuple(turn)) for bone, (place, turn) in pairs]
        self._server.send(self._server.trackers[1], reports)

    def close(self) -> None:
        self._server.close()
