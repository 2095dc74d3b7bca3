"""The height of a standing toe, and the posture of other performers, from examples."""

from dataclasses import replace

import numpy as np
import pytest

from harness.body import pose_from_qpos
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.posture_statistics import posture_of_others, toe_height_m
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


def test_the_posture_of_others_leaves_each_performer_out_once(walk: Scene) -> None:
    """Three planted performers, one of them with two takes; weights are square roots of frames."""
    take, at = walk.examples[0], walk.examples[0].qpos[:1]
    shifts, frames, subjects = (0.0, 0.1, 0.4, 0.4), (100, 25, 4, 5), ("a", "b", "c", "c")
    takes = []
    for shift, count, subject in zip(shifts, frames, subjects, strict=True):
        qpos = np.repeat(at, count, axis=0)
        qpos[:, 7] += shift
        qpos[: count // 2, 8] += 0.2  # varies within a take
        takes.append(replace(take, subject=subject, qpos=qpos))
    mean, variance = posture_of_others(MotionDatabase.build(walk.body, takes))
    weights, offsets = np.sqrt([100.0, 25.0, 9.0]), np.array([0.0, 0.1, 0.4])
    hinge = 4
    assert mean[hinge] - at[0, 7] == pytest.approx(np.average(offsets, weights=weights), abs=1e-5)
    deviation = 0.0
    for one in range(3):
        others = np.arange(3) != one
        deviation += weights[one] * (offsets[one] - np.average(offsets[others], weights=weights[others])) ** 2
    assert variance[hinge] == pytest.approx(deviation / weights.sum() + 0.01**2, rel=1e-3)
    assert variance[hinge + 1] > 0.09**2
    assert variance[hinge + 2] == pytest.approx(0.01**2, rel=1e-2)


def test_one_performer_deviates_from_the_own_mean(walk: Scene) -> None:
    alone = [replace(take, subject="p") for take in walk.examples[:2]]
    database = MotionDatabase.build(walk.body, alone)
    mean, variance = posture_of_others(database)
    np.testing.assert_allclose(mean, database.posture.mean(axis=0), atol=1e-5)
    np.testing.assert_allclose(variance, database.posture.astype(float).var(axis=0) + 0.01**2, rtol=1e-3, atol=1e-6)
