"""Errors on synthetic motion are neither trivial nor random: training data reduces them, but not to zero."""

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import Clip
from harness.core.skeleton import forward_kinematics
from harness.mocap import synthetic

STATIONS = {"head": 0.5, "thorax": 0.5, "lhand": 0.5, "rhand": 0.5, "ltibia": 0.9, "rtibia": 0.9}
"""Bones with a tracker, and its place along the bone."""
JUDGED = [("p1", 1), ("p3", 3), ("p5", 2), ("p8", 4)]


def features(clip: Clip, every: int) -> tuple[Floats, Floats]:
    """Readings of six trackers relative to the chest's heading (N, 54), and the hinge angles (N, 48) [rad]."""
    frames = slice(None, None, every)
    angles = clip.angles_rad[frames]
    pose = forward_kinematics(clip.skeleton, clip.root_m[frames], clip.world_from_root[frames], angles)
    bones = [clip.skeleton.index(bone) for bone in STATIONS]
    share = np.array(list(STATIONS.values()))[:, None]
    position = pose.start_m[:, bones] * (1.0 - share) + pose.end_m[:, bones] * share
    turn = pose.world_from_bone[:, bones]
    ahead = turn[:, 1, :, 0]
    level = rotations.to_matrix(rotations.about_z(-np.arctan2(ahead[:, 1], ahead[:, 0])))
    position = np.einsum("tij,tsj->tsi", level, position - position[:, 1:2] * [1.0, 1.0, 0.0])
    turn = level[:, None] @ turn
    flat = (position.reshape(len(angles), -1), 0.3 * turn[..., :2].reshape(len(angles), -1))
    return np.concatenate(flat, axis=1), angles


def squared_distance(a: Floats, b: Floats) -> Floats:
    out: Floats = np.sum(a**2, axis=1)[:, None] + np.sum(b**2, axis=1) - 2.0 * a @ b.T
    return out


def mean_error_deg(estimate: Floats, truth: Floats) -> float:
    return float(np.rad2deg(np.abs((estimate - truth + np.pi) % (2.0 * np.pi) - np.pi)).mean())


@pytest.mark.long
@pytest.mark.parametrize("behaviour", synthetic.BEHAVIOURS)
def test_learning_from_other_takes_beats_the_mean_pose_threefold(behaviour: str) -> None:
    """Kernel ridge regression from tracker readings to angles, trained on all takes but the test take."""
    takes = {
        (who, take): features(synthetic.generate(behaviour, who, take, seed=7, rate_hz=30.0), 10)
        for who in synthetic.REFERENCE_PERFORMERS
        for take in range(1, 5)
    }
    for judged in JUDGED:
        seen = [pair for key, pair in takes.items() if key != judged]
        x, y = (np.concatenate(part) for part in zip(*seen, strict=True))
        middle, spread, mean = x.mean(axis=0), x.std(axis=0) + 0.02, y.mean(axis=0)
        x = (x - middle) / spread
        width = 2.0 * x.shape[1]
        kernel = np.exp(-squared_distance(x, x) / width)
        weights = np.linalg.solve(kernel + 1e-3 * np.eye(len(x)), y - mean)
        x_new, truth = takes[judged]
        near = np.exp(-squared_distance((x_new - middle) / spread, x) / width)
        learnt, guessed = mean_error_deg(mean + near @ weights, truth), mean_error_deg(mean, truth)
        assert 0.5 < learnt < 4.0, f"{judged}: learnt {learnt:.2f} deg"
        assert guessed > 3.0 * learnt, f"{judged}: mean pose {guessed:.2f} deg, learnt {learnt:.2f} deg"
