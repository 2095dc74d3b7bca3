"""The benchmark of the live page reads sessions as a user would start them."""

import pytest

from tests.benchmarks import live_viewer


def test_the_row_is_a_ratio_of_medians() -> None:
    (row,) = live_viewer.viewer_rows([[1.0, 1.0], [2.0, 2.2], [9.0, 3.0]])
    assert row.value == pytest.approx(1.1)
    assert (row.unit, row.target) == ("x", "<= 1.05")
    assert "medians of 6 sessions" in row.reference


@pytest.mark.slow
def test_sessions_with_and_without_a_page(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_viewer, "PAIRS", 1)
    monkeypatch.setattr(live_viewer, "_SECONDS", 2.0)
    (row,) = live_viewer.bench_live_viewer()
    assert row.value is not None
    assert 0.3 < row.value < 3.0
