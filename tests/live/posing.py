"""Poses for tests of outputs, made without a tracker."""

import numpy as np

from harness.body import Kinematics, build_body, tpose
from harness.core.arrays import Floats
from harness.core.estimate import Estimate, Status
from harness.live.pose import LivePose
from harness.stream import TrackerFrame


def frame(at_s: float, measured_s: float | None = None, stations: int = 2) -> TrackerFrame:
    """A pose with these times; both clocks start together by default."""
    stamp_s = at_s if measured_s is None else measured_s
    return TrackerFrame(
        received_s=at_s,
        measured_s=np.full(stations, stamp_s),
        position_m=np.zeros((stations, 3)),
        tracker_from_station=np.tile([1.0, 0.0, 0.0, 0.0], (stations, 1)),
        position_valid=np.ones(stations, bool),
        orientation_valid=np.ones(stations, bool),
        quality=np.ones(stations),
        suspect=np.zeros(stations, bool),
    )


def configuration(rng: np.random.Generator, spread_rad: float = 0.3) -> Floats:
    """(55,) random configuration near the T-pose."""
    qpos = np.array(tpose(build_body().skeleton))
    qpos[:3] += rng.normal(scale=0.5, size=3)
    qpos[3:7] = rng.normal(size=4)
    qpos[3:7] /= np.linalg.norm(qpos[3:7])
    qpos[7:] += rng.normal(scale=spread_rad, size=48)
    return qpos


def live_pose(qpos: Floats, number: int = 0, at_s: float = 0.0, kinematics: Kinematics | None = None) -> LivePose:
    worn = kinematics or Kinematics(build_body())
    return LivePose(number, frame(at_s), at_s, at_s, at_s, Estimate(qpos, Status.SOLVED), worn)
