"""The chart of the named places: every name is on it once, and no name covers another."""

from pathlib import Path

from harness.body import NAMED_PLACES
from harness.report.kit.style import Chart
from harness.report.placement import place_chart
from tests.report.drawing import drawn_figures, texts_apart


def test_every_place_is_named_once(tmp_path: Path) -> None:
    charts: list[Chart] = []
    texts_apart(drawn_figures(lambda: charts.append(place_chart.draw_place_chart()))["places"])
    for name in NAMED_PLACES:
        assert charts[0].svg.count(f">{name}<") == 1, name
    place_chart.main(str(tmp_path / "places.png"))
    assert (tmp_path / "places.png").read_bytes() == charts[0].png
