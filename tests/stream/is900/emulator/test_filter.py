"""A device with a filter: prediction, enhancement, ranges and emitters act. Without one they are only stored."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.polhemus.codec.datagram import parse_datagram
from harness.stream.polhemus.codec.items import record_size, record_type
from harness.stream.polhemus.codec.records import RecordFormat, RecordValues, encode_records, yaw_pitch_roll_deg
from harness.stream.polhemus.codec.replies import TrackingStatus, parse_reply
from harness.stream.polhemus.codec.samples import DeviceSamples, FilterSamples
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.settings import DEFAULT_EMITTERS
from harness.stream.polhemus.emulator.udp_broadcast import UdpBroadcast
from tests.stream.is900.emulator.played import FILTER_EMITTERS, DeviceSession, make_samples, with_filter

ITEMS = (40, 2, 11, 1)
SET_UP = b"".join(b"O%d,40,2,11,1\r" % station for station in (1, 2, 3, 4)) + b"fuMZ\r"
TURN = rotations.exp(np.array([0.5, -0.4, 1.2]))
EMITTER_LINES = b"".join(emitter.line() for emitter in FILTER_EMITTERS)


def filtered_samples(**settings: Any) -> DeviceSamples:
    return with_filter(make_samples(quaternion=TURN), **settings)


def filter_of(samples: DeviceSamples) -> FilterSamples:
    assert samples.filter is not None
    return samples.filter


def read_poses(data: bytes) -> tuple[Floats, Floats]:
    """Return positions (R, 4, 3) [m] and quaternions (R, 4, 4) of R rounds of four stations."""
    table = np.frombuffer(data, record_type(ITEMS))
    assert bytes(table["station"]).decode() == "1234" * (len(table) // 4)
    return 0.01 * table["position"].reshape(-1, 4, 3).astype(float), table["quaternion"].reshape(-1, 4, 4).astype(float)


def assert_poses(data: bytes, position_m: Floats, turn: Floats) -> None:
    read_m, read = read_poses(data)
    np.testing.assert_allclose(read_m, position_m.reshape(-1, 4, 3), atol=1e-6)
    np.testing.assert_allclose(read, turn.reshape(-1, 4, 4), atol=1e-6)


def test_prediction_acts_at_once_and_on_its_station_alone() -> None:
    samples = filtered_samples()
    made, session = filter_of(samples), DeviceSession(samples=samples)
    session.send(SET_UP)
    plain = session.send(b"P")
    assert_poses(plain, samples.position_m[:1], samples.tracker_from_station[:1])
    ahead_s = np.array([0.0, 0.050, 0.0, 0.007])[:, None]
    turned = rotations.multiply(rotations.exp(ahead_s * made.turn_rad_s[0]), samples.tracker_from_station[0])
    predicted = session.send(b"Mp2,50\rMp4,7\rP")
    assert_poses(predicted, samples.position_m[0] + ahead_s * made.velocity_m_s[0], turned)
    assert session.send(b"Mp2\rMp3\r") == b"32p50\r\n33p 0\r\n"
    assert session.send(b"Mp2,0\rMp4,0\rP") == plain


@pytest.mark.parametrize("mode", [1, 2])
def test_enhancement_selects_another_pose_with_the_same_velocity(mode: int) -> None:
    samples = filtered_samples()
    made, session = filter_of(samples), DeviceSession(samples=samples)
    position_m, turn = samples.position_m[0].copy(), samples.tracker_from_station[0].copy()
    position_m[2], turn[2] = (
        made.enhanced_position_m[mode - 1, 0, 2],
        made.enhanced_tracker_from_station[mode - 1, 0, 2],
    )
    reply = session.send(SET_UP + b"MF3,%d\rP" % mode)
    assert_poses(reply, position_m, turn)
    position_m[2] += 0.02 * made.velocity_m_s[0, 2]
    turn[2] = rotations.multiply(rotations.exp(0.02 * made.turn_rad_s[0, 2]), turn[2])
    assert_poses(session.send(b"Mp3,20\rP"), position_m, turn)
    assert session.send(b"MF3,0\rMp3,0\rP") != reply


def test_polls_streams_and_packets_say_the_same() -> None:
    samples = filtered_samples(prediction_ms=(30, 0, 50), enhancement=(2, 1))
    made = filter_of(samples)
    settings = made.prediction_ms, made.enhancement
    position_m, turn = made.report_poses(samples.position_m, samples.tracker_from_station, *settings)
    session = DeviceSession(EmulatorConfig(udp=True), samples=samples)
    broadcast = UdpBroadcast(session.device, 0.0)
    streamed = session.send(SET_UP + b"C") + session.wait(0.1999)
    assert_poses(streamed, position_m[:10], turn[:10])
    assert session.send(b"cP") == streamed[-len(streamed) // 10 :]
    packets = [packet for data in broadcast.packets(0.2) if (packet := parse_datagram(data)) is not None]
    assert len(packets) == 40
    for index, packet in enumerate(packets):
        at = divmod(index, 4)
        assert packet.position_m == pytest.approx(position_m[at], abs=1e-5)
        assert packet.yaw_pitch_roll_deg == pytest.approx(yaw_pitch_roll_deg(turn[at][None])[0], abs=1e-4)


def test_a_setting_acts_within_a_round_in_packets_too() -> None:
    """The reading of station 2 is taken at 5 ms and ready at 9 ms."""
    samples = filtered_samples()
    made, session = filter_of(samples), DeviceSession(EmulatorConfig(udp=True), samples=samples)
    broadcast = UdpBroadcast(session.device, 0.0)
    before = broadcast.packets(0.0045)
    session.send(b"Mp1,50\rMp2,50\r", after_s=0.0046)
    after = broadcast.packets(0.0095)
    assert (len(before), len(after)) == (1, 1)
    (first, second) = (parse_datagram(data) for data in (*before, *after))
    assert first is not None
    assert second is not None
    assert first.position_m == pytest.approx(samples.position_m[0, 0], abs=1e-6)
    assert second.position_m == pytest.approx(samples.position_m[0, 1] + 0.05 * made.velocity_m_s[0, 1], abs=1e-6)


def test_geometry_is_applied_to_the_predicted_pose() -> None:
    """The tip lies along the predicted axes; a boresight makes the predicted orientation the reference."""
    samples = filtered_samples(prediction_ms=(50,))
    made, session = filter_of(samples), DeviceSession(samples=samples)
    turned = rotations.multiply(rotations.exp(0.05 * made.turn_rad_s[0, 0]), TURN)
    tip_m = samples.position_m[0, 0] + 0.05 * made.velocity_m_s[0, 0] + rotations.rotate(turned, np.array([0.2, 0, 0]))
    position_m, _ = read_poses(session.send(SET_UP + b"N1,20,0,0\rP"))
    np.testing.assert_allclose(position_m[0, 0], tip_m, atol=1e-6)
    _, turn = read_poses(session.send(b"MB1\rP"))
    np.testing.assert_allclose(turn[0, 0], rotations.IDENTITY, atol=1e-6)


def read_ranges(session: DeviceSession, after_s: float = 0.0) -> TrackingStatus:
    status = parse_reply(session.send(b"MP\r", after_s))
    assert isinstance(status, TrackingStatus)
    return status


def test_mp_reports_the_ranges_of_the_latest_reading() -> None:
    samples = filtered_samples()
    quality = samples.quality.copy()
    quality[:, 1] = 0.0
    made, session = filter_of(samples), DeviceSession(samples=replace(samples, quality=quality))
    for instant in range(3):
        status = read_ranges(session, after_s=0.02 if instant else 0.0159)  # the last station's time is 15 ms
        assert status.states == "TLTT" + 8 * "X"
        assert status.received == (*made.ranges_received[instant], *8 * [0])
        assert status.rejected == (*made.ranges_rejected[instant], *8 * [0])
    session.device.set_lost_stations("3")
    session.send(b"l4,0\r")
    status = read_ranges(session)
    assert status.states == "TLLX" + 8 * "X"
    assert (status.received[2:4], status.rejected[2:4]) == ((0, 0), (0, 0))
    assert status.received[:2] == tuple(made.ranges_received[2, :2])


def test_the_settings_after_power_on_are_those_of_the_samples() -> None:
    queries = b"Mp1\rMp2\rMs2\rMs3\rMCF\r"
    at_first = b"31p 5\r\n32p40\r\n32s010\r\n33s020\r\n" + EMITTER_LINES
    session = DeviceSession(
        EmulatorConfig(restart_s=0.0), samples=filtered_samples(prediction_ms=(5, 40), enhancement=(0, 1, 2))
    )
    assert session.send(queries) == at_first
    changes = b"Mp2,10\rMF3,1\rMCf2\rMCe\r"
    changed = b"31p 5\r\n32p10\r\n32s010\r\n33s010\r\n" + FILTER_EMITTERS[0].line() + FILTER_EMITTERS[2].line()
    assert session.send(changes + queries) == changed
    assert session.send(b"\x19" + queries, after_s=0.1) == at_first
    assert session.send(changes + b"\x0b\x19" + queries, after_s=0.1) == changed
    assert session.send(b"W" + queries) == at_first


def test_without_a_filter_prediction_and_enhancement_change_nothing() -> None:
    session = DeviceSession()
    plain = session.send(SET_UP + b"P")
    assert session.send(b"Mp1,50\rMF2,2\rP") == plain
    assert read_ranges(session).received[:4] == (12, 12, 12, 12)
    assert session.send(b"MCF1\r") == DEFAULT_EMITTERS[0].line()


def test_the_first_loop_has_the_bytes_of_a_take_that_is_encoded_at_once() -> None:
    """A simulation computes all instants together, the emulator one round at a time."""
    samples = filtered_samples(prediction_ms=(0, 11, 50, 33), enhancement=(0, 1, 2, 2))
    made, count = filter_of(samples), samples.taken_s.size
    poses = made.report_poses(samples.position_m, samples.tracker_from_station, made.prediction_ms, made.enhancement)
    values = RecordValues(
        samples.device_s.ravel(), poses[0].reshape(-1, 3), poses[1].reshape(-1, 4), samples.quality.ravel()
    )
    characters = np.tile(np.frombuffer(b"1234", np.uint8), len(samples))
    wire = encode_records((40, 2, 11, 21, 1), characters, values, RecordFormat()).tobytes()
    session = DeviceSession(samples=samples)
    lists = b"".join(b"O%d,40,2,11,21,1\r" % station for station in (1, 2, 3, 4))
    streamed = session.send(lists + b"fuMZ\rC") + session.wait(samples.loop_s - 1e-3)
    assert len(streamed) == count * record_size((40, 2, 11, 21, 1))
    assert streamed == wire
