"""Errors at each bone and hinge: means on the body, distributions, and errors against stated deviations."""

from collections.abc import Mapping, Sequence

import numpy as np

from harness.compare import Sampling
from harness.core.arrays import Floats
from harness.core.estimate import HALF_WIDTH_95
from harness.core.humanoid24 import standard_skeleton
from harness.core.number_format import format_number
from harness.report.kit.axes import label_rows, set_root_scale
from harness.report.kit.body_chart import BodyGroup, draw_bodies, joint_titles
from harness.report.kit.chart import draw_chart
from harness.report.kit.error_lines import Highlights
from harness.report.kit.page import DataTable, Drawing
from harness.report.kit.style import COLOURS, FAINT, INK, Axes, Chart, Figure
from harness.report.run.data import RunData, Trace
from harness.score import hinged_bones, joint_names

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


def body_drawing(means: JointMeans) -> Drawing:
    """Bodies with the mean error at each joint, the rotation on the left and the position on the right, and numbers."""
    groups = _body_groups(means)

    def draw(figure: Figure) -> None:
        draw_bodies(figure, groups)

    largest = [
        f"{title}: {BONE_ROWS[bone]} {format_number(values[bone], group.unit)} {group.unit}"
        for group in groups
        for title, values in group.bodies.items()
        for bone in [max(values, key=lambda name: values[name])]
    ]
    chart = draw_chart(
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
    return Drawing(chart, _joint_table(means))


def _joint_table(means: JointMeans) -> DataTable:
    """The numbers of the bodies: a row for each bone."""
    head = ["bone", *(f"{name} [{unit}]" for unit in ("deg", "mm") for name in means)]
    columns = [of[part].mean(axis=0) for part in (0, 1) for of in means.values()]
    units = [unit for unit in ("deg", "mm") for _ in means]
    rows = [
        [label, *(format_number(float(column[n]), unit) for column, unit in zip(columns, units, strict=True))]
        for n, label in enumerate(BONE_ROWS.values())
    ]
    caption = "Mean over units: rotation error relative to the parent [deg], position error of the far end [mm]."
    return DataTable(head, rows, caption=caption, label="error by joint")


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


def error_per_joint(run: RunData, highlights: Highlights) -> Chart:
    """Box plots of each joint's errors for the leader; medians of the control as points."""
    skeleton = standard_skeleton()
    bones = [skeleton.names[b] for b in hinged_bones(skeleton)]
    joints = list(joint_names(skeleton))
    leader, control = highlights.leader, highlights.control
    boxes = _pooled_errors(run, leader)
    points = _pooled_errors(run, control) if control else None
    has_points = points is not None and len(points[0]) > 0

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        for axes, names, part, title in (
            (left, bones, 0, "rotation relative to the parent [deg]"),
            (right, joints, 1, "position of the far end [mm]"),
        ):
            _draw_boxes(axes, boxes[part], COLOURS[1])
            if points is not None and has_points:
                median = np.median(points[part], axis=0)
                axes.plot(median, np.arange(len(names)), "o", markersize=3.5, color=COLOURS[0], label=control)
            label_rows(axes, names)
            set_root_scale(axes)
            axes.set_title(title)

    return draw_chart(
        "per_joint",
        f"Distribution at each joint, {leader}",
        f"{leader}: boxes from quartile to quartile, lines at the median, whiskers at the 5th and 95th percentile of "
        f"all scored frames.{f' Points: medians of {control}.' if has_points else ''} The axes have a square-root "
        "scale.",
        f"Box plots of the rotation error of 22 bones and the position error of 25 joint centres for {leader}.",
        draw,
        6.4,
    )


def _pooled_errors(run: RunData, series: str) -> tuple[Floats, Floats]:
    """Rotation (N, 22) [deg] and position (N, 25) [mm] errors of every scored frame of a series."""
    traces = [trace for trace in run.traces if trace.series == series]
    return np.concatenate([t.rotation_deg for t in traces]), np.concatenate([t.position_mm for t in traces])


def error_against_sigma(run: RunData, series: str) -> Chart:
    """Box plots of the error of each hinge of one series, on bands of its mean standard deviation."""
    traces = [trace for trace in run.traces if trace.series == series and len(trace.hinge_deg)]
    error_deg = np.concatenate([trace.hinge_deg for trace in traces])
    sigma_deg = np.concatenate([trace.sigma_deg[trace.scored] for trace in traces])
    names = standard_skeleton().dof_names
    share = np.mean(error_deg <= sigma_deg, axis=0)

    def draw(figure: Figure) -> None:
        panels = figure.subplots(1, 2)
        halves = np.array_split(np.arange(len(names)), 2)
        for axes, hinges in zip(panels, halves, strict=True):
            _draw_bands(axes, sigma_deg[:, hinges].mean(axis=0))
            _draw_boxes(axes, error_deg[:, hinges], COLOURS[0])
            label_rows(axes, [names[hinge] for hinge in hinges])
            axes.set_title("error of the hinge angle [deg]")
            set_root_scale(axes)
            for row, hinge in enumerate(hinges):
                place = {"transform": axes.get_yaxis_transform(), "ha": "left", "va": "center", "fontsize": 9.5}
                axes.text(1.01, row, f"{100.0 * share[hinge]:.0f} %", color=INK, **place)

    return draw_chart(
        "sigma",
        f"Error of each hinge against its standard deviation, {series}",
        f"{series}: bands to the mean standard deviation and 95 % region that it states. Boxes of the error from "
        "quartile to quartile, lines at the median, whiskers at the 5th and 95th percentile of all scored frames. "
        "Right of each row: share of frames within one standard deviation of that frame. The axes have a square-root "
        "scale.",
        f"Box plots of the error of 48 hinge angles of {series} on bands of the standard deviation that it states.",
        draw,
        6.4,
    )


def _draw_bands(axes: Axes, sigma_deg: Floats) -> None:
    """Bands (D,) from 0 to one standard deviation and to the end of the 95 % region [deg]."""
    rows = np.arange(len(sigma_deg))
    for times, alpha in ((HALF_WIDTH_95, 0.14), (1.0, 0.24)):
        axes.barh(rows, times * sigma_deg, height=0.94, color=COLOURS[1], alpha=alpha, linewidth=0)


def _draw_boxes(axes: Axes, values: Floats, colour: str) -> None:
    """A horizontal box for each column of (N, M) values. Axes.boxplot would import pyplot with its global state."""
    low, q1, middle, q3, high = np.quantile(values, [0.05, 0.25, 0.5, 0.75, 0.95], axis=0)
    places = np.arange(values.shape[1])
    axes.hlines(places, low, high, color=FAINT, linewidth=1.0)
    axes.barh(places, q3 - q1, left=q1, height=0.62, color=colour, alpha=0.55)
    axes.vlines(middle, places - 0.31, places + 0.31, color=INK, linewidth=1.6)
