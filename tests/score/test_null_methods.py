"""The scale of the scores, and the doctor that reads it."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.core.motion import BodyMotion
from harness.score.metrics import FRAME_METRICS
from harness.score.null_methods import NULL_METHODS, mean_pose, score_null_methods
from harness.testing import doctor
from tests.scored_run import RATE_HZ


@pytest.fixture
def take(truth_qpos: Floats) -> BodyMotion:
    return BodyMotion("walk_01", "a", "by hand", "walking", RATE_HZ, truth_qpos)


def test_null_methods_bound_the_scale(truth_qpos: Floats) -> None:
    found = {name: s.metrics for name, s in score_null_methods(standard_skeleton(), RATE_HZ, truth_qpos).items()}
    assert list(found) == list(NULL_METHODS)
    angle = {name: metrics["joint_angle_mean_deg"] or 0.0 for name, metrics in found.items()}
    assert angle["oracle"] == 0.0
    assert 0.0 < angle["last_value"] < 0.2 * angle["frozen_pose"]
    assert angle["last_value"] < angle["mean_pose"] < angle["frozen_pose"]
    assert found["last_value"]["lag_ms"] == pytest.approx(1e3 / RATE_HZ)
    assert found["mean_pose"]["root_position_mm"] == 0.0
    assert found["frozen_pose"]["jitter_m_s3"] == 0.0
    assert found["frozen_pose"]["lag_ms"] is None  # what does not move cannot be late


def test_the_mean_pose_keeps_the_root_and_stills_every_hinge(truth_qpos: Floats) -> None:
    found = mean_pose(truth_qpos)
    np.testing.assert_array_equal(found[:, :7], truth_qpos[:, :7])
    np.testing.assert_allclose(found[:, 7:], np.tile(truth_qpos[:, 7:].mean(axis=0), (len(found), 1)), atol=1e-12)


@pytest.fixture
def _without_evo(monkeypatch: pytest.MonkeyPatch) -> None:
    """Which takes seconds to start and has a test of its own."""
    monkeypatch.setattr(doctor, "find_evo", lambda: None)


@pytest.mark.usefixtures("_without_evo")
def test_the_doctor_finds_these_scores_sound(take: BodyMotion) -> None:
    checks = doctor.check_scores([take])
    assert all(check.ok for check in checks), [c for c in checks if not c.ok]
    assert len({check.name for check in checks}) == len(checks) >= 6
    assert set(checks[0]._asdict()) == {"name", "ok", "detail"}


@pytest.mark.usefixtures("_without_evo")
@pytest.mark.parametrize(
    ("name", "fails"),
    [
        ("mpjpe_mm", "moved 50 mm"),
        ("joint_angle_mean_deg", "null methods"),
        ("mpjre_deg", "scores zero"),
        ("root_position_mm", "scores zero"),
    ],
)
def test_the_doctor_finds_a_wrong_metric(
    take: BodyMotion, name: str, fails: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A metric made wrong by hand: a check must fail, or the checks are worth nothing."""
    right = FRAME_METRICS[name]
    wrong = {"mpjpe_mm": lambda p: 1.01 * right(p), "joint_angle_mean_deg": lambda p: 0.0 * right(p)}
    monkeypatch.setitem(FRAME_METRICS, name, wrong.get(name, lambda p: right(p) + 1e-3))
    failed = [check.name for check in doctor.check_scores([take]) if not check.ok]
    assert any(fails in failure for failure in failed), failed


@pytest.mark.usefixtures("_without_evo")
def test_evo_is_asked_only_where_it_is_installed(take: BodyMotion) -> None:
    (check,) = [c for c in doctor.check_scores([take]) if "evo" in c.name]
    assert check.ok
    assert "not installed" in check.detail


def test_evo_and_the_root_position_agree(take: BodyMotion) -> None:
    if doctor.find_evo() is None:
        pytest.skip("evo is not installed (extra dev)")
    (check,) = [c for c in doctor.check_scores([take]) if "evo" in c.name]
    assert check.ok, check.detail
    assert np.isfinite(float(check.detail.split()[1]))
