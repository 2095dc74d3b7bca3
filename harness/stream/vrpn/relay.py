"""Frames of a stream as reports of a VRPN server."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from harness.core.arrays import Floats
from harness.stream.frame import TrackerFrame, TrackerStream
from harness.stream.vrpn.messages import PoseReport
from harness.stream.vrpn.server import VrpnServer


def frame_reports(frame: TrackerFrame, measured_unix_s: Floats) -> list[PoseReport]:
    """The reports of a frame, measured at these times (S,) since 1970 [s]; the row of a station is its sensor.

    A report has no sign that a pose is not valid, so that a station without place or direction sends none.
    """
    rows = (frame.position_valid & frame.orientation_valid & np.isfinite(measured_unix_s)).nonzero()[0].tolist()
    positions_m, quaternions = frame.position_m.tolist(), frame.tracker_from_station.tolist()
    return [
        PoseReport(row, round(1e6 * float(measured_unix_s[row])), tuple(positions_m[row]), tuple(quaternions[row]))
        for row in rows
    ]


def describe_sensors(stations: Sequence[str]) -> str:
    """Sensors with the names of their stations, where these are no numbers: `0 head, 1 torso`."""
    return ", ".join(name if name == str(sensor) else f"{sensor} {name}" for sensor, name in enumerate(stations))


class RelayedStream:
    """A `TrackerStream` whose frames are also sent by a VRPN server, before anyone processes them."""

    def __init__(
        self,
        stream: TrackerStream,
        server: VrpnServer,
        tracker: str,
        measured_unix_s: Callable[[TrackerFrame], Floats],
    ) -> None:
        """`measured_unix_s` gives the times of measurement (S,) of a frame since 1970 [s]."""
        self._stream, self._server, self._tracker, self._unix_s = stream, server, tracker, measured_unix_s

    @property
    def stations(self) -> tuple[str, ...]:
        return self._stream.stations

    def __iter__(self) -> Iterator[TrackerFrame]:
        for frame in self._stream:
            self._server.send(self._tracker, frame_reports(frame, self._unix_s(frame)))
            yield frame

    def close(self) -> None:
        self._stream.close()
