"""Pooled clips, paired verdicts and the list of clips that became worse, on planted errors."""

import pytest

from harness.bench.accuracy.conditions import COMPARED_METHODS
from harness.bench.accuracy.statements import compare_methods, find_worse_clips, pool_clips, rank_pooled
from tests.bench.accuracy.planted import errors


def test_known_and_new_performers_are_pooled_apart() -> None:
    known = pool_clips(errors(1.0), "default", "known")
    assert len(known) == 4 * 3
    assert not any("new_1" in clip or clip.startswith(("boxing_inputs", "recovery")) for clip in known)
    assert known["walking_known_2"] == pytest.approx(1.02)
    assert pool_clips(errors(1.0), "default", "new").keys().isdisjoint(known)


def test_the_verdict_of_every_statement() -> None:
    by_method = {"ours": errors(1.0), "ik": errors(2.0), "local_pca": errors(1.0), "kernel_cca": errors(0.5)}
    found = compare_methods("ours", by_method)
    assert len(found) == 2 * 3 * 3  # dynamic_map was not measured
    for statement in found:
        other, known = statement.more["other"], statement.more["performers"] == "known"
        holds = other == "ik" or (other == "local_pca" and not known)
        assert (statement.verdict, statement.target) == (
            "met" if holds else "missed",
            "better" if known else "not worse",
        )
        assert statement.value == pytest.approx({"ik": 1.0, "local_pca": 0.0, "kernel_cca": -0.5}[other])
        if other == "ik":
            assert statement.measured == "1.01 against 2.01 deg"


def test_too_few_clips_give_no_verdict() -> None:
    few = {"ours": errors(1.0, clips=1), "ik": errors(2.0, clips=1)}
    found = compare_methods("ours", few)
    assert {statement.verdict for statement in found} == {"no verdict"}
    assert all("too few units" in statement.why for statement in found)


def test_a_method_is_not_compared_with_itself() -> None:
    by_method = dict.fromkeys(COMPARED_METHODS, errors(1.0))
    assert {s.more["other"] for s in compare_methods("dynamic_map", by_method)} == {"local_pca", "kernel_cca", "ik"}
    assert {s.more["other"] for s in compare_methods("ours", {**by_method, "ours": errors(1.0)})} == set(
        COMPARED_METHODS
    )


def test_the_ranking_has_the_lowest_mean_first() -> None:
    rankings = rank_pooled({"ours": errors(1.0), "ik": errors(2.0), "local_pca": errors(1.5)})
    assert len(rankings) == 6
    for ranking in rankings.values():
        assert list(ranking.means) == ["ours", "local_pca", "ik"]
        assert ranking.best == "ours"


def test_only_more_than_5_percent_is_worse() -> None:
    place = ("walking, noise", "walking_new_0")
    ours = errors(1.0, changed={place: 1.0501})
    by_method = {"ours": ours, "dynamic_map": errors(1.0), "ik": errors(1.0, changed={place: 1.001})}
    (worse,) = find_worse_clips("ours", by_method, "stored", errors(1.2))
    assert [worse.more[key] for key in ("condition", "clip", "other")] == [*place, "dynamic_map"]
    assert worse.value == pytest.approx(1.0501)
    assert worse.verdict == "missed"
    by_method["ours"] = errors(1.0, changed={place: 1.0499})
    (largest,) = find_worse_clips("ours", by_method, "stored", errors(1.2))
    assert largest.value == pytest.approx(1.0499)
    assert largest.verdict == "met"
    assert "walking_new_0" in largest.reference


def test_stored_errors_and_other_conditions_count_and_the_largest_ratio_is_first() -> None:
    silent, mixed = "recovery_boxing, default, torso silent", "boxing_inputs, clean, mixed"
    changed = {(silent, "recovery_boxing_known_0"): 2.0, (mixed, "boxing_inputs_known_1"): 1.5}
    by_method = {name: errors(1.0, changed=changed) for name in ("ours", "dynamic_map", "ik")}
    found = find_worse_clips("ours", by_method, "stored", errors(1.0))
    assert [(w.more["condition"], w.more["other"]) for w in found] == [(silent, "stored"), (mixed, "stored")]
    assert found[0].reference.startswith("4.00 and")  # while the station is silent: twice the others


def test_the_method_itself_sets_no_limit_of_today() -> None:
    by_method = {"dynamic_map": errors(1.0), "ik": errors(2.0)}
    (largest,) = find_worse_clips("dynamic_map", by_method, "stored", errors(1.0))
    assert (largest.verdict, largest.value) == ("met", 1.0)
    assert len(find_worse_clips("dynamic_map", by_method, "stored", errors(0.5))) == sum(map(len, errors(1.0).values()))
