"""What `harness bench wire` makes of the two processes' notes."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from harness.bench.cpu_time import overbooked
from harness.bench.limits import outcome_of
from harness.bench.wire import LineRun, _last_clock_reset, _losses_and_latency, _pose_times, line_rows
from harness.bench.wire_device import CASES
from harness.errors import Outcome


def test_records_count_from_the_last_time_that_the_clock_was_zeroed() -> None:
    assert _last_clock_reset(np.array([5.0, 6.0, 7.0, 0.0, 1.0, 2.0])) == 3
    assert _last_clock_reset(np.array([5.0, 6.0, 0.0, 1.0, 0.0, 1.0, 2.0])) == 4
    assert _last_clock_reset(np.array([0.0, 1.0, 2.0])) == 0


def test_the_way_is_from_the_last_byte_of_a_frame_to_its_pose_and_gaps_between_poses_are_losses() -> None:
    written_s = np.array([1.0, 1.1, 2.0, 2.1, 3.0, 3.1, 4.0, 4.1])
    ready_s = np.array([np.nan, 1.15, 2.2, 2.2, 3.3, np.nan, 4.2, np.nan])  # before the first and after the last: none
    lost, way_s = _losses_and_latency(written_s, ready_s)
    assert np.flatnonzero(lost).tolist() == [5]
    np.testing.assert_allclose(way_s, [0.05, 0.1, 0.3, 0.2])
    with pytest.raises(RuntimeError, match="no record"):
        _losses_and_latency(written_s, np.full(8, np.nan))


def test_poses_are_found_by_station_and_stamp(tmp_path: Path) -> None:
    table = tmp_path / "poses.csv"
    table.write_text("ready_s,device_s.head,device_s.torso\n1.5,0.25,0.5\n2.5,0.75,nan\n")
    head, torso = _pose_times(table, 2)
    assert head == {0.25: 1.5, 0.75: 2.5}
    assert torso[0.5] == 1.5


def test_rows_of_a_line_have_the_median_over_its_runs_of_what_exceeds_the_timer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each run is compared with the timer of the same run; losses are summed."""
    monkeypatch.setattr(os, "getloadavg", lambda: (0.0, 0.0, 0.0))
    runs = runs_of(latency_ms=(9.0, 4.0, 30.0), timer_ms=(1.0, 2.0, 10.0))
    losses, _, above = line_rows(CASES[0], 15.0, runs)
    assert losses.value == 3.0
    assert "of 300 in 3 x 15 s" in losses.reference
    assert above.value == 8.0  # of 8, 2 and 20
    assert "median of 3 runs; 2.00 to 20.00 ms" in above.reference
    assert above.target == "<= 5"
    assert (losses.verdict, above.verdict) == ("missed", "missed")


def test_an_overbooked_machine_gives_no_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    """The timer of the same run says so, or the number of processes that want to run."""
    monkeypatch.setattr(os, "getloadavg", lambda: (35.0, 35.0, 35.0))
    rows = line_rows(CASES[0], 15.0, runs_of(latency_ms=(9.0, 9.0, 9.0), timer_ms=(4.0, 4.0, 1.0)))
    held = [row for row in rows if row.target]
    assert [row.verdict for row in held] == ["no verdict"] * 2
    assert all(row.why == "the machine is overbooked: its timer is 4.0 ms late (p99), load 35" for row in held)
    assert outcome_of(rows) is Outcome.NOT_COMPARABLE
    monkeypatch.setattr(os, "cpu_count", lambda: 8)
    assert overbooked() == "the machine is overbooked: load 35 on 8 cores"
    monkeypatch.setattr(os, "cpu_count", lambda: 32)
    assert overbooked() == overbooked(1.9) == ""


def runs_of(latency_ms: Sequence[float], timer_ms: Sequence[float]) -> list[LineRun]:
    """Runs that lose 0, 2 and 1 records."""
    return [
        LineRun(100, n, 0.5, 1.0, p99, 40.0, timer)
        for p99, timer, n in zip(latency_ms, timer_ms, (0, 2, 1), strict=True)
    ]
