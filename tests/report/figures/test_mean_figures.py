"""Figures of means: every method is named, leader and ties are marked; bars of bones are means over clips."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle

from harness.compare import mean_interval
from harness.core.humanoid24 import standard_skeleton
from harness.errors import BadInput
from harness.report.figures.conditions import read_conditions, read_series
from harness.report.figures.mean_figures import joints_figure, ranking_figure
from harness.report.figures.print_figure import FigureSelection
from harness.report.kit.style import COLOURS, FAINT
from harness.report.run.joint_errors import BONE_ROWS
from harness.score import hinged_bones
from tests.compare.sides import cell, side, write_run
from tests.planted import MeansPlan, planted_means_run
from tests.report.drawing import drawn, spans, texts_apart


@pytest.mark.parametrize("width_mm", [85, 170])
def test_rows_have_the_means_intervals_and_differences_of_the_ranking(ranked: Path, width_mm: int) -> None:
    run = read_conditions(ranked)
    ranking = run.conditions[0].rank()
    assert ranking is not None
    with drawn(ranking_figure(run, FigureSelection()), width_mm) as figure:
        means, differences = figure.axes
        assert [text.get_text() for text in means.get_yticklabels()] == list(ranking.values)
        *inside, control = ranking.values  # the control errs four times as much, so its values stand at the edge
        *dots, edge = [float(np.ravel(line.get_xdata())[0]) for line in means.lines]
        np.testing.assert_allclose(dots, [ranking.means[name] for name in inside])
        np.testing.assert_allclose(
            spans(means.collections, 0), [mean_interval(ranking.values[name]) for name in inside]
        )
        *shown, other_edge = [float(np.ravel(line.get_xdata())[0]) for line in differences.lines[1:]]
        np.testing.assert_allclose(shown, [0.0, *(ranking.differences[name] for name in inside[1:])])
        expected = list[tuple[float, float]]()
        for name in inside[1:]:  # the interval of the difference, and below it that which is corrected for all lines
            low, high = ranking.results[name].low, ranking.results[name].high
            assert low is not None
            assert high is not None
            expected += [(-high, -low), ranking.simultaneous[name]]
        np.testing.assert_allclose(spans(differences.collections, 0), expected)
        assert edge == other_edge == 1.0  # of the width of the axis
        written = [[text.get_text() for text in axes.texts if text.get_text()[-1:].isdigit()] for axes in figure.axes]
        assert written == [[f"{ranking.means[control]:.2f}"], [f"+{ranking.differences[control]:.2f}"]]
        assert means.get_xlim()[1] < 0.5 * ranking.means[control]
        texts_apart(figure)


def test_leader_ties_and_others_differ_in_shape_and_colour(ranked: Path) -> None:
    with drawn(ranking_figure(read_conditions(ranked), FigureSelection())) as figure:
        marks = [(line.get_marker(), to_hex(line.get_color())) for line in figure.axes[0].lines]
        assert marks == [("D", COLOURS[1]), ("o", COLOURS[1]), ("s", FAINT), (">", FAINT)]
        assert figure.axes[0].get_yticklabels()[0].get_fontweight() == "bold"
        (legend,) = figure.legends
        assert [text.get_text() for text in legend.get_texts()] == ["lowest mean", "tied with it", "worse"]
        assert figure.axes[0].get_xlabel().split() == ["joint", "angle", "error", "[deg]"]


def test_few_clips_cannot_show_a_difference(framed: Path) -> None:
    figure = ranking_figure(read_conditions(framed).select("noise=clean"), FigureSelection())
    assert "Fewer than 6 units cannot show a difference." in figure.caption
    with drawn(figure) as shown:
        *_, heading = shown.axes[0].texts  # after the values at the edge
        assert "(2 performers): differences cannot be shown" in " ".join(heading.get_text().split())
        assert {line.get_marker() for line in shown.axes[0].lines} == {"D", "o", ">"}


def test_conditions_have_panels_on_one_scale(conditions: Path) -> None:
    figure = ranking_figure(read_conditions(conditions), FigureSelection())
    with drawn(figure) as shown:
        assert [" ".join(text.get_text().split()) for axes in shown.axes for text in axes.texts] == [
            "noise=clean, known performers (6 performers)",
            "noise=clean, new performers (2 performers): differences cannot be shown",
            "noise=default, known performers (6 performers)",
            "noise=default, new performers (2 performers): differences cannot be shown",
        ]
        assert len({axes.get_xlim() for axes in shown.axes[::2]}) == 1
        texts_apart(shown)


def test_long_names_stay_on_the_figure(tmp_path: Path) -> None:
    methods = {f"dynamic_map[widening={n},gate.reach_m=0.5]+ik": float(n) for n in (1, 2, 3)} | {"ik": 2.0}
    out = write_run(tmp_path / "run", side(methods=methods))
    with drawn(ranking_figure(read_conditions(out), FigureSelection())) as figure:
        texts_apart(figure)
        left, right = figure.axes
        assert left.get_yticklabels()[0].get_text().count("\n") == 2
        assert left.get_window_extent().width > 0.2 * figure.bbox.width
        assert right.get_window_extent().width > 0.2 * figure.bbox.width


def test_one_method_has_no_difference(ranked: Path) -> None:
    figure = ranking_figure(read_conditions(ranked).select(methods=["ik"]), FigureSelection())
    assert "difference" not in figure.caption
    with drawn(figure) as shown:
        assert len(shown.axes) == 1


def test_methods_that_were_not_measured_and_clips_that_not_all_share_are_named(tmp_path: Path) -> None:
    whole = side(methods={"ik": 2.0, "expert_map": 1.0}, clips=8)
    silent = side(methods={"silent": 1.0}, clips=8, metrics={"joint_angle_mean_deg": None})
    cells = (*whole.cells[:-1], *silent.cells)
    out = write_run(tmp_path / "run", replace(whole, cells=cells, planned=len(cells)))
    caption = ranking_figure(read_conditions(out), FigureSelection()).caption
    assert caption.startswith("Mean joint angle error on 7 clips that all methods were measured on. Lines: 95 % ")
    assert caption.endswith(" Not measured: silent.")


def test_one_clip_has_no_interval(tmp_path: Path) -> None:
    out = planted_means_run(tmp_path / "run", MeansPlan(("jumping",), 1, {"ik": 2.0, "late": 3.0}))
    caption = ranking_figure(read_conditions(out), FigureSelection()).caption
    assert caption.startswith("Mean joint angle error on 1 clip of 1 performer. Right:")


def test_methods_without_a_common_clip_are_not_ranked(tmp_path: Path) -> None:
    results = side()
    cells = (cell("a", "ik"), cell("b", "expert_map"))
    out = write_run(tmp_path / "run", replace(results, cells=cells, planned=2))
    with pytest.raises(BadInput, match="No clip of"):
        ranking_figure(read_conditions(out), FigureSelection())


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


def test_bars_of_one_clip_have_no_interval(framed: Path) -> None:
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
