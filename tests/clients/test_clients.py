"""InterSense's library, FreeVR, Vrui and VR Juggler at the emulator's pty (docs/is900.md 11.2 and 11.3)."""

import re
import signal
import struct
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from tests.clients.device import QUALITY, ROOT, angles_of, device, judge
from tests.clients.freevr import FreeVr
from tests.clients.gadgeteer import Early, Late
from tests.clients.intersense import Library
from tests.clients.tty import Tty, raw, wait_until
from tests.clients.vrpn import Vrpn
from tests.clients.vrui import Vrui
from tests.clients.wire import cut
from tests.interrupts import heeding_interrupts

LIMIT_S = 60.0
INCH_M = 0.0254
RUBBISH = b"cc*resetc*resetccc*resetc*resetc"


def good(client: Library, stations: int = 4) -> None:
    for number, station in enumerate(client.stations[:stations], start=1):
        judge(number, station.position_m, station.angles_deg, 1e-4, 0.01)


def explained(client: Library, size: int, stations: int, refused: int) -> None:
    """Nothing between records since it was open, and it refused no more of them than those with a CR LF inside.

    Before, `refused` were: until it has read the status it takes binary records for ASCII.
    """
    assert client.tty is not None
    began = client.tty.received.index(b"31G") + 16
    records, _ = cut(bytes(client.tty.received[began:]), {b"%d" % k: size for k in range(1, stations + 1)})
    inside = sum(b"\r\n" in record[:-2] for record in records)
    assert client.refused - refused <= 3 * inside, (client.refused, refused, inside)
    assert sum(station.records for station in client.stations) >= len(records) - 3 * inside - 1


@pytest.mark.parametrize(("version", "size"), [("1.01", 29), ("2.09", 33)])
def test_intersense_finds_and_reads_the_tracker(tmp_path: Path, version: str, size: int) -> None:
    with device(tmp_path) as on:
        client = Library(on.port, version)
        assert client.open()
        refused = client.refused
        assert (client.product, client.firmware, client.sync) == (16, "4.2301", 0)
        assert client.binary
        assert client.centimetres
        assert client.continuous
        items = [2, 4, 1] if version == "1.01" else [2, 4, 40, 22, 23, 1]
        assert [station.items for station in client.stations] == [items] * 8
        assert client.run(lambda: min(station.records for station in client.stations[:4]) >= 50, LIMIT_S)
        good(client)
        assert client.read_settings()
        explained(client, size, 4, refused)
        assert all(station.records == 0 for station in client.stations[4:])
        if version == "2.09":
            assert [station.active for station in client.stations] == [True] * 4 + [False] * 4
            assert {station.quality for station in client.stations[:4]} == {QUALITY}
        client.close()
        silent(on.port)


@pytest.mark.parametrize("version", ["1.01", "2.09"])
def test_intersense_reads_and_sets_stations_while_data_flow(tmp_path: Path, version: str) -> None:
    with device(tmp_path) as on:
        client = Library(on.port, version)
        assert client.open()
        assert all(client.read_station(number) for number in range(1, 9))
        assert [station.cube for station in client.stations] == [1, 2, 3, 4, -1, -1, -1, -1]
        assert client.set_station(2, 25, 4, 1, "2,4,21,1")
        station = client.stations[1]
        assert (station.prediction_ms, station.sensitivity, station.enhancement) == (25, 4, 1)
        assert station.items == [2, 4, 21, 1]
        count = station.records
        assert client.run(lambda: station.records >= count + 50, LIMIT_S)
        good(client)
        assert station.time_s > 0.0
        client.close()


def test_intersense_looks_for_another_product_first(tmp_path: Path) -> None:
    """Its rubbish ends up in front of the first `MS`, which fails quietly."""
    with device(tmp_path) as on:
        tty = Tty(on.port, raw())
        tty.write(RUBBISH + b"cMS\r\nMS\r\n")
        assert wait_until(lambda: re.search(rb"31Sg..\r\n", tty.received + tty.read(4096)) is not None, LIMIT_S)
        _, replies = cut(bytes(tty.received), {})
        assert replies[-1].startswith(b"31Sg")
        assert all(reply.startswith(b"2 E*ERROR*") for reply in replies[:-1])
        tty.close()


@pytest.mark.slow
@pytest.mark.parametrize("version", ["1.01", "2.09"])
def test_intersense_with_its_own_time_outs(tmp_path: Path, version: str) -> None:
    with device(tmp_path) as on:
        client = Library(on.port, version, patience=1.0, scale=1.0)
        assert client.open()
        refused = client.refused
        assert client.run(lambda: min(station.records for station in client.stations[:4]) >= 3000, LIMIT_S)
        good(client)
        explained(client, 29 if version == "1.01" else 33, 4, refused)
        client.close()


def silent(port: str) -> None:
    """Nothing comes from a device that was told to be quiet."""
    tty = Tty(port, raw())
    wait_until(lambda: not tty.read(4096), LIMIT_S, 0.2)
    assert not tty.wait(0.3)
    tty.close()


@pytest.mark.parametrize("stations", [4, 12])
def test_freevr(tmp_path: Path, stations: int) -> None:
    with device(tmp_path, stations=stations, rate_hz=60.0) as on:
        client = FreeVr(on.port, wands="1C")
        assert client.open(LIMIT_S)
        assert (client.firmware, client.system) == ("4.2301", "IS900VET")
        names = "123456789ABC"[:stations]
        units = [client.units[name] for name in names]
        assert [name for name, unit in client.units.items() if unit.active] == list(names)
        assert client.run(lambda: min(unit.records for unit in units) >= 10, LIMIT_S), client.warnings
        assert client.warnings == []
        for number, (name, unit) in enumerate(zip(names, units, strict=True), start=1):
            judge(number, tuple(INCH_M * v for v in unit.numbers[:3]), tuple(unit.numbers[3:]), 5e-4, 0.02)
            assert unit.items == ([40, 2, 4, 22, 23, 1] if name in "1C" else [40, 2, 4, 1])
            assert unit.length == (64 if name in "1C" else 51)
            assert unit.quality == QUALITY
            assert (unit.buttons, unit.stick) == ((0, (127, 127)) if name in "1C" else (-1, (-1, -1)))
            assert unit.tracking == "T"
            assert 1 <= unit.measured <= 12
            assert 0 <= unit.rejected <= unit.measured
        assert all(unit.tracking == "X" for name, unit in client.units.items() if name not in names)
        assert client.tracking_records >= 10
        assert sorted(client.emitters) == list(range(5001, 5001 + len(client.emitters)))
        assert client.emitters
        client.close()


def test_freevr_comes_after_a_client_that_left_it_streaming(tmp_path: Path) -> None:
    """Binary records of another list are still in the port's buffer; it hunts for its answers among them."""
    with device(tmp_path) as on:
        before = Vrpn(on.port)
        assert before.serve(lambda: len(before.reports) >= 40, LIMIT_S), before.said
        before.close()
        client = FreeVr(on.port)
        assert client.open(LIMIT_S)
        units = [client.units[name] for name in "1234"]
        counts = [unit.records for unit in units]
        assert client.run(lambda: all(u.records >= c + 10 for u, c in zip(units, counts, strict=True)), LIMIT_S)
        client.close()


def test_vrui(tmp_path: Path) -> None:
    with device(tmp_path) as on:
        before = Vrpn(on.port)  # leaves it streaming
        assert before.serve(lambda: len(before.reports) >= 4, LIMIT_S), before.said
        before.close()
        client = Vrui(on.port, scale=0.05)
        assert client.open((1, 3), probe=True)
        assert client.enabled == [1, 2, 3, 4]
        assert [int(emitter[-1]) for emitter in client.emitters] == list(range(5001, 5001 + len(client.emitters)))
        client.start()
        client.process(200, LIMIT_S)
        client.stop()
        client.close()
        assert client.lost_syncs == 1  # nothing stands before the first record
        order = [pose.station for pose in client.poses]
        assert order == [1 + 2 * ((k + (order[0] == 3)) % 2) for k in range(200)]
        for pose in client.poses:
            judge(pose.station, tuple(INCH_M * v for v in pose.position_in), pose.angles_deg, 1e-4, 0.01)
            assert (pose.buttons, pose.stick) == (0, (127, 127))
        again = Vrui(on.port, scale=0.05)
        assert again.open((2,), reset=True)
        again.start()
        again.process(50, LIMIT_S)
        assert {pose.station for pose in again.poses} == {2}
        again.stop()
        again.close()


def test_vrui_uploads_emitters(tmp_path: Path) -> None:
    upload = ((0.9144, -0.6096, 0.0, 0.0, 0.0, 1.0), (0.0, -0.6096, 2.5, 0.0, 0.6, 0.8))
    with device(tmp_path) as on:
        client = Vrui(on.port, scale=0.05)
        assert client.open((1,), upload=upload)
        client.close()
        client = Vrui(on.port, scale=0.05)
        assert client.open((1,), probe=True)
        client.close()
    assert client.enabled == [1]
    assert [emitter[1:7] for emitter in client.emitters] == [pytest.approx(one, abs=1e-4) for one in upload]


def test_vr_juggler_as_it_is(tmp_path: Path) -> None:
    with device(tmp_path, stations=2) as on:
        client = Late(on.port)
        client.open(LIMIT_S)
        assert client.stations == 2
        for _ in range(60):
            client.sample(LIMIT_S)
            for station in (1, 2):
                judge(station, client.positions_m[station], angles_of(client.turns[station]), 1e-4, 0.01)
        client.close()


@pytest.mark.parametrize("stream", [False, True])
def test_vr_juggler_as_it_was(tmp_path: Path, stream: bool) -> None:
    """Its `c` may be lost with the queue that it empties; then a restart helps."""
    with device(tmp_path) as on:
        before = Tty(on.port, raw())
        before.write(b"C" if stream else b"c")
        assert not stream or wait_until(lambda: len(before.read(4096)) > 0, LIMIT_S)
        before.close()
        client = Early(on.port)
        assert client.open(stream)
        samples = [client.sample(lambda: False, stream) for _ in range(30)]
        client.close()
        silent(on.port)
    for sample in samples:
        assert sample is not None
        for station, record in enumerate(sample, start=1):
            numbers = struct.unpack_from("<6f", record, 3)
            judge(station, tuple(0.01 * v for v in numbers[:3]), numbers[3:], 1e-4, 0.01)


def test_the_verb_itself_is_ready_when_its_link_is_there(tmp_path: Path) -> None:
    """VRPN gets its first answer within the wait that it allows."""
    link = tmp_path / "tracker"
    verb = [sys.executable, "-m", "harness.cli", "emulate", "builtin_walking", "--pty", str(link), "--rate", "60"]
    process = subprocess.Popen(
        verb, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heeding_interrupts
    )
    guard = threading.Timer(200.0, process.kill)
    guard.start()
    try:
        assert wait_until(link.exists, 120.0, 0.01)
        client = Vrpn(str(link), is900_time=True)
        assert client.serve(lambda: len(client.reports) >= 200, LIMIT_S), client.said
        client.close()
        process.send_signal(signal.SIGINT)
        said, talk = process.communicate()
    finally:
        guard.cancel()
        process.kill()
    assert process.returncode == 0, talk
    assert said.splitlines()[-1] == "pass"
    assert client.said == ["resetting, attempt 1", "gives status", "reset completed"]
    assert {report.sensor for report in client.reports} == {0, 1, 2, 3}
    assert not link.is_symlink()
