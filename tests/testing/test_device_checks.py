"""What `harness doctor` tries of the way from a device: it passes here, and a fault is seen."""

from collections import namedtuple
from pathlib import Path

import pytest
from serial.tools import list_ports

from harness.stream.polhemus import EmulatorConfig
from harness.testing import device_checks
from harness.testing.device_checks import check_emulated_device, describe_serial_ports

FakePort = namedtuple("FakePort", "device")


@pytest.mark.parametrize("kind", ["tcp", "udp"])
def test_an_emulated_device_is_read(kind: str) -> None:
    ok, detail = check_emulated_device(kind)
    assert ok, detail
    assert "of 20 frames complete" in detail


def test_wrong_positions_are_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    heights_m = iter([0.0, 0.01])  # of the samples, then of the expectation
    monkeypatch.setattr(device_checks, "_heights_m", lambda: next(heights_m))
    ok, detail = check_emulated_device("tcp")
    assert not ok
    assert "largest error 1.0e+01 mm" in detail


def test_a_device_that_does_not_answer_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device_checks, "EmulatorConfig", lambda udp, udp_port: EmulatorConfig())
    ok, detail = check_emulated_device("udp")
    assert not ok
    assert "no packet of an IS-900 arrived" in detail


def test_serial_ports_are_listed_with_permission_and_latency(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(list_ports, "comports", lambda: [])
    assert describe_serial_ports() == "none found"
    usable = tmp_path / "ttyUSB0"
    usable.touch()
    timer = tmp_path / "sys" / "ttyUSB0" / "latency_timer"
    timer.parent.mkdir(parents=True)
    timer.write_text("16\n")
    monkeypatch.setattr(device_checks, "LATENCY_FOLDER", tmp_path / "sys")
    ports = [FakePort(str(usable)), FakePort(str(tmp_path / "ttyS9"))]
    monkeypatch.setattr(list_ports, "comports", lambda: ports)
    text = describe_serial_ports()
    assert f"{usable} (latency timer 16 ms)" in text
    assert f"{tmp_path / 'ttyS9'} (may not be opened by this user)" in text
