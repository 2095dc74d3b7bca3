"""The figure of a placement study: every size has its best set, its interval, its name and its ties."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadFile, NothingMeasured, Outcome
from harness.report.placement.pareto import placement_figure
from harness.report.placement.wording import set_name
from harness.results.findings import PlacementFindings, write_placement
from tests.report.drawing import drawn, spans, texts_apart


def written(folder: Path, findings: PlacementFindings) -> Path:
    folder.mkdir(exist_ok=True)
    write_placement(folder / "findings.json", findings)
    return folder


@pytest.mark.parametrize("width_mm", [85, 170])
def test_the_best_of_each_size_is_named_with_its_interval_and_ties(
    placement: PlacementFindings, placement_study: Path, width_mm: int
) -> None:
    with drawn(placement_figure(placement_study), width_mm) as figure:
        (axes,), (legend,) = figure.axes, figure.legends
        names = [" ".join(text.get_text().split()) for text in axes.texts]
        assert names == [set_name(best.stations) for best in placement.best]
        intervals = [(t.low, t.high) for best in placement.best if (t := placement.of(best.stations))]
        np.testing.assert_allclose(np.array(spans(axes.collections, 1)), np.array(intervals, dtype=float))
        ties = [np.size(line.get_ydata()) for line in axes.lines if line.get_label() == "tied with the best"]
        assert ties == [len(best.ties) for best in placement.best]
        labels = [text.get_text() for text in legend.get_texts()]
        assert labels == ["every set", "tied with the best", "best of its size"]
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("stations", "root orientation error [deg]")
        texts_apart(figure)


def test_few_clips_are_called_few(tmp_path: Path, placement: PlacementFindings) -> None:
    failed = replace(placement, failures={"ik on walk": "ValueError"})
    many = placement_figure(written(tmp_path / "many", failed)).caption
    tried = tuple(replace(one, errors=dict(list(one.errors.items())[:4])) for one in placement.tried)
    few = placement_figure(written(tmp_path / "few", replace(placement, tried=tried))).caption
    assert "on 7 clips of built-in performer" in many
    assert "so few clips" not in many
    assert "on 4 clips" in few
    assert "Differences cannot be shown with so few clips, so all sets count as tied." in few
    assert f"1 cell of {placement.planned:,} failed." in many


def test_a_study_without_a_measured_set_draws_nothing(tmp_path: Path, placement: PlacementFindings) -> None:
    tried = tuple(replace(one, mean=None) for one in placement.tried)
    failed = replace(placement, tried=tried, failures={"ik on walk": "ValueError"})
    with pytest.raises(NothingMeasured) as refused:
        placement_figure(written(tmp_path, failed))
    assert refused.value.outcome is Outcome.INCOMPLETE
    with pytest.raises(BadFile):
        placement_figure(tmp_path / "elsewhere")
