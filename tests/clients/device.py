"""An emulator in its own process, behind a pty, for clients that know nothing of it.

Each station moves on a circle and turns as it moves, so that every record can be checked by itself: the heading is the
station's angle on the circle. Run as a module it serves until its standard input ends, then prints what it sent.
"""

import argparse
import json
import math
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from harness.stream import serve_emulator
from harness.stream.polhemus import EmulatorConfig, Fault
from harness.stream.polhemus.codec import DeviceSamples, from_yaw_pitch_roll_deg

RADIUS_M, LOOP_S, QUALITY = 0.3, 5.0, 214
ROOT = Path(__file__).parents[2]


def centre_m(station: int) -> tuple[float, float, float]:
    """Return the centre of the circle of a station, counted from 1 [m]."""
    return 0.5 * station - 1.5, -0.25 * station, 1.0 + 0.1 * station


def tilt_deg(station: int) -> tuple[float, float]:
    """Return the constant pitch and roll of a station [deg]."""
    return 4.0 * station, -7.0 * station


def make_samples(stations: int, rate_hz: float) -> DeviceSamples:
    """One loop of this many stations, sampled one after another."""
    instants = round(LOOP_S * rate_hz)
    number = np.arange(1, stations + 1)
    taken_s = np.arange(instants)[:, None] / rate_hz + (number - 1) / (rate_hz * stations)
    angle = 2.0 * np.pi * taken_s / LOOP_S
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    tilts = np.broadcast_to(np.array([tilt_deg(int(k)) for k in number]), (instants, stations, 2))
    angles_deg = np.concatenate([np.rad2deg(angle)[:, :, None], tilts], axis=-1)
    return DeviceSamples(
        stations=tuple(f"station {k}" for k in number),
        rate_hz=rate_hz,
        take_frames=instants,
        taken_s=taken_s,
        ready_s=0.002,
        device_s=taken_s,
        position_m=np.array([centre_m(int(k)) for k in number]) + RADIUS_M * circle,
        tracker_from_station=from_yaw_pitch_roll_deg(angles_deg.reshape(-1, 3)).reshape(instants, stations, 4),
        quality=np.full((instants, stations), QUALITY / 255.0),
    )


def check_pose(
    station: int, position_m: tuple[float, ...], angles_deg: tuple[float, ...], tolerance_m: float, tolerance_deg: float
) -> None:
    """Check that a record with this pose can be one of this station."""
    x, y, z = (value - centre for value, centre in zip(position_m, centre_m(station), strict=True))
    assert abs(z) < tolerance_m
    assert abs(math.hypot(x, y) - RADIUS_M) < tolerance_m
    heading_deg = math.degrees(math.atan2(y, x))
    assert abs((angles_deg[0] - heading_deg + 180.0) % 360.0 - 180.0) < tolerance_deg + math.degrees(
        tolerance_m / RADIUS_M
    )
    assert all(abs(a - b) < tolerance_deg for a, b in zip(angles_deg[1:], tilt_deg(station), strict=True))


def yaw_pitch_roll_deg(quaternion_wxyz: tuple[float, ...]) -> tuple[float, float, float]:
    """Return yaw, pitch and roll of a unit quaternion [deg]."""
    w, x, y, z = quaternion_wxyz
    assert abs(math.hypot(w, x, y, z) - 1.0) < 1e-4
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    return math.degrees(yaw), math.degrees(pitch), math.degrees(roll)


@dataclass
class RunningDevice:
    """An emulated device that is switched on."""

    port: str
    summary: dict[str, float] = field(default_factory=dict)
    """The emulator's counts, once it is off."""


@contextmanager
def run_device(folder: Path, stations: int = 4, rate_hz: float = 75.0, **config: Any) -> Iterator[RunningDevice]:
    """Run a device while the block runs; fail when the emulator did not end cleanly. `faults` are tables."""
    running = RunningDevice(str(folder / "tracker"))
    command = [sys.executable, "-m", "tests.clients.device", running.port, str(stations), str(rate_hz)]
    process = subprocess.Popen(
        [*command, json.dumps(config)], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdin is not None
    assert process.stdout is not None
    guard = threading.Timer(300.0, process.kill)
    guard.start()
    try:
        assert process.stdout.readline() == "on\n"
        yield running
        process.stdin.close()
        running.summary = json.loads(process.stdout.read())
        assert process.wait(30.0) == 0
    finally:
        guard.cancel()
        process.kill()
        process.wait()
        process.stdin.close()
        process.stdout.close()


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("link")
    parser.add_argument("stations", type=int)
    parser.add_argument("rate_hz", type=float)
    parser.add_argument("config", type=json.loads)
    args = parser.parse_args()
    faults = tuple(Fault(**fault) for fault in args.config.pop("faults", ()))
    config = EmulatorConfig(faults=faults, **args.config)
    with serve_emulator(make_samples(args.stations, args.rate_hz), config, pty=args.link) as server:
        print("on", flush=True)
        sys.stdin.read()
        summary = server.summary()
    print(json.dumps(summary))


if __name__ == "__main__":
    main()
