"""VRPN at the emulator's pty: its reset, its reading, what it does in trouble (docs/is900.md 11.1)."""

import os
import struct
import time
from collections import Counter
from pathlib import Path

import pytest

from tests.clients.device import angles_of, device, judge
from tests.clients.tty import Tty, raw, wait_until
from tests.clients.vrpn import FAIL, RESETTING, SYNCING, Report, Vrpn

LISTS = b"".join(b"O%d,2,11,0\r" % k for k in range(1, 5))
FILTERS = b"x0.2,0.2,0.8,0.8\rv0.2,0.2,0.8,0.8\r"
LIMIT_S = 60.0


def good(reports: list[Report]) -> None:
    """All of them are what the stations do."""
    for report in reports:
        w = report.turn_xyzw
        judge(report.sensor + 1, report.position_m, angles_of((w[3], *w[:3])), 1e-4, 0.01)


def test_plain_reset_and_reading(tmp_path: Path) -> None:
    with device(tmp_path) as on:
        client = Vrpn(on.port)
        assert client.serve(lambda: len(client.reports) >= 400, LIMIT_S), client.said
        client.close()
    assert client.all_sent == b"cS" + LISTS + FILTERS + b"fC"
    assert client.said == ["resetting, attempt 1", "gives status", "reset completed"]
    good(client.reports)
    assert set(Counter(report.sensor for report in client.reports)) == {0, 1, 2, 3}
    order = [report.sensor for report in client.reports]
    assert order == [k % 4 for k in range(len(order))]


def test_timestamps_a_stylus_and_a_wand(tmp_path: Path) -> None:
    with device(tmp_path, rate_hz=60.0) as on:
        client = Vrpn(on.port, is900_time=True, styluses=(1,), wands=(0,))
        assert client.serve(lambda: len(client.reports) >= 600, LIMIT_S), client.said
        client.close()
    lists = [b"2,2,11,21,22,0", b"1,2,11,21,22,0", b"1,2,11,21,22,23,0"]
    lists += [b"1,2,11,21,22,23,0", b"2,2,11,21,22,0", b"3,2,11,21,0", b"4,2,11,21,0"]
    said = [b"O" + one + b"\r" for one in lists]
    assert client.all_sent == b"".join(said[:3]) + b"cS" + b"".join(said[3:]) + FILTERS + b"fCMT\rMZ\r"
    assert not client.resyncs
    assert "tracker failed to read" not in client.said
    good(client.reports)
    for report in client.reports:
        assert (report.buttons is None, report.stick is None) == (report.sensor not in (0, 1), report.sensor != 0)
        assert report.buttons in (None, 0)
        assert report.stick in (None, (0.0, 0.0))
    steps_back = [k for k in range(1, 600) if client.reports[k].time_s < client.reports[k - 1].time_s]
    assert len(steps_back) <= 1  # records between `C` and `MZ` carry the old clock
    after = client.reports[(steps_back or [0])[0] :]
    assert len(after) > 500
    assert all(-0.05 < report.read_s - report.time_s < 2.0 for report in after)
    late_s = sorted(report.read_s - report.time_s for report in after)
    assert late_s[len(late_s) // 2] < 0.1


def test_lines_of_the_configuration_file(tmp_path: Path) -> None:
    with device(tmp_path) as on:
        client = Vrpn(on.port, extra="MF1,2\r*1\rMp1,20\r")
        assert client.serve(lambda: len(client.reports) >= 40, LIMIT_S), client.said
        client.close()
        other = Tty(on.port, raw())
        other.write(b"c\rMp1\rMs1\r")
        assert wait_until(lambda: b"31p20\r\n31s02" in other.received + other.read(4096), LIMIT_S)
        other.close()
    assert client.all_sent.endswith(FILTERS + b"MF1,2\rMp1,20\rfC")


def test_a_device_that_streams_already(tmp_path: Path) -> None:
    """It closes without a word, and asks for lists before its reset while records still come; 54 bytes are a status."""
    with device(tmp_path, status_bytes=54) as on:
        for _ in range(2):
            client = Vrpn(on.port, wands=(2,))
            assert client.serve(lambda: len(client.reports) >= 40, LIMIT_S), client.said  # noqa: B023  # asked within the turn
            assert client.said[0] == "resetting, attempt 1"
            assert client.said[-2:] == ["gives status", "reset completed"]
            good(client.reports)
            client.close()


def test_a_fifth_station_makes_it_flush_again_and_again(tmp_path: Path) -> None:
    with device(tmp_path, stations=5, rate_hz=30.0) as on:
        client = Vrpn(on.port)
        assert client.serve(lambda: len(client.reports) >= 200, LIMIT_S), client.said[-5:]
        client.close()
    assert any("bad sensor # (4)" in line for line in client.resyncs)
    assert {report.sensor for report in client.reports} == {0, 1, 2, 3}
    assert client.said.count("resetting, attempt 1") == 1
    assert "tracker failed to read" not in client.said


def test_silence_makes_it_open_the_port_anew(tmp_path: Path) -> None:
    with device(tmp_path) as on:
        client = Vrpn(on.port)
        assert client.serve(lambda: len(client.reports) >= 40, LIMIT_S), client.said
        behind_its_back = Tty(on.port, raw())
        behind_its_back.write(b"c")
        behind_its_back.close()
        assert client.serve(lambda: client.said.count("reset completed") == 2, LIMIT_S), client.said
        count = len(client.reports)
        assert client.serve(lambda: len(client.reports) >= count + 40, LIMIT_S), client.said
        client.close()
    assert client.said.count("tracker failed to read") == 1
    assert client.said.count("resetting, attempt 1") == 2
    good(client.reports)


@pytest.mark.slow
def test_microseconds_where_it_expects_milliseconds(tmp_path: Path) -> None:
    """Its int overflows, its watchdog bites, and its reset puts things right."""
    with device(tmp_path) as on:
        client = Vrpn(on.port, is900_time=True)
        assert client.serve(lambda: len(client.reports) >= 40, LIMIT_S), client.said
        assert client.tty is not None
        client.tty.write(b"Mt\r")
        assert client.serve(lambda: client.said.count("reset completed") == 2, LIMIT_S), client.said
        count = len(client.reports)
        assert client.serve(lambda: len(client.reports) >= count + 400, LIMIT_S), client.said
        client.close()
    assert client.said.count("tracker failed to read") == 1


def test_a_device_that_says_nothing_is_restarted(tmp_path: Path) -> None:
    """Held back by 13, it answers no `S`; the third attempt's 19 frees it."""
    with device(tmp_path) as on:
        other = Tty(on.port, raw())
        other.write(b"\x13")
        other.close()
        client = Vrpn(on.port)
        assert client.serve(lambda: len(client.reports) >= 40, LIMIT_S), client.said
        client.close()
    assert client.all_sent.startswith(b"cS" + b"\rcS" + b"\r\x19cS" + LISTS)


def test_its_last_resort_leads_to_a_status(tmp_path: Path) -> None:
    """Whatever state the line was in: here, in the middle of rubbish."""
    with device(tmp_path) as on:
        tty = Tty(on.port, raw())
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
def test_a_line_that_is_unplugged_for_a_while(tmp_path: Path) -> None:
    """The port goes away; it complains until it is there again."""
    with device(tmp_path, faults=[{"kind": "disconnect", "at_s": [2.5], "lasts_s": 3.0}]) as on:
        client = Vrpn(on.port)
        assert client.serve(lambda: "cannot open serial port" in client.said, LIMIT_S), client.said
        count = len(client.reports)
        assert client.serve(lambda: len(client.reports) >= count + 40, LIMIT_S), client.said
        client.close()
    good(client.reports)


@pytest.mark.parametrize(("rate_hz", "paced"), [(180.0, False), (180.0, True)])
def test_four_stations_at_180_hz(tmp_path: Path, rate_hz: float, paced: bool) -> None:
    """Over a line that carries half of it, whole records are left out, never parts."""
    with device(tmp_path, rate_hz=rate_hz, paced=paced) as on:
        client = Vrpn(on.port)
        assert client.serve(lambda: client.status == SYNCING, LIMIT_S), client.said
        began_s = time.monotonic()
        assert client.serve(lambda: len(client.reports) >= 1000, LIMIT_S), client.said
        took_s = time.monotonic() - began_s
        client.close()
    assert client.resyncs == []
    good(client.reports)
    assert took_s > 1000 / (4 * rate_hz if not paced else 360.0) - 0.5
    assert (on.summary["records_dropped"] > 0.0) == paced
    share = Counter(report.sensor for report in client.reports)
    assert all(200 <= share[sensor] <= 300 for sensor in range(4)), share


@pytest.mark.slow
def test_real_waits(tmp_path: Path) -> None:
    """As it is: 7 s for a reset, 2 s of silence before the next, 27 s for an attempt with a restart."""
    with device(tmp_path, rate_hz=60.0) as on:
        client = Vrpn(on.port, is900_time=True, wands=(0,), scale=1.0)
        assert client.serve(lambda: len(client.reports) >= 12000, 120.0), client.said
        assert client.tty is not None
        client.tty.write(b"c\x13")
        assert client.serve(lambda: client.said.count("reset completed") == 2, 120.0), client.said
        count = len(client.reports)
        assert client.serve(lambda: len(client.reports) >= count + 2400, 120.0), client.said
        client.close()
    assert client.resyncs == []
    assert client.said.count("tracker failed to read") == 1
    assert "resetting, attempt 3" in client.said
    good(client.reports)


def records(*stations: int, stamp_ms: float | None = None, last: bytes = b" ") -> bytes:
    """Made by hand: 2,11,0 or 2,11,21,0; the pose of docs/is900.md 5.4."""
    numbers = (39.3701, -19.6850, 59.0551, 0.7071068, 0.0, 0.0, 0.7071068)
    stamp = b"" if stamp_ms is None else struct.pack("<f", stamp_ms)
    return b"".join(b"0%d " % k + struct.pack("<7f", *numbers) + stamp + last for k in stations)


class ByHand:
    """A client at a bare pty, past its reset."""

    def __init__(self, is900_time: bool = False) -> None:
        self.master, self._slave = os.openpty()
        raw()(self._slave)
        self.client = Vrpn(os.ttyname(self._slave), is900_time=is900_time, scale=0.001, answer_s=0.05)
        self.client.status, self.client._zero_s = SYNCING, time.time()

    def feed(self, data: bytes) -> list[str]:
        """What it says to these bytes."""
        before = len(self.client.said)
        os.write(self.master, data)
        for _ in range(20):
            time.sleep(0.002)
            if self.client.status != FAIL:
                self.client.mainloop()
        return self.client.said[before:]

    def close(self) -> None:
        self.client.close()
        os.close(self.master)
        os.close(self._slave)


def test_what_it_takes_for_a_record() -> None:
    """The re-enactment itself: it believes the documented record and nothing like it."""
    hand = ByHand()
    assert hand.feed(records(1, 2, 3, 4)) == []
    assert [report.sensor for report in hand.client.reports] == [0, 1, 2, 3]
    assert hand.client.reports[0].position_m == pytest.approx((1.0, -0.5, 1.5), abs=1e-5)
    assert hand.client.reports[0].turn_xyzw == pytest.approx((0.0, 0.0, 0.7071068, 0.7071068))
    for part in (records(2)[:7], records(2)[7:31], records(2)[31:]):
        assert hand.feed(part) == []
    assert len(hand.client.reports) == 5
    for wrong, complaint in {
        records(5): "bad sensor # (4)",
        records(1, last=b"x"): "no space at end",
        b"01\x01" + records(1)[3:]: "bad 3rd char",
        b"x" + records(1): "while syncing",
        records(1)[:-1] + records(2): "no space at end",
    }.items():
        said = hand.feed(wrong)
        assert complaint in said[0]
        assert hand.feed(records(3)) == [] or hand.client.status == SYNCING
    assert all(report.sensor < 4 for report in hand.client.reports)
    hand.close()


def test_stamps_that_never_change_wake_its_watchdog() -> None:
    hand = ByHand(is900_time=True)
    end_s = time.monotonic() + 30.0
    while hand.client.status != FAIL:
        assert time.monotonic() < end_s
        hand.feed(records(1, stamp_ms=5.0))
    assert hand.client.said[-1] == "tracker failed to read"
    assert len(hand.client.reports) > 1
    hand.client.mainloop()
    assert hand.client.status == RESETTING
    hand.close()


def test_its_ladder() -> None:
    """What six attempts send where nobody answers."""
    hand = ByHand()
    hand.client.status = RESETTING
    for _ in range(6):
        hand.client.mainloop()
    attempts = (b"c", b"\rc", b"\r\x19c", b"\r\x19c", b"\rt\x19c", b"\rYt\x19c")
    assert hand.client.all_sent == b"".join(attempt + b"S" for attempt in attempts)
    hand.close()
