"""What is collected from cells, the outcome of a run, its text, and a quick run on real motion."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.bench.accuracy import measurement
from harness.bench.accuracy.clip_errors import ANGLE, SILENT_ANGLE, ErrorsByCondition, read_errors
from harness.bench.accuracy.conditions import SEEDS
from harness.bench.accuracy.measurement import AccuracyReport, collect_errors, measure_accuracy
from harness.bench.accuracy.statements import compare_methods, find_worse_clips, rank_pooled
from harness.bench.accuracy.targets import evaluate_targets
from harness.bench.accuracy.text import format_report, report_content
from harness.bench.limits import outcome_of
from harness.errors import BadInput, Outcome
from harness.experiment.workers import run_in_process
from harness.results import Cell, as_row, write_cell
from harness.simulate import Disturbance
from tests.bench.accuracy.planted import COMMIT, errors, stored
from tests.bench.accuracy.test_clip_errors import ROOT
from tests.command import Command

MakeCell = Callable[..., Cell]
BASELINE = ROOT / "results" / "baselines" / "accuracy" / "dynamic_map_40f3d61.json"


def report(ours: ErrorsByCondition, others: ErrorsByCondition, earlier: ErrorsByCondition) -> AccuracyReport:
    """A report of planted errors; every other method has the same ones."""
    by_method = {"ours": ours, **dict.fromkeys(("dynamic_map", "local_pca", "kernel_cca", "ik"), others)}
    statements = [
        *evaluate_targets(earlier, ours),
        *compare_methods("ours", by_method),
        *find_worse_clips("ours", by_method, "stored", earlier),
    ]
    no_lag = "ours has no option lag"
    return AccuracyReport("ours", "stored", False, {}, earlier, by_method, statements, no_lag, rank_pooled(by_method))


def test_cells_are_collected_by_method_condition_clip_and_seed(make_cell: MakeCell, tmp_path: Path) -> None:
    rows = [
        {**as_row(make_cell()), "scenario": name, "clip": "a", "seed": seed, "method": method, ANGLE: degrees}
        for name, seed, method, degrees in [
            ("boxing", 2, "ik", 2.0),
            ("boxing", 1, "ik", 1.0),
            ("boxing", 1, "ours", 3.0),
            ("walking", 1, "ours", 4.0),
            ("boxing_lagged", 1, "ours[lag=2]", 5.0),
        ]
    ]
    found = collect_errors(rows, tmp_path)
    assert found["ik"]["boxing, clean"]["a"].by_metric[ANGLE] == (1.0, 2.0)
    assert found["ours"]["walking, clean"]["a"].mean(ANGLE) == 4.0
    assert found["ours[lag=2]"]["boxing, clean"]["a"].mean(ANGLE) == 5.0
    assert SILENT_ANGLE not in found["ours"]["walking, clean"]["a"].by_metric


def test_a_cell_without_an_error_is_refused(make_cell: MakeCell, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="too few frames"):
        collect_errors([{**as_row(make_cell()), ANGLE: None}], tmp_path)


def test_the_error_while_a_station_is_silent_is_that_of_its_frames(make_cell: MakeCell, tmp_path: Path) -> None:
    cell = make_cell(
        scenario="recovery_boxing",
        noise="default",
        varied={"noise": "default", "disturbance.station": "torso"},
        defined_by={"disturbance": Disturbance("one_lost", "torso").as_dict()},
    )
    values = np.where((cell.time_s >= 3.0) & (cell.time_s < 5.0), 7.0, 1.0)
    cell = replace(cell, scores=replace(cell.scores, per_frame={**cell.scores.per_frame, ANGLE: values}))
    write_cell(tmp_path, cell)
    (found,) = collect_errors([as_row(cell)], tmp_path)["ik"].values()
    assert found[cell.clip].by_metric[SILENT_ANGLE] == (7.0,)

    later = {"disturbance": Disturbance("one_lost", "torso", from_s=300.0).as_dict()}
    other = replace(cell, key=cell.key[::-1], defined_by=later)
    write_cell(tmp_path, other)
    with pytest.raises(BadInput, match="while a station is silent"):
        collect_errors([as_row(other)], tmp_path)


def test_a_method_that_meets_everything_passes() -> None:
    found = report(errors(0.5), errors(1.0), errors(1.0))
    assert found.outcome is Outcome.PASS
    text = format_report(found)
    assert "boxing noise" in text
    assert "the largest ratio on a clip" in found.statements[-1].text
    assert text.endswith("0 of 41 targets missed")
    assert "known performers, clean, 12 clips: ours 0.51" in text


@pytest.mark.parametrize(
    "changed",
    [
        {("walking, default", f"walking_known_{n}"): 0.8 for n in range(3)},  # a target: 0.72
        {("jumping, noise", "jumping_new_1"): 1.08},  # one clip
    ],
)
def test_one_miss_is_a_regression(changed: dict[tuple[str, str], float]) -> None:
    found = report(errors(0.5, changed=changed), errors(1.0), errors(1.0))
    assert found.outcome is Outcome.REGRESSED
    assert re.search(r"\n[13] of \d+ targets missed$", format_report(found))


def test_a_statement_that_does_not_hold_is_a_regression() -> None:
    found = report(errors(0.5), errors(1.0), errors(1.0))
    kernel = {**found.by_method, "kernel_cca": errors(0.4)}
    assert outcome_of(found.statements) is Outcome.PASS
    assert replace(found, statements=compare_methods("ours", kernel)).outcome is Outcome.REGRESSED


def test_a_worse_clip_is_listed() -> None:
    place = ("jumping, noise", "jumping_new_1")
    found = report(errors(0.5, changed={place: 1.08}), errors(1.0), errors(1.0))
    text = format_report(found)
    assert any(all(word in line for word in (*place, "1.08", "1.069", "missed")) for line in text.splitlines())
    content = json.loads(json.dumps(report_content(found)))
    missed = [row for row in content["rows"] if row["verdict"] == "missed"]
    assert [row["clip"] for row in missed] == ["jumping_new_1"] * 3
    assert sum("at_least" in row for row in content["rows"]) == 16


def test_the_text_has_both_sides_of_every_condition() -> None:
    found = report(errors(0.5), errors(1.0), errors(1.0))
    text = format_report(replace(found, stored_title="old"))
    lines = [" ".join(line.split()) for line in text.splitlines()]
    assert "boxing, default old 2.0 0.75 5 6" in lines  # multiples of 1.01: mm, jitter's ratio, skate, the truth's
    assert "boxing, default ours 1.0 0.75 3 3" in lines


def test_failed_cells_leave_the_run_incomplete() -> None:
    found = AccuracyReport("ours", "stored", False, {"ours on a": "Traceback\nValueError: seven"})
    assert found.outcome is Outcome.INCOMPLETE
    assert "ours on a: ValueError: seven" in format_report(found)


def test_a_method_with_a_lag_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="has a lag"):
        measure_accuracy("ours[lag=2]", stored(errors(1.0)), tmp_path / "out", executor=run_in_process)


def test_without_real_motion_it_is_refused_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    monkeypatch.delenv("HARNESS_MOCAP", raising=False)
    monkeypatch.chdir(tmp_path)
    captured = command("bench", "accuracy", "--only", "presets", "--baseline", BASELINE, code=Outcome.REFUSED.exit_code)
    assert "--mocap" in captured.err
    assert captured.out.splitlines()[-1] == "refused"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["startup", "--quick"], "--quick with speed. It applies to accuracy or ranking"),
        (["--jobs", "2"], "--jobs with speed"),
        (["accuracy", "startup"], "runs alone"),
        (["accuracy", "--seed", "2"], "--seed with accuracy"),
        (["accuracy", "--seeds", "6"], "there are 5 seeds"),
        (["accuracy", "--quick", "--save", "x.json"], "--quick has one seed"),
        (["accuracy", "--quick", "--only", "setups"], "and no set-ups"),
        (["accuracy", "--baseline", "none.json"], "none.json"),
    ],
)
def test_flags_that_do_not_fit_are_refused(words: list[str], named: str, command: Command) -> None:
    assert named in command("bench", *words, code=Outcome.REFUSED.exit_code).err


@pytest.mark.parametrize(
    ("code", "named"),
    [({"commit": None, "dirty": None}, "no checkout"), ({"commit": "ab", "dirty": True}, "differs from its commit")],
)
def test_errors_of_code_without_a_commit_are_not_saved(
    code: dict[str, object], named: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(measurement, "current_circumstances", lambda: code)
    monkeypatch.delenv("HARNESS_MOCAP", raising=False)
    words = ["bench", "accuracy", "--only", "presets", "--baseline", str(BASELINE), "--save", "never.json"]
    assert named in command(*words, code=Outcome.REFUSED.exit_code).err


def test_saved_errors_are_those_of_the_method_and_its_commit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    measured = report(errors(0.5), errors(1.0), errors(1.0))
    monkeypatch.setattr(measurement, "current_circumstances", lambda: {"commit": COMMIT, "dirty": False})
    monkeypatch.setattr(measurement, "measure_accuracy", lambda *_, **__: measured)
    monkeypatch.chdir(tmp_path)
    words = ["bench", "accuracy", "--only", "presets", "--baseline", str(BASELINE)]
    words += ["--method", "ours", "--save", "mine.json"]
    command(*words)
    found = read_errors(tmp_path / "mine.json")
    assert (found.method, found.commit, found.seeds) == ("ours", COMMIT, SEEDS)
    assert found.conditions["boxing, clean"]["boxing_new_2"].mean(ANGLE) == pytest.approx(0.52)

    monkeypatch.setattr(measurement, "measure_accuracy", lambda *_, **__: replace(measured, failures={"a": "b"}))
    command(*words[:-1], "failed.json", code=Outcome.INCOMPLETE.exit_code)
    assert not (tmp_path / "failed.json").exists()


@pytest.mark.slow
def test_a_quick_run_compares_the_same_clips_and_resumes(mocap: Path, tmp_path: Path, command: Command) -> None:
    words = ["bench", "accuracy", "--quick", "--method", "mean_pose", "--json", "--mocap", str(mocap)]
    words += ["--baseline", str(BASELINE), "--out", str(tmp_path / "out")]
    content = command(*words, code=Outcome.NOT_COMPARABLE.exit_code).content
    earlier = read_errors(BASELINE).first_seeds((1,))
    targets = [row for row in content["rows"] if "at_least" in row]
    clips = {clip for target in targets for clip in target["clip_names"]}
    assert clips == {"13_17@0.20-0.40", "16_22", "07_05"}
    for target in targets:
        (clip,) = target["clip_names"]
        assert target["stored_deg"] == earlier[target["condition"]][clip].mean(ANGLE)
        assert target["verdict"] == "no verdict"
        assert target["value"] > 1.5  # the mean pose follows nothing
    times = {path: path.stat().st_mtime_ns for path in (tmp_path / "out" / "cells").iterdir()}
    assert command(*words, code=Outcome.NOT_COMPARABLE.exit_code).content == content
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "out" / "cells").iterdir()} == times
