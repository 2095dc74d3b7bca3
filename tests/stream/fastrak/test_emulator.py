"""The emulated FASTRAK: its bytes, and the commands of its manual."""

import numpy as np
import pytest

from harness.core import rotations
from harness.errors import BadInput
from harness.stream.fastrak.emulator import FastrakDevice, FastrakEmulator, FastrakEmulatorConfig
from harness.stream.polhemus.codec.replies import StatusRecord, parse_reply
from tests.stream.is900.emulator.played import DeviceSession, make_samples

QUARTER_TURN = rotations.about_z(np.pi / 2.0)


class FastrakSession(DeviceSession):
    """A FASTRAK and its clock."""

    def __init__(self, stations: int = 2, config: FastrakEmulatorConfig | None = None) -> None:
        self.device = FastrakDevice(make_samples(stations, quaternion=QUARTER_TURN), config, 0.0)
        self.now_s = 0.0


def test_records_have_the_layout_of_the_manual() -> None:
    """(1, -0.5, 1.5) m is (39.37, -19.69, 59.06) inches or (100, -50, 150) cm; docs/is900.md 5.4 has these bytes."""
    device = FastrakSession(1)
    assert device.send(b"P") == b"01   39.37 -19.69  59.06  90.00  -0.00   0.00\r\n"
    assert device.send(b"uP")[:24] == b"01  100.00 -50.00 150.00"
    assert device.send(b"O1,2,11,0\rUfP").hex() == ("303120f67a1d42f67a9dc171386c42f304353f0000000000000000f304353f20")
    assert device.send(b"O1,5,6,7,1\rFP") == (b"01  0.0000 1.0000 0.0000-1.0000 0.0000 0.0000 0.0000 0.0000 1.0000\r\n")


def test_extended_precision_has_an_exponent() -> None:
    """`3(Sx.xxxxxESxxb)` of the manual, revision G, page 59."""
    device = FastrakSession(1)
    position = b" 3.93701E+01 -1.96850E+01  5.90551E+01 "
    assert device.send(b"O1,52,50,54,51\rP") == b"01 " + position + b"  9.00000E+01 -0.00000E+00  0.00000E+00 \r\n"
    assert device.send(b"O1,52,4,1\rP") == b"01 " + position + b"  90.00  -0.00   0.00\r\n"
    binary = device.send(b"fO1,2,11,1\rP")
    assert device.send(b"O1,52,61,51\rP") == binary
    assert b" EC -3*" in device.send(b"O1,2,52,1\r"), "the position twice"


def test_the_status_has_the_layout_of_the_manual() -> None:
    """Firmware of 2012 has the tag `F3` and the map of the receivers; older firmware has blanks."""
    assert FastrakSession(3).send(b"S") == b"21S3F0         3.02  OutputCompensat CPG2030-003-10  \r\n"
    device = FastrakSession(3, FastrakEmulatorConfig(tagged=True))
    assert device.send(b"S") == b"21S3F0    F37  3.02  OutputCompensat CPG2030-003-10  \r\n"
    status = parse_reply(device.send(b"fuCS")[:55])
    assert isinstance(status, StatusRecord)
    assert (status.binary, status.centimetres, status.continuous, status.tag) == (True, True, True, "F37")
    assert status.identification == "OutputCompensat CPG2030-003-10"
    assert len(status.line()) == 55
    assert parse_reply(status.line()) == status


def test_lengths_in_commands_have_the_unit_of_records() -> None:
    device = FastrakSession()
    device.send(b"N1,1,0,0\r")  # an inch
    assert device.send(b"N1\r") == b"21N   1.000   0.000   0.000\r\n"
    assert device.send(b"uN1\r") == b"21N   2.540   0.000   0.000\r\n"
    device.send(b"A2,100,0,0,200,0,0,100,100,0\r")
    assert device.send(b"A2\r")[:24] == b"22A 100.00   0.00   0.00"
    assert device.send(b"UA2\r")[:24] == b"22A  39.37   0.00   0.00"


@pytest.mark.parametrize(
    ("hemisphere", "sign"),
    [("1,0,0", 1), ("-1,0,0", -1), ("0,0,1", 1), ("0,0,-1", -1), ("0,1,0", -1), ("0.1,1,0", -1), ("0,0,0", 1)],
)
def test_signs_flip_outside_the_hemisphere(hemisphere: str, sign: int) -> None:
    """The station is at (1, -0.5, 1.5) m; its orientation stays."""
    device = FastrakSession(1)
    device.send(f"uH1,{hemisphere}\r".encode())
    position = "".join(f"{sign * value:7.2f}" for value in (100.0, -50.0, 150.0)).encode()
    assert device.send(b"P") == b"01 " + position + b"  90.00  -0.00   0.00\r\n"
    device.send(b"A1,0,0,0,0,100,0,-100,0,0\r")  # the alignment comes after it
    turned = "".join(f"{sign * value:7.2f}" for value in (-50.0, -100.0, 150.0)).encode()
    assert device.send(b"P")[3:24] == turned


def test_a_real_device_begins_with_the_forward_hemisphere() -> None:
    device = FastrakSession(1, FastrakEmulatorConfig(hemisphere=(-1.0, 0.0, 0.0)))
    assert device.send(b"H1\r") == b"21H  -1.00   0.00   0.00\r\n"
    assert device.send(b"P")[3:10] == b" -39.37"
    assert FastrakSession(1).send(b"H1\r") == b"21H   0.00   0.00   0.00\r\n"


def test_an_increment_holds_records_back() -> None:
    """The stations move along X by 1 mm a reading."""
    device = FastrakSession(2)
    device.send(b"uI1,0.45\rI2,1\r")
    assert device.send(b"I1\rUI1\r") == b"21I   0.45\r\n21I   0.18\r\n"
    records = (device.send(b"uC") + device.wait(0.5)).splitlines()
    tens = {c: [float(line[3:10]) for line in records if line[1:2] == c] for c in (b"1", b"2")}
    for station, step in ((b"1", 0.5), (b"2", 1.0)):
        assert len(tens[station]) > 1
        np.testing.assert_allclose(np.diff(tens[station]), step, atol=0.011)
    assert len(device.send(b"cP").splitlines()) == 2, "a poll has every station"
    device.send(b"I1,0\rI2,0\r")
    rates = [line[1:2] for line in (device.send(b"C") + device.wait(0.5)).splitlines()]
    assert rates.count(b"1") > 2 * len(tens[b"1"])


def test_boresight_turns_all_of_an_orientation() -> None:
    device = FastrakSession(1)
    device.send(b"G1,0,-15,5\rB1\rO1,4,1\r")
    assert device.send(b"P") == b"01    0.00 -15.00   5.00\r\n"
    assert device.send(b"b1\rP")[:10] == b"01   90.00"


def test_stations_are_switched_and_told() -> None:
    device = FastrakSession(3)
    assert device.send(b"l1\r") == b"21l1110\r\n"
    device.send(b"l2,0\r")
    assert device.send(b"l1\r") == b"21l1010\r\n"
    assert [record[1:2] for record in device.send(b"P").splitlines()] == [b"1", b"3"]


@pytest.mark.parametrize(
    ("command", "code"),
    [
        (b"l5,0\r", -3),  # it has four stations
        (b"O5,2,1\r", -3),
        (b"O1,40,2,1\r", -3),  # items of an IS-900
        (b"O1,21\r", -3),
        (b"MS\r", -99),  # commands of InterSense
        (b"MZ\r", -99),
        (b"l*\r", -3),
        (b"Q1\r", -99),  # not stored
        (b"I1,-1\r", -3),
    ],
)
def test_what_only_an_is900_has_is_refused(command: bytes, code: int) -> None:
    device = FastrakSession()
    before = device.device.settings
    assert b" EC %d*" % code in device.send(command)
    assert device.device.settings == before


def test_compensation_is_a_letter_without_a_terminator() -> None:
    device = FastrakSession()
    assert device.send(b"dl1\r") == b"21l1100\r\n"
    assert device.send(b"Dl1\r") == b"21l1100\r\n"


def test_factory_defaults_and_saved_settings() -> None:
    device = FastrakSession()
    device.send(b"O1,2,1\ru\x0bf")
    device.send(b"\x19", 1.0)
    device.send(b"", 1.0)
    settings = device.device.settings
    assert (settings.station("1").items, settings.centimetres, settings.binary) == ((2, 1), True, False)
    device.send(b"W")
    settings = device.device.settings
    assert (settings.station("1").items, settings.centimetres) == ((2, 4, 1), False)


def test_more_records_than_a_fastrak_sends_are_refused() -> None:
    with pytest.raises(BadInput, match="4 stations at 50 Hz") as refused:
        FastrakEmulator(make_samples(4, rate_hz=50.0))
    assert "at most 30 Hz" in str(refused.value)
    with pytest.raises(BadInput, match="do not fit 5 stations"):
        FastrakEmulator(make_samples(5, rate_hz=20.0))
