"""The whole stream, from true motion to decoded frames."""

import dataclasses
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from harness.body import DEFAULT_MOUNTS, Body, Kinematics
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.simulate.components.faults import LostStation
from harness.simulate.components.mount import MountSlip
from harness.simulate.components.stationary import Clock
from harness.simulate.link import TrackerConfig
from harness.simulate.noise import NOISE_PRESETS, Noise, noise_preset
from harness.simulate.simulation import Simulation, sampling_times_s, simulate_tracker
from harness.simulate.trajectory import Trajectory
from harness.stream import TrackerFrame
from harness.stream.polhemus.codec import ByteCapture, FrameReader
from harness.stream.recording import RecordingStream, record_capture
from harness.testing.stream_checks import check_stream
from tests.simulate.conftest import worn

Boxer = tuple[Body, BodyMotion]
OVERLOADED = TrackerConfig(rate_hz=60.0)
"""Six stations at 60 Hz are a fifth more than 115200 baud can carry."""


@cache
def seen(boxer: Boxer, noise: Noise | str = "clean", tracker: TrackerConfig | None = None, seed: int = 1) -> Simulation:
    chosen = noise_preset(noise) if isinstance(noise, str) else noise
    return simulate_tracker(*boxer, worn(), tracker or TrackerConfig(), chosen, seed=seed)


def column(simulation: Simulation, name: str) -> NDArray[Any]:
    """One field of all frames, (F, S, ...)."""
    return np.array([getattr(frame, name) for frame in simulation.frames])


def same(a: TrackerFrame, b: TrackerFrame) -> bool:
    """Whether frames are equal bit for bit, with NaN equal to NaN."""
    pairs = [(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(TrackerFrame)]
    return all(np.asarray(x).tobytes() == np.asarray(y).tobytes() for x, y in pairs)


def error_m(boxer: Boxer, simulation: Simulation, tracker: TrackerConfig) -> tuple[Floats, Floats]:
    """Distance [m] and angle [rad] (F, S) of the frames from where MuJoCo has the stations at their true times."""
    body, take = boxer
    trajectory, kinematics, known = Trajectory(body, take), Kinematics(body), simulation.calibration
    times_s = sampling_times_s(trajectory.duration_s, tracker, len(known.stations))
    bones = [body.skeleton.index(bone) for bone in known.bones]
    shape = len(simulation.frames), len(bones)
    at_m, world_from_station = np.empty((*shape, 3)), np.empty((*shape, 4))
    for f, index in enumerate(simulation.frame_index):
        for s, qpos in enumerate(trajectory.qpos(times_s[index])):
            kinematics.set(qpos)
            there_m, turn = kinematics.station_poses(bones, known.mount_m, known.bone_from_station)
            at_m[f, s], world_from_station[f, s] = there_m[s], turn[s]
    told_m = known.tracker_origin_m + rotations.rotate(known.world_from_tracker, column(simulation, "position_m"))
    told = rotations.multiply(known.world_from_tracker, column(simulation, "tracker_from_station"))
    return np.linalg.norm(told_m - at_m, axis=2), rotations.angle_between_rad(told, world_from_station)


def test_clean_frames_are_the_truth_but_for_float32(boxer: Boxer) -> None:
    simulation = seen(boxer)
    assert simulation.expected == len(simulation.frames)
    np.testing.assert_array_equal(simulation.frame_index, np.arange(simulation.expected))
    far_m, turned_rad = error_m(boxer, simulation, TrackerConfig())
    assert far_m.max() < 1e-6
    assert turned_rad.max() < 1e-6
    assert column(simulation, "position_valid").all()
    assert not column(simulation, "suspect").any()
    assert column(simulation, "quality").min() == 1.0


def test_the_truth_is_that_of_the_mean_sampling_time(boxer: Boxer) -> None:
    simulation, trajectory = seen(boxer), Trajectory(*boxer)
    times_s = sampling_times_s(trajectory.duration_s, TrackerConfig(), 6)
    np.testing.assert_allclose(np.diff(times_s, axis=1), TrackerConfig().record_s, atol=1e-12)
    np.testing.assert_allclose(np.diff(times_s, axis=0), 1.0 / 40.0, atol=1e-12)
    assert trajectory.duration_s - 1.0 / 40.0 < times_s.max() <= trajectory.duration_s
    np.testing.assert_allclose(simulation.truth_s, times_s.mean(axis=1), atol=1e-12)
    np.testing.assert_array_equal(simulation.truth_qpos, trajectory.qpos(simulation.truth_s))


def test_the_tracker_looks_forward_right_and_down(boxer: Boxer) -> None:
    known = seen(boxer).calibration
    assert (known.kind, known.stations) == ("exact", tuple(m.station for m in worn()))
    axes = [rotations.rotate(known.world_from_tracker, axis) for axis in np.eye(3)]
    np.testing.assert_allclose(axes, np.diag([1.0, -1.0, -1.0]), atol=1e-12)
    np.testing.assert_allclose(known.tracker_origin_m, TrackerConfig().origin_m)


@pytest.mark.long
@pytest.mark.parametrize("noise", NOISE_PRESETS)
@pytest.mark.parametrize("tracker", [TrackerConfig(), OVERLOADED], ids=["40 Hz", "overload"])
def test_bytes_in_any_pieces_give_the_same_frames(
    boxer: Boxer, noise: str, tracker: TrackerConfig, rng: np.random.Generator
) -> None:
    """Decoding all bytes at once gives the frames that a driver gets byte by byte."""
    simulation = seen(boxer, noise, tracker)
    wire, reader, frames = simulation.wire, FrameReader(simulation.wire_format), []
    begin = 0
    for end, received_s in zip(wire.ends.tolist(), wire.received_s.tolist(), strict=True):
        cut = int(rng.integers(begin, end))
        frames += reader.feed(wire.data[begin:cut], received_s - 0.001)
        frames += reader.feed(wire.data[cut:end], received_s)
        begin = end
    frames += reader.finish()
    assert len(frames) == len(simulation.frames)
    assert all(same(a, b) for a, b in zip(frames, simulation.frames, strict=True))
    assert (reader.garbage_bytes, len(reader.replies), reader.clock_resets) == (0, 0, 0)


def test_equal_seeds_give_equal_bytes(boxer: Boxer) -> None:
    wires = [seen(boxer, "default", seed=seed).wire.data for seed in (1, 1, 2)]
    assert wires[0] == wires[1]
    assert wires[0] != wires[2]


def test_stamps_are_the_drifting_clock_rounded_to_float32_milliseconds(boxer: Boxer) -> None:
    """The drift comes back by regression: rounding allows 0.01 ppm here, 15 times its standard deviation."""
    simulation = seen(boxer, Noise(clock=Clock(offset_s=9.0, drift_ppm=20.0)))
    stamps_s = column(simulation, "measured_s")
    times_s = sampling_times_s(Trajectory(*boxer).duration_s, TrackerConfig(), 6)
    slope, offset_s = np.polynomial.polynomial.polyfit(times_s.ravel(), stamps_s.ravel(), 1)[::-1]
    assert 1e6 * (slope - 1.0) == pytest.approx(20.0, abs=0.01)
    assert offset_s == pytest.approx(9.0, abs=1e-6)
    exact_s = 9.0 + (1.0 + 20e-6) * times_s
    np.testing.assert_array_equal(stamps_s, (exact_s * 1e3).astype(np.float32).astype(float) * 1e-3)
    assert np.abs(stamps_s - exact_s).max() > 1e-7, "rounding shows"


def test_records_arrive_after_latency_and_line(boxer: Boxer) -> None:
    tracker = TrackerConfig(latency_s=0.020)
    simulation = seen(boxer, tracker=tracker)
    times_s = sampling_times_s(Trajectory(*boxer).duration_s, tracker, 6)
    np.testing.assert_allclose(simulation.wire.received_s, times_s.ravel() + 0.020 + tracker.record_s, atol=1e-9)
    np.testing.assert_allclose([f.received_s for f in simulation.frames], simulation.wire.received_s[5::6], atol=1e-12)
    assert simulation.health["latency_p50_ms"] == pytest.approx(20.0 + 1e3 * tracker.record_s)


def test_an_overloaded_line_drops_records_and_frames_still_find_their_truth(boxer: Boxer) -> None:
    simulation = seen(boxer, tracker=OVERLOADED)
    sampled = 6 * simulation.expected
    assert simulation.health["records_dropped"] == sampled - len(simulation.wire.data) // 38 > 0.1 * sampled
    assert np.all(np.diff(simulation.frame_index) > 0)
    far_m, turned_rad = error_m(boxer, simulation, OVERLOADED)
    valid = column(simulation, "position_valid")
    np.testing.assert_array_equal(np.isnan(far_m), ~valid)
    assert valid.sum() == simulation.health["records_sent"]
    assert far_m[valid].max() < 1e-6
    assert turned_rad[valid].max() < 1e-6
    assert not column(simulation, "suspect").any(), "an absent record is no reason to doubt the others"


def test_a_lost_station_is_an_invalid_row_and_its_records_go_on(boxer: Boxer) -> None:
    simulation = seen(boxer, Noise(lost=(LostStation("torso", 2.0, 4.0),)))
    row = simulation.stations.index("torso")
    lost = column(simulation, "quality")[:, row] == 0.0
    assert lost.sum() == pytest.approx(80, abs=1)
    assert np.isnan(column(simulation, "position_m")[lost, row]).all()
    assert np.isnan(column(simulation, "tracker_from_station")[lost, row]).all()
    assert not column(simulation, "position_valid")[lost, row].any()
    assert not np.isnan(column(simulation, "measured_s")).any()
    assert len(simulation.wire.data) == 38 * 6 * simulation.expected
    assert simulation.health["readings_invalid"] == lost.sum()
    assert column(simulation, "position_valid").sum() == 6 * simulation.expected - lost.sum()


def test_default_noise_errs_by_what_its_parts_allow(boxer: Boxer) -> None:
    simulation, clean = seen(boxer, "default"), seen(boxer)
    far_m = np.linalg.norm(column(simulation, "position_m") - column(clean, "position_m"), axis=2)
    valid = column(simulation, "position_valid")
    assert 0.001 < np.median(far_m[valid]) < 0.010
    assert 0.05 < far_m[valid].max() < 0.45
    health = simulation.health
    assert health["readings_invalid"] == np.sum(~valid) == round(health["lost_share"] * valid.size)
    assert 0.01 < health["echo_share"] < 0.06
    assert np.mean(far_m[valid] > 0.045) == pytest.approx(health["echo_share"], abs=0.005)


def test_a_slipped_strap_is_a_tracker_mounted_elsewhere(boxer: Boxer) -> None:
    """Round a capsule, slipping by an angle from the beginning is being put on at that angle."""
    body, take = boxer
    shin = DEFAULT_MOUNTS["left_ankle"]
    slip = MountSlip("left_ankle", around_rad=0.5, along_m=-0.03)
    length_m = body.skeleton.length_m[body.skeleton.index(shin.bone)]
    elsewhere = dataclasses.replace(shin, around_rad=shin.around_rad + 0.5, along=shin.along - 0.03 / length_m)
    slipped = simulate_tracker(body, take, [shin], TrackerConfig(), Noise(mount_slip=(slip,)), seed=1)
    there = simulate_tracker(body, take, [elsewhere], TrackerConfig(), Noise(), seed=1)
    gap = column(slipped, "position_m") - column(there, "position_m")
    assert np.abs(gap).max() < 1e-6
    angle = rotations.angle_between_rad(column(slipped, "tracker_from_station"), column(there, "tracker_from_station"))
    assert angle.max() < 1e-6


@pytest.mark.parametrize(
    ("noise", "tracker"),
    [
        (noise_preset("clean"), TrackerConfig()),
        (noise_preset("default"), TrackerConfig()),
        (noise_preset("default"), OVERLOADED),
        (noise_preset("default"), TrackerConfig(rate_hz=20.0, slot_s=0.0)),
        (Noise(lost=(LostStation("head"),)), TrackerConfig(baud=38400, rate_hz=20.0)),
    ],
    ids=["clean", "default", "overload", "no skew", "lost"],
)
def test_every_simulated_stream_keeps_to_the_contract(
    boxer: Boxer, noise: Noise, tracker: TrackerConfig, tmp_path: Path
) -> None:
    simulation = seen(boxer, noise, tracker)
    path = record_capture(tmp_path / "a.rec", simulation.wire_format, simulation.wire, {}).path
    frames = check_stream(lambda: RecordingStream(path), rate_hz=tracker.rate_hz, at_most=10_000)
    assert len(frames) == len(simulation.frames)


def test_sixteen_bit_records_are_shorter_and_coarser(boxer: Boxer) -> None:
    tracker = TrackerConfig(items=(40, 18, 20, 21, 1), rate_hz=75.0)
    simulation = seen(boxer, tracker=tracker)
    assert simulation.health["records_dropped"] == 0.0
    far_m, turned_rad = error_m(boxer, simulation, tracker)
    assert 1e-4 < far_m.max() < 3**0.5 * 3.0 / 8192
    assert 1e-4 < turned_rad.max() < 1e-3


def test_a_take_shorter_than_a_frame_is_refused(boxer: Boxer) -> None:
    body, take = boxer
    short = dataclasses.replace(take, qpos=take.qpos[:2])
    with pytest.raises(BadInput, match="shorter than one frame"):
        simulate_tracker(body, short, worn(), TrackerConfig(), Noise(), seed=1)


def test_the_wire_can_be_cut_at_any_byte(boxer: Boxer, rng: np.random.Generator) -> None:
    """Frames before the cut are untouched; the last one may lack stations."""
    simulation = seen(boxer, "default")
    wire = simulation.wire
    for cut in rng.integers(1000, 5000, 5).tolist():
        kept = int(np.searchsorted(wire.ends, cut, side="right"))
        part = ByteCapture(wire.data[:cut], np.append(wire.ends[:kept], cut), wire.received_s[: kept + 1])
        reader = FrameReader(simulation.wire_format)
        frames = [*reader.feed_all(part), *reader.finish()]
        assert len(frames) in (kept // 6, kept // 6 + 1)
        assert all(same(a, b) for a, b in zip(frames[: kept // 6], simulation.frames, strict=False))
