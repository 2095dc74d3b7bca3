"""Endless takes: the first round equals the simulation, and the return ends where the take began."""

from dataclasses import replace

import numpy as np
import pytest

from harness.body import Body
from harness.core import rotations
from harness.core.motion import BodyMotion
from harness.simulate.loop import loop_trajectory, simulate_loop
from harness.simulate.noise import noise_preset
from harness.simulate.simulation import TrackerConfig, simulate_tracker
from harness.stream.is900 import Device
from harness.stream.polhemus.codec import SHORT_LIST, ByteCapture, FrameReader
from tests.simulate.conftest import worn

TRACKER = TrackerConfig(slot_s=0.0033)


@pytest.mark.parametrize("noise", ["clean", "default"])
def test_the_first_lap_is_what_the_simulation_says(boxer: tuple[Body, BodyMotion], noise: str) -> None:
    body, take = boxer
    played = simulate_loop(body, take, worn(), TRACKER, noise_preset(noise), seed=3)
    seen = simulate_tracker(body, take, worn(), TRACKER, noise_preset(noise), seed=3)
    assert played.take_frames == len(seen.frames)
    for row, frame in enumerate(seen.frames):
        np.testing.assert_allclose(frame.measured_s, played.device_s[row], atol=1e-6)
        sound = frame.position_valid
        np.testing.assert_allclose(frame.position_m[sound], played.position_m[row][sound], atol=1e-6)


def test_beyond_the_16_bit_range_device_and_simulation_agree(boxer: tuple[Body, BodyMotion]) -> None:
    """The tracker hangs so high that the ankles are out of range: both give the same frames, and no wrong position."""
    body, take = boxer
    tracker = replace(TRACKER, items=SHORT_LIST, origin_m=(0.0, 0.0, 3.2))
    played = simulate_loop(body, take, worn(), tracker, noise_preset("clean"), seed=3)
    seen = simulate_tracker(body, take, worn(), tracker, noise_preset("clean"), seed=3)
    device, reader = Device(played, now_s=0.0), FrameReader(seen.wire_format)
    for station in seen.wire_format.characters.decode():
        device.receive(f"O{station},{','.join(map(str, SHORT_LIST))}\r".encode(), 0.0)
    device.receive(b"fuMZ\rC", 0.0)
    sent = [message.data for message in device.messages(played.taken_s[played.take_frames - 1, -1]) if message.station]
    frames = reader.feed_all(ByteCapture(b"".join(sent), np.array([sum(map(len, sent))]), np.array([0.0])))
    assert len(frames) >= len(seen.frames) - 1
    for row, (frame, simulated) in enumerate(zip(frames, seen.frames, strict=False)):
        for name in ("measured_s", "position_m", "tracker_from_station", "position_valid", "orientation_valid"):
            np.testing.assert_array_equal(getattr(frame, name), getattr(simulated, name))
        inside = (np.abs(played.position_m[row]) < 3.0 - 3.0 / 8192).all(axis=1)
        outside = (np.abs(played.position_m[row]) >= 3.0).any(axis=1)
        assert frame.position_valid[inside].all()
        assert not frame.position_valid[outside].any()
        assert frame.orientation_valid.all()
        valid = frame.position_valid
        assert np.abs(frame.position_m[valid] - played.position_m[row][valid]).max(initial=0.0) < 3.0 / 8192
    beyond = int((np.abs(played.position_m[: len(seen.frames)]) >= 3.0).any(axis=2).sum())
    assert 0 < beyond <= seen.health["readings_out_of_range"] < 4 * len(seen.frames)


def test_the_way_back_goes_on_from_the_end_to_the_beginning(boxer: tuple[Body, BodyMotion]) -> None:
    body, take = boxer
    played = simulate_loop(body, take, worn(), TRACKER, noise_preset("clean"), seed=3)
    assert len(played) >= played.take_frames + TRACKER.rate_hz
    steps_m = np.linalg.norm(np.diff(played.position_m, axis=0, append=played.position_m[:1]), axis=2)
    assert steps_m[played.take_frames - 1 :].max() <= steps_m[: played.take_frames - 1].max()
    after = np.roll(played.tracker_from_station, -1, axis=0)
    steps_rad = rotations.angle_between_rad(played.tracker_from_station, after)
    assert steps_rad[played.take_frames - 1 :].max() <= max(steps_rad[: played.take_frames - 1].max(), 0.1)
    np.testing.assert_allclose(np.diff(played.taken_s[:, 0]), 1.0 / TRACKER.rate_hz)
    assert played.loop_s == pytest.approx(played.taken_s[-1, 0] + 1.0 / TRACKER.rate_hz)


def test_the_clock_runs_on_through_the_lap(boxer: tuple[Body, BodyMotion]) -> None:
    body, take = boxer
    played = simulate_loop(body, take, worn(), TRACKER, noise_preset("noise"), seed=3)
    pace_s = np.diff(played.device_s[:, 0])
    np.testing.assert_allclose(pace_s, (1.0 + 20e-6) / TRACKER.rate_hz, rtol=1e-9)
    assert played.device_loop_s == pytest.approx((1.0 + 20e-6) * played.loop_s)
    assert played.device_s[0, 0] == 0.0


def test_a_round_of_the_looping_trajectory_is_a_whole_number_of_frames(boxer: tuple[Body, BodyMotion]) -> None:
    """It leaves the time for stop, way back and start, and comes back to the first position and velocity."""
    body, take = boxer
    trajectory, frames = loop_trajectory(body, take, 40.0)
    loop_s = frames / 40.0
    assert trajectory.duration_s + 1.7 <= loop_s < trajectory.duration_s + 1.7 + 1.0 + 1.0 / 40.0
    assert trajectory.ends_s > loop_s + 0.5
    moments_s = np.array([0.0, loop_s])
    qpos, qvel = trajectory.qpos(moments_s), trajectory.qvel(moments_s)
    np.testing.assert_allclose(qpos[1], qpos[0], atol=1e-9)
    np.testing.assert_allclose(qvel[1], qvel[0], atol=1e-9)
