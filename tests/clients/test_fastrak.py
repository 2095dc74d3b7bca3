"""Other drivers at the pty of the emulated FASTRAK: VRPN, VR Juggler, and the package `fastrakserialdriver`."""

import time
from pathlib import Path

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream import serve_emulator
from harness.stream.fastrak import FastrakEmulatorConfig
from harness.stream.polhemus.codec import DeviceSamples, from_yaw_pitch_roll_deg
from tests.clients import device as circles
from tests.clients.device import yaw_pitch_roll_deg
from tests.clients.gadgeteer import VrJuggler
from tests.clients.vrpn import VrpnClient

INCH_M = 0.0254
RATE_HZ, STATIONS, INSTANTS = 40.0, 3, 240
LIMIT_S = 10.0


def make_samples() -> DeviceSamples:
    """Stations on circles, each at a place and an attitude of its own, in reach of a FASTRAK."""
    taken_s = np.arange(INSTANTS)[:, None] / RATE_HZ + np.arange(STATIONS) / (RATE_HZ * STATIONS)
    turn = 2.0 * np.pi * taken_s * RATE_HZ / INSTANTS
    axis = np.array([0.6, 0.0, 0.8])
    return DeviceSamples(
        stations=("a", "b", "c"),
        rate_hz=RATE_HZ,
        take_frames=INSTANTS,
        taken_s=taken_s,
        ready_s=0.004,
        device_s=taken_s,
        position_m=np.stack([0.5 + 0.2 * np.cos(turn), 0.2 * np.sin(turn), 0.1 * np.arange(STATIONS) + 0 * turn], -1),
        tracker_from_station=rotations.exp(0.4 * np.sin(turn)[..., None] * axis),
        quality=np.ones((INSTANTS, STATIONS)),
    )


def check_pose(values: tuple[float, ...], position_m: Floats, quaternions: Floats) -> None:
    """Check x, y, z [inch] and azimuth, elevation, roll [deg] against the nearest of these poses."""
    row = int(np.linalg.norm(position_m - INCH_M * np.array(values[:3]), axis=1).argmin())
    np.testing.assert_allclose(INCH_M * np.array(values[:3]), position_m[row], atol=1e-6)
    turned = from_yaw_pitch_roll_deg(np.array([values[3:]]))[0]
    assert abs(float(turned @ quaternions[row])) == pytest.approx(1.0, abs=1e-6)


def test_the_package_reads_every_pose(tmp_path: Path) -> None:
    package = pytest.importorskip("fastrakSerialDriver.fastrakDevice", reason="no fastrakserialdriver: extra `dev`")
    support = pytest.importorskip("fastrakSerialDriver.commands.support")
    samples = make_samples()
    position_m, quaternions = samples.position_m[:, 1], samples.tracker_from_station[:, 1]
    with serve_emulator(samples, FastrakEmulatorConfig(), pty=tmp_path / "port") as server:
        device = package.FastrakDevice(str(tmp_path / "port"), station=support.FastrakStations.STATION_2)
        device.enableStream()
        until_s = time.monotonic() + LIMIT_S
        while len(device.data) < 60 * 29 and time.monotonic() < until_s:
            device._thread.join(0.05)
        device.disableStream()
        data = bytes(device.data)
        summary = server.summary()
        device._ser.close()
    records = [data[at : at + 29] for at in range(0, len(data) - 28, 29)]
    assert len(records) >= 60
    read = 0
    for record in records:
        pose = package.FastrakPostion.parseValidPosition(record)
        if pose is None:  # it strips white space, which may be a byte of the last number
            assert record[26:27].isspace()
            continue
        read += 1
        check_pose((pose.x, pose.y, pose.z, pose.psi, pose.theta, pose.phi), position_m, quaternions)
    assert read > 0.8 * len(records)
    assert summary["commands_refused"] == 0


def test_vr_juggler_polls_it(tmp_path: Path) -> None:
    link = tmp_path / "port"
    with serve_emulator(circles.make_samples(3, 40.0), FastrakEmulatorConfig(), pty=link):
        client = VrJuggler(str(link))
        client.open(LIMIT_S)
        assert client.stations == 3
        client.tty.write(b"O3,2,11,1\r")  # it gives stations 1 and 2 alone their lists
        for _ in range(30):
            client.sample(LIMIT_S)
            for station, position_m in client.positions_m.items():
                angles_deg = yaw_pitch_roll_deg(client.quaternions[station])
                circles.check_pose(station, position_m, angles_deg, 1e-4, 0.01)
        client.close()


def test_vrpn_serves_it(tmp_path: Path) -> None:
    link = tmp_path / "port"
    with serve_emulator(circles.make_samples(4, 30.0), FastrakEmulatorConfig(), pty=link) as server:
        client = VrpnClient(str(link))
        assert client.serve(lambda: len(client.reports) >= 120, 60.0), client.log
        client.close()
        refused = server.summary()["commands_refused"]
    assert client.log == ["resetting, attempt 1", "gives status", "reset completed"]
    assert {report.sensor for report in client.reports} == {0, 1, 2, 3}
    for report in client.reports:
        x, y, z, w = report.quaternion_xyzw
        angles_deg = yaw_pitch_roll_deg((w, x, y, z))
        circles.check_pose(report.sensor + 1, report.position_m, angles_deg, 1e-4, 0.01)
    assert refused == 0
