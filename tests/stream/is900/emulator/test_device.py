"""The device: records, the clock, streaming, saving and restarting, geometry. No line, no I/O."""

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.stream.is900.emulator.device import Device
from harness.stream.polhemus.codec.items import record_type
from harness.stream.polhemus.codec.records import from_yaw_pitch_roll_deg, yaw_pitch_roll_deg
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.settings import STATION_NAMES
from tests.stream.is900.emulator.played import DeviceSession, make_samples

SET_UP = b"O1,40,2,11,21,1\rO2,40,2,11,21,1\rO3,40,2,11,21,1\rO4,40,2,11,21,1\rfu"
ORIENTATION = from_yaw_pitch_roll_deg(np.array([[40.0, -20.0, 10.0]]))[0]


def record_table(data: bytes, items: tuple[int, ...] = (40, 2, 11, 21, 1)) -> np.ndarray:
    return np.frombuffer(data, record_type(items))


def test_the_state_after_power_on() -> None:
    """ASCII, inches, polled, list 2,4,1: 47 bytes per plugged-in station (docs/is900.md 12, 5.4 D)."""
    session = DeviceSession()
    assert session.wait(1.0) == b""
    lines = session.send(b"P").split(b"\r\n")
    assert [line[:3] for line in lines[:-1]] == [b"01 ", b"02 ", b"03 ", b"04 "]
    assert lines[0][3:24] == b"%7.2f%7.2f%7.2f" % (1.05 / 0.0254, -0.5 / 0.0254, 1.5 / 0.0254)
    assert [float(lines[0][at : at + 7]) for at in (24, 31, 38)] == [0.0, 0.0, 0.0]


def test_settings_take_effect_at_once() -> None:
    session = DeviceSession()
    session.send(b"O1,2,1\rO2,2,1\rl3,0\rl4,0\r", after_s=1.001)
    inches, centimetres = session.send(b"P"), session.send(b"uP")
    assert inches[:10] == b"01   41.34"
    assert centimetres[:10] == b"01  105.00"
    assert len(session.send(b"fP")) == 2 * 17
    assert session.send(b"FUP") == inches
    assert session.send(b"O2,18,1\rP")[26:29] == b"02 "


def test_lists_differ_by_station() -> None:
    session = DeviceSession(EmulatorConfig(controls="still", stylus_bytes=2))
    reply = session.send(b"O1,2,1\rO2,40,2,11,21,1\rO3,22,23,0\rO4,2,4,16,1\rfP", after_s=0.5)
    assert [len(part) for part in (reply[:17], reply[17:55], reply[55:62], reply[62:])] == [17, 38, 7, 31]
    assert reply[55:62] == b"03 \x00\x7f\x7f "


def test_streaming_begins_with_a_whole_round_and_stops_between_records() -> None:
    session = DeviceSession()
    session.send(SET_UP + b"MZ\r")
    session.send(b"C", after_s=0.013)  # in the middle of the first round
    session.device.receive(b"", 0.100)
    stations = bytes(record_table(session.device.advance(0.101))["station"]).decode()
    assert stations.startswith("1234")
    assert stations == ("1234" * 9)[: len(stations)]
    session.device.receive(b"c", 0.131)
    rest = session.device.messages(1.0)
    assert rest[-1].halts
    assert all(message.ready_s <= 0.131 + 0.004 for message in rest)


def test_a_poll_while_streaming_sends_one_more_round() -> None:
    session = DeviceSession()
    session.send(SET_UP + b"MZ\rC")
    assert len(session.send(b"", 0.1)) % 38 == 0
    assert len(session.send(b"P")) == 4 * 38


def test_the_clock_counts_samples_from_zero() -> None:
    session, played = DeviceSession(), make_samples()
    session.send(SET_UP + b"MT\r", after_s=0.3217)
    first = record_table(session.send(b"MZ\rC"))
    later = record_table(session.wait(0.999))
    stamps = np.concatenate([first["time"], later["time"]])
    np.testing.assert_array_equal(stamps, (1e3 * played.device_s.ravel()).astype(np.float32)[: len(stamps)])
    later_records = record_table(session.send(b"MZ\r") + session.wait(0.1))
    assert 0.0 <= later_records["time"][0] < 20.0
    assert record_table(session.send(b"Mt\rP", after_s=0.0))["time"][0] == pytest.approx(1e6 * 0.1, abs=2e4)


def test_loops_follow_each_other_and_the_clock_continues() -> None:
    session, played = DeviceSession(), make_samples()
    streamed = record_table(session.send(SET_UP + b"MZ\rC") + session.wait(2.5 * played.loop_s))
    station_records = streamed[streamed["station"] == ord("1")]
    np.testing.assert_array_equal(station_records["position"][0], station_records["position"][len(played)])
    assert station_records["time"][len(played)] == np.float32(1e3 * (played.device_s[0, 0] + played.device_loop_s))
    assert np.ptp(np.diff(station_records["time"].astype(float))) < 0.01


def test_a_lost_station_keeps_sending_and_an_inactive_one_is_silent() -> None:
    session = DeviceSession()
    session.send(SET_UP)
    session.device.set_lost_stations("2")
    assert record_table(session.send(b"P"))["quality"].tolist() == [255, 0, 255, 255]
    assert b"TC0L00TC0" in session.send(b"MP\r").upper()
    session.device.set_lost_stations("")
    assert bytes(record_table(session.send(b"l2,0\rP"))["station"]) == b"134"
    assert b"TC0X00TC0" in session.send(b"MP\r").upper()


def test_a_suspended_device_holds_its_replies() -> None:
    session = DeviceSession()
    session.send(SET_UP + b"MZ\rC")
    assert len(session.wait(0.1)) > 4 * 38
    assert session.send(b"\x13O1\rP") == b""
    assert session.wait(0.1) == b""
    assert session.send(b"\x11") == b"21O40 21121 1\r\n"
    assert record_table(session.wait(0.1))["time"][0] > 5e3 + 190.0


def test_a_restart_restores_the_saved_settings_after_a_silence() -> None:
    session = DeviceSession(EmulatorConfig(restart_s=2.0))
    session.send(b"O1,2,1\r\x0bO1,2,11,1\rfuC")
    assert session.send(b"\x19SO1\r", after_s=0.0001) == b""
    assert session.send(b"SP", after_s=1.9) == b""
    assert session.send(b"O1\r", after_s=0.2) == b"21O 2 1\r\n"
    assert session.send(b"S")[:6] == b"21S3F0"
    assert session.wait(1.0) == b""
    assert session.send(b"WO1\r") == b"21O 2 4 1\r\n"
    assert session.send(b"fO1,21,1\rl2,0\rl3,0\rl4,0\rMZ\rP") == b"01 " + np.float32(5000.0).tobytes() + b"\r\n"


def test_19_acts_in_the_middle_of_a_line() -> None:
    """The recovery of VRPN sends 19 after letters without a terminator (docs/is900.md 3)."""
    session = DeviceSession(EmulatorConfig(restart_s=0.0))
    assert session.send(b"\rY\x19c") == b""
    assert session.send(b"S")[:3] == b"21S"


def test_vrpn_resets_a_device_that_does_not_answer() -> None:
    """CR, 19 and `c` come 2 s apart, then a wait of 20 s. The last attempts have letters without CR (11.1)."""
    for characters in (b"\r\x19c", b"\rt\x19c", b"\rYt\x19c"):
        session = DeviceSession(EmulatorConfig(restart_s=10.0))
        for byte in characters:
            assert session.send(bytes([byte]), after_s=2.0) == b""
        assert len(session.send(b"S", after_s=20.0)) == 55


def test_the_same_bytes_at_the_same_times_give_the_same_answer() -> None:
    def run(step_s: float) -> bytes:
        device = Device(make_samples(), EmulatorConfig(), 0.0)
        device.receive(SET_UP + b"MZ\rC", 0.0)
        out = b"".join(device.advance(k * step_s) for k in range(round(1.0 / step_s) + 1))
        device.receive(b"S", 1.0)
        return out + device.advance(1.0)

    assert run(0.001) == run(0.25) == run(1.0)


def read_pose(session: DeviceSession) -> tuple[Floats, Floats]:
    row = record_table(session.send(b"P"))[0]
    return 0.01 * row["position"].astype(float), row["quaternion"].astype(float)


@pytest.mark.parametrize("mode", [b"MBI\rB1\r", b"MBF\rMB1\r"])
def test_boresight_zeroes_only_the_heading(mode: bytes) -> None:
    session = DeviceSession(quaternion=ORIENTATION)
    session.send(SET_UP)
    position_m, _ = read_pose(session)
    session.send(mode)
    position_after, quaternion = read_pose(session)
    np.testing.assert_allclose(quaternion, from_yaw_pitch_roll_deg(np.array([[0.0, -20.0, 10.0]]))[0], atol=1e-6)
    np.testing.assert_array_equal(position_after, position_m)
    session.send(b"b1\r")
    np.testing.assert_allclose(read_pose(session)[1], ORIENTATION, atol=1e-6)


@pytest.mark.parametrize("mode", [b"MBF\rB1\r", b"MBI\rMB1\r"])
def test_full_boresight_makes_the_present_orientation_the_reference(mode: bytes) -> None:
    session = DeviceSession(quaternion=ORIENTATION)
    session.send(SET_UP + mode)
    np.testing.assert_allclose(read_pose(session)[1], rotations.IDENTITY, atol=1e-6)
    session.send(b"G1,90,0,0\r" + mode)
    np.testing.assert_allclose(read_pose(session)[1], rotations.about_z(np.pi / 2), atol=1e-6)


def test_an_alignment_is_relative_to_the_present_frame() -> None:
    session = DeviceSession(quaternion=ORIENTATION)
    session.send(SET_UP)
    session.send(b"A1,100,-50,150,100,0,150,0,-50,150\r")  # X along the old Y, Y along the old -X
    position_m, quaternion = read_pose(session)
    np.testing.assert_allclose(position_m, [0.0, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(quaternion, rotations.multiply(rotations.about_z(-np.pi / 2), ORIENTATION), atol=1e-6)
    session.send(b"A1,0,0,0,0,1,0,-1,0,0\r")
    np.testing.assert_allclose(
        read_pose(session)[1], rotations.multiply(rotations.about_z(-np.pi), ORIENTATION), atol=1e-6
    )
    session.send(b"A1,10,0,0,11,0,0,10,1,0\r")
    np.testing.assert_allclose(read_pose(session)[0], [-0.1, 0.0, 0.0], atol=1e-6)
    session.send(b"R1\r")
    np.testing.assert_allclose(read_pose(session)[0], [1.0, -0.5, 1.5], atol=1e-6)


def test_a_tip_offset_is_in_station_axes() -> None:
    session = DeviceSession(quaternion=rotations.about_z(np.pi / 2))
    session.send(SET_UP + b"N1,10,0,0\r")
    np.testing.assert_allclose(read_pose(session)[0], [1.0, -0.4, 1.5], atol=1e-6)


def test_the_reference_angles_move_nothing_before_the_next_boresight() -> None:
    """`G` (docs/is900.md 4.1): the next boresight makes the orientation equal to them; position never moves."""
    session = DeviceSession(quaternion=ORIENTATION)
    session.send(SET_UP)
    assert session.send(b"G1\r") == b"21G   0.00   0.00   0.00\r\n"
    before = read_pose(session)
    session.send(b"G1,90,-30,45\r")
    assert session.send(b"G1\r") == b"21G  90.00 -30.00  45.00\r\n"
    for value, same in zip(read_pose(session), before, strict=True):
        np.testing.assert_array_equal(value, same)
    for command, angles_deg in (
        (b"MB1\r", (90.0, -30.0, 45.0)),  # in the default mode MBI: all three angles
        (b"b1\r", (40.0, -20.0, 10.0)),
        (b"B1\r", (90.0, -20.0, 10.0)),  # the heading alone
        (b"MBF\rB1\r", (90.0, -30.0, 45.0)),  # as on a Fastrak
        (b"G1,0,0,0\r", (90.0, -30.0, 45.0)),  # the boresight in effect stays
        (b"B1\r", (0.0, 0.0, 0.0)),
        (b"b1\r", (40.0, -20.0, 10.0)),
    ):
        session.send(command)
        position_m, quaternion = read_pose(session)
        np.testing.assert_allclose(yaw_pitch_roll_deg(quaternion[None])[0], angles_deg, atol=1e-3, err_msg=str(command))
        np.testing.assert_array_equal(position_m, before[0])


def test_the_hemisphere_vector_is_echoed_and_moves_nothing() -> None:
    session = DeviceSession(quaternion=ORIENTATION)
    session.send(SET_UP)
    before = read_pose(session)
    assert session.send(b"H1\r") == b"21H   1.00   0.00   0.00\r\n", "a Fastrak's default"
    assert session.send(b"H1,0,0,-1\rH1\r") == b"21H   0.00   0.00  -1.00\r\n"
    session.send(b"B1\rb1\r")
    for value, same in zip(read_pose(session), before, strict=True):
        np.testing.assert_array_equal(value, same)


SPARSE = ("1357", "29", "3B", "C", "123456789ABC")


@pytest.mark.parametrize("characters", SPARSE)
def test_stations_have_the_numbers_of_their_receivers(characters: str) -> None:
    count = len(characters)
    samples = make_samples(count)
    session = DeviceSession(EmulatorConfig(characters=characters), samples=samples)
    session.send(b"fu" + b"".join(b"O%c,40,2,11,21,1\r" % c for c in characters.encode()) + b"MZ\r")
    table = record_table(session.send(b"P"))
    assert bytes(table["station"]).decode() == characters
    np.testing.assert_allclose(0.01 * table["position"], samples.position_m[0], atol=1e-6)
    flags = "".join("01"[c in characters] for c in STATION_NAMES)
    assert session.send(b"l*\r") == f"21l{flags}{20 * '0'}\r\n".encode()
    assert session.send(b"l\r") == f"21l{flags[:4]}\r\n".encode(), "without a station: the first four, 9 bytes"
    states = session.send(b"MP\r")[3:39:3].decode()
    assert states == "".join("XT"[c in characters] for c in STATION_NAMES)
    session.send(f"l{characters[-1]},0\rl{characters[-1]},1\r".encode())
    session.send(b"".join(b"l%c,1\r" % c for c in STATION_NAMES.encode()))
    assert session.device.active == characters, "a station that is not plugged in stays off"
    streamed = record_table(session.send(b"MZ\rC") + session.wait(1.0))
    assert bytes(streamed["station"][:count]).decode() == characters


def test_numbers_that_no_device_has_are_refused() -> None:
    for characters in ("13", "1335", "3157", "1D35", "135x"):
        with pytest.raises(BadInput, match="do not fit 4 stations"):
            DeviceSession(EmulatorConfig(characters=characters))


def test_a_constellation_can_be_cleared_and_uploaded() -> None:
    """The lines of a public configuration, with blanks after the commas (docs/is900.md 4.2)."""
    session = DeviceSession()
    session.send(SET_UP + b"MCC\r\nMCe\r\n")
    assert session.send(b"MCF\r\n") == b""
    assert record_table(session.send(b"P"))["quality"].tolist() == [0] * 4, "without emitters nothing is tracked"
    session.send(b"MCC\nMCF1, -0.9262, -1.4014, -2.4494, 0.000, 0.707, 0.707, 5001\nMCF18,1,2,-2.5,0,0,1,5018\nMCe\n")
    assert session.send(b"MCF\r\n") == (
        b"31F      1   -0.9262   -1.4014   -2.4494   0.00   0.71   0.71   5001\r\n"
        b"31F     18    1.0000    2.0000   -2.5000   0.00   0.00   1.00   5018\r\n"
    )
    assert record_table(session.send(b"P"))["quality"].tolist() == [255] * 4
    assert session.send(b"MCf18,5018\nMCf99\nMCe\nMCF\n").count(b"31F") == 1, "FreeVR names the identity too"
    assert b"EC -2" in session.send(b"MCf1,x\n")
