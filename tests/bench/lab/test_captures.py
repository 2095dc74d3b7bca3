"""Captures with planted faults: the bytes of `harness record sim:`, and the fault is in them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.bench.lab import captures
from harness.bench.lab.captures import PLANTED_FAULTS, planted_capture, planted_numbers, planted_scenario
from harness.cli import main
from harness.errors import UnknownName
from harness.stream.recording import CONFIGURED, RECEIVED, CaptureReader, Recording, read_recording
from tests.bench.lab.scenario_files import write_scenario

SECONDS = 20.0


def _line(recording: Recording) -> list[tuple[str, float, bytes]]:
    return [(b.kind, b.monotonic_s, b.payload) for b in recording.blocks() if b.kind in (CONFIGURED, RECEIVED)]


@pytest.mark.parametrize("kind", ["white", "echoes", "lost", "duplicates", "clock", "stamps"])
def test_a_capture_has_the_bytes_of_the_command_record(kind: str, tmp_path: Path) -> None:
    planted = planted_capture(kind, 7, tmp_path, seconds=SECONDS)
    typed = tmp_path / "typed.rec"
    source = f"sim:{write_scenario(tmp_path, kind, 7)}"
    assert main(["record", source, str(typed), "--seconds", str(SECONDS), "--seed", "7"]) == 0
    lines = [_line(read_recording(path)) for path in (planted, typed)]
    assert lines[0] == lines[1]
    assert len(lines[0]) > 4000


def test_a_share_of_the_records_is_sent_twice(tmp_path: Path) -> None:
    plain, twice = (planted_capture(kind, 7, tmp_path, seconds=100.0) for kind in ("clock", "duplicates"))
    counts = [sum(block.records for block in CaptureReader(path).blocks()) for path in (plain, twice)]
    assert counts[1] / counts[0] - 1.0 == pytest.approx(captures.REPEATED_SHARE, rel=0.3)
    right = next(iter(CaptureReader(twice).blocks())).stations[captures.STATION]
    assert np.sum(np.diff(right.stamp_s) == 0.0) > 10


def test_a_station_is_lost_for_its_share_of_the_time(tmp_path: Path) -> None:
    block = next(iter(CaptureReader(planted_capture("lost", 3, tmp_path)).blocks()))
    lost = {station: float(np.mean(readings.quality == 0.0)) for station, readings in block.stations.items()}
    assert lost.pop(captures.STATION) == pytest.approx(captures.LOST_SHARE, rel=0.5)
    assert max(lost.values()) < 0.02


def test_a_scale_is_planted_relative_to_an_earlier_capture_of_the_session(monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in range(1, 40):
        later, earlier = planted_scenario("scale", seed), planted_scenario(captures.EARLIER, seed)
        assert later.seed == earlier.seed
        draw = captures._scale_draw(later.seed)
        assert abs(draw) >= captures.LEAST_DRAW
        scales = [draw * scale for scale in (later.components["session"]["scale"], 1e-3)]
        (number,) = planted_numbers("scale", seed)
        assert scales[0] - scales[1] == pytest.approx(number.value, rel=1e-9)
    assert replace(later, components={}) == replace(earlier, components={})


def test_every_fault_has_something_to_find() -> None:
    without = [kind for kind, fault in PLANTED_FAULTS.items() if not fault.numbers]
    assert without == [captures.NO_FAULT, "exchanged", "none_validated", captures.EARLIER]
    with pytest.raises(UnknownName):
        planted_capture("smoke", 1, Path())
