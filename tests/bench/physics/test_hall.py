"""The rows on `hall` on few seeds, and that they notice a room in which little is heard."""

import pytest

from harness.bench.physics import hall
from harness.simulate.physics import ConstellationSettings, Physics

SEEDS = tuple(range(101, 109))
"""Not those of the table."""


@pytest.mark.long
def test_every_row_is_met() -> None:
    for row in hall.hall_rows(SEEDS):
        assert row.verdict == "met", f"{row.text}: {row.measured}"


def test_rest_is_missed_where_few_emitters_are_heard(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hall, "HALL", Physics(constellation=ConstellationSettings(name="hall", range_m=2.0)))
    assert [row.verdict for row in hall.rest_rows(SEEDS[:3])] == ["missed", "missed"]
