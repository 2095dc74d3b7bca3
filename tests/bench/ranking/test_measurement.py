"""What the comparison of rankings runs on both sides, what it makes of the cells, and its text."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from harness.bench.ranking.agreement import compare_rankings
from harness.bench.ranking.measurement import (
    BEHAVIOURS,
    MOST_BUILTIN,
    RankingReport,
    measure_rankings,
    plan_rankings,
    rank_rows,
    station_sets,
)
from harness.bench.ranking.text import format_rankings, rankings_content
from harness.core.split import performer_of
from harness.errors import Outcome
from harness.experiment.scenarios import Scenario
from harness.experiment.workers import run_in_process
from harness.results import PRIMARY_METRIC
from tests.command import Command


def test_the_sides_differ_in_the_motion_alone() -> None:
    planned = plan_rankings()
    assert len(planned) == 4 * len(BEHAVIOURS)
    for kind in ("methods", "places"):
        for behaviour in BEHAVIOURS:
            builtin, real = (s for s in planned if s.name.startswith(f"{behaviour}_{kind}"))
            assert (builtin.motion.source, real.motion.source) == ("builtin", "cmu")
            same = replace(real, name=builtin.name, motion=builtin.motion)
            assert same.content() == builtin.content()
            shared = ("source", "rate_hz", "test", "examples")
            assert replace(real.motion, **{k: getattr(builtin.motion, k) for k in shared}) == builtin.motion


def test_a_clip_of_each_performer_is_tested_and_nobody_learns_from_himself() -> None:
    for scenario in plan_rankings():
        performers = [performer_of(clip.partition("@")[0]) for clip in scenario.motion.test]
        assert None not in performers
        assert len(set(performers)) == len(performers)
        assert len(performers) <= (MOST_BUILTIN if scenario.motion.source == "builtin" else 13)
        assert scenario.motion.split == "subject"


def test_a_set_has_a_pair_on_limbs_and_one_more_station() -> None:
    sets = station_sets()
    assert len(sets) == len({frozenset(stations) for stations in sets.values()}) == 12
    assert sets["upper arms + head"] == ("left_upper_arm", "right_upper_arm", "head")
    (scenario, *_) = (s for s in plan_rankings() if "_places_" in s.name)
    assert {name for stations in sets.values() for name in stations} <= set(scenario.stations)


def planted_rows(scenarios: list[Scenario], missing: tuple[str, str] = ("", "")) -> Iterator[dict[str, Any]]:
    """Rows of every planned cell but those of a (method, clip): each item errs by its place in the list."""
    for scenario in scenarios:
        for n, stations in enumerate(scenario.vary.get("worn", [list(scenario.worn)])):
            for m, method in enumerate(scenario.methods):
                for k, clip in enumerate(scenario.motion.test):
                    if (method, clip) != missing:
                        error = 1.0 + n + m + 0.01 * k * (1 + (n + m) % 2)
                        row = {"scenario": scenario.name, "method": method, "clip": clip, "stations": stations}
                        yield {**row, PRIMARY_METRIC: error}


def test_rows_become_rankings_by_behaviour() -> None:
    planned = plan_rankings()
    found = rank_rows(planted_rows(planned), planned)
    kinds = ("methods", "sets of three", "limb pairs", "third stations")
    assert set(found) == {(behaviour, kind) for behaviour in BEHAVIOURS for kind in kinds}
    assert found["walking", "methods"].tau == found["boxing", "sets of three"].tau == 1.0
    assert list(found["walking", "sets of three"].means) == list(station_sets())
    assert list(found["walking", "limb pairs"].means) == ["hands", "ankles", "upper arms", "thighs"]
    assert list(found["walking", "third stations"].means) == ["pelvis", "torso", "head"]
    sets = found["jumping", "sets of three"].means
    hands = [sets[f"hands + {place}"][1] for place in ("pelvis", "torso", "head")]
    assert found["jumping", "limb pairs"].means["hands"][1] == pytest.approx(sum(hands) / 3)
    assert (found["walking", "methods"].low, found["boxing", "methods"].low) == (1.0, None)


def test_the_statement_on_boxing_says_that_five_performers_are_too_few() -> None:
    planned = plan_rankings()
    text = format_rankings(RankingReport(rank_rows(planted_rows(planned), planned)))
    why = "too few units: 5 real performers, of at least 6"
    assert f"boxing, methods: Kendall's tau 1, without an interval ({why}). No pair can be told. ik has" in text


def test_a_failed_cell_leaves_its_method_out_and_makes_the_outcome_incomplete() -> None:
    planned = plan_rankings()
    found = rank_rows(planted_rows(planned, ("local_pca", "16_16")), planned)
    report = RankingReport(found, {"walking_methods_cmu: 16_16 local_pca": "Traceback\nValueError: singular"})
    assert report.outcome is Outcome.INCOMPLETE
    text = format_rankings(report)
    assert "left out: local_pca, not measured on real motion of 16" in text
    assert "FAILED walking_methods_cmu: 16_16 local_pca: ValueError: singular" in text
    assert "local_pca" in found["jumping", "methods"].means


def test_a_set_that_failed_leaves_out_its_places() -> None:
    planned = plan_rankings()
    failed = ("right_ankle", "left_ankle", "torso")
    rows = [row for row in planted_rows(planned) if set(row["stations"]) != set(failed) or row["clip"] != "02_04"]
    found = rank_rows(rows, planned)
    assert set(found["jumping", "sets of three"].left_out) == {"ankles + torso"}
    assert set(found["jumping", "limb pairs"].left_out) == {"ankles"}
    assert set(found["jumping", "third stations"].left_out) == {"torso"}
    assert not found["walking", "sets of three"].left_out


def test_the_text_names_units_pairs_and_what_would_be_enough() -> None:
    def side(*means: float) -> dict[str, dict[str, float | None]]:
        offsets = (0.1, -0.2, 0.15, 0.0, -0.05, 0.12, -0.12)
        return {
            item: {f"{k}": mean + sign * offset for k, offset in enumerate(offsets)}
            for item, mean, sign in zip("abc", means, (1, -1, 1), strict=True)
        }

    ranking = compare_rankings(side(1.0, 2.0, 2.1), side(2.0, 1.0, 2.1))
    report = RankingReport({("walking", "methods"): ranking})
    text = format_rankings(report)
    rows = [" ".join(line.split()) for line in text.splitlines()]
    assert rows[2:6] == [
        "joint angle [deg] built-in rank real rank",
        "a 1.00 1 2.00 2",
        "b 2.00 2 1.00 1",
        "c 2.10 3 2.10 3",
    ]
    assert rows[8:10] == [
        "a, b reversed −1.00 −1.24 to −0.76 +1.00 +0.76 to +1.24 < 0.001 6",
        "a, c agree −1.1 −1.1 to −1.1 −0.1 −0.1 to −0.1 < 0.001 6",
    ]
    numbers, why = (
        "−0.10 −0.34 to +0.14 −1.10 −1.34 to −0.86 0.177 35",
        "no significant difference on the built-in side",
    )
    assert rows[10] == f"b, c cannot tell {numbers} {why}"
    tau, reversed_pair = "Kendall's tau 0.33 (−0.33 to 0.33), 7 built-in and 7 real performers", "a than b"
    counts = "Of 3 pairs: 1 agree, 1 reversed, 1 cannot be told."
    better = f"Better on built-in motion and worse on real motion: {reversed_pair}."
    cost = "On real motion a, best on built-in motion, errs 1.00 deg more than b, best there."
    assert rows[-1] == f"walking, methods: {tau}. {counts} {better} {cost}"
    (content,) = rankings_content(report)["rankings"]
    assert (content["behaviour"], content["pairs"][0]["verdict"]) == ("walking", "contradict")


@pytest.mark.parametrize("words", [["ik"], ["--large"], ["--seed", "2"], ["--method", "ik"], ["--seeds", "2"]])
def test_other_words_are_refused(words: list[str], command: Command) -> None:
    said = command("bench", "ranking", *words, code=2).err
    assert ("ranking runs alone" if words == ["ik"] else f"{words[0]} with ranking") in said


def test_without_real_motion_it_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command) -> None:
    monkeypatch.delenv("HARNESS_MOCAP", raising=False)
    assert "--mocap" in command("bench", "ranking", "--quick", "--out", tmp_path / "out", code=2).err
    assert not (tmp_path / "out").exists()


@pytest.mark.long
def test_cells_are_run_and_ranked(tmp_path: Path) -> None:
    """With other built-in performers in place of real ones."""
    planned = []
    for scenario in plan_rankings(quick=True)[::2]:
        performers = ("p1", "p2") if scenario.motion.source == "builtin" else ("p3", "p4")
        takes = tuple(f"walking_{performer}_01" for performer in performers)
        motion = replace(scenario.motion, source="builtin", rate_hz=0.0, test=takes, examples=takes)
        planned.append(replace(scenario, motion=motion, methods=("ik", "mean_pose")))
    report = measure_rankings(planned, tmp_path / "out", executor=run_in_process)
    assert report.outcome is Outcome.PASS
    (ranking,) = report.rankings.values()
    assert (ranking.builtin, ranking.real) == (("p1", "p2"), ("p3", "p4"))
    assert next(iter(ranking.means)) == "ik"
    again = measure_rankings(planned, tmp_path / "out", executor=run_in_process)
    assert again.rankings == report.rankings
