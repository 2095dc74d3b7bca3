"""A placement study's findings survive their file, and a damaged file is refused with the reason."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from harness.errors import BadFile
from harness.results.findings.advice import (
    HalvingRound,
    PlacementAdvice,
    SecondChoice,
    SecondMethod,
    SetError,
    SizeStep,
)
from harness.results.findings.placement_findings import PlacementFindings, read_placement, write_placement
from tests.results.rewrite import read_json, write_json

Damage = Callable[[dict[str, Any]], Any]


def test_findings_come_back_as_they_were_written(tmp_path: Path, placement: PlacementFindings) -> None:
    findings, path = placement, tmp_path / "findings.json"
    write_placement(path, findings)
    assert read_placement(path) == findings
    first = path.read_bytes()
    write_placement(path, read_placement(path))
    assert path.read_bytes() == first


def test_an_advice_comes_back_with_its_file_and_names_candidates_alone(
    tmp_path: Path, placement: PlacementFindings
) -> None:
    best, path = SetError(("pelvis",), 4.0, 3.5, 4.5, 32, 1.0), tmp_path / "findings.json"
    given = replace(
        placement,
        effort="quick",
        split="new",
        base=("pelvis",),
        station_costs={"pelvis": 1.0, "left_hand": 2.0},
        rounds=(HalvingRound(1, 3, 4, 2),),
        advice=PlacementAdvice(best, "smallest", (("left_hand",),), 3),
        size_steps=(SizeStep(("pelvis",), ("left_hand", "pelvis"), 0.5, 0.1, 0.9, 0.01, 32, "better"),),
        front=(best,),
        second=SecondMethod("ik", (SecondChoice(("pelvis",), ("left_hand",), 0.5, worse=True),), (best,)),
    )
    write_placement(path, given)
    assert read_placement(path) == given
    for damaged in (
        replace(given, base=("nose",)),
        replace(given, station_costs={"nose": 1.0}),
        replace(given, advice=PlacementAdvice(replace(best, stations=("nose",)), "only")),
        replace(given, front=(replace(best, stations=("nose",)),)),
        replace(given, size_steps=(SizeStep(("nose",), ("pelvis",), None),)),
        replace(given, second=SecondMethod("ik", (SecondChoice(("pelvis",), ("nose",), None),))),
    ):
        write_placement(path, damaged)
        with pytest.raises(BadFile, match="nose"):
            read_placement(path)


def test_a_paper_is_no_placement(tmp_path: Path) -> None:
    path = tmp_path / "findings.json"
    write_json(path, {"paper": "liu2011", "schema": 1})
    with pytest.raises(BadFile, match="no key in findings called 'paper'"):
        read_placement(path)


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda c: c.update(schema=2), "schema 2"),
        (lambda c: c.pop("tried"), "missing tried"),
        (lambda c: c.update(surprise=1), "surprise"),
        (lambda c: c["tried"][0].update(mean="low"), r"tried\[0\].mean"),
        (lambda c: c["rankings"][0].update(mode="guess"), "guess"),
        (lambda c: c["best"][0].update(stations=["left_elbow"]), "left_elbow"),
        (lambda c: c["contributions"][0].update(candidate="nose"), "nose"),
    ],
)
def test_damage_is_named(placement: PlacementFindings, tmp_path: Path, damage: Damage, said: str) -> None:
    path = tmp_path / "findings.json"
    write_placement(path, placement)
    content = read_json(path)
    damage(content)
    write_json(path, content)
    with pytest.raises(BadFile, match=said):
        read_placement(path)


@pytest.mark.parametrize("other", [{"placement": "another"}, {"seed": 99}, {"motion": "cmu"}])
def test_findings_of_another_study_are_refused(
    placement: PlacementFindings, tmp_path: Path, other: dict[str, str | int]
) -> None:
    findings, path = placement, tmp_path / "findings.json"
    identity = {"placement": findings.name, "motion": findings.motion, "seed": findings.seed}
    write_placement(path, findings)
    write_json(tmp_path / "study.json", identity)
    assert read_placement(path) == findings
    write_json(tmp_path / "study.json", {**identity, **other})
    with pytest.raises(BadFile, match=r"as study\.json says, of"):
        read_placement(path)
