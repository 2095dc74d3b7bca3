"""Joint centres of configurations, for tests of poses."""

import numpy as np

from harness.body import pose_from_qpos
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton


def joint_centres_m(skeleton: Skeleton, qpos: Floats) -> Floats:
    """(T, 25, 3) positions of the root, then of each bone's far end, for configurations (T, 55) [m]."""
    return np.concatenate([qpos[:, None, :3], pose_from_qpos(skeleton, qpos).end_m], axis=1)
