"""The rows on `hall` on few seeds, and that they notice a room in which little is heard."""

import pytest

from harness.bench.physics import hall
from harness.simulate.physics import ConstellationSettings, Physics, Sound

SEEDS = tuple(range(101, 109))
"""Not those of the table."""


@pytest.mark.long
def test_every_row_is_met() -> None:
    for row in hall.hall_rows(SEEDS):
        assert row.verdict == "met", f"{row.text}: {row.measured}"


def test_rest_is_missed_where_few_ranges_are_heard_and_they_are_worse(monkeypatch: pytest.MonkeyPatch) -> None:
    physics = Physics(ConstellationSettings(name="hall", range_m=2.6), sound=Sound(range_noise_m=0.005))
    monkeypatch.setattr(hall, "HALL", physics)
    assert [row.verdict for row in hall.rest_rows(SEEDS[:3])] == ["missed", "missed"]
