"""Characterisation of planted captures: what is named, and what the unit file holds."""

from pathlib import Path

import numpy as np
import pytest

from harness.bench.lab.captures import planted_capture
from harness.core import rotations
from harness.measure import UnitFile
from harness.stream import BodyPoses, PoseLog
from harness.stream.recording import CaptureReader, PoseRecording
from harness.study.trust.characterization import (
    DEFAULT_KEPT,
    Characterization,
    characterize_capture,
    characterize_log,
    measured_numbers,
    preset_components,
)

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("captures")


@pytest.fixture(scope="module")
def white(folder: Path) -> Characterization:
    return characterize_capture(CaptureReader(planted_capture("white", 1001, folder)))


def test_doubled_white_noise_is_named_with_its_size(white: Characterization) -> None:
    named = {(check.key, check.station): check for check in white.named}
    position = named["components.white.position_m", ""]
    assert position.measured.contains(0.0015)
    assert position.measured.value / position.expected.value == pytest.approx(2.0, rel=0.03)
    assert ("components.white.orientation_rad", "") in named
    assert ("components.white.position_m", "torso") in named
    assert not [key for key, _ in named if "white" not in key]


def test_the_unit_file_has_measured_values_and_defaults_with_reasons(white: Characterization) -> None:
    unit, preset = white.unit, preset_components()
    assert unit.components["white"]["position_m"] == white.profile.parameters["components.white.position_m"].value
    assert unit.components["session"] == preset["session"]
    assert unit.components["excursion"]["ramp_s"] == preset["excursion"]["ramp_s"]
    assert set(DEFAULT_KEPT) <= set(unit.not_measured)
    assert unit.components["speed"] == preset["speed"]
    assert "--rigid" in unit.not_measured["components.speed.ahead_s"]
    low, high = unit.components["echo"]["size_m"]
    assert low < high
    assert isinstance(unit.components["echo"]["burst_records"][0], int)
    assert unit.tracker["rate_hz"] == 40.0
    assert len(str(unit.capture["digest"])) == 64


def test_a_unit_is_no_departure_from_itself(white: Characterization, folder: Path) -> None:
    again = characterize_capture(CaptureReader(folder / "white_1001.rec"), expected=white.unit)
    assert again.expected_from == white.unit.name
    assert not again.named
    assert len(again.checks) >= 25


def test_another_day_is_compared_with_an_earlier_unit(white: Characterization, folder: Path) -> None:
    unit: UnitFile = white.unit
    found = characterize_capture(CaptureReader(planted_capture("clock", 1002, folder)), expected=unit)
    named = {check.key for check in found.named}
    assert {"components.white.position_m", "components.clock.drift_ppm"} <= named


def test_a_clock_that_was_not_set_is_named(folder: Path) -> None:
    found = characterize_capture(CaptureReader(planted_capture("stamps", 1001, folder)))
    named = {check.key: check.measured for check in found.named}
    assert named["timing.stamp_resolution_s"].value == pytest.approx(0.002)
    assert named["timing.clock_age_s"].value == pytest.approx(18_000.0, abs=1.0)


def test_means_are_checked_and_not_the_ends(white: Characterization) -> None:
    keys = {key for key, _ in measured_numbers(white.profile)}
    assert "components.echo.size_m" in keys
    assert not [key for key in keys if key[-1].isdecimal()]


def test_the_needed_time_follows_the_rate(white: Characterization) -> None:
    rate = white.profile.parameters["components.excursion.onsets_per_min"].value
    (advice,) = white.report.advice
    assert advice.needed_minutes == pytest.approx(97 / (6 * rate))


def test_a_body_with_gaps_has_no_spectrum(tmp_path: Path, rng: np.random.Generator) -> None:
    """Every fiftieth pose is missing, so that no 10 s are without a gap."""
    bodies = tuple(
        BodyPoses(
            name,
            rows / 50.0,
            0.001 * rng.normal(size=(len(rows), 3)),
            rotations.exp(0.001 * rng.normal(size=(len(rows), 3))),
        )
        for name, rows in (("gaps", np.flatnonzero(np.arange(3000) % 50)), ("whole", np.arange(3000)))
    )
    log = PoseLog(bodies, "rest.csv")
    path = tmp_path / "rest.csv"
    path.write_text("poses")
    report = characterize_log(PoseRecording(path, log, {})).report
    assert [curve.station for curve in report.spectra] == ["whole"]
    assert [curve.station for curve in report.allan_position] == ["gaps", "whole"]
