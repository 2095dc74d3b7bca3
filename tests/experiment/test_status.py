"""How far work is: while it goes on, after it was stopped, and when it is done."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from harness.cli import main
from harness.errors import BadFile
from harness.experiment.status import read_status
from harness.results import CellIndex, as_row, select_cells
from harness.results.files import folder_lock
from tests.planted import Plan, planted_run

PLAN = Plan(behaviours=("walking",), methods={"ik": 1.5, "mean_pose": 14.0}, takes=2, duration_s=1.5)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four cells."""
    return planted_run(tmp_path_factory.mktemp("status") / "run", PLAN)


@pytest.fixture
def run(made: Path, tmp_path: Path) -> Path:
    """As `harness run` leaves it when it was stopped: four cells of eight."""
    out = tmp_path / "run"
    shutil.copytree(made, out)
    with CellIndex(out) as found:
        found.expect([f"to come {n}" for n in range(4)])
    return out


def index(source: Path, out: Path, count: int, planned: int, **facts: Any) -> None:
    """A folder with some cells of a run, and an index that plans more."""
    out.mkdir(exist_ok=True)
    rows = [as_row(cell) for cell in select_cells(source)][:count]
    for row in rows:
        shutil.copytree(source / "cells" / row["key"], out / "cells" / row["key"])
    with CellIndex(out) as found:
        found.expect([f"cell {n}" for n in range(planned)])
        found.add(rows)
        found.record_outcomes((f"cell {n}", row["key"], "") for n, row in enumerate(rows))
        found.record_outcomes([(f"cell {planned - 1}", "", "Traceback\nValueError: on purpose")])
        found.note(kind="sweep", name="tiny", command="harness sweep tiny", **facts)


def test_a_sweep_is_counted_and_its_pace_tells_what_is_left(made: Path, tmp_path: Path) -> None:
    out = tmp_path / "sweep"
    index(made, out, 3, 10, started_s=1000.0, seen_s=1030.0, made=3)
    (out / "cells" / "finished_but_not_in_the_index").mkdir(parents=True)
    (out / "cells" / ".unfinished-1-abc").mkdir()
    found = read_status(out)
    assert (found.kind, found.name, found.planned, found.finished) == ("sweep", "tiny", 10, 4)
    assert found.failures == {"cell 9": "Traceback\nValueError: on purpose"}
    assert not found.running
    assert found.left_s == pytest.approx(30.0 / 3 * 5)
    with folder_lock(out):
        assert read_status(out).running


def test_the_verb_says_it(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "sweep"
    index(made, out, 3, 4, started_s=1000.0, seen_s=1030.0, made=3)
    assert main(["status", str(out)]) == 4
    assert capsys.readouterr().out.splitlines() == [
        "sweep tiny: finished, 3 of 4 cells finished, 1 failed",
        "FAILED cell 3: ValueError: on purpose",
        "one of them again: harness sweep tiny --cell 'cell 3'",
        "incomplete",
    ]
    assert main(["status", str(out), "--json"]) == 4
    said = json.loads(capsys.readouterr().out)
    assert (said["cells_planned"], said["cells_finished"], said["cells_failed"]) == (4, 3, 1)
    assert (said["running"], said["left_s"], said["outcome"]) == (False, None, "incomplete")


def test_a_run_is_counted_like_a_sweep(run: Path, made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = read_status(made)
    assert (found.kind, found.planned, found.finished, found.running) == ("run", 4, 4, False)
    assert main(["status", str(made)]) == 0
    found = read_status(run)
    assert (found.planned, found.finished, found.failures) == (8, 4, {})
    with folder_lock(run):
        assert read_status(run).running
    capsys.readouterr()
    assert main(["status", str(run)]) == 4
    assert "run run: not running, 4 of 8 cells finished, 0 failed" in capsys.readouterr().out


def test_a_paper_is_all_its_runs(run: Path, made: Path) -> None:
    shutil.copytree(made, run.parent / "another")
    found = read_status(run.parent)
    assert (found.kind, found.planned, found.finished) == ("paper", 12, 8)


def test_a_run_without_an_index_is_refused_with_advice(run: Path) -> None:
    for file in run.glob("index.sqlite*"):
        file.unlink()
    with pytest.raises(BadFile, match=r"index\.sqlite.*Give its command again"):
        read_status(run)


def test_what_is_no_work_of_ours_is_told(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="no such folder"):
        read_status(tmp_path / "nowhere")
    (tmp_path / "mine").mkdir()
    with pytest.raises(BadFile, match="no results of the harness; expected a run, a sweep"):
        read_status(tmp_path / "mine")
