"""The body from the front or from behind, and discs where stations may be worn.

Pictures are drawn as outlines, so that every page has them, without OpenGL and on light and dark screens.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from harness.body import Mount, locate_mount
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.report.kit.body_chart import body_outlines, standing_pose
from harness.report.kit.style import GRID, INK, PAPER, Axes
from harness.results.findings import CandidatePlace

HALF_WIDTH_M, LOW_M, HIGH_M = 0.62, -0.99, 0.78
"""Half of the width that a view shows, and its lower and upper end, from the root [m]."""
DISC_M = 0.042
"""Radius of a disc [m]."""


def locate_places(places: Sequence[CandidatePlace]) -> tuple[Floats, Floats]:
    """(N, 3) positions of places on the standing body, from its root [m], and (N, 3) their outward normals."""
    skeleton, pose = standard_skeleton(), standing_pose()
    at_m, outward = np.empty((len(places), 3)), np.empty((len(places), 3))
    for n, place in enumerate(places):
        mount = Mount(place.name, place.bone, place.along, float(np.deg2rad(place.around_deg)), place.stand_off_m)
        local_m, bone_from_station = locate_mount(skeleton, mount)
        start_m, turn = np.zeros(3), np.eye(3)
        if place.bone in skeleton.names:
            bone = skeleton.index(place.bone)
            start_m, turn = pose.start_m[0, bone], pose.world_from_bone[0, bone]
        at_m[n] = start_m + turn @ local_m
        outward[n] = turn @ rotations.rotate(bone_from_station, np.array([0.0, 0.0, 1.0]))
    return at_m, outward


def draw_outline(axes: Axes, *, behind: bool = False, half_width_m: float = HALF_WIDTH_M) -> None:
    """Draw the body on empty axes. From the front its left side is on the right."""
    from matplotlib.patches import Polygon

    side = -1.0 if behind else 1.0
    for outline in body_outlines():
        axes.add_patch(Polygon(outline * (side, 1.0), facecolor=GRID, edgecolor="none"))
    axes.set_xlim(-half_width_m, half_width_m)
    axes.set_ylim(LOW_M, HIGH_M)
    axes.set_aspect("equal")
    axes.set_axis_off()


def draw_station(axes: Axes, at: tuple[float, float], colour: str, *, hollow: bool = False, scale: float = 1.0) -> None:
    """Draw the disc of a station at a point of a view [m]; a hollow one is a ring."""
    from matplotlib.patches import Circle

    look: dict[str, Any] = {"facecolor": colour, "edgecolor": PAPER, "linewidth": 1.0}
    if hollow:
        look = {"facecolor": PAPER, "edgecolor": colour, "linewidth": 1.6}
    axes.add_patch(Circle(at, scale * DISC_M, zorder=3, **look))


def draw_ring(axes: Axes, at: tuple[float, float]) -> None:
    """Draw the ring of a recommended station around its disc."""
    from matplotlib.patches import Circle

    axes.add_patch(Circle(at, DISC_M + 0.026, facecolor="none", edgecolor=INK, linewidth=2.0, zorder=4))
