"""The rows on `hall` on few seeds, and that they notice a schedule that lets every emitter fire."""

import pytest

from harness.bench.physics import hall
from harness.simulate.physics import schedule

SEEDS = tuple(range(101, 109))
"""Not those of the table."""


@pytest.mark.long
def test_every_row_is_met() -> None:
    for row in hall.hall_rows(SEEDS):
        assert row.verdict == "met", f"{row.text}: {row.measured}"


def test_rest_is_missed_where_every_emitter_fires(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schedule, "NEAR_EMITTERS", 36)
    assert [row.verdict for row in hall.rest_rows(SEEDS[:3])] == ["missed", "missed"]
