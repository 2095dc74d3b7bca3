"""The papers' speeds: databases of exactly their frames, verdicts by the slowest, and nothing measured twice."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.mocap import synthetic
from harness.reconstruct import MotionDatabase
from harness.results.findings import BarChart
from harness.study.papers import published_speed as module
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.published_speed import (
    KIM2012,
    LIU2011,
    MAX_TEST_S,
    PublishedSpeed,
    build_database,
    build_speed_dataset,
    compare_speed,
    list_test_clips,
    make_speed_experiment,
    missing_clips,
    truncate_motions,
)
from harness.study.speed import benchmark_clips
from harness.study.speed.round_robin_timing import MethodSpeed
from tests.mocap.sample_files import clip, write_clip

TINY = PublishedSpeed(
    "It runs.", "walking", {"golf": {"golf": 850}}, ("weighted_blend", "ik"), ("weighted_blend",), fps=0.1
)


def pace(method: str, frames: int, fps: float, p99_ms: float = 1.0) -> MethodSpeed:
    return MethodSpeed(method, frames, 700, fps, 1e3 / fps, p99_ms, 5.0, 1.0, {"ik": 0.5}, 2.0)


def paces(
    published: PublishedSpeed, fps: float, p99_ms: float = 1.0, *, share: float = 1.0
) -> dict[str, list[MethodSpeed]]:
    """Of every method with every database, the last one a little slower."""
    return {
        database: [pace(m, int(share * sum(frames.values())), fps - 0.1 * n, p99_ms) for m in published.methods]
        for n, (database, frames) in enumerate(published.databases.items())
    }


def test_the_papers_databases_have_the_frames_that_they_state() -> None:
    assert {name: sum(frames.values()) for name, frames in LIU2011.databases.items()} == {
        "walking": 18_160,
        "boxing": 31_358,
        "jumping": 6_483,
        "golf": 2_339,
        "table_tennis": 7_582,
        "all together": 65_922,
    }
    assert KIM2012.databases["boxing"] == {"boxing": 7_233}
    assert set(LIU2011.paper_methods) <= set(LIU2011.methods)
    assert set(KIM2012.paper_methods) <= set(KIM2012.methods)


@pytest.mark.parametrize(("published", "claims"), [(LIU2011, 4), (KIM2012, 1)])
def test_the_slowest_database_decides(published: PublishedSpeed, claims: int) -> None:
    last = list(published.databases)[-1]
    fast = make_speed_experiment(published, paces(published, published.fps + 1.0), machine="this machine", real=False)
    slow = make_speed_experiment(published, paces(published, published.fps, 26.0), machine="this machine", real=False)
    assert len(fast.claims) == len(slow.claims) == claims
    rates = [[claim for claim in each.claims if claim.unit == "frames/s"] for each in (fast, slow)]
    assert {claim.verdict for claim in rates[0]} == {"reproduced"}
    assert {claim.verdict for claim in rates[1]} == {"not reproduced"}
    assert last in slow.claims[0].measured
    assert all("another machine" in claim.why for claim in rates[1])
    assert {claim.verdict for claim in fast.claims if claim.unit == "ms"} <= {"not comparable"}
    assert any("this machine" in difference for difference in fast.differences)


def test_a_smaller_database_is_not_comparable_and_none_not_run() -> None:
    small = make_speed_experiment(LIU2011, paces(LIU2011, 1_000.0, share=0.5), machine="this machine", real=False)
    assert {claim.verdict for claim in small.claims} == {"not comparable"}
    assert "walking 9,080 of 18,160" in small.claims[0].why
    none = make_speed_experiment(LIU2011, {}, machine="this machine", real=True, absent=["golf: there is none"])
    assert {claim.verdict for claim in none.claims} == {"not run"}
    assert "golf: there is none" in none.notes[-1]


def test_tables_and_bars_have_every_pace() -> None:
    told = make_speed_experiment(LIU2011, paces(LIU2011, 500.0), machine="this machine", real=False)
    (table,), (bars,) = told.tables, told.figures
    assert len(table.rows) == len(LIU2011.databases) * len(LIU2011.methods)
    assert all(len(row) == len(table.columns) for row in table.rows)
    assert isinstance(bars, BarChart)
    assert set(bars.series) == set(LIU2011.methods)
    assert {len(values) for values in (*bars.series.values(), *bars.published.values())} == {len(bars.groups)}


def test_a_speed_is_measured_once_and_its_database_given_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("harness.study.papers.published_speed.MAX_TEST_S", 3.2)
    study = PaperStudy(tmp_path, "builtin", 1, {})
    first = compare_speed(study, TINY)
    assert [claim.verdict for claim in first.claims] == ["reproduced"]
    assert "850" in first.tables[0].rows[0]
    assert {path.name for path in (tmp_path / "measured").iterdir()} == {"speed_golf.json"}

    def never(*_: object) -> list[MethodSpeed]:
        raise AssertionError("measured again")

    monkeypatch.setattr(module, "measure_speed", never)
    assert compare_speed(study, TINY) == first
    with pytest.raises(AssertionError, match="again"):
        compare_speed(study, replace(TINY, databases={"swings": {"golf": 850}}))


WORN = benchmark_clips.load_clean_scenario()


@pytest.fixture
def library(tmp_path: Path) -> PaperStudy:
    """Three walks of 3 s and more, two of them judged, and one swing of golf."""
    folder = tmp_path / "library"
    rows = ["path,subject,trial,behaviour,frames,fps"]
    for name, behaviour, frames in (
        ("91_01", "walking", 360),
        ("91_02", "walking", 480),
        ("92_01", "walking", 420),
        ("93_01", "golf", 360),
    ):
        motion = clip(frames, name=name)
        rng, time_s = generator(1, name), np.arange(frames)[:, None] / 120.0  # another motion in each clip
        rate_hz, phase_rad = rng.uniform(0.5, 2.0, (2, motion.angles_rad.shape[1]))
        write_clip(folder, replace(motion, angles_rad=0.2 * np.sin(2.0 * np.pi * rate_hz * time_s + phase_rad)))
        rows.append(f"{name[:2]}/{name}.amc,{name[:2]},{name[3:]},{behaviour},{frames},120")
    (folder / "manifest.csv").write_text("\n".join(rows) + "\n")
    motion_of = replace(WORN.motion, test=("91_01", "91_02@0.2-0.6"), behaviours=("walking",), examples=())
    golf = replace(WORN.motion, test=("93_01",), behaviours=("golf",), examples=())
    runs = {"walks": replace(WORN, motion=motion_of), "swings": replace(WORN, motion=golf)}
    (tmp_path / "study").mkdir()
    return PaperStudy(tmp_path / "study", "cmu", 1, runs, library=folder)


def test_built_in_frames_are_counted_by_behaviour(tmp_path: Path) -> None:
    study, frames = PaperStudy(tmp_path, "builtin", 1, {}), {"golf": 850, "boxing": 40}
    assert missing_clips(study, frames) == ""
    database, clips = build_speed_dataset(study, frames, WORN, tmp_path / "databases")
    counted = {b: sum(len(run) for run in database.segments if run.behaviour == b) for b in synthetic.BEHAVIOURS}
    assert {behaviour: count for behaviour, count in counted.items() if count} == frames
    assert len(clips) == 2
    assert not {trial.take for trial in clips} & {run.take for run in database.segments}
    assert len(clips[0].simulation.frames) == pytest.approx(MAX_TEST_S * benchmark_clips.RATE_HZ, abs=2)


def test_a_database_is_built_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = build_database(tmp_path, {"seed": 1}, lambda: benchmark_clips.make_take_factories(50, 1))
    asked: list[str] = []

    def takes() -> list[BodyMotion]:
        asked.append("again")
        return [benchmark_clips.generate_take(0, 1, frames=60)]

    again = build_database(tmp_path, {"seed": 1}, takes)
    np.testing.assert_array_equal(first.posture, again.posture)
    assert not asked
    assert len(build_database(tmp_path, {"seed": 2}, takes)) == 60
    monkeypatch.setattr("harness.study.papers.published_speed.source_hash", lambda: "edited")
    assert len(build_database(tmp_path, {"seed": 1}, takes)) == 60
    assert asked == ["again", "again"]


@pytest.mark.parametrize(("count", "lengths"), [(0, []), (5, [5]), (10, [10]), (15, [10, 5]), (99, [10, 20])])
def test_as_many_frames_as_there_are(count: int, lengths: list[int]) -> None:
    takes = [benchmark_clips.generate_take(which, 1, frames=frames) for which, frames in enumerate((10, 20))]
    assert [len(take) for take in truncate_motions(takes, count)] == lengths


def test_a_library_gives_what_it_has_and_keeps_the_longest_judged_clip(library: PaperStudy) -> None:
    assert list_test_clips(library) == {"walking": {"91_01", "91_02"}, "golf": {"93_01"}}
    database, clips = build_speed_dataset(library, {"walking": 10_000}, WORN, library.out / "databases")
    assert [trial.take for trial in clips] == ["91_02"]
    assert {run.take for run in database.segments} == {"91_01", "92_01"}
    assert len(database) == pytest.approx((360 + 420) / 3, abs=4)
    assert len(build_speed_dataset(library, {"walking": 70}, WORN, library.out / "databases")[0]) == 70
    assert len(list((library.out / "databases").iterdir())) == 2


def test_what_a_library_lacks_is_named(library: PaperStudy) -> None:
    assert missing_clips(library, {"walking": 5}) == ""
    assert "golf" in missing_clips(library, {"golf": 5})
    assert "table_tennis" in missing_clips(library, {"table_tennis": 5})
    together = {"walking": 5, "golf": 5, "table_tennis": 5_000}
    assert missing_clips(library, together) == ""
    database, clips = build_speed_dataset(library, together, WORN, library.out / "databases")
    assert {trial.take for trial in clips} == {"91_02", "93_01"}
    assert {run.take for run in database.segments} == {"91_01", "92_01"}
    assert isinstance(database, MotionDatabase)
