"""The bench of sweeps: what it judges beside is what it sweeps, and it sees a table that differs."""

from dataclasses import replace
from pathlib import Path

from harness.bench import sweep
from harness.experiment.scenarios import expand_sweep, load_sweep


def test_what_is_judged_beside_are_the_cells_of_the_sweep(tmp_path: Path) -> None:
    (swept,) = expand_sweep(*load_sweep(sweep._write_sweep(tmp_path, 3)))
    beside = sweep._small_scenario(3)
    ours, theirs = ([replace(made, vary={}) for _, made in scenario.variants()] for scenario in (beside, swept))
    assert len(ours) == 3
    assert ours == theirs


def test_tables_are_compared_but_for_times(tmp_path: Path) -> None:
    table = "method,joint_angle_mean_deg,step_p50_ms,seconds\nik,2.5,0.1,0.2\nmean_pose,7.5,0.7,0.9\n"
    for name, text in {
        "one": table,
        "slower": table.replace("0.7,0.9", "0.8,1.1"),
        "wrong": table.replace("2.5,", "2.6,"),
    }.items():
        (tmp_path / name).write_text(text)
    assert sweep._count_differing_lines(tmp_path / "one", tmp_path / "slower") == 0
    assert sweep._count_differing_lines(tmp_path / "one", tmp_path / "wrong") == 1


def test_two_jobs_are_given_the_same_shipped_clips(tmp_path: Path) -> None:
    (tmp_path / "shared.toml").write_text(sweep.PARALLEL_SWEEP)
    (scenario,) = expand_sweep(*load_sweep(tmp_path / "shared.toml"))
    assert scenario.motion.test == sweep.CLIPS
    assert len(scenario.variants()) == 16
