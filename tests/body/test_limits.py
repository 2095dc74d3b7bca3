"""Share of real motion outside the joint limits, for clips that the limits were not derived from."""

from pathlib import Path

import numpy as np
import pytest

from harness.body import retargeting
from harness.core import humanoid24
from harness.core.arrays import Floats
from harness.mocap import MotionLibrary

CLIPS = (
    *("13_17", "14_02", "16_16", "16_22", "16_31", "02_01", "07_05", "29_01", "49_01"),
    *("16_02", "16_05", "14_08", "127_25", "01_01", "02_04", "64_01", "02_07"),
)
"""Names of the test clips."""
KINDS = ("own skeleton", "standard body", "without the margin")
MARGIN_RAD = np.deg2rad(10.0)
"""Margin of the limits around the envelope of other clips."""


def excess_rad(angles_rad: Floats, margin_rad: float = 0.0) -> Floats:
    """(T, 48) excess of each principal angle over its limits, which are narrowed by a margin [rad]."""
    skeleton = humanoid24.standard_skeleton()
    angles = np.array(angles_rad)
    for where in skeleton.dof_of_bone:
        if where.stop - where.start == 3:
            middle = angles[:, where.start + 1]
            beyond = np.cos(middle) < 0.0
            angles[:, where] = np.where(beyond[:, None], angles[:, where] * [1, -1, 1] + np.pi, angles[:, where])
    low, high = humanoid24.limits_rad().T + margin_rad * np.array([[1.0], [-1.0]])
    turns = 2 * np.pi * np.arange(-3, 4)[:, None, None]
    beyond_low, beyond_high = low - (angles + turns), (angles + turns) - high
    out: Floats = np.min(np.maximum(0.0, np.maximum(beyond_low, beyond_high)), axis=0)
    return out


def test_the_measure_sees_turns_and_twins(rng: np.random.Generator) -> None:
    low, high = humanoid24.limits_rad().T
    inside = rng.uniform(np.maximum(low, -np.pi / 2), np.minimum(high, np.pi / 2), size=(50, 48))
    assert np.max(excess_rad(inside + 2 * np.pi * rng.integers(-2, 3, size=(50, 48)))) < 1e-9
    thigh = humanoid24.standard_skeleton().dof_of_bone[humanoid24.BONES.index("lfemur")]
    twin = np.array(inside)
    twin[:, thigh] = twin[:, thigh] * [1, -1, 1] + np.pi
    assert np.max(excess_rad(twin)) < 1e-9
    knee = humanoid24.standard_skeleton().dof_names.index("ltibia.rx")
    inside[:, knee] = high[knee] + 0.1
    np.testing.assert_allclose(excess_rad(inside)[:, knee], 0.1, atol=1e-9)


def test_truth_is_seldom_outside_the_joint_limits(mocap: Path, capsys: pytest.CaptureFixture[str]) -> None:
    library, standard = MotionLibrary(mocap), humanoid24.standard_skeleton()
    own, common, envelope = [], [], []
    for name in CLIPS:
        clip = library.load(name)
        _, dofs = clip.skeleton.subset(humanoid24.BONES)
        take, _ = retargeting.retarget_to_common_body(clip, standard)
        own.append(np.rad2deg(excess_rad(clip.angles_rad[:, dofs])))
        envelope.append(np.rad2deg(excess_rad(clip.angles_rad[:, dofs], MARGIN_RAD)))
        common.append(np.rad2deg(excess_rad(humanoid24.unpack(take.qpos)[2])))
    lines = [f"{'share of frames outside, worst excess':40}" + "".join(f"{kind:>24}" for kind in KINDS)]
    found = [np.concatenate(excess_deg) for excess_deg in (own, common, envelope)]
    for dof, name in enumerate(standard.dof_names):
        if any(np.any(excess_deg[:, dof]) for excess_deg in found):
            lines.append(f"{name:40}" + "".join(_cell(excess_deg[:, dof]) for excess_deg in found))
    lines.append(f"{'all 48 hinges':40}" + "".join(_cell(excess_deg) for excess_deg in found))
    with capsys.disabled():
        print(f"\n{len(CLIPS)} test clips, {len(found[0])} frames", *lines, sep="\n  ")
    for excess_deg, percent in zip(found, (0.05, 0.5, 0.5), strict=True):
        share = 100.0 * np.mean(excess_deg > 0.0, axis=0)
        assert np.mean(share) < percent
        assert np.max(share) < 10 * percent


def _cell(excess_deg: Floats) -> str:
    return f"{100.0 * np.mean(excess_deg > 0.0):14.3f} %, {np.max(excess_deg):4.1f} deg"
