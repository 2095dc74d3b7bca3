"""The figure of a placement study: every size has its best set, its interval, its name and its ties."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadFile, NothingMeasured, Outcome
from harness.report.placement.pareto import placement_figure
from harness.report.placement.wording import set_name
from tests.report.drawing import texts_apart
from tests.report.fabricate_placement import CLIPS, made_up, write_made_up
from tests.report.figures.made_up import drawn, spans


@pytest.mark.parametrize("width_mm", [85, 170])
def test_the_best_of_each_size_is_named_with_its_interval_and_ties(tmp_path: Path, width_mm: int) -> None:
    findings = made_up()
    with drawn(placement_figure(write_made_up(tmp_path, findings)), width_mm) as figure:
        (axes,), (legend,) = figure.axes, figure.legends
        names = [" ".join(text.get_text().split()) for text in axes.texts]
        assert names == [set_name(best.stations) for best in findings.best]
        intervals = [(t.low, t.high) for best in findings.best if (t := findings.of(best.stations))]
        assert spans(axes.collections, 1) == intervals
        ties = [np.size(line.get_ydata()) for line in axes.lines if line.get_label() == "tied with the best"]
        assert ties == [len(best.ties) for best in findings.best]
        assert [text.get_text() for text in legend.get_texts()] == [
            "every set",
            "tied with the best",
            "best of its size",
        ]
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("stations", "joint angle error [deg]")
        texts_apart(figure)


def test_few_clips_are_called_few(tmp_path: Path) -> None:
    many = placement_figure(write_made_up(tmp_path / "many")).caption
    few = placement_figure(write_made_up(tmp_path / "few", made_up(CLIPS[:4]))).caption
    assert "on 8 clips of built-in performer" in many
    assert "so few clips" not in many
    assert "on 4 clips" in few
    assert "Differences cannot be shown with so few clips, so all sets count as tied." in few
    assert f"1 cell of {made_up().planned:,} failed." in many


def test_a_study_without_a_measured_set_draws_nothing(tmp_path: Path) -> None:
    findings = made_up()
    nothing = replace(findings, tried=tuple(replace(tried, mean=None) for tried in findings.tried))
    with pytest.raises(NothingMeasured) as refused:
        placement_figure(write_made_up(tmp_path, nothing))
    assert refused.value.outcome is Outcome.INCOMPLETE
    with pytest.raises(BadFile):
        placement_figure(tmp_path / "elsewhere")
