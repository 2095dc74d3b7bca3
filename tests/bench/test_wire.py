"""What `harness bench wire` makes of the two processes' notes."""

from pathlib import Path

import numpy as np
import pytest

from harness.bench.wire import _last_clock_reset, _losses_and_latency, _pose_times


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
