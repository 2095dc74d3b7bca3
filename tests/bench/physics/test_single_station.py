"""The rows of one station on few seeds, and that they notice parts that are missing."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from harness.bench.physics import scenes, single_station
from harness.results.findings import BenchmarkStatement
from harness.simulate.physics import Physics

SEEDS = tuple(range(101, 115))
"""Not those of the table."""
MORE_SEEDS = tuple(range(101, 131))
"""The first step of speed is 0.09 mm: fewer seeds do not tell it from none."""


@pytest.mark.long
@pytest.mark.parametrize(
    ("rows", "count"),
    [
        (single_station.rest_row, 1),
        pytest.param(single_station.free_rows, 3, marks=pytest.mark.slow),
        pytest.param(single_station.speed_row, 1, marks=pytest.mark.slow),
        (single_station.turned_row, 1),
        pytest.param(single_station.hand_row, 1, marks=pytest.mark.slow),
        (single_station.temperature_row, 1),
        (single_station.covered_row, 2),
    ],
)
def test_every_row_is_met(rows: Callable[[tuple[int, ...]], list[BenchmarkStatement]], count: int) -> None:
    found = rows(MORE_SEEDS if rows is single_station.speed_row else SEEDS)
    assert len(found) == count
    for row in found:
        assert row.verdict == "met", f"{row.text}: {row.measured}"


def changed(monkeypatch: pytest.MonkeyPatch, **changes: object) -> None:
    """Let the rows use other defaults of the physics."""
    monkeypatch.setattr(single_station, "Physics", lambda: replace(Physics(), **changes))  # type: ignore[arg-type]


def test_a_row_is_missed_where_ranges_are_worse(monkeypatch: pytest.MonkeyPatch) -> None:
    changed(monkeypatch, sound=replace(Physics().sound, range_noise_m=0.0025))
    (row,) = single_station.rest_row(SEEDS[:3])
    assert row.verdict == "missed"
    assert row.text == "static, spread of 3-D position"


def test_the_temperature_row_is_missed_where_the_device_measures_the_temperature(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(single_station, "_WARMER_K", 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        (row,) = single_station.temperature_row(SEEDS[:2])
    assert row.verdict == "missed"


@pytest.mark.slow
def test_excursions_need_the_shadow(monkeypatch: pytest.MonkeyPatch) -> None:
    changed(monkeypatch, room=replace(Physics().room, shadow=False))
    assert single_station.free_rows(SEEDS[:3])[0].verdict == "missed"


@pytest.mark.long
def test_a_filter_that_never_gives_a_station_up_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    changed(monkeypatch, fusion=replace(Physics().fusion, sigma_limit_m=10.0, coast_s=60.0))
    assert single_station.covered_row(SEEDS[:3])[1].verdict == "missed"


def test_a_station_is_lost_rather_than_wrong_while_an_accelerometer_is_at_its_limit() -> None:
    physics, seconds, speed_m_s = Physics(), 15.0, 4.0
    source = partial(scenes.free_source, 107, seconds, speed_m_s, physics)
    motion = source().sample_motion(np.arange(0.0, seconds, 1.0 / 400.0))
    force_m_s2 = np.gradient(motion.velocity_m_s[:, 0], 1.0 / 400.0, axis=0)
    assert np.abs(force_m_s2).max() > physics.inertial.accelerometer.limit
    errors = scenes.track_free_station(source, seconds, physics, 107)
    assert np.nanmax(errors.size_m) < 0.1
    assert np.mean(errors.quality > 0.0) > 0.7
