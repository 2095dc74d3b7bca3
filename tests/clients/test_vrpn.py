"""VRPN at the emulator's pty: its reset, its reading, its recovery (docs/is900.md 11.1)."""

import os
import struct
import time
from collections import Counter
from pathlib import Path

import pytest

from tests.clients.device import check_pose, run_device, yaw_pitch_roll_deg
from tests.clients.tty import Tty, raw_mode, wait_until
from tests.clients.vrpn import FAIL, RESETTING, SYNCING, Report, VrpnClient

LISTS = b"".join(b"O%d,2,11,0\r" % k for k in range(1, 5))
FILTERS = b"x0.2,0.2,0.8,0.8\rv0.2,0.2,0.8,0.8\r"
LIMIT_S = 60.0


def check_reports(reports: list[Report]) -> None:
    """Check that all reports have possible poses of their stations."""
    for report in reports:
        q = report.quaternion_xyzw
        check_pose(report.sensor + 1, report.position_m, yaw_pitch_roll_deg((q[3], *q[:3])), 1e-4, 0.01)


def test_plain_reset_and_reading(tmp_path: Path) -> None:
    with run_device(tmp_path) as device:
        client = VrpnClient(device.port)
        assert client.serve(lambda: len(client.reports) >= 400, LIMIT_S), client.log
        client.close()
    assert client.all_sent == b"cS" + LISTS + FILTERS + b"fC"
    assert client.log == ["resetting, attempt 1", "gives status", "reset completed"]
    check_reports(client.reports)
    assert set(Counter(report.sensor for report in client.reports)) == {0, 1, 2, 3}
    sensors = [report.sensor for report in client.reports]
    assert sensors == [k % 4 for k in range(len(sensors))]


@pytest.mark.long
def test_timestamps_with_a_stylus_and_a_wand(tmp_path: Path) -> None:
    with run_device(tmp_path, rate_hz=60.0) as device:
        client = VrpnClient(device.port, is900_time=True, styluses=(1,), wands=(0,))
        assert client.serve(lambda: len(client.reports) >= 600, LIMIT_S), client.log
        client.close()
    lists = [b"2,2,11,21,22,0", b"1,2,11,21,22,0", b"1,2,11,21,22,23,0"]
    lists += [b"1,2,11,21,22,23,0", b"2,2,11,21,22,0", b"3,2,11,21,0", b"4,2,11,21,0"]
    log = [b"O" + items + b"\r" for items in lists]
    assert client.all_sent == b"".join(log[:3]) + b"cS" + b"".join(log[3:]) + FILTERS + b"fCMT\rMZ\r"
    assert not client.resyncs
    assert "tracker failed to read" not in client.log
    check_reports(client.reports)
    for report in client.reports:
        assert (report.buttons is None, report.stick is None) == (report.sensor not in (0, 1), report.sensor != 0)
        assert report.buttons in (None, 0, 1, 2, 4, 8, 16, 32)
    sticks = [report.stick for report in client.reports if report.stick is not None]
    assert max(abs(value) for stick in sticks for value in stick) > 0.9  # a wand has a joystick that moves
    assert all(0.0 in stick for stick in sticks)
    for sensor in (0, 1):
        assert len({report.buttons for report in client.reports if report.sensor == sensor}) > 1
    steps_back = [k for k in range(1, 600) if client.reports[k].time_s < client.reports[k - 1].time_s]
    assert len(steps_back) <= 1  # records between `C` and `MZ` carry the old clock
    reports = client.reports[(steps_back or [0])[0] :]
    assert len(reports) > 500
    assert all(-0.05 < report.read_s - report.time_s < 2.0 for report in reports)
    delays_s = sorted(report.read_s - report.time_s for report in reports)
    assert delays_s[len(delays_s) // 2] < 0.1


def test_commands_of_the_configuration_file(tmp_path: Path) -> None:
    with run_device(tmp_path) as device:
        client = VrpnClient(device.port, extra="MF1,2\r*1\rMp1,20\r")
        assert client.serve(lambda: len(client.reports) >= 40, LIMIT_S), client.log
        client.close()
        terminal = Tty(device.port, raw_mode())
        terminal.write(b"c\rMp1\rMs1\r")
        assert wait_until(lambda: b"31p20\r\n31s02" in terminal.received + terminal.read(4096), LIMIT_S)
        terminal.close()
    assert client.all_sent.endswith(FILTERS + b"MF1,2\rMp1,20\rfC")


def test_a_device_that_is_already_streaming(tmp_path: Path) -> None:
    """The client closes without a command, and sets lists before its reset while records still arrive.

    54 bytes are a status.
    """
    with run_device(tmp_path, status_bytes=54) as device:
        for _ in range(2):
            client = VrpnClient(device.port, wands=(2,))
            assert client.serve(lambda: len(client.reports) >= 40, LIMIT_S), client.log  # noqa: B023  # called within the iteration
            assert client.log[0] == "resetting, attempt 1"
            assert client.log[-2:] == ["gives status", "reset completed"]
            check_reports(client.reports)
            client.close()


def test_a_fifth_station_causes_repeated_flushing(tmp_path: Path) -> None:
    with run_device(tmp_path, stations=5, rate_hz=30.0) as device:
        client = VrpnClient(device.port)
        assert client.serve(lambda: len(client.reports) >= 200, LIMIT_S), client.log[-5:]
        client.close()
    assert any("bad sensor # (4)" in line for line in client.resyncs)
    assert {report.sensor for report in client.reports} == {0, 1, 2, 3}
    assert client.log.count("resetting, attempt 1") == 1
    assert "tracker failed to read" not in client.log


@pytest.mark.long
def test_silence_makes_it_reopen_the_port(tmp_path: Path) -> None:
    with run_device(tmp_path) as device:
        client = VrpnClient(device.port)
        assert client.serve(lambda: len(client.reports) >= 40, LIMIT_S), client.log
        second_client = Tty(device.port, raw_mode())
        second_client.write(b"c")
        second_client.close()
        assert client.serve(lambda: client.log.count("reset completed") == 2, LIMIT_S), client.log
        count = len(client.reports)
        assert client.serve(lambda: len(client.reports) >= count + 40, LIMIT_S), client.log
        client.close()
    assert client.log.count("tracker failed to read") == 1
    assert client.log.count("resetting, attempt 1") == 2
    check_reports(client.reports)


@pytest.mark.slow
def test_microseconds_where_it_expects_milliseconds(tmp_path: Path) -> None:
    """Its integer overflows, its watchdog reopens the port, and its reset corrects the unit."""
    with run_device(tmp_path) as device:
        client = VrpnClient(device.port, is900_time=True)
        assert client.serve(lambda: len(client.reports) >= 40, LIMIT_S), client.log
        assert client.tty is not None
        client.tty.write(b"Mt\r")
        assert client.serve(lambda: client.log.count("reset completed") == 2, LIMIT_S), client.log
        count = len(client.reports)
        assert client.serve(lambda: len(client.reports) >= count + 400, LIMIT_S), client.log
        client.close()
    assert client.log.count("tracker failed to read") == 1


@pytest.mark.long
def test_a_silent_device_is_restarted(tmp_path: Path) -> None:
    """A device suspended by 13 does not answer `S`; the 19 of the third attempt resumes it."""
    with run_device(tmp_path) as device:
        terminal = Tty(device.port, raw_mode())
        terminal.write(b"\x13")
        terminal.close()
        client = VrpnClient(device.port)
        assert client.serve(lambda: len(client.reports) >= 40, LIMIT_S), client.log
        client.close()
    assert client.all_sent.startswith(b"cS" + b"\rcS" + b"\r\x19cS" + LISTS)


def test_its_last_reset_attempt_leads_to_a_status(tmp_path: Path) -> None:
    """This holds in any state of the line: here, in the middle of garbage."""
    with run_device(tmp_path) as device:
        tty = Tty(device.port, raw_mode())
        tty.write(b"C")
        assert wait_until(lambda: len(tty.received + tty.read(4096)) > 100, LIMIT_S)
        tty.write(b"rubbish without an end")
        for character in (b"\r", b"Y", b"t", b"\x19", b"c"):
            tty.write(character)
            time.sleep(0.3)
        tty.flush_input()
        time.sleep(0.1)
        assert tty.read(100) == b""
        tty.write(b"S")
        assert wait_until(lambda: tty.waiting >= 55, LIMIT_S)
        time.sleep(0.02)
        status = tty.read_available(100)
        assert (len(status), status[:3], status[-1:]) == (55, b"21S", b"\n")
        tty.close()


@pytest.mark.slow
def test_a_temporarily_unplugged_line(tmp_path: Path) -> None:
    """The port disappears; the client complains until it returns."""
    with run_device(tmp_path, faults=[{"kind": "disconnect", "at_s": [2.5], "lasts_s": 3.0}]) as device:
        client = VrpnClient(device.port)
        assert client.serve(lambda: "cannot open serial port" in client.log, LIMIT_S), client.log
        count = len(client.reports)
        assert client.serve(lambda: len(client.reports) >= count + 40, LIMIT_S), client.log
        client.close()
    check_reports(client.reports)


@pytest.mark.long
@pytest.mark.parametrize(("rate_hz", "paced"), [(180.0, False), (180.0, True)])
def test_four_stations_at_180_hz(tmp_path: Path, rate_hz: float, paced: bool) -> None:
    """Over a line that carries half of it, whole records are dropped, never parts."""
    with run_device(tmp_path, rate_hz=rate_hz, paced=paced) as device:
        client = VrpnClient(device.port)
        assert client.serve(lambda: client.status == SYNCING, LIMIT_S), client.log
        began_s = time.monotonic()
        assert client.serve(lambda: len(client.reports) >= 1000, LIMIT_S), client.log
        elapsed_s = time.monotonic() - began_s
        client.close()
    assert client.resyncs == []
    check_reports(client.reports)
    assert elapsed_s > 1000 / (4 * rate_hz if not paced else 360.0) - 0.5
    assert (device.summary["records_dropped"] > 0.0) == paced
    counts = Counter(report.sensor for report in client.reports)
    assert all(200 <= counts[sensor] <= 300 for sensor in range(4)), counts


@pytest.mark.slow
def test_original_waits(tmp_path: Path) -> None:
    """With the original waits: 7 s for a reset, 2 s of silence before the next, 27 s for an attempt with a restart."""
    with run_device(tmp_path, rate_hz=60.0) as device:
        client = VrpnClient(device.port, is900_time=True, wands=(0,), scale=1.0)
        assert client.serve(lambda: len(client.reports) >= 12000, 120.0), client.log
        assert client.tty is not None
        client.tty.write(b"c\x13")
        assert client.serve(lambda: client.log.count("reset completed") == 2, 120.0), client.log
        count = len(client.reports)
        assert client.serve(lambda: len(client.reports) >= count + 2400, 120.0), client.log
        client.close()
    assert client.resyncs == []
    assert client.log.count("tracker failed to read") == 1
    assert "resetting, attempt 3" in client.log
    check_reports(client.reports)


def make_records(*stations: int, stamp_ms: float | None = None, last_byte: bytes = b" ") -> bytes:
    """Build records of 2,11,0 or 2,11,21,0 with the pose of docs/is900.md 5.4."""
    numbers = (39.3701, -19.6850, 59.0551, 0.7071068, 0.0, 0.0, 0.7071068)
    stamp = b"" if stamp_ms is None else struct.pack("<f", stamp_ms)
    return b"".join(b"0%d " % k + struct.pack("<7f", *numbers) + stamp + last_byte for k in stations)


class ManualClient:
    """A client at a pty without a device, after its reset."""

    def __init__(self, is900_time: bool = False) -> None:
        self.master, self._slave = os.openpty()
        raw_mode()(self._slave)
        self.client = VrpnClient(os.ttyname(self._slave), is900_time=is900_time, scale=0.001, answer_s=0.05)
        self.client.status, self.client._zero_s = SYNCING, time.time()

    def feed(self, data: bytes) -> list[str]:
        """Return what the client prints when it receives these bytes."""
        before = len(self.client.log)
        os.write(self.master, data)
        for _ in range(20):
            time.sleep(0.002)
            if self.client.status != FAIL:
                self.client.mainloop()
        return self.client.log[before:]

    def close(self) -> None:
        self.client.close()
        os.close(self.master)
        os.close(self._slave)


def test_which_bytes_it_accepts_as_a_record() -> None:
    """Check the simulated client itself: it accepts the documented record and nothing similar."""
    manual = ManualClient()
    assert manual.feed(make_records(1, 2, 3, 4)) == []
    assert [report.sensor for report in manual.client.reports] == [0, 1, 2, 3]
    assert manual.client.reports[0].position_m == pytest.approx((1.0, -0.5, 1.5), abs=1e-5)
    assert manual.client.reports[0].quaternion_xyzw == pytest.approx((0.0, 0.0, 0.7071068, 0.7071068))
    for part in (make_records(2)[:7], make_records(2)[7:31], make_records(2)[31:]):
        assert manual.feed(part) == []
    assert len(manual.client.reports) == 5
    for data, complaint in {
        make_records(5): "bad sensor # (4)",
        make_records(1, last_byte=b"x"): "no space at end",
        b"01\x01" + make_records(1)[3:]: "bad 3rd char",
        b"x" + make_records(1): "while syncing",
        make_records(1)[:-1] + make_records(2): "no space at end",
    }.items():
        log = manual.feed(data)
        assert complaint in log[0]
        assert manual.feed(make_records(3)) == [] or manual.client.status == SYNCING
    assert all(report.sensor < 4 for report in manual.client.reports)
    manual.close()


def test_constant_stamps_trigger_its_watchdog() -> None:
    manual = ManualClient(is900_time=True)
    end_s = time.monotonic() + 30.0
    while manual.client.status != FAIL:
        assert time.monotonic() < end_s
        manual.feed(make_records(1, stamp_ms=5.0))
    assert manual.client.log[-1] == "tracker failed to read"
    assert len(manual.client.reports) > 1
    manual.client.mainloop()
    assert manual.client.status == RESETTING
    manual.close()


def test_its_reset_attempts() -> None:
    """What six attempts send when nothing answers."""
    manual = ManualClient()
    manual.client.status = RESETTING
    for _ in range(6):
        manual.client.mainloop()
    attempts = (b"c", b"\rc", b"\r\x19c", b"\r\x19c", b"\rt\x19c", b"\rYt\x19c")
    assert manual.client.all_sent == b"".join(attempt + b"S" for attempt in attempts)
    manual.close()
