"""The figure of errors at each bone: bars are means over clips of the stored errors, in rows with the right names."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Rectangle

from harness.core.humanoid24 import standard_skeleton
from harness.errors import BadInput
from harness.report.figures.conditions import read_conditions, read_series
from harness.report.figures.mean_figures import joints_figure
from harness.report.figures.print_figure import FigureSelection
from harness.report.run.joint_errors import BONE_ROWS
from harness.score.pair import hinged_bones
from tests.report.drawing import drawn, texts_apart

BONES = [standard_skeleton().names[bone] for bone in hinged_bones(standard_skeleton())]


def test_every_bone_with_hinges_has_a_row() -> None:
    assert sorted(BONE_ROWS) == sorted(BONES)
    assert BONE_ROWS["lfemur"] == "left femur"


@pytest.mark.parametrize(("width_mm", "panels"), [(85, 1), (170, 2)])
def test_bars_are_means_over_clips(framed: Path, width_mm: int, panels: int) -> None:
    run = read_conditions(framed)
    traces = read_series(framed, run.conditions[-1], lambda name, _: name == "best_match+ik")["best_match+ik"]
    rotation = np.mean([trace.rotation_deg.mean(axis=0) for trace in traces], axis=0)
    position = np.mean([trace.position_mm.mean(axis=0) for trace in traces], axis=0)
    points = ["root", *standard_skeleton().names]
    with drawn(joints_figure(run, FigureSelection()), width_mm) as figure:
        assert len(figure.axes) == panels
        assert [text.get_text() for text in figure.axes[0].get_yticklabels()] == list(BONE_ROWS.values())
        expected = [[rotation[BONES.index(bone)] for bone in BONE_ROWS], [position[points.index(b)] for b in BONE_ROWS]]
        for axes, values in zip(figure.axes, expected, strict=False):
            bars = [patch.get_width() for patch in axes.patches if isinstance(patch, Rectangle)]
            np.testing.assert_allclose(bars, values, rtol=1e-5)
        (legend,) = figure.legends
        assert [text.get_text() for text in legend.get_texts()] == ["best_match+ik (lowest mean)", "ik (control)"]
        assert "[deg]" in figure.axes[0].get_xlabel()
        texts_apart(figure)


def test_one_clip_has_no_interval(framed: Path) -> None:
    run = read_conditions(framed)
    clip = run.conditions[0].clips[0]
    assert "Whiskers: 95 % interval over units." in joints_figure(run, FigureSelection()).caption
    figure = joints_figure(run, FigureSelection(clip=clip))
    assert "Whiskers" not in figure.caption
    assert clip in figure.caption
    with drawn(figure) as shown:
        assert not shown.axes[0].collections


def test_a_clip_on_which_the_leader_was_not_measured_is_refused(viewed: Path) -> None:
    run = read_conditions(viewed)
    (condition,) = run.conditions
    clip = condition.clips[0]
    cells = tuple(row for row in condition.cells if (row["method"], row["clip"]) != ("map", clip))
    less = replace(run, conditions=(replace(condition, cells=cells),))
    with pytest.raises(BadInput, match=f"map was not measured on {clip}"):
        joints_figure(less, FigureSelection(clip=clip))
