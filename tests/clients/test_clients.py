"""InterSense's library, FreeVR, Vrui and VR Juggler at the emulator's pty (docs/is900.md 11.2 and 11.3)."""

import re
import signal
import struct
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from tests.clients.device import QUALITY, ROOT, check_pose, run_device, yaw_pitch_roll_deg
from tests.clients.freevr import FreeVrClient
from tests.clients.gadgeteer import EarlyVrJuggler, VrJuggler
from tests.clients.intersense import InterSenseClient
from tests.clients.tty import Tty, raw_mode, wait_until
from tests.clients.vrpn import VrpnClient
from tests.clients.vrui import VruiClient
from tests.clients.wire import split_records_and_replies
from tests.interrupts import heeding_interrupts

LIMIT_S = 60.0
INCH_M = 0.0254
PRODUCT_PROBE = b"cc*resetc*resetccc*resetc*resetc"


def check_poses(client: InterSenseClient, stations: int = 4) -> None:
    for number, station in enumerate(client.stations[:stations], start=1):
        check_pose(number, station.position_m, station.angles_deg, 1e-4, 0.01)


def check_all_records(client: InterSenseClient, size: int, stations: int, refused_before: int) -> None:
    """Check that only records arrived, and that the client refused only those that contain CR LF.

    `refused_before` is the number refused before: until the client has read the status, it takes binary records for
    ASCII.
    """
    assert client.tty is not None
    began = client.tty.received.index(b"31G") + 16
    records, _ = split_records_and_replies(
        bytes(client.tty.received[began:]), {b"%d" % k: size for k in range(1, stations + 1)}
    )
    split_count = sum(b"\r\n" in record[:-2] for record in records)
    assert client.refused_count - refused_before <= 3 * split_count, (
        client.refused_count,
        refused_before,
        split_count,
    )
    assert sum(station.records for station in client.stations) >= len(records) - 3 * split_count - 1


@pytest.mark.long
@pytest.mark.parametrize(("version", "size"), [("1.01", 29), ("2.09", 33)])
def test_intersense_detects_and_reads_the_tracker(tmp_path: Path, version: str, size: int) -> None:
    with run_device(tmp_path) as device:
        client = InterSenseClient(device.port, version)
        assert client.open()
        refused_before = client.refused_count
        assert (client.product, client.firmware, client.sync) == (16, "4.2301", 0)
        assert client.binary
        assert client.centimetres
        assert client.continuous
        items = [2, 4, 1] if version == "1.01" else [2, 4, 40, 22, 23, 1]
        assert [station.items for station in client.stations] == [items] * 8
        assert client.run(lambda: min(station.records for station in client.stations[:4]) >= 50, LIMIT_S)
        check_poses(client)
        assert client.read_settings()
        check_all_records(client, size, 4, refused_before)
        assert all(station.records == 0 for station in client.stations[4:])
        if version == "2.09":
            assert [station.active for station in client.stations] == [True] * 4 + [False] * 4
            assert {station.quality for station in client.stations[:4]} == {QUALITY}
        client.close()
        check_silence(device.port)


@pytest.mark.long
@pytest.mark.parametrize("version", ["1.01", "2.09"])
def test_intersense_reads_and_sets_stations_while_data_flow(tmp_path: Path, version: str) -> None:
    with run_device(tmp_path) as device:
        client = InterSenseClient(device.port, version)
        assert client.open()
        assert all(client.read_station(number) for number in range(1, 9))
        assert [station.cube_number for station in client.stations] == [1, 2, 3, 4, -1, -1, -1, -1]
        assert client.set_station(2, 25, 4, 1, "2,4,21,1")
        station = client.stations[1]
        assert (station.prediction_ms, station.sensitivity, station.enhancement) == (25, 4, 1)
        assert station.items == [2, 4, 21, 1]
        count = station.records
        assert client.run(lambda: station.records >= count + 50, LIMIT_S)
        check_poses(client)
        assert station.time_s > 0.0
        client.close()


def test_intersense_reads_a_device_with_more_stations_than_inertia_cubes(tmp_path: Path) -> None:
    """Version 1.01 gives up at an answer to `MCI` above 4, version 2.09 takes the station's number."""
    with run_device(tmp_path, stations=6, rate_hz=30.0) as device:
        client = InterSenseClient(device.port, "2.09")
        assert client.open()
        assert all(client.read_station(number) for number in range(1, 9))
        assert [station.cube_number for station in client.stations] == [1, 2, 3, 4, 5, 6, -1, -1]
        client.close()


def test_intersense_looks_for_another_product_first(tmp_path: Path) -> None:
    """Its other probes are joined to the first `MS`, which gets an error record."""
    with run_device(tmp_path) as device:
        tty = Tty(device.port, raw_mode())
        tty.write(PRODUCT_PROBE + b"cMS\r\nMS\r\n")
        assert wait_until(lambda: re.search(rb"31Sg..\r\n", tty.received + tty.read(4096)) is not None, LIMIT_S)
        _, replies = split_records_and_replies(bytes(tty.received), {})
        assert replies[-1].startswith(b"31Sg")
        assert all(reply.startswith(b"2 E*ERROR*") for reply in replies[:-1])
        tty.close()


@pytest.mark.slow
@pytest.mark.parametrize("version", ["1.01", "2.09"])
def test_intersense_with_its_original_time_outs(tmp_path: Path, version: str) -> None:
    with run_device(tmp_path) as device:
        client = InterSenseClient(device.port, version, timeout_factor=1.0, scale=1.0)
        assert client.open()
        refused_before = client.refused_count
        assert client.run(lambda: min(station.records for station in client.stations[:4]) >= 3000, LIMIT_S)
        check_poses(client)
        check_all_records(client, 29 if version == "1.01" else 33, 4, refused_before)
        client.close()


def check_silence(port: str) -> None:
    """Check that nothing arrives from a device that was stopped."""
    tty = Tty(port, raw_mode())
    wait_until(lambda: not tty.read(4096), LIMIT_S, 0.2)
    assert not tty.wait(0.3)
    tty.close()


@pytest.mark.parametrize("stations", [4, 12])
def test_freevr(tmp_path: Path, stations: int) -> None:
    with run_device(tmp_path, stations=stations, rate_hz=60.0, controls="still") as device:
        client = FreeVrClient(device.port, wands="1C")
        assert client.open(LIMIT_S)
        assert (client.firmware, client.system) == ("4.2301", "IS900VET")
        names = "123456789ABC"[:stations]
        states = [client.stations[name] for name in names]
        assert [name for name, state in client.stations.items() if state.active] == list(names)
        assert client.run(lambda: min(state.records for state in states) >= 10, LIMIT_S), client.warnings
        assert client.warnings == []
        for number, (name, state) in enumerate(zip(names, states, strict=True), start=1):
            check_pose(
                number,
                tuple(INCH_M * v for v in state.numbers[:3]),
                tuple(state.numbers[3:]),
                5e-4,
                0.02,
            )
            assert state.items == ([40, 2, 4, 22, 23, 1] if name in "1C" else [40, 2, 4, 1])
            assert state.length == (64 if name in "1C" else 51)
            assert state.quality == QUALITY
            assert (state.buttons, state.stick) == ((0, (127, 127)) if name in "1C" else (-1, (-1, -1)))
            assert state.tracking == "T"
            assert 1 <= state.measured <= 12
            assert 0 <= state.rejected <= state.measured
        assert all(state.tracking == "X" for name, state in client.stations.items() if name not in names)
        assert client.tracking_records >= 10
        assert sorted(client.emitters) == list(range(5001, 5001 + len(client.emitters)))
        assert client.emitters
        client.close()


def test_freevr_after_a_client_that_left_it_streaming(tmp_path: Path) -> None:
    """Binary records of another list are still in the port's buffer; the client searches for its replies among them."""
    with run_device(tmp_path) as device:
        previous_client = VrpnClient(device.port)
        assert previous_client.serve(lambda: len(previous_client.reports) >= 40, LIMIT_S), previous_client.log
        previous_client.close()
        client = FreeVrClient(device.port)
        assert client.open(LIMIT_S)
        states = [client.stations[name] for name in "1234"]
        counts = [state.records for state in states]
        assert client.run(
            lambda: all(station.records >= count + 10 for station, count in zip(states, counts, strict=True)),
            LIMIT_S,
        )
        client.close()


@pytest.mark.long
def test_vrui(tmp_path: Path) -> None:
    with run_device(tmp_path) as device:
        previous_client = VrpnClient(device.port)  # leaves the device streaming
        assert previous_client.serve(lambda: len(previous_client.reports) >= 4, LIMIT_S), previous_client.log
        previous_client.close()
        client = VruiClient(device.port, scale=0.05)
        assert client.open((1, 3), probe=True)
        assert client.active_stations == [1, 2, 3, 4]
        assert [int(emitter[-1]) for emitter in client.emitters] == list(range(5001, 5001 + len(client.emitters)))
        client.start()
        client.process(200, LIMIT_S)
        client.stop()
        client.close()
        assert client.lost_syncs == 1  # nothing precedes the first record
        stations_read = [pose.station for pose in client.poses]
        assert stations_read == [1 + 2 * ((k + (stations_read[0] == 3)) % 2) for k in range(200)]
        for pose in client.poses:
            check_pose(pose.station, tuple(INCH_M * v for v in pose.position_in), pose.angles_deg, 1e-4, 0.01)
            assert pose.buttons in (0, 1, 2, 4, 8, 16, 32)
            assert 127 in pose.stick  # one axis moves at a time
        second_client = VruiClient(device.port, scale=0.05)
        assert second_client.open((2,), reset=True)
        second_client.start()
        second_client.process(50, LIMIT_S)
        assert {pose.station for pose in second_client.poses} == {2}
        second_client.stop()
        second_client.close()


def test_vrui_uploads_emitters(tmp_path: Path) -> None:
    upload = ((0.9144, -0.6096, 0.0, 0.0, 0.0, 1.0), (0.0, -0.6096, 2.5, 0.0, 0.6, 0.8))
    with run_device(tmp_path) as device:
        client = VruiClient(device.port, scale=0.05)
        assert client.open((1,), upload=upload)
        client.close()
        client = VruiClient(device.port, scale=0.05)
        assert client.open((1,), probe=True)
        client.close()
    assert client.active_stations == [1]
    assert [emitter[1:7] for emitter in client.emitters] == [pytest.approx(values, abs=1e-4) for values in upload]


def test_current_vr_juggler(tmp_path: Path) -> None:
    with run_device(tmp_path, stations=2) as device:
        client = VrJuggler(device.port)
        client.open(LIMIT_S)
        assert client.stations == 2
        for _ in range(60):
            client.sample(LIMIT_S)
            for station in (1, 2):
                check_pose(
                    station, client.positions_m[station], yaw_pitch_roll_deg(client.quaternions[station]), 1e-4, 0.01
                )
        client.close()


@pytest.mark.long
@pytest.mark.parametrize("stream", [False, True])
def test_early_vr_juggler(tmp_path: Path, stream: bool) -> None:
    """Its `c` may be lost with the queue that it empties; then a restart helps."""
    with run_device(tmp_path) as device:
        previous_client = Tty(device.port, raw_mode())
        previous_client.write(b"C" if stream else b"c")
        assert not stream or wait_until(lambda: len(previous_client.read(4096)) > 0, LIMIT_S)
        previous_client.close()
        client = EarlyVrJuggler(device.port)
        assert client.open(stream)
        samples = [client.sample(lambda: False, stream) for _ in range(30)]
        client.close()
        check_silence(device.port)
    for sample in samples:
        assert sample is not None
        for station, record in enumerate(sample, start=1):
            numbers = struct.unpack_from("<6f", record, 3)
            check_pose(station, tuple(0.01 * v for v in numbers[:3]), numbers[3:], 1e-4, 0.01)


def test_the_command_is_ready_when_its_link_exists(tmp_path: Path) -> None:
    """VRPN gets its first reply within its own time limit."""
    link = tmp_path / "tracker"
    command = [sys.executable, "-m", "harness.cli", "emulate", "builtin_walking", "--pty", str(link), "--rate", "60"]
    process = subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heeding_interrupts
    )
    guard = threading.Timer(200.0, process.kill)
    guard.start()
    try:
        assert wait_until(link.exists, 120.0, 0.01)
        client = VrpnClient(str(link), is900_time=True)
        assert client.serve(lambda: len(client.reports) >= 200, LIMIT_S), client.log
        client.close()
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate()
    finally:
        guard.cancel()
        process.kill()
    assert process.returncode == 0, errors
    assert output.splitlines()[-1] == "pass"
    assert client.log == ["resetting, attempt 1", "gives status", "reset completed"]
    assert {report.sensor for report in client.reports} == {0, 1, 2, 3}
    assert not link.is_symlink()
