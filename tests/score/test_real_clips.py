"""Scores on real motion: the doctor's checks hold there, and feet are found on the ground."""

from pathlib import Path

import numpy as np
import pytest

from harness.core.humanoid24 import pack, standard_skeleton
from harness.core.motion import BodyMotion
from harness.mocap import MotionLibrary
from harness.score.null_methods import score_null_methods
from harness.testing import doctor
from harness.testing.doctor import check_scores


@pytest.mark.parametrize("name", ["16_15", "64_01", "13_39"])
def test_a_real_clip_is_scored_soundly(mocap: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """By evo too, for one of them: it takes seconds to start."""
    if name != "64_01":
        monkeypatch.setattr(doctor, "find_evo", lambda: None)
    clip = MotionLibrary(mocap).load(name)
    skeleton, dofs = clip.skeleton.subset(standard_skeleton().names)
    qpos = pack(clip.root_m, clip.world_from_root, clip.angles_rad[:, dofs])[::3]
    take = BodyMotion(clip.name, clip.subject, clip.source, clip.behaviour, clip.rate_hz / 3, qpos)
    checks = check_scores([take], skeleton)
    assert all(check.ok for check in checks), [c for c in checks if not c.ok]
    truth = score_null_methods(skeleton, take.rate_hz, qpos)["oracle"]
    assert np.isfinite(truth.per_frame["foot_skate_true_mm_s"][truth.scored]).mean() > 0.6  # share of time in contact
    for metric, most in (("foot_skate_true_mm_s", 100.0), ("float_true_mm", 10.0), ("penetration_true_mm", 15.0)):
        value = truth.metrics[metric]
        assert value is not None
        assert value < most, metric
