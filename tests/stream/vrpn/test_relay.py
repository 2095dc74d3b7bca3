"""Frames as reports: sensors, times and digits; and a relayed stream."""

import threading
from itertools import islice

import numpy as np

from harness.stream.frame import TrackerFrame
from harness.stream.vrpn.client import VrpnTracker
from harness.stream.vrpn.messages import PoseReport
from harness.stream.vrpn.relay import RelayedStream, describe_sensors, frame_reports
from harness.stream.vrpn.server import VrpnServer
from tests.stream.vrpn.feeder import QUICK, fed_server, port_of


def test_only_whole_poses_become_reports() -> None:
    valid = np.array([True, True, False, True])
    place, turn = np.arange(12.0).reshape(4, 3), np.tile([0.6, 0.0, 0.8, 0.0], (4, 1))
    place[2], turn[1] = np.nan, np.nan
    turned = np.array([True, False, True, True])
    measured = np.array([1.0, 1.0, 1.0, np.nan])
    frame = TrackerFrame(2.0, measured, place, turn, valid, turned, np.ones(4), np.zeros(4, bool))
    assert frame_reports(frame, 1.7e9 + measured) == [
        PoseReport(0, 1_700_000_001_000_000, (0.0, 1.0, 2.0), (0.6, 0.0, 0.8, 0.0))
    ]


def test_sensors_have_the_names_of_stations() -> None:
    assert describe_sensors(("head", "1", "torso")) == "0 head, 1, 2 torso"


def test_a_relayed_tracker_is_the_same_tracker_again() -> None:
    """A server, a client that serves on, and its client: the reports of the last are those of the first."""
    seen: list[PoseReport] = []
    with fed_server() as feeder, VrpnServer(["Again"], port=0) as server:
        tracker = VrpnTracker(port_of(feeder.server), timing=QUICK)
        relayed = RelayedStream(tracker, server, "Again", tracker.measured_unix_s)
        assert relayed.stations == ("0", "1")
        reading = threading.Thread(target=lambda: list(relayed))
        reading.start()
        try:
            port = port_of(server, "Again")
            with VrpnTracker(port, on_report=lambda report, now_s: seen.append(report), timing=QUICK) as again:
                list(islice(again, 40))
        finally:
            relayed.close()
            reading.join()
    begin = feeder.sent.index(seen[0])
    assert len(seen) > 70
    assert seen == feeder.sent[begin : begin + len(seen)]
