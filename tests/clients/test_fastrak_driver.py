"""The package `fastrakserialdriver` at the pty of the emulated FASTRAK. It needs no hardware."""

import time
from pathlib import Path

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.fastrak import serve_fastrak
from harness.stream.polhemus.codec import DeviceSamples, from_yaw_pitch_roll_deg

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
    with serve_fastrak(samples, pty=tmp_path / "port") as server:
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
