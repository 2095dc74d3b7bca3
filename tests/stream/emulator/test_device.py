"""The device at work: records, the clock, streaming, saving and restarting, geometry. No line, no I/O."""

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.codec.items import record_type
from harness.stream.codec.records import from_yaw_pitch_roll_deg
from harness.stream.emulator.config import EmulatorConfig
from harness.stream.emulator.device import Device
from tests.stream.emulator.played import Talk, samples

QUIET = b"O1,40,2,11,21,1\rO2,40,2,11,21,1\rO3,40,2,11,21,1\rO4,40,2,11,21,1\rfu"
TURN = from_yaw_pitch_roll_deg(np.array([[40.0, -20.0, 10.0]]))[0]


def table(data: bytes, items: tuple[int, ...] = (40, 2, 11, 21, 1)) -> np.ndarray:
    return np.frombuffer(data, record_type(items))


def test_the_state_after_power_on() -> None:
    """ASCII, inches, polled, list 2,4,1: 47 bytes of each station that is plugged in (docs/is900.md 12, 5.4 D)."""
    talk = Talk()
    assert talk.wait(1.0) == b""
    lines = talk.say(b"P").split(b"\r\n")
    assert [line[:3] for line in lines[:-1]] == [b"01 ", b"02 ", b"03 ", b"04 "]
    assert lines[0][3:24] == b"%7.2f%7.2f%7.2f" % (1.05 / 0.0254, -0.5 / 0.0254, 1.5 / 0.0254)
    assert [float(lines[0][at : at + 7]) for at in (24, 31, 38)] == [0.0, 0.0, 0.0]


def test_settings_take_effect_at_once() -> None:
    talk = Talk()
    talk.say(b"O1,2,1\rO2,2,1\rl3,0\rl4,0\r", after_s=1.001)
    inches, centimetres = talk.say(b"P"), talk.say(b"uP")
    assert inches[:10] == b"01   41.34"
    assert centimetres[:10] == b"01  105.00"
    assert len(talk.say(b"fP")) == 2 * 17
    assert talk.say(b"FUP") == inches
    assert talk.say(b"O2,18,1\rP")[26:29] == b"02 "


def test_lists_differ_by_station() -> None:
    talk = Talk()
    said = talk.say(b"O1,2,1\rO2,40,2,11,21,1\rO3,22,23,0\rO4,2,4,16,1\rfP", after_s=0.5)
    assert [len(part) for part in (said[:17], said[17:55], said[55:62], said[62:])] == [17, 38, 7, 31]
    assert said[55:62] == b"03 \x00\x7f\x7f "


def test_streaming_begins_with_a_whole_round_and_stops_between_records() -> None:
    talk = Talk()
    talk.say(QUIET + b"MZ\r")
    talk.say(b"C", after_s=0.013)  # in the middle of the first round
    talk.device.receive(b"", 0.100)
    stations = bytes(table(talk.device.advance(0.101))["station"]).decode()
    assert stations.startswith("1234")
    assert stations == ("1234" * 9)[: len(stations)]
    talk.device.receive(b"c", 0.131)
    rest = talk.device.messages(1.0)
    assert rest[-1].halts
    assert all(message.ready_s <= 0.131 + 0.004 for message in rest)


def test_a_poll_while_streaming_is_one_more_set() -> None:
    talk = Talk()
    talk.say(QUIET + b"MZ\rC")
    assert len(talk.say(b"", 0.1)) % 38 == 0
    assert len(talk.say(b"P")) == 4 * 38


def test_the_clock_counts_samples_from_zero() -> None:
    talk, given = Talk(), samples()
    talk.say(QUIET + b"MT\r", after_s=0.3217)
    first = table(talk.say(b"MZ\rC"))
    later = table(talk.wait(0.999))
    stamps = np.concatenate([first["time"], later["time"]])
    np.testing.assert_array_equal(stamps, (1e3 * given.device_s.ravel()).astype(np.float32)[: len(stamps)])
    again = table(talk.say(b"MZ\r") + talk.wait(0.1))
    assert 0.0 <= again["time"][0] < 20.0
    assert table(talk.say(b"Mt\rP", after_s=0.0))["time"][0] == pytest.approx(1e6 * 0.1, abs=2e4)


def test_laps_follow_each_other_and_the_clock_goes_on() -> None:
    talk, given = Talk(), samples()
    heard = table(talk.say(QUIET + b"MZ\rC") + talk.wait(2.5 * given.loop_s))
    one = heard[heard["station"] == ord("1")]
    np.testing.assert_array_equal(one["position"][0], one["position"][len(given)])
    assert one["time"][len(given)] == np.float32(1e3 * (given.device_s[0, 0] + given.device_loop_s))
    assert np.ptp(np.diff(one["time"].astype(float))) < 0.01


def test_a_lost_station_keeps_sending_and_one_switched_off_is_silent() -> None:
    talk = Talk()
    talk.say(QUIET)
    talk.device.set_lost_stations("2")
    assert table(talk.say(b"P"))["quality"].tolist() == [255, 0, 255, 255]
    assert b"TC0L00TC0" in talk.say(b"MP\r").upper()
    talk.device.set_lost_stations("")
    assert bytes(table(talk.say(b"l2,0\rP"))["station"]) == b"134"
    assert b"TC0X00TC0" in talk.say(b"MP\r").upper()


def test_suspended_it_says_nothing_and_answers_later() -> None:
    talk = Talk()
    talk.say(QUIET + b"MZ\rC")
    assert len(talk.wait(0.1)) > 4 * 38
    assert talk.say(b"\x13O1\rP") == b""
    assert talk.wait(0.1) == b""
    assert talk.say(b"\x11") == b"21O40 21121 1\r\n"
    assert table(talk.wait(0.1))["time"][0] > 5e3 + 190.0


def test_a_restart_keeps_what_was_saved_and_is_silent_at_first() -> None:
    talk = Talk(EmulatorConfig(restart_s=2.0))
    talk.say(b"O1,2,1\r\x0bO1,2,11,1\rfuC")
    assert talk.say(b"\x19SO1\r", after_s=0.0001) == b""
    assert talk.say(b"SP", after_s=1.9) == b""
    assert talk.say(b"O1\r", after_s=0.2) == b"21O 2 1\r\n"
    assert talk.say(b"S")[:6] == b"21S3F0"
    assert talk.wait(1.0) == b""
    assert talk.say(b"WO1\r") == b"21O 2 4 1\r\n"
    assert talk.say(b"fO1,21,1\rl2,0\rl3,0\rl4,0\rMZ\rP") == b"01 " + np.float32(5000.0).tobytes() + b"\r\n"


def test_19_counts_in_the_middle_of_a_line() -> None:
    """The recovery of VRPN sends it after letters without a terminator (docs/is900.md 3)."""
    talk = Talk(EmulatorConfig(restart_s=0.0))
    assert talk.say(b"\rY\x19c") == b""
    assert talk.say(b"S")[:3] == b"21S"


def test_the_same_bytes_at_the_same_times_give_the_same_answer() -> None:
    def run(step_s: float) -> bytes:
        device = Device(samples(), EmulatorConfig(), 0.0)
        device.receive(QUIET + b"MZ\rC", 0.0)
        out = b"".join(device.advance(k * step_s) for k in range(round(1.0 / step_s) + 1))
        device.receive(b"S", 1.0)
        return out + device.advance(1.0)

    assert run(0.001) == run(0.25) == run(1.0)


def pose(talk: Talk) -> tuple[Floats, Floats]:
    row = table(talk.say(b"P"))[0]
    return 0.01 * row["position"].astype(float), row["quaternion"].astype(float)


@pytest.mark.parametrize("mode", [b"MBI\rB1\r", b"MBF\rMB1\r"])
def test_boresight_zeroes_the_heading_alone(mode: bytes) -> None:
    talk = Talk(turn=TURN)
    talk.say(QUIET)
    place, _ = pose(talk)
    talk.say(mode)
    same, turn = pose(talk)
    np.testing.assert_allclose(turn, from_yaw_pitch_roll_deg(np.array([[0.0, -20.0, 10.0]]))[0], atol=1e-6)
    np.testing.assert_array_equal(same, place)
    talk.say(b"b1\r")
    np.testing.assert_allclose(pose(talk)[1], TURN, atol=1e-6)


@pytest.mark.parametrize("mode", [b"MBF\rB1\r", b"MBI\rMB1\r"])
def test_full_boresight_makes_the_present_orientation_the_reference(mode: bytes) -> None:
    talk = Talk(turn=TURN)
    talk.say(QUIET + mode)
    np.testing.assert_allclose(pose(talk)[1], rotations.IDENTITY, atol=1e-6)
    talk.say(b"H1,90,0,0\r" + mode)
    np.testing.assert_allclose(pose(talk)[1], rotations.about_z(np.pi / 2), atol=1e-6)


def test_an_alignment_makes_a_frame_of_three_points_on_top_of_the_present_one() -> None:
    talk = Talk(turn=TURN)
    talk.say(QUIET)
    talk.say(b"A1,100,-50,150,100,0,150,0,-50,150\r")  # X along the old Y, Y along the old -X
    place, turn = pose(talk)
    np.testing.assert_allclose(place, [0.0, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(turn, rotations.multiply(rotations.about_z(-np.pi / 2), TURN), atol=1e-6)
    talk.say(b"A1,0,0,0,0,1,0,-1,0,0\r")
    np.testing.assert_allclose(pose(talk)[1], rotations.multiply(rotations.about_z(-np.pi), TURN), atol=1e-6)
    talk.say(b"A1,10,0,0,11,0,0,10,1,0\r")
    np.testing.assert_allclose(pose(talk)[0], [-0.1, 0.0, 0.0], atol=1e-6)
    talk.say(b"R1\r")
    np.testing.assert_allclose(pose(talk)[0], [1.0, -0.5, 1.5], atol=1e-6)


def test_a_tip_lies_along_the_stations_axes_and_mounting_turns_the_room() -> None:
    talk = Talk(turn=rotations.about_z(np.pi / 2))
    talk.say(QUIET + b"N1,10,0,0\r")
    np.testing.assert_allclose(pose(talk)[0], [1.0, -0.4, 1.5], atol=1e-6)
    talk.say(b"N1,0,0,0\rG1,90,0,0\r")
    place, turn = pose(talk)
    np.testing.assert_allclose(place, [0.5, 1.0, 1.5], atol=1e-6)
    np.testing.assert_allclose(np.abs(turn), [0.0, 0.0, 0.0, 1.0], atol=1e-6)
    assert pose(talk)[0] == pytest.approx(place)
