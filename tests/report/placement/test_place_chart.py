"""The chart of the named places: every name is on it, and a body that cannot be drawn is an error."""

from pathlib import Path

import numpy as np
import pytest

from harness.body import NAMED_PLACES
from harness.errors import SystemFault
from harness.report.placement import place_chart


def test_every_place_is_named_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    count, height, width = len(NAMED_PLACES), 740, 760
    at = np.column_stack([np.linspace(100.0, 660.0, count), np.linspace(60.0, 700.0, count)])
    facing = np.where(np.arange(count) % 2, 1.0, -1.0)
    views = {
        "picture": np.full((2, height, width, 4), 200, np.uint8),
        "at": np.array([np.column_stack([at, sign * facing]) for sign in (1.0, -1.0)]),
    }
    monkeypatch.setattr(place_chart, "render_body", lambda *args: (views, ""))
    chart = place_chart.draw_place_chart()
    for name in NAMED_PLACES:
        assert chart.svg.count(f">{name}<") == 1, name
    place_chart.main(str(tmp_path / "places.png"))
    assert (tmp_path / "places.png").read_bytes() == chart.png


def test_a_body_that_cannot_be_drawn_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(place_chart, "render_body", lambda *args: (None, "no OpenGL"))
    with pytest.raises(SystemFault, match="no OpenGL"):
        place_chart.draw_place_chart()
