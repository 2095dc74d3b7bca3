"""Stated uncertainty as a line of text, and as the distance to which it moves each bone."""

import numpy as np
import pytest

from harness.body import build_body
from harness.core.arrays import Floats
from harness.core.estimate import HALF_WIDTH_95
from harness.live.file_outputs import hinges_in_qpos_order
from harness.live.stated_uncertainty import bone_reach_m, describe_uncertainty

SKELETON = build_body().skeleton


def sigma_rad(**degrees: float) -> Floats:
    """(48,) 2 degrees, but for the hinges that are named, such as `lfemur_ry`; in the order of `qpos`."""
    names = [SKELETON.dof_names[d].replace(".", "_") for d in hinges_in_qpos_order(SKELETON)]
    assert set(degrees) <= set(names)
    return np.deg2rad([degrees.get(name, 2.0) for name in names])


@pytest.mark.parametrize(
    ("hinge", "bone"), [("lfemur_rx", "left femur"), ("rhumerus_rz", "right humerus"), ("lowerback_rx", "lowerback")]
)
def test_the_text_has_the_mean_and_the_largest_hinge(hinge: str, bone: str) -> None:
    text = describe_uncertainty(SKELETON, sigma_rad(**{hinge: 8.0}))
    mean, largest = HALF_WIDTH_95 * (47 * 2.0 + 8.0) / 48, HALF_WIDTH_95 * 8.0
    assert text == f"stated 95 % region of hinge angles: ±{mean:.1f}° on average; largest: {bone} ±{largest:.1f}°"


def test_a_method_without_standard_deviations_is_said_to_have_none() -> None:
    assert describe_uncertainty(SKELETON, None) == "the method states no uncertainty"


def test_a_bone_is_moved_by_its_least_certain_hinge() -> None:
    reach_m = bone_reach_m(SKELETON, sigma_rad(lfemur_ry=8.0, rtibia_rx=80.0))
    expected_m = SKELETON.length_m * np.sin(np.deg2rad(2.0 * HALF_WIDTH_95))
    femur, tibia = SKELETON.index("lfemur"), SKELETON.index("rtibia")
    expected_m[femur] = SKELETON.length_m[femur] * np.sin(np.deg2rad(8.0 * HALF_WIDTH_95))
    expected_m[tibia] = SKELETON.length_m[tibia]  # beyond a right angle the end is anywhere around the joint
    expected_m[[not hinges for hinges in SKELETON.hinges]] = 0.0
    np.testing.assert_allclose(reach_m, expected_m, rtol=1e-12)
