"""References of a capture: clips, loops of an emulator, other captures."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.body import bone_poses
from harness.core import rotations
from harness.core.humanoid24 import BONES
from harness.errors import BadFile, BadInput
from harness.experiment import Playback, prepare_playback
from harness.experiment.scenarios import load_scenario
from harness.measure import MeasuredPoses, TruthSpline, register_poses
from harness.mocap import synthetic
from harness.simulate import Noise, exact_calibration, loop_motion, simulate_loop
from harness.stream.recording import CaptureReader, record_capture
from harness.study.trust.capture_readings import measured_poses, read_capture
from harness.study.trust.truth_motion import pair_names, truth_of_capture, truth_of_clip, truth_of_playback

CLIP = "boxing_p1_01"


@pytest.fixture(scope="module")
def playback() -> Playback:
    return prepare_playback("builtin_boxing", clip=CLIP)


def capture(playback: Playback, path: Path, **note: object) -> Path:
    simulation = playback.simulation
    record_capture(path, simulation.wire_format, simulation.wire, {"source": "simulation", **note})
    return path


def test_bodies_are_the_bones_of_the_performer(playback: Playback) -> None:
    truth = truth_of_playback(playback, host_clock=True)
    place, turn = bone_poses(playback.body.skeleton, playback.take.qpos)
    assert truth.body_of["left_hand"] == "lhand"
    hand = truth.bodies["lhand"]
    np.testing.assert_array_equal(hand.position_m, place[:, BONES.index("lhand")])
    np.testing.assert_array_equal(hand.world_from_body, turn[:, BONES.index("lhand")])
    np.testing.assert_allclose(hand.time_s, np.arange(len(playback.take)) / playback.take.rate_hz)
    exact = exact_calibration(playback.body, playback.mounts, playback.tracker)
    np.testing.assert_array_equal(truth.nominal["left_hand"].position_m, exact.mount_m[0])


def test_stations_without_names_are_those_of_the_playback_in_order(playback: Playback) -> None:
    truth = truth_of_playback(playback, ("1", "2", "3", "4", "5", "6"), host_clock=False)
    named = truth_of_playback(playback, host_clock=False)
    assert list(truth.body_of.values()) == list(named.body_of.values())
    assert list(truth.nominal) == ["1", "2", "3", "4", "5", "6"]


def test_a_loop_is_the_take_and_the_way_back_that_the_emulator_plays(playback: Playback) -> None:
    """Stations on the bones of the looped motion are where the noise-free emulator reports them, all around."""
    body, take, tracker = playback.body, playback.take, playback.tracker
    played = simulate_loop(body, take, playback.mounts, tracker, Noise(), seed=1)
    motion = loop_motion(body, take, playback.mounts, tracker)
    assert len(motion) == round(played.loop_s * motion.rate_hz)
    calibration = exact_calibration(body, playback.mounts, tracker)
    truth = truth_of_playback(playback, host_clock=False, device_s=(0.0, 2.0 * played.loop_s))
    assert truth.loop_s == played.loop_s
    tracker_from_world = rotations.inverse(calibration.world_from_tracker)
    for row, (station, bone) in enumerate(truth.body_of.items()):
        spline, mount = TruthSpline(truth.bodies[bone]), truth.nominal[station]
        for lap in (0.0, played.loop_s):
            body_m, world_from_body = spline.poses(played.taken_s[:-1, row] + lap)
            station_m = body_m + rotations.rotate(world_from_body, mount.position_m)
            found_m = rotations.rotate(tracker_from_world, station_m - calibration.tracker_origin_m)
            error_m = np.linalg.norm(found_m - played.position_m[:-1, row], axis=1)
            assert np.quantile(error_m, 0.95) < 1e-4
            assert np.max(error_m) < 0.01  # where the take turns into the way back


@pytest.mark.parametrize("first", [0, 3])
def test_loops_of_a_capture_are_told_from_their_neighbours(playback: Playback, first: int) -> None:
    """Two and a half loops agree with the clip one loop earlier as well, over less time."""
    samples, stations = playback.samples, {}
    laps = np.arange(first, first + 3)
    for row, station in enumerate(samples.stations):
        time_s = (laps[:, None] * samples.device_loop_s + samples.device_s[:, row]).ravel()
        kept = slice(0, 5 * len(samples) // 2)
        place, turn, quality = (
            np.concatenate([values[:, row]] * 3)[kept]
            for values in (samples.position_m, samples.tracker_from_station, samples.quality)
        )
        stations[station] = MeasuredPoses(time_s[kept], place, turn, quality > 0.0)
    ends = [(poses.measured_s[0], poses.measured_s[-1]) for poses in stations.values()]
    device_s = min(end[0] for end in ends), max(end[1] for end in ends)
    truth = truth_of_playback(playback, host_clock=False, device_s=device_s)
    found = register_poses(stations, truth.bodies, pairs=truth.body_of)
    drift_s = 2e-5 * found.reference_s
    assert found.values["time_offset_orientation_s"].value == pytest.approx(drift_s, abs=1e-4)
    assert found.matched > 0.97


def test_a_clip_is_worn_with_the_stations_of_a_scenario() -> None:
    clip, scenario = synthetic.generate("boxing", "p1", 1, seed=3, duration_s=5.0), load_scenario("builtin_boxing")
    truth = truth_of_clip(clip, scenario, ["head", "left_hand"])
    assert truth.body_of == {"head": "head", "left_hand": "lhand"}
    assert list(truth.nominal) == ["head", "left_hand"]
    assert truth.playback is None
    with pytest.raises(BadInput, match="has no station 'nose'"):
        truth_of_clip(clip, scenario, ["nose"])


def test_another_capture_gives_its_readings(playback: Playback, tmp_path: Path) -> None:
    other = read_capture(CaptureReader(capture(playback, tmp_path / "a.rec")))
    truth = truth_of_capture(other, ["head"])
    poses = measured_poses(other.readings["head"])
    np.testing.assert_array_equal(truth.bodies["head"].position_m, poses.position_m[poses.valid])
    assert truth.is_tracker
    with pytest.raises(BadInput, match="no body nose; it has"):
        truth_of_capture(other, ["nose"])


def test_the_longest_session_is_read_and_the_others_are_named(playback: Playback, tmp_path: Path) -> None:
    whole, path = capture(playback, tmp_path / "whole.rec"), tmp_path / "two.rec"
    simulation = playback.simulation
    record_capture(path, simulation.wire_format, simulation.wire, {}, seconds=2.0)
    record_capture(path, simulation.wire_format, simulation.wire, {})
    alone, both = read_capture(CaptureReader(whole)), read_capture(CaptureReader(path))
    assert alone.left_out == ()
    assert len(both.left_out) == 1
    assert both.left_out[0].startswith("4")  # 480 records of 2 s
    assert both.left_out[0].endswith("records of 1 other session(s) of the device are left out.")
    for station, one in alone.readings.items():
        np.testing.assert_array_equal(both.readings[station].position_m, one.position_m)


def test_a_capture_without_records_is_refused(playback: Playback, tmp_path: Path) -> None:
    path = tmp_path / "empty.rec"
    simulation = playback.simulation
    record_capture(path, simulation.wire_format, simulation.wire, {}, seconds=0.0)
    with pytest.raises(BadFile, match="no record of a station"):
        read_capture(CaptureReader(path))


def test_lost_and_suspect_readings_are_not_valid(playback: Playback, tmp_path: Path) -> None:
    one_capture = read_capture(CaptureReader(capture(playback, tmp_path / "a.rec")))
    for one in one_capture.readings.values():
        valid = measured_poses(one).valid
        assert not valid[one.quality == 0.0].any()
        assert not valid[one.suspect].any()
        assert valid[(one.quality > 0.0) & ~one.suspect].all()


def test_stations_without_a_body_are_left_out_and_one_must_have_one() -> None:
    bodies: dict[str, Any] = {"A": None, "b": None}
    assert pair_names(["a", "c"], bodies) == {"a": "A"}
    assert pair_names(["a"], {"x": bodies["b"]}) == {"a": "x"}
    with pytest.raises(BadInput, match="no body c, d; it has A, b"):
        pair_names(["c", "d"], bodies)
