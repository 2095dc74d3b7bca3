"""Takes of the rig: rest, sweeps about every axis, and no motion between two places of the body."""

import numpy as np
import pytest

from harness.core import rotations
from harness.errors import UnknownName
from harness.mocap.sources import open_motion_source
from harness.mocap.synthetic.takes import RIG_TAKES, RigTake, generate_rig, stretch_marks

SHORT = "rig_p1_01"


def test_takes_are_clips_of_the_built_in_source() -> None:
    source = open_motion_source("builtin", None, seed=3, rate_hz=None)
    assert set(RIG_TAKES) <= set(source.names())
    clip = source.load(SHORT)
    assert (clip.name, clip.subject, source.behaviour(SHORT), source.subject(SHORT)) == (SHORT, "p1", "rig", "p1")
    np.testing.assert_array_equal(clip.root_m, generate_rig(SHORT).root_m)
    with pytest.raises(UnknownName, match="rig_p1_99"):
        generate_rig("rig_p1_99")


def test_stretches_follow_one_another() -> None:
    take = RigTake(70.0, 40.0, 30.0, 20.0)
    assert take.stretches() == (
        ("static", 0.0, 70.0),
        ("slow", 70.0, 110.0),
        ("fast", 110.0, 140.0),
        ("covered", 140.0, 160.0),
    )
    assert RigTake(5.0, covered_s=2.0).stretches() == (("static", 0.0, 5.0), ("covered", 5.0, 7.0))
    assert stretch_marks(SHORT) == ((0.0, "static"), (70.0, "slow"), (110.0, "fast"), (150.0, "covered"))
    assert stretch_marks("rig_p1_03") == ((0.0, "static"),)
    assert stretch_marks("boxing_p1_01") == ()


def test_each_take_has_its_own_length() -> None:
    assert {name: generate_rig(name).duration_s for name in RIG_TAKES} == {
        "rig_p1_01": 190.0,
        "rig_p1_02": 300.0,
        "rig_p1_03": 1200.0,
        "rig_p1_04": 1380.0,
    }


def test_the_rig_rests_sweeps_and_comes_back() -> None:
    clip, times = generate_rig(SHORT), {name: (begin, end) for name, begin, end in RIG_TAKES[SHORT].stretches()}
    assert not clip.angles_rad.any()
    speed_m_s = np.linalg.norm(np.diff(clip.root_m, axis=0), axis=1) * clip.rate_hz
    turning = rotations.angle_between_rad(clip.world_from_root[1:], clip.world_from_root[:-1]) * clip.rate_hz
    time_s = (np.arange(len(speed_m_s)) + 0.5) / clip.rate_hz

    def of(values: np.ndarray, stretch: str) -> np.ndarray:
        begin_s, end_s = times[stretch]
        return values[(time_s > begin_s) & (time_s < end_s)]

    for stretch in ("static", "covered"):
        assert of(speed_m_s, stretch).max() == of(turning, stretch).max() == 0.0
    assert 0.1 < np.median(of(speed_m_s, "slow")) < 0.5 < np.median(of(speed_m_s, "fast")) < 2.0
    assert 0.1 < np.median(of(turning, "slow")) < 0.7 < np.median(of(turning, "fast")) < 3.0
    np.testing.assert_allclose(clip.root_m[-1], clip.root_m[0], atol=1e-12)
    assert speed_m_s.max() / clip.rate_hz < 0.05  # no jump where stretches meet
    for stretch in ("slow", "fast"):
        begin, end = (round(at_s * clip.rate_hz) for at_s in times[stretch])
        angles = rotations.log(clip.world_from_root[begin:end])
        # Every direction is swept, and so is every axis: room, mounts and heading can be told apart.
        assert np.linalg.svd(clip.root_m[begin:end] - clip.root_m[begin], compute_uv=False)[-1] > 1.0
        assert np.linalg.svd(angles, compute_uv=False)[-1] > 1.0
