"""The rows of orientation measure what made-up errors show."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from harness.bench.physics import orientation
from harness.bench.physics.scenes import StationErrors
from harness.core.arrays import Floats
from harness.simulate.physics import Physics

ROLL, PITCH, YAW = 0.3, 0.4, 0.6
"""Constant errors [deg]: the root mean square of pitch and roll is 0.354."""


def made_up(white_deg: float, white_m: float) -> StationErrors:
    """Constant errors with a white part of alternating sign; the sixth of eight records is lost and far off."""
    sign: Floats = np.array([1.0, -1.0, 1.0, -1.0, 1.0, 9.0, 1.0, -1.0])[:, None]
    turn_rad = np.deg2rad(np.array([ROLL, PITCH, YAW]) + white_deg * sign)
    quality = np.where(sign[:, 0] == 9.0, 0.0, 1.0)
    return StationErrors(np.arange(8) / 40.0, white_m * np.tile(sign, 3), turn_rad, quality)


@pytest.mark.parametrize(("scale", "verdict"), [(0.68, "missed"), (0.72, "met"), (1.28, "met"), (1.32, "missed")])
def test_white_part_is_that_of_successive_records(scale: float, verdict: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of records with alternating errors +-w the differences are 2 w, so the white part is w times the root of 2."""
    white_deg = scale * orientation.WHITE_DEG / np.sqrt(2.0)
    monkeypatch.setattr(orientation, "track_free_station", lambda *args: made_up(white_deg, 1e-4))
    *_, white, position = orientation.room_rows(Physics(), (1, 2))
    assert white.measured == f"{scale * 0.05:.3f} deg, {scale * 0.05:.3f} to {scale * 0.05:.3f}"
    assert white.verdict == verdict
    assert (position.measured, position.verdict) == ("0.245 mm, 0.245 to 0.245", "missed")


def test_tilt_and_yaw_are_root_mean_squares_over_the_seeds(monkeypatch: pytest.MonkeyPatch) -> None:
    def track(make_source: object, seconds: float, physics: Physics, seed: int) -> StationErrors:
        errors = made_up(0.0, 0.0)
        return StationErrors(errors.time_s, errors.error_m, seed * errors.turn_rad, errors.quality)

    monkeypatch.setattr(orientation, "track_free_station", track)
    rest_tilt, rest_yaw, tilt, yaw, *_ = orientation.room_rows(Physics(), (0, 1))
    assert rest_tilt.measured == tilt.measured == "0.250 deg, 0.000 to 0.354"
    assert rest_yaw.measured == yaw.measured == "0.424 deg, 0.000 to 0.600"
    assert [row.verdict for row in (rest_tilt, rest_yaw, tilt, yaw)] == ["met"] * 4


def test_every_room_has_its_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(orientation, "track_free_station", lambda *args: made_up(0.0, 0.0))
    rows = list(orientation.orientation_rows((1,)))
    assert [row.text.split(",")[0] for row in rows] == ["cave"] * 6 + ["hall"] * 6


@pytest.mark.long
@pytest.mark.parametrize("room", orientation.ROOMS)
def test_every_row_is_met(room: str) -> None:
    physics = Physics()
    physics = replace(physics, constellation=replace(physics.constellation, name=room))
    for row in orientation.room_rows(physics, tuple(range(101, 121))):
        assert row.verdict == "met", f"{row.text}: {row.measured}"


@pytest.mark.long
@pytest.mark.parametrize(
    ("missed", "changes"),
    [
        ("at rest: pitch and roll", {"inertial": {"accelerometer": {"turn_on": 0.0, "misalignment_rad": 0.0}}}),
        ("at rest: yaw", {"sound": {"range_noise_m": 0.0, "microphone_sd_m": 0.0}}),
        ("at rest: white part", {"fusion": {"gyroscope": {"noise": 0.001}}}),
    ],
)
def test_a_row_is_missed_where_its_cause_is_absent(missed: str, changes: dict[str, Any]) -> None:
    rows = orientation.room_rows(changed(Physics(), changes), tuple(range(101, 106)))
    assert f"cave, {missed}" in [row.text for row in rows if row.verdict == "missed"]


def changed(settings: Any, changes: dict[str, Any]) -> Any:
    """Settings with some fields of some tables replaced."""
    new = {k: changed(getattr(settings, k), v) if isinstance(v, dict) else v for k, v in changes.items()}
    return replace(settings, **new)
