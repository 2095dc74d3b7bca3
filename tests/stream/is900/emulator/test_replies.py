"""Replies of the device, byte for byte: every query of docs/is900.md 4, and the errors."""

import pytest

from harness.stream.is900.emulator.setting_commands import SET_ONLY_COMMANDS, SETTER_COMMANDS
from harness.stream.polhemus.codec.replies import TrackingStatus
from harness.stream.polhemus.emulator.config import EmulatorConfig
from tests.stream.is900.emulator.played import DeviceSession

STATES = b"21l" + b"1111" + b"0" * 28 + b"\r\n"
REPLIES = [
    (b"S", b"21S3F0" + b" " * 9 + b"4.2301 IS900VET" + b" " * 23 + b"\r\n"),
    (b"O1\r\n", b"21O 2 4 1\r\n"),
    (b"OC\r", b"2CO 2 4 1\r\n"),
    (b"Oc\n", b"2CO 2 4 1\r\n"),
    (b"O2,40,2,11,21,1\r\nO2\r\n", b"22O40 21121 1\r\n"),
    (b"l*\r\n", STATES),
    (b"l1\r", b"21l1111\r\n"),
    (b"l5\r", b"25l0111\r\n"),
    (b"Mpa\rMsA\rla\r", b"3Ap 0\r\n3As000\r\n2Al0111\r\n"),
    (b"l2,0\rl1\rl*\r", b"21l1011\r\n21l1011" + b"0" * 28 + b"\r\n"),
    (b"l6,1\rl6\r", b"26l0111\r\n"),
    (b"A1\r\n", b"21A" + b"%7.2f" * 9 % (0, 0, 0, 200, 0, 0, 0, 200, 0) + b"\r\n"),
    (b"A1,10,0,0,11,0,0,10,1,0\rA1\r", b"21A" + b"%7.2f" * 9 % (10, 0, 0, 210, 0, 0, 10, 200, 0) + b"\r\n"),
    (b"A1,10,0,0,11,0,0,10,1,0\rR1\rA1\r", b"21A" + b"%7.2f" * 9 % (0, 0, 0, 200, 0, 0, 0, 200, 0) + b"\r\n"),
    (b"G2\r", b"22G   0.00   0.00   0.00\r\n"),
    (b"G2,10,-5,2.5\rG2\r", b"22G  10.00  -5.00   2.50\r\n"),
    (b"H3\r", b"23H   1.00   0.00   0.00\r\n"),
    (b"H3,90,0,0\rH3\r", b"23H  90.00   0.00   0.00\r\n"),
    (b"N1,1.5,0,-2\rN1\r", b"21N   1.500   0.000  -2.000\r\n"),
    (b"V1,2,2,2,-1,-1,-1\rV1\r", b"21V" + b"%8.3f" * 6 % (2, 2, 2, -1, -1, -1) + b"\r\n"),
    (b"MS\r\n", b"31Sg08\r\n"),
    (b"MBF\rMt\rML0\rMS\r\n", b"31Sg06\r\n"),
    (b"Ms4\r", b"34s000\r\n"),
    (b"MF4,2\rMH4,1\rMs4\r", b"34s022\r\n"),
    (b"MH4,2\rMh4\rMs4\r", b"34s000\r\n"),
    (b"Mp1\r", b"31p 0\r\n"),
    (b"Mp1,50\rMp1\r", b"31p50\r\n"),
    (b"MQ1\r", b"31Q3\r\n"),
    (b"MQ1,5\rMQ1\r", b"31Q5\r\n"),
    (b"MG\r\n", b"31G0   0.00  0\r\n"),
    (b"MG2,60.0\rMGP10\rMGS2\rMG\r\n", b"31G2  60.00  0\r\n"),
    (b"MU\r", b"31U20\r\n"),
    (b"MU15\rMU\r", b"31U15\r\n"),
    (b"Mg\r", b"31g1\r\n"),
    (b"MCF5\r", b"31F      5    0.0000    0.0000    0.0000   0.00   0.00   1.00   5005\r\n"),
    (
        b"MCC\rMCF1,1,2,3,0,0,1,7\rMCe\rMCF\r",
        b"31F      1    1.0000    2.0000    3.0000   0.00   0.00   1.00      7\r\n",
    ),
    (b"MCC\rMCx\rMCf5\rMCe\rMCF4\r", b"31F      4    0.0000   -0.6096    0.0000   0.00   0.00   1.00   5004\r\n"),
    (b"MCI2\rMCI2,1\rMCi\r", b"32I2\r\n"),
    (b"ML1\rMLB50\r", b""),
    (b"MP\r\n", TrackingStatus("T" * 4 + "X" * 8, (12,) * 4 + (0,) * 8, (0,) * 12, 50.0).line()),
    (b"MSchAlg\rMSchAlg2\rMSchAlg\r", b"31SchAlg1\r\n31SchAlg2\r\n"),
    (b"MConfigLockMode2\rMConfigLockMode\r", b"31CLM2\r\n"),
    (b"MEthIp10.0.0.7\rMEthIp\r", b"31EI10.0.0.7\r\n"),
    (b"MEthUdp1\rMEthUdp\rMEthUdpPort\r", b"31EU1\r\n31EUP5001\r\n"),
    (b"MLogOpen\rO1\rMLogClose\rO1\rMLogSend\r", b"21O 2 4 1\r\n" * 2 + b"31LF5000:O1\r\n"),
    (b"MLogState\rMLogOpen\rMLogState\rO1\rMLogClear\rMLogSend\r", b"31LS0\r\n31LS1\r\n21O 2 4 1\r\n"),
    (b"MInfoSystem\r", b"51TIS900VET 4.2301\r\n"),
    (b"MSystemTest1\rMSystemTest2\r", b"51T1 OK\r\n51T2 OK\r\n"),
    (b"b1\rx0.2,0.2,0.8,0.8\rv0.2,0.2,0.8,0.8\rMBI\rMT\rMZ\r", b""),
    (b"\r\n\n\r", b""),
]


def error_record(command: bytes, code: int, field: int = 1) -> bytes:
    return b"2 E*ERROR*%b*ERROR* EC %d*PS1  *FL%d *ST0\r\n" % (command, code, field)


REJECTED = [
    (b"T", -99, 1),
    (b"e1,1", -99, 1),
    (b"t", -99, 1),
    (b"Y", -99, 1),
    (b"Q", -99, 1),
    (b"*resetMS", -99, 1),
    (b"MCM", -99, 1),
    (b"MTx", -99, 1),
    (b"O:,40,2,4,1", -3, 1),
    (b"O,2,4,1", -1, 1),
    (b"O1,", -1, 2),
    (b"O1,2,,1", -1, 3),
    (b"O1,2,x,1", -2, 3),
    (b"O1,99", -3, 2),
    (b"O1,2,2", -3, 2),
    (b"O1,2.7", -3, 2),
    (b"O1,2,4.5,1", -3, 3),
    (b"A1,1,2,3", -1, 5),
    (b"A1,0,0,0,1,0,0,2,0,0", -3, 2),
    (b"G1,1,2,3,4", -3, 5),
    (b"Mp1,51", -3, 2),
    (b"MQ1,0", -3, 2),
    (b"MF9,3", -3, 2),
    (b"l1,2", -3, 2),
    (b"o1153,N,8,0", -3, 1),
    (b"o1152,N", -1, 3),
    (b"MEthIp1.2.3", -3, 1),
    (b"MCF99", -3, 1),
    (b"N1,nan,0,0", -2, 2),
    (b"N1,1_0,0,0", -2, 2),
    (b"N1,1e300,0,0", -3, 2),
    (b"N1,0,0,-1000001", -3, 4),
    (b"A1,0,0,0,1e200,0,0,0,1e200,0", -3, 5),
    (b"MCF1,1e200,0,0,0,0,1,7", -3, 2),
]


@pytest.mark.parametrize(("query", "reply"), REPLIES, ids=lambda value: repr(value)[:30])
def test_every_query_has_its_reply(query: bytes, reply: bytes) -> None:
    assert DeviceSession().send(query) == reply


@pytest.mark.parametrize(("query", "code", "field"), REJECTED)
def test_a_rejected_command_gets_an_error_record_and_changes_nothing(query: bytes, code: int, field: int) -> None:
    session = DeviceSession()
    before = session.device.settings
    assert session.send(query + b"\r\n") == error_record(query, code, field)
    assert session.device.settings == before
    assert session.send(b"O1\r") == b"21O 2 4 1\r\n"


def test_an_overlong_line_is_rejected() -> None:
    session = DeviceSession()
    assert session.send(b"O1," + b"2," * 400 + b"1\r").endswith(b"EC -5*PS1  *FL1 *ST0\r\n")
    assert session.send(b"O1\r") == b"21O 2 4 1\r\n"


def test_errors_are_logged_while_the_log_is_on() -> None:
    session = DeviceSession()
    reply_bytes = session.send(b"T\r")
    assert session.send(b"ME\r") == reply_bytes
    assert session.send(b"MEC\rME\r") == b""
    assert session.send(b"ME0\rT\rME\r") == reply_bytes
    assert session.send(b"ME1\rT\rME\r") == 2 * reply_bytes


def test_every_setter_is_tried_here() -> None:
    tried_commands = b" ".join(query for query, _ in REPLIES) + b" ".join(query for query, *_ in REJECTED)
    assert [
        name for name in {*SETTER_COMMANDS, *SET_ONLY_COMMANDS} - {"ME0", "ME1"} if name.encode() not in tried_commands
    ] == []


@pytest.mark.parametrize("size", [54, 55])
def test_the_status_record_has_flags_and_firmware(size: int) -> None:
    session = DeviceSession(EmulatorConfig(status_bytes=size, firmware="3.11", identification="IS900VWT"))
    assert len(session.send(b"S")) == size
    assert session.send(b"fS")[:6] == b"21S3F1"
    assert session.send(b"uS")[:6] == b"21S3F3"
    assert session.send(b"CS")[:6] == b"21S3FB"
    reply_bytes = session.send(b"cUFS")
    assert (reply_bytes[:6], reply_bytes[15:21], reply_bytes[21:30]) == (b"21S3F0", b"3.11  ", b" IS900VWT")


@pytest.mark.parametrize(("firmware", "item", "supported"), [("4.1105", 40, 0), ("4.1301", 40, 1), ("4.2301", 76, 0)])
def test_items_need_their_firmware(firmware: str, item: int, supported: int) -> None:
    session = DeviceSession(EmulatorConfig(firmware=firmware))
    expected_error = error_record(b"O1,%d,2,4,1" % item, -3, 2)
    assert session.send(b"O1,%d,2,4,1\r" % item) == (b"" if supported else expected_error)
    assert session.send(b"O1\r") == (b"21O%2d 2 4 1\r\n" % item if supported else b"21O 2 4 1\r\n")
