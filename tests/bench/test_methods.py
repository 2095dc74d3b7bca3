"""The benchmark of methods reports what was measured, on a database small enough for a test."""

import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mink", reason="the bench compares with mink, an extra")

from harness.bench import methods, peak_memory
from harness.bench.peak_memory import NO_METHOD
from harness.reconstruct import MotionDatabase, make_method
from harness.study.speed import benchmark_clips
from harness.study.speed.round_robin_timing import measure_speed


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten takes, two of each behaviour, one of them of the performer who is followed."""
    where = tmp_path_factory.mktemp("bench") / "database"
    MotionDatabase.build(
        benchmark_clips.build_common_body(), benchmark_clips.make_take_factories(8_000, 1), folder=where
    )
    return where


@pytest.mark.long
def test_methods_and_mink_are_timed_on_the_same_clips(folder: Path) -> None:
    learnt = MotionDatabase.open(folder)
    clips = benchmark_clips.generate_held_out_clips(1, 2.0)
    mink = {methods.MINK: methods._mink_contender}
    speeds = measure_speed(("weighted_blend", "ik"), learnt, clips, 1, references=mink)
    assert [speed.steps for speed in speeds] == [5 * 40] * 2
    assert all(set(speed.ratios) == {"ik", "mink"} for speed in speeds)
    memory = methods.memory_row("weighted_blend", 0, 1_000_000, 1_000)
    assert memory.value == pytest.approx(1e6 / (4 * 1_000 * (55 + 60)))
    row, to_ik, tail = methods.method_rows(speeds[0], [memory])
    entries = row.as_dict()
    assert entries["method"] == "weighted_blend"
    assert entries["fps"] == row.value
    assert (row.verdict, to_ik.value, to_ik.target) == ("", entries["ratio_to_ik"], ">= 0.25")
    assert (
        0.0
        < float(entries["p50_ms"])
        <= float(entries["p99_ms"])
        == pytest.approx((tail.value or 0.0) * float(entries["p50_ms"]))
    )
    assert 0.1 < float(entries["error_deg"]) < 10.0
    assert entries["peak_memory_ratio"] == memory.value
    assert float(entries["ratio_to_mink"]) > float(entries["ratio_to_ik"]) > 0.0


def test_a_database_is_as_fast_as_itself(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(methods, "CLIP_S", 2.0)
    learnt = MotionDatabase.open(folder)
    row = methods.large_database_row("weighted_blend", learnt, learnt, 1, lambda *_: None)
    assert row.value is not None
    assert 0.3 < row.value < 3.0
    assert row.target == "<= 1.3"


def test_learning_is_timed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    learnt = MotionDatabase.open(folder)
    monkeypatch.setattr(benchmark_clips, "fit_named_method", lambda *_: time.sleep(0.2))
    row = methods.learning_row("weighted_blend", learnt, 1)
    assert (row.unit, row.target, row.verdict) == ("units", "<= 400", "met")
    assert row.text == f"weighted_blend, learning from {len(learnt):,} frames, CPU time"
    assert float(row.reference.split()[0]) < 0.2, "sleeping is no work"


def test_options_change_the_hash() -> None:
    plain, other = (make_method(name) for name in ("ik", "ik[prior_sigma_rad=0.4]"))
    assert methods.config_hash(plain) == methods.config_hash(make_method("ik")) != methods.config_hash(other)


def test_memory_is_that_of_the_process_alone(folder: Path) -> None:
    held = np.ones(30_000_000)  # 240 MB that a child must not count
    nothing = peak_memory.measure_peak_bytes(NO_METHOD, folder, 1)
    assert held[-1] == 1.0
    assert nothing > 50e6
    if sys.platform == "linux":
        assert nothing < peak_memory.peak_bytes()


def test_recall_is_judged_by_exact_search(folder: Path) -> None:
    rows = methods.recall_rows(MotionDatabase.open(folder), 1, every=40)
    assert [row.target for row in rows] == [">= 0.95"] * 3
    assert all(0.9 < (row.value or 0.0) <= 1.0 for row in rows)
