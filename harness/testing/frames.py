"""Frames without a device: exact readings of a known motion, for tests and contract suites."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from harness.body import DEFAULT_MOUNTS, Body, Kinematics, tpose
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.seeds import generator
from harness.simulate import TrackerConfig
from harness.simulate import exact_calibration as place_exactly
from harness.stream import TrackerFrame

SIX_STATIONS = ("left_wrist", "right_wrist", "left_ankle", "right_ankle", "torso", "head")


def exact_calibration(body: Body, stations: Sequence[str] = SIX_STATIONS) -> Calibration:
    """Exact calibration of the default mounts of these stations, with a tracker frame that is not the world frame."""
    room = TrackerConfig(origin_m=(1.0, -2.0, 2.5))
    exact = place_exactly(body, [DEFAULT_MOUNTS[station] for station in stations], room)
    return replace(exact, world_from_tracker=rotations.exp(np.array([np.pi, 0.0, 0.3])))


def exact_frames(body: Body, calibration: Calibration, qpos: Floats, rate_hz: float = 40.0) -> list[TrackerFrame]:
    """Noiseless readings of configurations (T, 55), evenly spaced in time."""
    kinematics = Kinematics(body)
    bones = [body.skeleton.index(bone) for bone in calibration.bones]
    tracker_from_world = rotations.inverse(calibration.world_from_tracker)
    valid, frames = np.ones(len(bones), bool), []
    for index, configuration in enumerate(qpos):
        kinematics.set(configuration)
        position_m, orientation = kinematics.station_poses(bones, calibration.mount_m, calibration.bone_from_station)
        frames.append(
            TrackerFrame(
                received_s=index / rate_hz,
                measured_s=np.full(len(bones), index / rate_hz),
                position_m=rotations.rotate(tracker_from_world, position_m - calibration.tracker_origin_m),
                tracker_from_station=rotations.multiply(tracker_from_world, orientation),
                position_valid=valid,
                orientation_valid=valid,
                quality=valid,
                suspect=~valid,
            )
        )
    return frames


def drop_stations(frame: TrackerFrame, lost: Sequence[int]) -> TrackerFrame:
    """Remove the readings of stations, given by index, from a frame."""
    kept = np.ones(len(frame.quality), bool)
    kept[list(lost)] = False
    return replace(
        frame,
        measured_s=np.where(kept, frame.measured_s, np.nan),
        position_m=np.where(kept[:, None], frame.position_m, np.nan),
        tracker_from_station=np.where(kept[:, None], frame.tracker_from_station, np.nan),
        position_valid=frame.position_valid & kept,
        orientation_valid=frame.orientation_valid & kept,
        quality=np.where(kept, frame.quality, 0.0),
        suspect=frame.suspect & kept,
    )


def swaying_motion(body: Body, frames: int, seed: int = 1, rate_hz: float = 40.0) -> Floats:
    """(T, 55) a smooth motion: the root moves along a curve while every hinge swings."""
    rng = generator(seed, "swaying")
    t = np.arange(frames)[:, None] / rate_hz
    low, high = body.model.jnt_range[1:].T
    out = np.tile(tpose(body.skeleton), (frames, 1))
    out[:, :2] += 0.5 * np.hstack([np.sin(0.4 * t), 1.0 - np.cos(0.4 * t)])
    out[:, 3:7] = rotations.about_z(0.4 * t[:, 0])
    swing = np.minimum(0.3, 0.2 * (high - low)) * np.sin(
        2.0 * np.pi * (rng.uniform(0.2, 0.6, 48) * t + rng.uniform(0.0, 1.0, 48))
    )
    out[:, 7:] = np.clip(out[:, 7:] + swing, low + 0.01, high - 0.01)
    return out
