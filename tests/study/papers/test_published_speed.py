"""The papers' speeds: databases of exactly their frames, verdicts by the slowest, and nothing measured twice."""

from dataclasses import replace
from pathlib import Path

import pytest

from harness.experiment.round_robin_timing import MethodSpeed
from harness.results.findings import BarChart
from harness.study.papers import published_speed as module
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.published_speed import KIM2012, LIU2011, PublishedSpeed, compare_speed, make_speed_experiment

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
    monkeypatch.setattr("harness.study.papers.speed_dataset.MAX_TEST_S", 3.2)
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
