"""Figures of frames: one curve of errors a method; errors over time, with who is in colour and which clip is shown."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex

from harness.errors import BadInput
from harness.report.figures.conditions import read_conditions, read_series
from harness.report.figures.frame_figures import distribution_figure, over_time_figure
from harness.report.figures.print_figure import FigureSelection
from harness.report.kit.style import COLOURS, MUTED
from tests.report.drawing import texts_apart
from tests.report.figures.made_up import drawn


@pytest.mark.parametrize("width_mm", [85, 170])
def test_every_method_has_a_curve_that_is_told_from_the_others(framed: Path, width_mm: int) -> None:
    with drawn(distribution_figure(read_conditions(framed), FigureSelection()), width_mm) as figure:
        (axes,), (legend,) = figure.axes, figure.legends
        assert [text.get_text() for text in legend.get_texts()] == ["ik", "best_match", "best_match+ik", "mean_pose"]
        assert len({str(line.get_color()) for line in axes.lines}) == 4
        assert len({str(line.get_marker()) for line in axes.lines}) == 4
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("joint angle error [deg]", "frames below the error [%]")
        texts_apart(figure)


def test_half_of_the_frames_lie_below_the_median(framed: Path) -> None:
    run = read_conditions(framed).select("noise=clean", ["ik"])
    clip = run.conditions[0].clips[0]
    (trace,) = read_series(framed, run.conditions[0], lambda _, row: row["clip"] == clip)["ik"]
    errors = trace.errors["joint_angle_mean_deg"][trace.scored]
    figure = distribution_figure(run, FigureSelection(clip=clip))
    assert f"{len(errors)} frames of {clip}, noise=clean" in figure.caption
    with drawn(figure) as shown:
        (line,) = shown.axes[0].lines
        x, y = (np.asarray(values, dtype=float) for values in line.get_data())
        assert np.interp(50.0, y, x) == pytest.approx(np.median(errors), rel=0.01)
        assert (x[0], x[-1]) == (errors.min(), errors.max())


def test_metrics_without_values_of_frames_are_refused(framed: Path) -> None:
    with pytest.raises(BadInput, match="step_p50_ms is no metric of single frames"):
        distribution_figure(read_conditions(framed), FigureSelection(metric="step_p50_ms"))


@pytest.mark.parametrize("width_mm", [85, 170])
def test_leader_and_control_are_in_colour_and_every_method_is_named(framed: Path, width_mm: int) -> None:
    with drawn(over_time_figure(read_conditions(framed), FigureSelection()), width_mm) as figure:
        (axes,), (legend,) = figure.axes, figure.legends
        names = [text.get_text() for text in legend.get_texts()]
        assert names == ["best_match+ik (lowest mean)", "ik (control)", "best_match", "mean_pose"]
        assert [to_hex(line.get_color()) for line in axes.lines] == [COLOURS[1], COLOURS[0], MUTED, MUTED]
        looks = [(to_hex(line.get_color()), str(line.get_linestyle()), str(line.get_marker())) for line in axes.lines]
        assert len(set(looks)) == 4
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("time [s]", "joint angle error [deg]")
        texts_apart(figure)


def test_the_lines_are_the_errors_of_the_clip(framed: Path) -> None:
    run = read_conditions(framed)
    clip = run.conditions[0].clips[1]
    figure = over_time_figure(run, FigureSelection(clip=clip, metric="mpjpe_mm"))
    assert figure.name == f"time_{clip}_mpjpe_mm"
    (trace,) = read_series(framed, run.conditions[-1], lambda name, row: (name, row["clip"]) == ("ik", clip))["ik"]
    with drawn(figure) as shown:
        line = next(line for line in shown.axes[0].lines if str(line.get_label()).startswith("ik"))
        values = np.asarray(line.get_ydata())
        np.testing.assert_allclose(values[np.isfinite(values)], trace.errors["mpjpe_mm"][trace.scored])
        assert shown.axes[0].get_xlim()[0] == trace.time_s[trace.scored][0]
    assert "noise=default" in figure.caption


def test_the_clip_with_the_largest_error_is_shown_unless_one_is_named(framed: Path) -> None:
    run = read_conditions(framed)
    values = run.conditions[-1].values()
    means = {
        clip: np.mean([of["joint_angle_mean_deg"][clip] for of in values.values()]) for clip in run.conditions[-1].clips
    }
    worst = max(means, key=lambda clip: means[clip])
    caption = over_time_figure(run, FigureSelection()).caption
    assert f"over time on {worst}, of 2 clips the one with the largest mean error, noise=default." in caption


def test_metrics_without_an_error_over_time_are_refused(framed: Path) -> None:
    with pytest.raises(BadInput, match="lag_ms is no metric of which the error is drawn over time"):
        over_time_figure(read_conditions(framed), FigureSelection(metric="lag_ms"))
