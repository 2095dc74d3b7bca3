"""What `harness bench wire` makes of the two processes' notes."""

from pathlib import Path

import numpy as np
import pytest

from harness.bench.wire import LineRun, _last_clock_reset, _losses_and_latency, _pose_times, line_rows
from harness.bench.wire_cases import CASES


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


def test_rows_of_a_line_have_the_median_over_its_runs_of_what_exceeds_the_timer() -> None:
    """Each run is compared with the timer of the same run; losses are summed."""
    latency_ms, timer_ms, lost = (9.0, 4.0, 30.0), (1.0, 2.0, 10.0), (0, 2, 1)
    runs = [
        LineRun(100, n, 0.5, 1.0, p99, 40.0, timer) for p99, timer, n in zip(latency_ms, timer_ms, lost, strict=True)
    ]
    losses, _, above = line_rows(CASES[0], 15.0, runs)
    assert losses.value == 3.0
    assert "of 300 in 3 x 15 s" in losses.reference
    assert above.value == 8.0  # of 8, 2 and 20
    assert "median of 3 runs; 2.00 to 20.00 ms" in above.reference
    assert above.target == "<= 5"
