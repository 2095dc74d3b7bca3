"""Motion to view: built-in clips whose estimates are the truth moved sideways."""

import numpy as np

from harness.core import rotations
from harness.core.skeleton import Skeleton, forward_kinematics
from harness.mocap.synthetic import generate
from harness.report.kit.motion_player import NO_ESTIMATE, PlayerClip, PlayerStations, PlayerTrack

RATE_HZ, FRAMES = 40.0, 40
METHODS = ("ik", "map")


def make_clip(behaviour: str = "walking") -> tuple[Skeleton, PlayerClip]:
    """A clip of one second whose second method has no estimate in frame 3, and one station that is lost there."""
    made = generate(behaviour, "p1", 1, seed=1, duration_s=FRAMES / RATE_HZ, rate_hz=RATE_HZ)
    pose = forward_kinematics(made.skeleton, made.root_m, made.world_from_root, made.angles_rad)
    joints_m = np.concatenate([made.root_m[:, None], pose.end_m], axis=1)[:FRAMES]
    solved = np.zeros(FRAMES, dtype=np.int64)
    third = np.arange(FRAMES) == 3
    tracks = [
        PlayerTrack("ik", np.add(joints_m, [0.0, 0.05, 0.0]), solved),
        PlayerTrack("map", np.add(joints_m, [0.0, 0.2, 0.0]), np.where(third, NO_ESTIMATE, 0)),
    ]
    turn = np.tile(rotations.IDENTITY, (FRAMES, 1, 1))
    stations = PlayerStations(("head",), joints_m[:, 6:7], turn, np.where(third, 2, 0)[:, None])
    time_s = np.arange(FRAMES) / RATE_HZ
    truth = PlayerTrack("truth", joints_m, solved)
    return made.skeleton, PlayerClip(behaviour, behaviour, time_s, 0.0, truth, tracks, stations)
