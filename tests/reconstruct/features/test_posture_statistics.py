"""The height of a standing toe, from examples."""

from dataclasses import replace

import numpy as np
import pytest

from harness.body import pose_from_qpos
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.posture_statistics import toe_height_m
from tests.reconstruct.conftest import Scene


def test_it_is_the_median_of_the_lower_toe_and_follows_the_floor(walk: Scene) -> None:
    skeleton = walk.body.skeleton
    bones = [skeleton.index("lfoot"), skeleton.index("rfoot")]
    for raised_m in (0.0, 0.3):
        takes = []
        for take in walk.examples:
            qpos = np.array(take.qpos)
            qpos[:, 2] += raised_m
            takes.append(replace(take, qpos=qpos))
        toes_m = np.concatenate([pose_from_qpos(skeleton, take.qpos).end_m[:, bones, 2] for take in takes])
        expected = np.median(toes_m.min(axis=1))
        found = toe_height_m(walk.body, MotionDatabase.build(walk.body, takes))
        assert found == pytest.approx(expected, abs=1e-4)
        assert 0.02 < found - raised_m < 0.08
