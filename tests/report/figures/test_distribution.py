"""The distribution figure: one curve a method, over the frames that are meant."""

from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadInput
from harness.report.figures.conditions import read_conditions, read_series
from harness.report.figures.frame_figures import distribution_figure
from harness.report.figures.print_figure import FigureSelection
from tests.report.drawing import drawn, texts_apart


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
