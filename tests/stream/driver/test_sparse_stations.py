"""Units whose stations are not numbered 1, 2, 3: wired devices share receivers (docs/is900.md 14)."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadInput
from harness.stream.codec.samples import DeviceSamples
from harness.stream.driver import DriverConfig, Is900
from harness.stream.emulator.config import EmulatorConfig
from harness.stream.frame import TrackerFrame
from harness.stream.recording.recording import RecordingWriter
from harness.stream.recording.replay import RecordingStream
from tests.stream.driver.bench import START_S, Bench, EmulatedDevice, frames_for, make_samples

SPARSE = ("1357", "29", "3AB", "C", "24", "123456789ABC")


def make_unit(characters: str, rate_hz: float = 20.0) -> tuple[Bench, DeviceSamples]:
    count = len(characters)
    samples = replace(make_samples(count, rate_hz), stations=tuple(f"s{c}" for c in characters))
    return Bench(EmulatedDevice(samples, EmulatorConfig(characters=characters), START_S)), samples


def check_frames(frames: list[TrackerFrame], samples: DeviceSamples, rows: list[int]) -> None:
    """Check that every row of every frame is the reading of its station."""
    assert len(frames) > 10
    for frame in frames[1:-1]:
        assert frame.position_valid.tolist() == [True] * len(rows)
        k = round(frame.measured_s[0] * samples.rate_hz - 0.2) % len(samples)
        np.testing.assert_allclose(frame.position_m, samples.position_m[k, rows], atol=1e-6)
        assert not frame.suspect.any()


@pytest.mark.parametrize("characters", SPARSE)
def test_all_stations_are_read_under_their_numbers(characters: str) -> None:
    bench, samples = make_unit(characters)
    with bench.driver() as driver:
        assert driver.stations == tuple(characters)
        assert driver.wire.characters.decode() == characters
        check_frames(frames_for(driver, bench, 1.0), samples, list(range(len(characters))))
        assert driver.counts["garbage_bytes"] == 0
    assert bench.kinds == ["connected"]


@pytest.mark.parametrize("characters", [c for c in SPARSE if len(c) > 1])
def test_some_stations_are_read_by_number_or_in_the_order_of_the_device(characters: str) -> None:
    for config, rows in (
        (DriverConfig(stations=("last",), characters=characters[-1]), [len(characters) - 1]),
        (DriverConfig(stations=("first",)), [0]),
        (DriverConfig(stations=("a", "b"), characters=characters[0] + characters[-1]), [0, len(characters) - 1]),
    ):
        bench, samples = make_unit(characters)
        with bench.driver(config) as driver:
            check_frames(frames_for(driver, bench, 1.0), samples, rows)
            read = ", ".join(f"{characters[row]} {name}" for row, name in zip(rows, driver.stations, strict=True))
            others = ", ".join(character for row, character in enumerate(characters) if row not in rows)
            assert driver.station_list == (f"{read}; not read: {others}" if others else read)
        device = bench.device
        assert isinstance(device, EmulatedDevice)
        assert device.emulator.device.active == characters, "the others are switched on again"


def test_names_that_are_numbers_mean_these_stations() -> None:
    for names, rows in ((("9",), [1]), (("9", "2"), [0, 1])):
        bench, samples = make_unit("29")
        with bench.driver(DriverConfig(stations=names)) as driver:
            assert driver.stations == tuple(sorted(names))
            check_frames(frames_for(driver, bench, 1.0), samples, rows)
    bench, _ = make_unit("29")
    with pytest.raises(BadInput, match=r"no station 1 \(1\); it has 2, 9"):
        bench.driver(DriverConfig(stations=("1",)))


def test_a_recording_of_such_a_unit_replays_the_same_frames(tmp_path: Path) -> None:
    bench, samples = make_unit("29")
    path = tmp_path / "take.rec"
    with (
        RecordingWriter(path) as writer,
        Is900("bench", DriverConfig(stations=("head", "hand")), observer=writer, host=bench.host) as driver,
    ):
        frames = frames_for(driver, bench, 1.0)
    replayed = list(RecordingStream(path))
    assert RecordingStream(path).wire.characters == b"29"
    check_frames(replayed[: len(frames)], samples, [0, 1])
    for first, second in zip(frames, replayed, strict=False):
        np.testing.assert_array_equal(first.position_m, second.position_m)
