"""What `harness bench lab` measures: the long capture is one session of sound records, and costs are real."""

from pathlib import Path

import numpy as np
import pytest

from harness.bench.lab import speed
from harness.bench.lab.captures import planted_capture
from harness.bench.lab.verb_cost import measure_verb
from harness.stream.recording import CaptureReader


def test_a_long_capture_goes_on_from_part_to_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed, "PART_S", 30.0)
    path = tmp_path / "long.rec"
    speed.long_capture(path, seed=1001, minutes=1.0)
    reader = CaptureReader(path)
    blocks = list(reader.blocks())
    assert {block.session for block in blocks} == {0}
    assert not reader.damage
    assert len(reader.wire.stations) == 6
    for station in reader.wire.stations:
        measured_s = np.concatenate([block.stations[station].measured_s for block in blocks])
        assert len(measured_s) == 60 * 120
        assert np.allclose(np.diff(measured_s), 1.0 / 120.0, atol=1e-4)


@pytest.mark.slow
def test_the_cost_of_a_verb_is_that_of_its_own_process(tmp_path: Path) -> None:
    capture = planted_capture("clock", 1001, tmp_path, seconds=30.0)
    cpu_s, peak_bytes = measure_verb("characterize", capture)
    assert 0.5 < cpu_s < 60.0
    assert 80e6 < peak_bytes < 500e6
    with pytest.raises(RuntimeError, match=r"missing\.rec"):
        measure_verb("characterize", tmp_path / "missing.rec")


def test_a_study_has_no_verdict_on_an_overbooked_machine() -> None:
    assert [speed.trust_row(seconds, 10.0, "").verdict for seconds in (12.0, 14.0)] == ["met", "missed"]
    busy = speed.trust_row(14.0, 10.0, "the machine is overbooked")
    assert (busy.verdict, busy.why) == ("no verdict", "the machine is overbooked")
