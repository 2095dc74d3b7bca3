"""Outcomes of planted captures: stored once, used again, and the same bytes however many processes find them."""

import shutil
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import pytest

from harness.bench.lab import outcomes
from harness.bench.lab.captures import STATION
from harness.bench.lab.outcomes import CaptureOutcome, StoredCheck, StoredNumber, collect_outcomes, outcome_path
from harness.errors import BadFile, BadInput
from harness.experiment.workers import process_executor, run_in_process
from harness.results import source_hash

R = TypeVar("R")
TASKS = [("clock", 1), ("none", 1), ("clock", 2)]


def _no_progress(step: str, done: int, planned: int) -> None:
    pass


def _outcome(kind: str, seed: int, folder: Path) -> CaptureOutcome:
    check = StoredCheck("components.white.position_m", 0.1 * seed, 0.0, None, STATION, 0.3, 1e-9, True)
    return CaptureOutcome(kind, seed, source_hash(), (check,), (StoredNumber("a", 1.0, 0.5, 2.0),))


def _refuse(function: Callable[..., R], tasks: Sequence[tuple[Any, ...]]) -> Generator[tuple[int, Future[R]]]:
    assert not tasks
    yield from ()


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outcomes, "_analyse", _outcome)


@pytest.mark.usefixtures("quick")
def test_outcomes_are_stored_and_read_again(tmp_path: Path) -> None:
    seen: list[tuple[str, int, int]] = []
    found = collect_outcomes(TASKS, tmp_path, run_in_process, lambda *step: seen.append(step))
    assert list(found) == TASKS
    assert [step[1:] for step in seen] == [(1, 3), (2, 3), (3, 3)]
    again = collect_outcomes(TASKS, tmp_path, _refuse, _no_progress)
    assert again == found
    assert again["clock", 2].checks[0].value == 0.2
    assert again["clock", 2].checks[0].contains(1e9)
    assert not again["clock", 2].checks[0].contains(-1e9)


@pytest.mark.usefixtures("quick")
def test_outcomes_of_other_source_and_missing_ones_are_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    collect_outcomes(TASKS, tmp_path, run_in_process, _no_progress)
    outcome_path(tmp_path, "none", 1).unlink()
    computed: list[str] = []
    collect_outcomes(TASKS, tmp_path, run_in_process, lambda name, *_: computed.append(name))
    assert computed == ["none 1"]
    monkeypatch.setattr(outcomes, "source_hash", lambda: "another")
    collect_outcomes(TASKS, tmp_path, run_in_process, lambda name, *_: computed.append(name))
    assert computed[1:] == ["clock 1", "none 1", "clock 2"]


@pytest.mark.usefixtures("quick")
def test_a_damaged_outcome_is_named(tmp_path: Path) -> None:
    collect_outcomes(TASKS, tmp_path, run_in_process, _no_progress)
    path = outcome_path(tmp_path, "clock", 2)
    path.write_text(path.read_text().replace("0.2", "0.3"))
    with pytest.raises(BadFile, match=r"0002\.json"):
        collect_outcomes(TASKS, tmp_path, run_in_process, _no_progress)


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("other", [("none", 1), ("clock", 2)])
def test_an_outcome_in_the_place_of_another_is_refused(tmp_path: Path, other: tuple[str, int]) -> None:
    collect_outcomes(TASKS, tmp_path, run_in_process, _no_progress)
    shutil.copy(outcome_path(tmp_path, *other), outcome_path(tmp_path, "clock", 1))
    with pytest.raises(BadFile, match=f"0001.json: of {other[0]}/000{other[1]}; expected .*, of clock/0001"):
        collect_outcomes(TASKS, tmp_path, _refuse, _no_progress)


def test_a_capture_that_is_refused_is_an_outcome(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(kind: str, seed: int, folder: Path) -> CaptureOutcome:
        raise BadInput(f"{folder}/none.rec has no rest.", "Let it lie.")

    monkeypatch.setattr(outcomes, "_analyse", refuse)
    found = collect_outcomes([("none", 1)], tmp_path, run_in_process, _no_progress)["none", 1]
    assert found.failure.startswith("FOLDER/none.rec has no rest.")
    assert not found.names_nothing
    assert replace(found, failure="").names_nothing


@pytest.mark.long
def test_one_process_and_two_store_the_same_bytes(tmp_path: Path) -> None:
    tasks = [("clock", 1001), ("latency", 1001)]
    for jobs, found in ((1, tasks[:1]), (2, tasks)):
        with process_executor(jobs) as executor:
            collect_outcomes(found, tmp_path / str(jobs), executor, _no_progress)
    one, two = (outcome_path(tmp_path / str(jobs), *tasks[0]).read_bytes() for jobs in (1, 2))
    assert one == two
    assert b'"failure": ""' in one
