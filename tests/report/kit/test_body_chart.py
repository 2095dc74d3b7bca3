"""The body with errors: discs lie at the joints, in the colours of their values, outlines are those of geoms."""

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from harness.core.skeleton import BodyGeom
from harness.report.kit.body_chart import BodyGroup, draw_bodies, joint_titles, project_outline

VALUES = {"lfemur": 4.0, "rfemur": 1.0, "lhand": 2.0}
GROUP = BodyGroup("error [deg]", "deg", False, {"leader": VALUES, "control": {"head": 8.0}})


def discs(figure: Figure) -> dict[str, Circle]:
    patches = [patch for axes in figure.axes for patch in axes.patches if isinstance(patch, Circle)]
    return {str(patch.get_gid()): patch for patch in patches}


def test_discs_have_the_place_and_the_colour_of_their_joint() -> None:
    figure = Figure(figsize=(8.0, 4.0))
    draw_bodies(figure, [GROUP])
    found = discs(figure)
    assert set(found) == {"joint-0-0", "joint-0-1", "joint-0-2", "joint-1-0"}
    left, right, hand, head = (np.array(found[gid].get_center()) for gid in sorted(found))
    assert left[0] > 0.05 > -0.05 > right[0], "the body's left side is on the right"
    assert left[1] == pytest.approx(right[1], abs=0.01)
    assert hand[1] < 0.1, "the arms hang"
    assert head[1] > 0.5
    for gid, value in (("joint-0-0", 4.0), ("joint-0-1", 1.0), ("joint-1-0", 8.0)):
        assert to_rgb(found[gid].get_facecolor()) == pytest.approx(colormaps["viridis"](value / 8.0)[:3], abs=0.01)


def test_far_ends_are_drawn_beyond_the_joints() -> None:
    figure = Figure(figsize=(8.0, 4.0))
    draw_bodies(figure, [GROUP, BodyGroup("error [mm]", "mm", True, {"leader": VALUES})])
    found = discs(figure)
    hip, knee = (np.array(found[gid].get_center()) for gid in ("joint-0-0", "joint-2-0"))
    assert hip[1] - knee[1] > 0.3


def test_titles_name_joint_value_and_method() -> None:
    assert joint_titles([GROUP], {"lfemur": "left femur"})["joint-0-0"] == "left femur: 4.00 deg (leader)"


def test_the_outline_of_a_capsule_and_of_an_ellipsoid() -> None:
    quarter = np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0])  # z becomes -y
    capsule = BodyGeom("root", "c", "capsule", np.zeros(3), quarter, np.array([0.1, 0.4, 0.0]), 1.0)
    outline = project_outline(capsule, np.eye(3))
    np.testing.assert_allclose(np.abs(outline).max(axis=0), [0.5, 0.1], atol=1e-3)
    ellipsoid = BodyGeom("root", "e", "ellipsoid", np.zeros(3), quarter, np.array([0.1, 0.2, 0.4]), 1.0)
    outline = project_outline(ellipsoid, np.eye(3))
    np.testing.assert_allclose(np.abs(outline).max(axis=0), [0.4, 0.2], atol=1e-3)
