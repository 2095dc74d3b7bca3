"""A scenario that varies its disturbance, run whole: twins share every draw, and recovery is in the summary."""

from pathlib import Path

import numpy as np
import pytest

from harness.errors import Outcome, UnknownName
from harness.experiment import engine
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.report.run.text import run_table
from harness.results import read_summary, select_cells

SCENARIO = """
schema = 1
seed = 3
methods = ["ik:previous"]
noise = "default"
[disturbance]
station = "head"
from_s = 1.5
lasts_s = 1.0
[vary]
"disturbance.kind" = ["none", "all_lost", "start_off"]
[motion]
source = "builtin"
longest_s = 4.6
behaviours = ["walking"]
test = ["walking_p1_01"]
[stations]
left_hand = { bone = "lhand", along = 1.0, around_deg = -90.0 }
right_hand = { bone = "rhand", along = 1.0, around_deg = 90.0 }
torso = { bone = "thorax", along = 0.5, around_deg = 0.0 }
head = { bone = "head", along = 1.0, around_deg = 0.0 }
"""


def test_recovery_is_measured_by_a_run(tmp_path: Path) -> None:
    (tmp_path / "lost.toml").write_text(SCENARIO)
    out = tmp_path / "out"
    assert engine.run(load_scenario(tmp_path / "lost.toml"), out) is Outcome.PASS
    cells = {cell.varied["disturbance.kind"]: cell for cell in select_cells(out)}
    plain, lost = cells["none"], cells["all_lost"]
    before = plain.time_s < 1.5 - 1e-9
    assert 55 < before.sum() < 62
    np.testing.assert_array_equal(plain.estimate_qpos[before], lost.estimate_qpos[before])
    np.testing.assert_array_equal(plain.truth_qpos, lost.truth_qpos)
    assert not np.array_equal(plain.estimate_qpos, lost.estimate_qpos)
    gone = (lost.time_s >= 1.5) & (lost.time_s < 2.45)
    assert not lost.position_valid[gone].any()
    assert set(lost.status[gone]) == {1, 2}
    summary = read_summary(out)
    rows = {row["disturbance"]: row for row in summary["recovery"]}
    assert set(rows) == {"all_lost", "start_off"}
    found = {name: (row["evaluated_frames"], row["status_right"]) for name, row in rows.items()}
    assert found == {"all_lost": (40, 1.0), "start_off": (40, 1.0)}
    assert all(row["ratio"] == pytest.approx(row["disturbed_deg"] / row["undisturbed_deg"]) for row in rows.values())
    assert "all_lost" in run_table(summary).split("recovery: ")[1]


def test_a_station_that_nobody_wears_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    (tmp_path / "lost.toml").write_text(SCENARIO.replace('"head"\nfrom', '"haed"\nfrom'))
    with pytest.raises(UnknownName, match="Did you mean 'head'"):
        engine.run(load_scenario(tmp_path / "lost.toml"), tmp_path / "out")
    assert not (tmp_path / "out").exists()
