"""Validation of simulated captures: what is found, what is named, and what is refused."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadInput, NotComparable, Outcome, UnknownName
from harness.experiment import Playback, prepare_playback
from harness.measure import ErrorProcess, StationResiduals, UnitFile
from harness.simulate import TrackerConfig
from harness.stream.recording import CaptureReader, record_capture
from harness.study.trust.capture_readings import CaptureReadings, read_capture
from harness.study.trust.characterization import preset_components
from harness.study.trust.truth_motion import TruthMotion
from harness.study.trust.truth_source import TruthSource, load_truth
from harness.study.trust.validation import (
    Validation,
    describe_left_out,
    evaluate_registered,
    session_unit,
    validate_capture,
)

pytestmark = pytest.mark.long
CLIP = "boxing_p1_01"


def capture(playback: Playback, path: Path, seconds: float = np.inf, **note: object) -> CaptureReadings:
    simulation = playback.simulation
    whole = {"source": "simulation", "scenario": "builtin_boxing", "clip": CLIP, "noise": "default", **note}
    record_capture(path, simulation.wire_format, simulation.wire, whole, seconds=seconds)
    return read_capture(CaptureReader(path))


@pytest.fixture(scope="module")
def boxing(tmp_path_factory: pytest.TempPathFactory) -> CaptureReadings:
    playback = prepare_playback("builtin_boxing", clip=CLIP, noise="default")
    return capture(playback, tmp_path_factory.mktemp("validation") / "boxing.rec")


@pytest.fixture(scope="module")
def truth(boxing: CaptureReadings) -> TruthMotion:
    return load_truth(boxing, TruthSource(CLIP))


@pytest.fixture(scope="module")
def found(boxing: CaptureReadings, truth: TruthMotion) -> Validation:
    return validate_capture(boxing, truth)


def test_a_sound_capture_shows_the_preset_and_no_departure(found: Validation) -> None:
    assert found.named == ()
    assert not found.exchanged
    assert len(found.report.notes) == 1  # that errors are those after the registration
    numbers = found.report.numbers
    assert numbers["components.speed.ahead_s"].value == pytest.approx(0.002, abs=0.0003)
    assert numbers["components.clock.drift_ppm"].value == pytest.approx(20.0, abs=10.0)
    assert numbers["time_offset_orientation_s"].value == pytest.approx(2e-5 * found.registration.reference_s, abs=2e-4)
    assert numbers["latency_s"].value == pytest.approx(TrackerConfig().latency_s + TrackerConfig().record_s, abs=2e-4)
    checked = [(check.key, check.station) for check in found.report.checks]
    assert {key for key, station in checked if not station} == {
        "components.speed.ahead_s", "components.clock.drift_ppm", "scale", "heading_rad", "latency_s",
    }  # fmt: skip
    assert {station for key, station in checked if key == "mount_turn_rad"} == set(found.registration.mounts)


def test_each_station_has_its_errors(found: Validation, boxing: CaptureReadings) -> None:
    assert set(found.report.accuracy) == set(found.registration.mounts)
    one = found.report.accuracy["right_hand"]
    assert 0.01 < one.lost_share < 0.03
    assert one.readings == pytest.approx(0.98 * 800, abs=20)
    assert found.report.capture.duration_s == pytest.approx(20.0, abs=0.1)


def test_exchanged_stations_are_named_and_have_no_mount_checks(boxing: CaptureReadings, truth: TruthMotion) -> None:
    swapped = dict(truth.body_of) | {"left_hand": "rhand", "right_hand": "lhand"}
    found = validate_capture(boxing, replace(truth, body_of=swapped))
    assert dict(found.exchanged) == {"left_hand": "lhand", "right_hand": "rhand"}
    assert found.named == ()
    assert "left_hand" not in {check.station for check in found.report.checks}


def named_keys(found: Validation) -> set[tuple[str, str]]:
    return {(check.key, check.station) for check in found.named}


def test_numbers_that_differ_from_a_unit_file_are_named(
    boxing: CaptureReadings, truth: TruthMotion, found: Validation
) -> None:
    unit = session_unit(found, None, "unit")
    assert named_keys(validate_capture(boxing, truth, expected=unit)) == set()
    shifted = {key: replace_value(unit, key, by) for key, by in {"latency_s": 0.01, "heading_rad": 0.05}.items()}
    for key, other in shifted.items():
        again = validate_capture(boxing, truth, expected=other)
        assert named_keys(again) == {(key, "")}
        assert again.report.expected_from == other.name


def replace_value(unit: UnitFile, key: str, by: float) -> UnitFile:
    one = unit.session[key]
    moved = replace(one, value=one.value + by, low=one.low + by, high=one.high + by)
    return replace(unit, session={**unit.session, key: moved})


def test_a_unit_file_gains_what_the_reference_shows(found: Validation) -> None:
    unit = session_unit(found, None, "unit")
    assert unit.components["speed"]["ahead_s"] == found.report.numbers["components.speed.ahead_s"].value
    assert unit.measured["components.clock.drift_ppm"] == found.report.numbers["components.clock.drift_ppm"]
    assert set(unit.session) == {"scale", "heading_rad", "latency_s"}
    assert unit.components["white"] == preset_components()["white"]
    known = replace(unit, components=with_clock(unit, 33.0))
    again = session_unit(found, known, "again")
    assert again.components["clock"]["drift_ppm"] == 33.0  # a longer capture knows the clock better


def with_clock(unit: UnitFile, ppm: float) -> Mapping[str, dict[str, object]]:
    return {**unit.components, "clock": {**unit.components["clock"], "drift_ppm": ppm}}


def test_another_tracker_as_reference_is_compared_with_no_preset(boxing: CaptureReadings) -> None:
    found = validate_capture(boxing, load_truth(boxing, TruthSource(str(boxing.path))))
    assert found.report.checks == ()
    assert found.report.numbers["time_offset_orientation_s"].value == pytest.approx(0.0, abs=1e-6)
    assert not found.report.numbers["latency_s"].is_measured
    for station, mount in found.registration.mounts.items():
        assert np.linalg.norm(mount.position_m) < 1e-6, station


def test_scores_of_a_registered_capture_are_those_of_the_method(boxing: CaptureReadings, found: Validation) -> None:
    (scores,) = evaluate_registered(found, ["ik"])
    value = scores.metrics["joint_angle_mean_deg"]
    assert value is not None
    assert 1.0 < value < 8.0
    assert scores.scores.coverage == 1.0
    assert scores.take.calibration.kind == "registered"


def test_a_lost_part_of_the_capture_is_reported(boxing: CaptureReadings, truth: TruthMotion, tmp_path: Path) -> None:
    """Half of a second is overwritten, and the end is cut off: the rest is used."""
    data = bytearray(boxing.path.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 2000] = bytes(2000)
    path = tmp_path / "damaged.rec"
    path.write_bytes(data[: 9 * len(data) // 10])
    found = validate_capture(read_capture(CaptureReader(path)), truth)
    assert found.capture.damage or len(found.report.notes) > 1
    assert found.report.capture.duration_s < 18.5
    assert found.named == ()


def test_a_short_capture_cannot_be_compared(boxing: CaptureReadings, truth: TruthMotion, tmp_path: Path) -> None:
    playback = prepare_playback("builtin_boxing", clip=CLIP, noise="default")
    with pytest.raises(NotComparable, match="overlap by at most") as refused:
        validate_capture(capture(playback, tmp_path / "short.rec", seconds=5.0), truth)
    assert refused.value.outcome is Outcome.NOT_COMPARABLE


def test_another_motion_and_other_stations_are_refused(boxing: CaptureReadings, truth: TruthMotion) -> None:
    with pytest.raises(BadInput, match="The motion is not the reference's"):
        validate_capture(boxing, load_truth(boxing, TruthSource("boxing_p2_01")))
    with pytest.raises(BadInput, match="No station of"):
        validate_capture(boxing, replace(truth, body_of={"nose": "head"}))


def test_a_capture_with_gaps_in_one_twentieth_cannot_be_compared(boxing: CaptureReadings, truth: TruthMotion) -> None:
    hidden = {}
    for name, poses in truth.bodies.items():
        gap = (poses.time_s > 8.0) & (poses.time_s < 10.0)
        hidden[name] = replace(poses, position_m=np.where(gap[:, None], np.nan, poses.position_m))
    with pytest.raises(NotComparable, match="At least 95 % must match"):
        validate_capture(boxing, replace(truth, bodies=hidden))


def test_a_capture_without_stamps_is_refused(boxing: CaptureReadings, truth: TruthMotion) -> None:
    without = {name: replace(one, measured_s=np.full(len(one), np.nan)) for name, one in boxing.readings.items()}
    with pytest.raises(BadInput, match="have no time stamps"):
        validate_capture(replace(boxing, readings=without), truth)


def test_a_station_without_a_pose_is_left_out(boxing: CaptureReadings, truth: TruthMotion) -> None:
    head = boxing.readings["head"]
    lost = replace(head, position_m=np.full((len(head), 3), np.nan))
    found = validate_capture(replace(boxing, readings={**boxing.readings, "head": lost}), truth)
    assert "head" not in found.registration.mounts
    assert found.report.notes[0] == "head: no pose in the whole capture; left out."
    assert found.named == ()
    with pytest.raises(BadInput, match="head has no mount"):
        evaluate_registered(found, ["ik"])
    with pytest.raises(NotComparable, match="has a pose"):
        validate_capture(replace(boxing, readings={"head": lost}), truth)


def test_what_names_no_reference_is_refused(boxing: CaptureReadings, tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="no synthetic take called 'nothing'"):
        load_truth(boxing, TruthSource("nothing"))
    playback = prepare_playback("builtin_boxing", clip=CLIP, noise="default")
    unnamed = capture(playback, tmp_path / "unnamed.rec", scenario=None)
    with pytest.raises(BadInput, match="--scenario"):
        load_truth(unnamed, TruthSource(CLIP))
    assert load_truth(unnamed, TruthSource(CLIP, "builtin_boxing")).playback is not None


def test_stations_of_which_many_readings_were_left_out_are_named() -> None:
    """Excursions are a twentieth of the readings; a reference that stands still for a fifth of the time is not."""
    quiet, noise = np.zeros((100, 3)), ErrorProcess(1e-3, 1e-3, 1.0)
    used = np.ones((100, 2), bool)
    used[:5] = False
    head = StationResiduals(1.0, np.arange(100.0), quiet, quiet, np.ones(100, bool), used, (noise, noise, noise))
    assert describe_left_out({"head": head}) == ()
    used[:21, 0] = False
    (said,) = describe_left_out({"head": head, "hand": replace(head, used=used)})
    assert said.startswith("hand: 21 % of the positions and 5 % of the orientations lie far from the others")
