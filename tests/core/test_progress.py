"""Bars on a terminal: they count what code reports, and print nothing elsewhere."""

import io
import sys
from itertools import count

import pytest

from harness.core.progress import report_step, show_steps


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("stream", [Terminal(), io.StringIO()])
def test_steps_are_counted_on_a_terminal(stream: io.StringIO, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", stream)
    clock = count()
    monkeypatch.setattr("tqdm.std.time", lambda: float(next(clock)))  # each look at the clock is a second later
    report_step("before any bar")
    with show_steps("parts"):
        for step in ("first", "second"):
            report_step(step)
    report_step("after")
    shown = stream.getvalue()
    if stream.isatty():
        assert "1 parts" in shown
        assert "first" in shown
        assert "after" not in shown
    else:
        assert shown == ""


def test_a_chart_is_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    from harness.report.kit import draw_chart

    steps: list[str] = []
    monkeypatch.setattr("harness.report.kit.chart.report_step", steps.append)
    draw_chart("name", "Errors over time", "caption", "alt", lambda figure: None, 1.0)
    assert steps == ["Errors over time"]
