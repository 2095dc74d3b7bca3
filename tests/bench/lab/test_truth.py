"""Rows of the truth table of a lab's verbs, from outcomes that are known."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from harness.bench.lab import truth
from harness.bench.lab.captures import NO_FAULT, NO_FAULTS, PLANTED_FAULTS, STATION, needed_captures, planted_numbers
from harness.bench.lab.outcomes import CaptureOutcome, StoredCheck, StoredNumber
from harness.bench.lab.truth import KINDS, coverage_rows, fault_row, fault_rows
from harness.bench.lab.validated_captures import PROMISES, registration_rows
from harness.study.trust.characterization import preset_values


def _check(key: str, value: float, station: str = "", *, half: float = 0.0, named: bool = True) -> StoredCheck:
    return StoredCheck(key, value, value - half, value + half, station, 0.0, 1e-6 if named else 1.0, named)


def _found(kind: str, seed: int = 1) -> CaptureOutcome:
    """The outcome in which a fault is found exactly."""
    checks = tuple(_check(one.key, one.value, one.station) for one in planted_numbers(kind, seed))
    return CaptureOutcome(kind, seed, "", checks, exchanged=PLANTED_FAULTS[kind].exchanged)


@pytest.mark.parametrize(("count", "needed"), [(100, 95), (20, 19), (1, 1), (10, 10), (3, 3)])
def test_needed_captures(count: int, needed: int) -> None:
    assert needed_captures(count) == needed


def test_every_kind_is_met_when_all_is_found_and_missed_when_nothing_is() -> None:
    seeds = (1, 2)
    rows = fault_rows(seeds, {(kind, seed): _found(kind, seed) for kind in KINDS for seed in seeds})
    assert len(rows) == len(KINDS) == 14
    assert all(row.verdict == "met" for row in rows)
    assert not any(row.why for row in rows)
    nothing = {(kind, seed): CaptureOutcome(kind, seed, "") for kind in KINDS for seed in seeds}
    assert [row.verdict == "met" for row in fault_rows(seeds, nothing)] == [kind in NO_FAULTS for kind in KINDS]


def test_a_size_may_be_near_or_within_its_interval() -> None:
    def met(value: float, half: float, named: bool = True) -> bool:
        check = _check("components.clock.drift_ppm", value, half=half, named=named)
        return fault_row("clock", [CaptureOutcome("clock", 1, "", (check,))]).verdict == "met"

    assert all(met(*found) for found in [(80.0, 0.0), (95.0, 0.0), (65.0, 0.0), (120.0, 41.0)])
    assert not met(97.0, 10.0)
    assert not met(80.0, 0.0, named=False)


def test_the_size_of_a_change_is_that_beside_the_earlier_number() -> None:
    (number,) = planted_numbers("scale", 3)
    earlier = 0.02
    for measured, met in ((number.value + earlier, True), (number.value, False)):
        check = replace(_check("scale", measured), expected=earlier)
        assert fault_row("scale", [CaptureOutcome("scale", 3, "", (check,))]).verdict == ("met" if met else "missed")


def test_named_and_sized_must_hold_of_one_capture() -> None:
    unnamed = replace(_found("clock"), checks=(_check("components.clock.drift_ppm", 80.0, named=False),))
    wrong = replace(_found("clock"), checks=(_check("components.clock.drift_ppm", 300.0),))
    row = fault_row("clock", [_found("clock")] * 93 + [unnamed] * 3 + [wrong] * 4)
    assert row.measured == "named in 97, its size in 96, both in 93"
    assert row.verdict == "missed"
    assert fault_row("clock", [_found("clock")] * 95 + [wrong] * 5).verdict == "met"


def test_a_fault_of_one_station_is_not_found_at_another() -> None:
    (check,) = _found("lost").checks
    assert check.station == STATION
    assert fault_row("lost", [replace(_found("lost"), checks=(replace(check, station="head"),))]).verdict == "missed"


def test_what_else_is_named_and_what_is_refused_is_told() -> None:
    other = _check("scale", 0.1)
    row = fault_row(
        NO_FAULT, [replace(_found(NO_FAULT), checks=(other,)), CaptureOutcome(NO_FAULT, 2, "", failure="No")]
    )
    assert row.measured == "in 0"
    assert row.why == "named: scale in 1; refused in 1: No"
    row = fault_row("clock", [replace(_found("clock"), checks=(*_found("clock").checks, other))])
    assert row.verdict == "met"
    assert row.why == "also named: scale in 1"


def test_exchanged_stations_must_be_the_planted_ones() -> None:
    assert fault_row("exchanged", [replace(_found("exchanged"), exchanged=("head: thorax",))]).verdict == "missed"
    row = fault_row("latency", [replace(_found("latency"), exchanged=("head: thorax",))])
    assert "exchanged stations (head: thorax) in 1" in row.why
    assert (
        fault_row("none_validated", [replace(_found("none_validated"), exchanged=("head: thorax",))]).verdict
        == "missed"
    )


def test_coverage_has_two_sides() -> None:
    key = "components.white.position_m"
    true = preset_values()[key].value

    def outcome(covers: bool) -> CaptureOutcome:
        low = 0.9 * true if covers else 1.1 * true
        return CaptureOutcome(NO_FAULT, 1, "", parameters=(StoredNumber(key, low, low, 2.0 * true),))

    def met(covered: int) -> bool:
        (row,) = coverage_rows([outcome(i < covered) for i in range(200)])
        return row.verdict == "met"

    assert [met(count) for count in (179, 180, 190, 198, 199)] == [False, True, True, True, False]
    (row,) = coverage_rows([outcome(True), CaptureOutcome(NO_FAULT, 2, "")])
    assert row.why == "not measured in 1 of 2"


def test_registration_is_held_to_its_promises() -> None:
    exact = dict.fromkeys(PROMISES, 0.0)
    assert all(row.verdict == "met" for row in registration_rows([exact] * 20, 20))
    assert {row.verdict for row in registration_rows([exact] * 18, 20)} == {"missed"}
    off = registration_rows([exact | {"mounts_m": 0.003}] * 2, 2)
    assert [row.verdict for row in off].count("missed") == 1
    assert off[1].why == "largest 3 mm"


def test_constants_are_not_chosen_on_the_seeds_of_the_table() -> None:
    """Whoever chooses constants of the estimators uses seeds from 1001 on."""
    assert max(truth.SEEDS) + len(truth.SEEDS) < 1001
    assert math.isclose(len(truth.SEEDS), 100)


@pytest.mark.long
def test_registration_of_a_capture_is_as_promised(tmp_path: Path) -> None:
    from harness.bench.lab.validated_captures import registration_errors, validate_planted

    errors = registration_errors(validate_planted("none_validated", 1001, tmp_path), 1001)
    assert all(row.verdict == "met" for row in registration_rows([errors], 1))
    assert all(value > 0.0 for value in errors.values())
    assert all(row.verdict == "missed" for row in registration_rows([dict.fromkeys(errors, 1000.0)], 1))
