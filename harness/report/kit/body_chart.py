"""The body from the front with a coloured disc at each joint: errors by joint, for one method or several."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from harness.body import body_geoms
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.core.number_format import format_number
from harness.core.skeleton import BodyGeom, Pose, pose_from_rotations
from harness.report.kit.markup import Markup, tag
from harness.report.kit.style import FAINT, GRID, PAPER, Axes, Figure

if TYPE_CHECKING:
    from matplotlib.cm import ScalarMappable

_COLOURS = "viridis"
_ARM_ANGLE_RAD = np.deg2rad(62.0)
"""Angle by which the arms hang below the horizontal."""
_ARM_BONES = ("humerus", "radius", "wrist", "hand")
_DISC_M, _AROUND = 0.036, np.linspace(0.0, 2.0 * np.pi, 21)
_ALONG, _END_ALONG = {"clavicle": 0.5}, {"hand": 2.2, "foot": 2.2}
"""Where joint and far end of a bone are drawn, as a share of the bone; 0 and 1 for the others. Clavicles and neck share
a joint; wrist and ankle would cover the ends of hand and foot."""


@dataclass(frozen=True)
class BodyGroup:
    """Bodies with one colour bar, one next to the other."""

    label: str
    """Quantity and unit of the colour bar."""
    unit: str
    at_far_end: bool
    """Whether the values belong to the far ends of the bones instead of to their joints."""
    bodies: Mapping[str, Mapping[str, float]]
    """Title -> bone -> value."""


def draw_bodies(figure: Figure, groups: Sequence[BodyGroup]) -> None:
    """Draw the bodies of all groups in one row, and a colour bar from 0 to the largest value below each group.

    The figure needs no layout. The disc of the n-th bone of the m-th body has the gid "joint-m-n"; `joint_titles`
    describes them.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    width = 1.0 / sum(len(group.bodies) for group in groups)
    place = 0
    for group in groups:
        norm = Normalize(0.0, max((max(values.values()) for values in group.bodies.values()), default=1.0))
        colours = ScalarMappable(norm, _COLOURS)
        bar = figure.add_axes((width * (place + 0.08), 0.125, width * (len(group.bodies) - 0.16), 0.028))
        for title, values in group.bodies.items():
            axes = figure.add_axes((width * place, 0.17, width, 0.77))
            _draw_body(axes, values, group, colours, place)
            axes.set_title(title, loc="center", fontsize=9.5)
            place += 1
        figure.colorbar(colours, cax=bar, orientation="horizontal")
        bar.set_xlabel(group.label)
        bar.grid(False)


def joint_titles(groups: Sequence[BodyGroup], names: Mapping[str, str]) -> dict[str, str]:
    """Gid of each disc -> name of the joint and its value."""
    bodies = [(group, title, values) for group in groups for title, values in group.bodies.items()]
    return {
        f"joint-{m}-{n}": f"{names.get(bone, bone)}: {format_number(value, group.unit)} {group.unit} ({title})"
        for m, (group, title, values) in enumerate(bodies)
        for n, (bone, value) in enumerate(values.items())
    }


def _draw_body(axes: Axes, values: Mapping[str, float], group: BodyGroup, colours: "ScalarMappable", body: int) -> None:
    from matplotlib.patches import Circle, Polygon

    for outline in body_outlines():
        axes.add_patch(Polygon(outline, facecolor=GRID, edgecolor="none"))
    faces = np.asarray(colours.to_rgba(np.array(list(values.values()))))
    for n, bone in enumerate(values):
        style = {"facecolor": faces[n], "edgecolor": PAPER, "linewidth": 0.8}
        axes.add_patch(Circle(_place(bone, group.at_far_end), _DISC_M, gid=f"joint-{body}-{n}", **style))
    for across, side in ((-0.6, "right"), (0.6, "left")):
        axes.text(across, 0.7, side, ha="left" if across < 0.0 else "right", color=FAINT, fontsize=9.5)
    axes.set_xlim(-0.62, 0.62)
    axes.set_ylim(-1.03, 0.84)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _place(bone: str, at_far_end: bool) -> tuple[float, float]:
    """Where a joint is drawn, seen from the front: the body's left side is on the right [m]."""
    skeleton, pose = standard_skeleton(), standing_pose()
    index = skeleton.index(bone)
    start, end = pose.start_m[0, index], pose.end_m[0, index]
    share = _END_ALONG.get(bone[1:], 1.0) if at_far_end else _ALONG.get(bone[1:], 0.0)
    _, across, up = start + share * (end - start)
    return float(across), float(up)


def standing_body() -> Markup:
    """The body as a picture of class "waiting", seen from the front [cm]."""
    lines = [" ".join(f"{100.0 * x:.1f},{-100.0 * z:.1f}" for x, z in outline) for outline in body_outlines()]
    shapes = [tag("polygon", points=points) for points in lines]
    return tag("svg", *shapes, class_="waiting", viewBox="-62 -84 124 187", aria_hidden="true")


@lru_cache(maxsize=1)
def standing_pose() -> Pose:
    """The standard body with its arms hanging, its root at the origin."""
    skeleton = standard_skeleton()
    world_from_bone = np.tile(np.eye(3), (1, len(skeleton.names), 1, 1))
    for n, bone in enumerate(skeleton.names):
        if bone[1:] in _ARM_BONES:
            angle = -_ARM_ANGLE_RAD if bone[0] == "l" else _ARM_ANGLE_RAD
            world_from_bone[0, n] = rotations.to_matrix(rotations.exp(np.array([angle, 0.0, 0.0])))
    return pose_from_rotations(skeleton, np.zeros((1, 3)), world_from_bone)


@lru_cache(maxsize=1)
def body_outlines() -> tuple[Floats, ...]:
    """(N, 2) outline of each part of the body, seen from the front [m]."""
    return tuple(_each_outline())


def _each_outline() -> Iterator[Floats]:
    skeleton, pose = standard_skeleton(), standing_pose()
    for geom in body_geoms(skeleton):
        if geom.bone == "root":
            start_m, turn = np.zeros(3), np.eye(3)
        else:
            bone = skeleton.index(geom.bone)
            start_m, turn = pose.start_m[0, bone], pose.world_from_bone[0, bone]
        yield project_outline(geom, turn) + (start_m + turn @ geom.centre_m)[1:]


def project_outline(geom: BodyGeom, world_from_bone: Floats) -> Floats:
    """(21, 2) outline of a geom seen along x, about its centre [m]."""
    axes = world_from_bone @ rotations.to_matrix(geom.bone_from_shape)
    circle = np.stack([np.cos(_AROUND), np.sin(_AROUND)], axis=1)
    if geom.kind == "capsule":
        half = geom.size_m[1] * axes[1:, 2]
        out: Floats = geom.size_m[0] * circle + np.sign(circle @ half)[:, None] * half
        return out
    shadow = (axes * geom.size_m)[1:]  # the ellipse is what this maps the unit ball to
    ellipse: Floats = circle @ np.linalg.cholesky(shadow @ shadow.T).T
    return ellipse
