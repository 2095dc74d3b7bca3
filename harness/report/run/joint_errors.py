"""Errors at each bone: means over units of the leader and of the control, on the body and as numbers."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from harness.compare.units import Sampling
from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.core.number_format import format_number
from harness.core.text_table import Table
from harness.report.kit.body_chart import BodyGroup, draw_bodies, joint_titles
from harness.report.kit.chart import draw_chart
from harness.report.kit.highlights import Highlights
from harness.report.kit.markup import Markup
from harness.report.kit.style import Chart
from harness.report.kit.table import html_table
from harness.report.run.data import RunData, Trace
from harness.score.pair import hinged_bones, joint_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BONE_ROWS = {
    **{"head": "head", "upperneck": "upper neck", "lowerneck": "lower neck", "thorax": "thorax"},
    **{"upperback": "upper back", "lowerback": "lower back"},
    **{
        f"{side[0]}{bone}": f"{side} {bone}"
        for bone in ("clavicle", "humerus", "radius", "wrist", "hand", "femur", "tibia", "foot")
        for side in ("left", "right")
    },
}
"""Bones with hinges from the top, left and right next to each other, and their labels."""
_HEIGHT_IN = 4.1
JointMeans = Mapping[str, tuple[Floats, Floats]]
"""Series -> mean rotation error [deg] and position error [mm] of each clip, (clips, 22) in the order of BONE_ROWS."""


def means_by_unit(traces: Sequence[Trace], sampling: Sampling) -> tuple[Floats, Floats]:
    """Mean rotation error [deg] and position error [mm] of each unit of statistics, (units, 22) in BONE_ROWS.

    The scored frames of a cell, the cells of a clip and the clips of a unit are averaged. Clips without a scored frame
    are left out.
    """
    skeleton = standard_skeleton()
    bones = [skeleton.names[bone] for bone in hinged_bones(skeleton)]
    rotations = [bones.index(bone) for bone in BONE_ROWS]
    positions = [joint_names(skeleton).index(bone) for bone in BONE_ROWS]
    by_clip: dict[str, list[tuple[Floats, Floats]]] = {}
    for trace in traces:
        if len(trace.rotation_deg):
            rows = (trace.rotation_deg.mean(axis=0)[rotations], trace.position_mm.mean(axis=0)[positions])
            by_clip.setdefault(trace.clip, []).append(rows)
    by_unit: dict[str, list[Floats]] = {}
    for clip, cells in by_clip.items():
        by_unit.setdefault(sampling.unit_of(clip), []).append(np.mean(cells, axis=0))
    means = np.array([np.mean(clips, axis=0) for clips in by_unit.values()]).reshape(-1, 2, len(BONE_ROWS))
    return means[:, 0], means[:, 1]


def highlighted_means(run: RunData, highlights: Highlights) -> JointMeans:
    """The means of the leader and of the control; a series without a scored frame is left out."""
    shown = [name for name in (highlights.leader, highlights.control) if name]
    sampling = Sampling.of_summary(run.full_summary)
    means = {name: means_by_unit([trace for trace in run.traces if trace.series == name], sampling) for name in shown}
    return {name: of for name, of in means.items() if len(of[0])}


def body_chart(means: JointMeans) -> Chart:
    """Bodies with the mean error at each joint, the rotation on the left and the position on the right."""
    groups = _body_groups(means)

    def draw(figure: "Figure") -> None:
        draw_bodies(figure, groups)

    largest = [
        f"{title}: {BONE_ROWS[bone]} {format_number(values[bone], group.unit)} {group.unit}"
        for group in groups
        for title, values in group.bodies.items()
        for bone in [max(values, key=lambda name: values[name])]
    ]
    return draw_chart(
        "joints_body",
        "Error by joint",
        "Mean over units, seen from the front: the body's left side is on the right. Left: rotation of each bone "
        "relative to its parent, at the joint between them. Right: position of each bone's far end. Point at a joint "
        f"for its value. Largest errors: {'; '.join(largest)}.",
        f"The body with a coloured disc at each joint for the error of {' and '.join(means)}. {'; '.join(largest)}.",
        draw,
        _HEIGHT_IN,
        layout=None,
        titles=joint_titles(groups, BONE_ROWS),
    )


def joint_table(means: JointMeans) -> Markup:
    """The numbers of the bodies: a row for each bone."""
    head = ["bone", *(f"{name} [{unit}]" for unit in ("deg", "mm") for name in means)]
    columns = [of[part].mean(axis=0) for part in (0, 1) for of in means.values()]
    units = [unit for unit in ("deg", "mm") for _ in means]
    rows = [
        [label, *(format_number(float(column[n]), unit) for column, unit in zip(columns, units, strict=True))]
        for n, label in enumerate(BONE_ROWS.values())
    ]
    caption = "Mean over units: rotation error relative to the parent [deg], position error of the far end [mm]."
    return html_table(Table(head, rows), caption, label="error by joint")


def _body_groups(means: JointMeans) -> list[BodyGroup]:
    return [
        BodyGroup(
            label,
            unit,
            at_far_end,
            {name: dict(zip(BONE_ROWS, map(float, of[part].mean(axis=0)), strict=True)) for name, of in means.items()},
        )
        for part, (label, unit, at_far_end) in enumerate(
            (("rotation error [deg]", "deg", False), ("position error of the far end [mm]", "mm", True))
        )
    ]
