"""Guided captures: stretches begin at rest or in motion, are marked, and are continued after any end."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadFile
from harness.stream.emulators import serve_emulator
from harness.stream.frame import TrackerFrame
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.is900 import Is900
from harness.stream.polhemus.codec.samples import DeviceSamples
from harness.stream.recording import guided_capture
from harness.stream.recording.guided_capture import Stretch, capture_stretches, finished_stretches
from harness.stream.recording.recording import read_recording
from harness.stream.recording.station_readings import CaptureBlock, CaptureReader
from tests.stream.is900.driver.bench import START_S, Bench, EmulatedDevice, make_samples

STATIC = Stretch("static", 4.0, "let the stations lie still", True)
SLOW = Stretch("slow", 4.0, "sweep the stations", False)
COVERED = Stretch("covered", 2.0, "cover them", True)
ALL = (STATIC, SLOW, COVERED)
RATE_HZ, REST_S, LOOP_S = 25.0, 12.0, 24.0
PLACE_M = np.array([0.5, -0.2, 0.1])


def resting_and_moving() -> DeviceSamples:
    """Two stations that rest for 12 s, then sway for 12 s."""
    taken_s = np.arange(round(LOOP_S * RATE_HZ))[:, None] / RATE_HZ + np.arange(2) / (8.0 * RATE_HZ)
    sway = np.where(taken_s < REST_S, 0.0, 0.3 * np.sin(2.0 * np.pi * (taken_s - REST_S) / 4.0))
    return replace(
        make_samples(2, RATE_HZ),
        take_frames=len(taken_s),
        taken_s=taken_s,
        device_s=taken_s,
        position_m=PLACE_M + sway[..., None],
        tracker_from_station=np.broadcast_to(rotations.IDENTITY, (*taken_s.shape, 4)),
        quality=np.ones_like(taken_s),
    )


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    """A device in virtual time, in place of the port."""
    bench = Bench(EmulatedDevice(resting_and_moving(), None, START_S))

    def open_on_bench(port: str, config: DriverConfig, **observers: Any) -> Is900:
        return Is900(bench.port, config, host=bench.host, **observers)

    monkeypatch.setattr(guided_capture, "open_tracker_at", open_on_bench)
    return bench


def capture(path: Path, *stretches: Stretch, ready: Callable[[], bool] = lambda: True, **callbacks: Any) -> list[str]:
    """Capture the stretches and return what was logged."""
    lines: list[str] = []
    note: dict[str, object] = {"source": "test"}
    capture_stretches("bench", DriverConfig(), path, stretches, note, ready=ready, log=lines.append, **callbacks)
    return lines


def stretches_of(path: Path) -> list[CaptureBlock]:
    return [block for block in CaptureReader(path).blocks() if block.stretch]


def length_s(block: CaptureBlock) -> float:
    received_s = next(iter(block.stations.values())).received_s
    return float(received_s[-1] - received_s[0])


def spread_m(block: CaptureBlock) -> float:
    return max(float(np.ptp(readings.position_m, axis=0).max()) for readings in block.stations.values())


@pytest.mark.long
def test_each_stretch_has_its_length_and_its_motion(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    lines = capture(path, *ALL)
    blocks = stretches_of(path)
    assert [block.stretch for block in blocks] == ["static", "slow", "covered"]
    for block, stretch in zip(blocks, ALL, strict=True):
        assert length_s(block) == pytest.approx(stretch.seconds, abs=0.1)
    assert spread_m(blocks[0]) == spread_m(blocks[2]) == 0.0
    assert spread_m(blocks[1]) > 0.3
    assert finished_stretches(path) == {"static", "slow", "covered"}
    assert "static, 4 s: let the stations lie still" in lines
    marks = [(mark["stretch"], mark.get("finished")) for mark in read_recording(path).marks]
    ends = [("", name) for name in ("static", "slow", "covered")]
    assert marks == [("", None), ("static", None), ends[0], ("slow", None), ends[1], ("covered", None), ends[2]]


@pytest.mark.long
def test_a_stretch_waits_for_rest_and_says_who_moves(bench: Bench, tmp_path: Path) -> None:
    said: list[str] = []
    capture(tmp_path / "a.rec", SLOW, STATIC, progress=said.append)
    assert spread_m(stretches_of(tmp_path / "a.rec")[1]) == 0.0
    assert "slow: waiting (move the stations)" in said
    assert "static: waiting (1, 2 move)" in said
    assert said[-1] == ""


def test_a_finished_capture_needs_no_device(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    capture(path, STATIC)
    before, bench.plugged = path.read_bytes(), False
    assert capture(path, STATIC) == ["static: recorded already"]
    assert path.read_bytes() == before


@pytest.mark.long
def test_a_person_may_stop_and_go_on(bench: Bench, tmp_path: Path) -> None:
    path, answers = tmp_path / "a.rec", iter([True, False])
    with pytest.raises(BadFile, match="unfinished capture"):
        capture(path, *ALL, ready=lambda: next(answers))
    assert finished_stretches(path) == {"static"}
    before = path.read_bytes()
    assert capture(path, *ALL)[0] == "static: recorded already"
    assert path.read_bytes().startswith(before)
    assert [block.stretch for block in stretches_of(path)] == ["static", "slow", "covered"]


@pytest.mark.long
def test_a_stretch_that_was_cut_is_recorded_again(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "a.rec"

    def interrupt(text: str) -> None:
        if text.startswith("slow: 2 s left"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        capture(path, *ALL, progress=interrupt)
    assert finished_stretches(path) == {"static"}
    before = path.read_bytes()
    capture(path, *ALL)
    assert path.read_bytes().startswith(before)
    blocks = stretches_of(path)
    assert [block.stretch for block in blocks] == ["static", "slow", "slow", "covered"]
    assert length_s(blocks[1]) < 3.0 < length_s(blocks[2])
    assert finished_stretches(path) == {"static", "slow", "covered"}


def test_a_device_that_ends_leaves_the_stretch_unfinished(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, opened = tmp_path / "a.rec", vars(guided_capture)["open_tracker_at"]
    devices: list[Any] = []

    def kept(*words: Any, **more: Any) -> Any:
        devices.append(opened(*words, **more))
        return devices[-1]

    monkeypatch.setattr(guided_capture, "open_tracker_at", kept)

    def close(text: str) -> None:
        if text.startswith("static: 2 s left"):
            devices[0].close()

    with pytest.raises(BadFile, match="unfinished capture"):
        capture(path, STATIC, progress=close)
    assert finished_stretches(path) == set()


def test_another_file_is_refused_untouched(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_bytes(b"no recording")
    with pytest.raises(BadFile, match="no recording"):
        capture(path, STATIC)
    assert path.read_bytes() == b"no recording"
    assert finished_stretches(tmp_path / "absent.rec") == set()


def frames(position_m: Floats, turn: Floats, quality: Floats, rate_hz: float = 40.0) -> Iterator[TrackerFrame]:
    """Frames of one station."""
    for i in range(len(position_m)):
        tracked = np.array([quality[i] > 0.0])
        place, angle = (np.where(tracked, values[i], np.nan)[None] for values in (position_m, turn))
        yield TrackerFrame(
            i / rate_hz, np.array([i / rate_hz]), place, angle, tracked, tracked, quality[i : i + 1], ~tracked
        )


STILL_M, STILL = np.zeros((80, 3)), np.tile(rotations.IDENTITY, (80, 1))
EXCURSION_M = np.where(np.arange(80)[:, None] > 45, [0.03, 0.02, 0.0], 0.0)
MOVED_M = np.linspace(0.0, 0.4, 80)[:, None] * [1.0, 0.0, 0.0]
BACK_M = 0.3 * np.cos(np.linspace(-1.5, 1.5, 80))[:, None] * [0.0, 1.0, 0.0]
"""A motion that turns back in the middle of the time."""
TURNED = rotations.exp(np.linspace(0.0, 0.3, 80)[:, None] * [0.0, 0.0, 1.0])
TRACKED, LOST = np.ones(80), np.zeros(80)


@pytest.mark.parametrize(
    ("position_m", "turn", "quality", "moving"),
    [
        (STILL_M, STILL, TRACKED, []),
        (EXCURSION_M, STILL, TRACKED, []),
        (MOVED_M, STILL, TRACKED, ["a"]),
        (BACK_M, STILL, TRACKED, ["a"]),
        (STILL_M, TURNED, TRACKED, ["a"]),
        (MOVED_M, TURNED, LOST, []),
        (MOVED_M[:20], STILL[:20], TRACKED[:20], None),
    ],
)
def test_what_moves_is_told_from_errors(
    position_m: Floats, turn: Floats, quality: Floats, moving: list[str] | None
) -> None:
    watch = guided_capture._RestWatch()
    for frame in frames(position_m, turn, quality):
        watch.add(frame)
    assert watch.moving(("a",)) == moving


def test_motion_that_is_over_counts_no_more() -> None:
    watch = guided_capture._RestWatch()
    place_m = np.concatenate([MOVED_M, np.tile(MOVED_M[-1], (90, 1))])
    for frame in frames(place_m, np.tile(rotations.IDENTITY, (170, 1)), np.ones(170)):
        watch.add(frame)
    assert watch.moving(("a",)) == []


GUIDED = """
import sys
from pathlib import Path
from harness.stream.is900 import DriverConfig
from harness.stream.recording.guided_capture import Stretch, capture_stretches
stretches = [Stretch("static", 1.5, "rest", True), Stretch("covered", 1.0, "cover", True)]
capture_stretches(sys.argv[1], DriverConfig(), Path(sys.argv[2]), stretches, {}, ready=lambda: True)
"""


@pytest.mark.long
def test_a_killed_capture_goes_on_where_it_was(tmp_path: Path) -> None:
    """As by `kill -9`: what was recorded stays as it is, and the same command finishes the capture."""
    path = tmp_path / "a.rec"
    samples = replace(resting_and_moving(), position_m=np.broadcast_to(PLACE_M, (600, 2, 3)))
    with serve_emulator(samples, tcp="127.0.0.1:0") as device:
        before, finished = b"", set[str]()
        for kilobytes in (1, 4, 9):
            command = [sys.executable, "-c", GUIDED, device.name, str(path)]
            with subprocess.Popen(command) as process:
                until_s = time.monotonic() + 60.0
                while process.poll() is None and time.monotonic() < until_s:
                    if path.exists() and path.stat().st_size > len(before) + 1000 * kilobytes:
                        break
                    time.sleep(0.01)
                process.send_signal(signal.SIGKILL)
            content = path.read_bytes()
            assert content.startswith(before)
            assert finished <= finished_stretches(path)
            before, finished = content, finished_stretches(path)
        subprocess.run(command, check=True, timeout=60.0)
    assert path.read_bytes().startswith(before)
    assert finished_stretches(path) == {"static", "covered"}
    assert len(read_recording(path).damage) <= 3
    last = {block.stretch: length_s(block) for block in stretches_of(path)}
    assert last["static"] > 1.4
    assert last["covered"] > 0.9
