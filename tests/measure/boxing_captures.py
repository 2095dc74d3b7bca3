"""Boxing as six simulated stations report it through the device's bytes, with the true values of the registration."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.body import Body, bone_poses
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import BONES
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.experiment.scenarios import load_scenario
from harness.measure.pose_series import MeasuredPoses, TruthPoses
from harness.simulate import Noise, TrackerConfig, simulate_tracker


@dataclass(frozen=True)
class BoxingCapture:
    """Stations, truth, and what the registration should find."""

    stations: Mapping[str, MeasuredPoses]
    truths: Mapping[str, TruthPoses]
    body_of: Mapping[str, str]
    mounts: Mapping[str, tuple[Floats, Floats]]
    """Position with the session's offset [m], and `body_from_station`."""
    scale: float
    tracker_origin_m: Floats
    world_from_tracker: Floats


def capture_boxing(body: Body, take: BodyMotion, noise: Noise, seed: int) -> BoxingCapture:
    """Six stations at 40 Hz, as a driver delivers their frames."""
    mounts = load_scenario("builtin_boxing").nominal_mounts
    found = simulate_tracker(body, take, mounts, TrackerConfig(rate_hz=40.0), noise, seed=seed)
    exact = found.calibration
    place, turn = bone_poses(body.skeleton, take.qpos)
    time_s = np.arange(len(take)) / take.rate_hz
    stations, reported = {}, {}
    for row, (station, mount_m) in enumerate(zip(exact.stations, exact.mount_m, strict=True)):
        pose = [
            np.array([getattr(frame, name)[row] for frame in found.frames])
            for name in ("measured_s", "position_m", "tracker_from_station", "position_valid")
        ]
        stations[station] = MeasuredPoses(pose[0], pose[1], pose[2], pose[3].astype(bool))
        offset_m = np.zeros(3)
        if noise.session:
            draws = generator(seed, "noise", take.name, "session", station).normal(size=3)
            offset_m = noise.session.station_offset_m * draws
        mount = exact.bone_from_station[row]
        reported[station] = (mount_m + rotations.rotate(mount, offset_m), mount)
    scale = 0.0
    if noise.session:
        scale = noise.session.scale * float(generator(seed, "noise", take.name, "session", "").normal())
    bodies = {bone: TruthPoses(time_s, place[:, BONES.index(bone)], turn[:, BONES.index(bone)]) for bone in exact.bones}
    body_of = dict(zip(exact.stations, exact.bones, strict=True))
    return BoxingCapture(stations, bodies, body_of, reported, scale, exact.tracker_origin_m, exact.world_from_tracker)
