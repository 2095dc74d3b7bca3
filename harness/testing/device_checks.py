"""Checks of the way from a device to the driver on this computer: an emulated device over TCP and UDP, serial ports."""

import os
import socket
from itertools import islice
from pathlib import Path

import numpy as np
from serial.tools import list_ports

from harness.core.arrays import Floats
from harness.errors import HarnessError
from harness.stream import serve_emulator
from harness.stream.is900 import DriverConfig, open_tracker
from harness.stream.polhemus import EmulatorConfig
from harness.stream.polhemus.codec import DeviceSamples

_STATIONS = ("head", "torso", "left_hand", "right_hand")
_RATE_HZ, _LOOP_S, _FRAMES = 20.0, 4.0, 20
_TOLERANCE_M = 1e-5
LATENCY_FOLDER = Path("/sys/bus/usb-serial/devices")
"""Where Linux shows the latency timer of USB adapters with FTDI chips."""


def check_emulated_device(kind: str) -> tuple[bool, str]:
    """Read an emulated device over "tcp" or "udp" on this computer: whether its frames are right, and what was seen."""
    samples = _make_samples()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        number = int(probe.getsockname()[1])
    config = EmulatorConfig(udp=kind == "udp", udp_port=number)
    try:
        with serve_emulator(samples, config, tcp="127.0.0.1:0") as emulator:
            port = f"udp://127.0.0.1:{number}" if kind == "udp" else emulator.name
            with open_tracker(port, DriverConfig(stations=_STATIONS)) as tracker:
                frames = list(islice(tracker, 1, 1 + _FRAMES))  # the first one may begin within a round
    except (HarnessError, OSError) as error:
        return False, str(error)
    read_m = np.array([frame.position_m for frame in frames])
    # Each station stays at its own height and distance, so that a reading can be judged without its time.
    wrong_m = np.abs(np.linalg.norm(read_m[..., :2], axis=-1) - 1.0) + np.abs(read_m[..., 2] - _heights_m())
    worst_m = float(np.max(wrong_m[np.isfinite(wrong_m)], initial=0.0))
    complete = sum(bool(frame.position_valid.all()) for frame in frames)
    detail = f"{complete} of {len(frames)} frames complete, largest error {1e3 * worst_m:.1e} mm"
    return complete > 0 and worst_m < _TOLERANCE_M, detail


def describe_serial_ports() -> str:
    """Describe the serial ports: whether this user may open each, and the latency timer of USB adapters."""
    ports = [port.device for port in sorted(list_ports.comports())]
    return "; ".join(map(_describe_port, ports)) or "none found"


def _describe_port(device: str) -> str:
    texts = [] if os.access(device, os.R_OK | os.W_OK) else ["may not be opened by this user"]
    timer = LATENCY_FOLDER / Path(device).name / "latency_timer"
    if timer.is_file():
        texts.append(f"latency timer {timer.read_text().strip()} ms")
    return " ".join([device, *([f"({', '.join(texts)})"] if texts else [])])


def _heights_m() -> Floats:
    return np.arange(len(_STATIONS), dtype=float) / 10.0


def _make_samples() -> DeviceSamples:
    """Stations that go round a circle of 1 m, each at its own height."""
    count, stations = round(_LOOP_S * _RATE_HZ), len(_STATIONS)
    taken_s = np.arange(count)[:, None] / _RATE_HZ + np.arange(stations) / (4.0 * stations * _RATE_HZ)
    angle = 2.0 * np.pi * taken_s / _LOOP_S
    zero = np.zeros_like(angle)
    return DeviceSamples(
        stations=_STATIONS,
        rate_hz=_RATE_HZ,
        take_frames=count,
        taken_s=taken_s,
        ready_s=0.002,
        device_s=taken_s,
        position_m=np.stack([np.cos(angle), np.sin(angle), zero + _heights_m()], axis=-1),
        tracker_from_station=np.stack([np.cos(0.5 * angle), zero, zero, np.sin(0.5 * angle)], axis=-1),
        quality=np.ones_like(angle),
    )
