"""Which cells pair, which names of differing inputs are told, and what two cells of one name are."""

from dataclasses import replace
from typing import Any

import pytest

from harness.compare.matching import PAIRING_KEYS, RELAXABLE_KEYS, inputs_that_differ, pair_cells
from harness.errors import BadInput, UnknownName
from harness.results import ResultSet
from tests.compare.sides import cell, manifest, side

OTHER: dict[str, Any] = {
    "scenario": "other",
    "clip": "walk_77",
    "seed": 2,
    "method": "mean_pose",
    "inputs": "pos",
    "split": "block",
    "noise": "clean",
    "varied": {"noise": "clean"},
}


def of(*cells: Any, title: str = "A") -> ResultSet:
    return ResultSet(title, manifest(), cells, len(cells))


@pytest.mark.parametrize("name", PAIRING_KEYS)
def test_cells_pair_on_each_name(name: str) -> None:
    a, b = of(cell(), cell("walk_02")), of(replace(cell(), **{name: OTHER[name]}), cell("walk_02"))
    found = pair_cells(a, b, None, ())
    assert [(mine.clip, theirs.clip) for mine, theirs in found.pairs] == [("walk_02", "walk_02")]
    assert (found.only_a, found.only_b) == (a.cells[:1], b.cells[:1])
    assert pair_cells(a, a, None, ()).pairs == tuple((c, c) for c in a.cells)


@pytest.mark.parametrize("name", RELAXABLE_KEYS)
def test_cells_pair_across_what_is_loosened(name: str) -> None:
    a, b = of(cell()), of(replace(cell(), **{name: OTHER[name]}))
    assert not pair_cells(a, b, None, ()).pairs
    assert len(pair_cells(a, b, None, (name,)).pairs) == 1


def test_order_is_that_of_the_reference() -> None:
    cells = [cell(f"walk_{n}") for n in range(4)]
    found = pair_cells(of(*cells), of(*reversed(cells)), None, ())
    assert [mine.clip for mine, _ in found.pairs] == [c.clip for c in cells]


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"scenario": "other"}, "scenario: demo against other"),
        ({"seed": 2}, "seed: 1 against 2"),
        ({"varied": {"worn": ["head", "torso"]}}, "varied: nothing against worn=head+torso"),
        ({"noise": "clean", "inputs": "pos"}, "inputs: pos+ori against pos; noise: default against clean"),
    ],
)
def test_what_keeps_all_cells_apart_is_named(changes: dict[str, Any], why: str) -> None:
    assert pair_cells(side(clips=3), side(clips=3, **changes), None, ()).why_none == why


def test_cells_that_cannot_be_told_apart_are_refused() -> None:
    with pytest.raises(BadInput, match=r"B has ik on walk_01 \(demo, seed 1\) twice"):
        pair_cells(of(cell()), of(cell(), cell(), title="B"), None, ())
    two = of(cell(), cell(seed=2))
    assert len(pair_cells(two, two, None, ()).pairs) == 2
    with pytest.raises(BadInput, match="twice"):
        pair_cells(two, two, None, ("seed",))


def test_two_methods_pair_whatever_they_are_called() -> None:
    run = side(methods={"ik": 1.0, "mean_pose": 2.0}, clips=3)
    found = pair_cells(run, run, ("ik", "mean_pose"), ())
    assert [(a.method, b.method, a.clip == b.clip) for a, b in found.pairs] == [("ik", "mean_pose", True)] * 3
    with pytest.raises(UnknownName, match=r"no method in A called 'ki'.*ik, mean_pose"):
        pair_cells(run, run, ("ki", "ik"), ())


def test_a_method_that_learns_nothing_pairs_with_any_protocol() -> None:
    nothing, learns = cell(method="ik:previous", split="none"), cell(method="ik")
    run = of(nothing, learns)
    (pair,) = pair_cells(run, run, ("ik:previous", "ik"), ()).pairs
    assert inputs_that_differ([pair], ["mpjpe_mm"]) == {}
    assert not pair_cells(of(nothing), of(replace(nothing, split="sequence")), None, ()).pairs
    block = replace(learns, split="block", method="mean_pose")
    assert not pair_cells(of(learns), of(block), ("ik", "mean_pose"), ()).pairs


def differing(changes: dict[str, Any], metrics: tuple[str, ...] = ("mpjpe_mm",), clips: int = 3) -> list[str]:
    a, b = side(clips=clips), side(clips=clips, defined_by=changes)
    return list(inputs_that_differ(pair_cells(a, b, None, ()).pairs, metrics).values())


@pytest.mark.parametrize(
    ("changes", "texts"),
    [
        ({}, []),
        ({"tracker": {"rate_hz": 60.0, "items": [40, 2]}}, ["tracker.rate_hz: 40 against 60"]),
        ({"tracker": {"rate_hz": 40.0 + 1e-9, "items": [40, 2]}}, ["tracker.rate_hz: 40.0 against 40.000000001"]),
        ({"tracker": {"rate_hz": 40.0, "items": []}}, ["tracker.items: 40, 2 against none"]),
        ({"profile": "worn out"}, ["profile: none against worn out"]),
        ({"profile": None}, []),  # what an older version did not know yet is as none
        ({"metric_versions": {"mpjpe_mm": 2}}, ["metric_versions.mpjpe_mm: 1 against 2"]),
        ({"examples": {"walk_0": "digest 0"}}, [f"examples.walk_{n}: digest {n} against none" for n in range(1, 6)]),
    ],
)
def test_inputs_that_differ_are_named(changes: dict[str, Any], texts: list[str]) -> None:
    assert differing(changes) == texts


def test_versions_of_metrics_that_are_not_compared_do_not_matter() -> None:
    changed = {"metric_versions": {**cell().defined_by["metric_versions"], "jitter_m_s3": 2}}
    assert differing(changed) == []
    assert differing(changed, ("mpjpe_mm", "jitter_m_s3")) == ["metric_versions.jitter_m_s3: 1 against 2"]


def test_inputs_that_differ_in_some_pairs_or_differently_in_each_say_so() -> None:
    a = side(clips=4, defined_by={"motion_digest": "0" * 40})
    b = replace(a, cells=(replace(a.cells[0], defined_by={**a.cells[0].defined_by, "seed": 7}), *a.cells[1:]))
    (text,) = inputs_that_differ(pair_cells(a, b, None, ()).pairs, ()).values()
    assert text == "seed: 1 against 7 (1 of 4 pairs)"
    each = [replace(c, defined_by={**c.defined_by, "motion_digest": f"{n}" * 8}) for n, c in enumerate(a.cells)]
    (text,) = inputs_that_differ(pair_cells(a, replace(a, cells=tuple(each)), None, ()).pairs, ()).values()
    assert text == "motion_digest: 00000000000000000000000… against 00000000 on walk_00"
