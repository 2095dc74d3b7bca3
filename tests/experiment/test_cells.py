"""Cells of one clip: which of them, in which order, with what kept from one job to the next."""

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.core.split import ClipPart
from harness.errors import BadFile
from harness.experiment.cells import CellOutcome, clear_caches, run_task
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_motion import ScenarioMotion
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.experiment.tasks import ClipTask
from harness.results import Cell, as_row, cell_folder, read_cell, read_row, write_cell
from tests.results.rewrite import read_json, write_json

SMALL = Scenario(
    name="small",
    motion=ScenarioMotion("builtin", ("walking_p1_01",), ("walking",), ("walking_p1_02",), longest_s=1.5),
    stations=load_scenario("demo").stations,
    methods=("ik:previous", "mean_pose"),
    vary={"noise": ["clean", "default"]},
)


def job(**changes: object) -> ClipTask:
    return replace(ClipTask(SMALL, ClipPart("walking_p1_01"), "walking", None, "harness run small"), **changes)  # type: ignore[arg-type]


def run_clip_task(task: ClipTask, out: Path, stop: Path | None = None) -> Iterator[CellOutcome]:
    (out / "cells").mkdir(exist_ok=True)
    return run_task("test", task, out, stop or out / "stop")


def made(out: Path, *jobs: ClipTask) -> dict[str, Cell]:
    ended = [cell for one in jobs for cell in run_clip_task(one, out)]
    assert all(cell.failure == "" for cell in ended)
    return {cell.cell: read_cell(cell_folder(out, cell.key)) for cell in ended}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Cell]]:
    clear_caches()
    out = tmp_path_factory.mktemp("cells")
    return out, made(out, job())


def test_chosen_variants_of_a_job_are_those_cells_and_no_others() -> None:
    names = [str(cell) for cell in job().cells()]
    assert [str(cell) for cell in job(chosen=(1,)).cells()] == names[2:]
    assert [str(cell) for cell in job(chosen=(0, 1)).cells()] == names
    assert SMALL.variants((1,)) == SMALL.variants()[1:]


def test_a_row_is_the_same_when_a_cell_ends_and_when_it_is_found(whole: tuple[Path, dict[str, Cell]]) -> None:
    out, found = whole
    again = list(run_clip_task(job(), out))
    assert [cell.cell for cell in again] == list(found)
    for ended in again:
        assert ended.seconds == 0.0
        assert ended.row == json.loads(json.dumps(as_row(found[ended.cell])))
        assert ended.row is not None
        assert list(ended.row) == list(as_row(found[ended.cell]))
        assert (ended.row["scenario"], ended.row["varied"]["noise"]) == ("small", ended.row["noise"])


@pytest.mark.parametrize("first", ["alone", "after another"])
def test_what_a_process_keeps_from_its_last_job_changes_no_result(
    whole: tuple[Path, dict[str, Cell]], tmp_path: Path, first: str
) -> None:
    """Variants and methods dealt out to jobs, in another order, give the cells of one job."""
    _, found = whole
    other = job(scenario=replace(SMALL, methods=("mean_pose",)), chosen=(1,))
    rest = [job(chosen=(0,)), job(scenario=replace(SMALL, methods=("ik:previous",)), chosen=(1,))]
    clear_caches()
    parts = made(tmp_path, other) if first == "alone" else made(tmp_path, other, *rest)
    assert set(parts) == set(list(found)[-1:] if first == "alone" else found)
    for name, cell in parts.items():
        assert cell.key == found[name].key
        np.testing.assert_array_equal(cell.estimate_qpos, found[name].estimate_qpos)
        np.testing.assert_array_equal(cell.truth_qpos, found[name].truth_qpos)


def test_scenarios_of_another_name_share_no_cell(whole: tuple[Path, dict[str, Cell]]) -> None:
    out, found = whole
    renamed = job(scenario=replace(SMALL, name="other", methods=("ik:previous",)), chosen=(0,))
    (other,) = made(out, renamed).values()
    (one,) = (cell for cell in found.values() if (cell.method, cell.noise) == ("ik:previous", "clean"))
    assert other.defined_by == one.defined_by
    assert (other.key != one.key, other.scenario) == (True, "other")


def test_a_job_ends_early_once_it_is_asked_to(tmp_path: Path) -> None:
    stop = tmp_path / "stop"
    ended = []
    for cell in run_clip_task(job(scenario=replace(SMALL, methods=("ik:previous",))), tmp_path, stop):
        ended.append(cell)
        stop.touch()
    assert len(ended) == 1
    assert ended[0].seconds > 0.0


@pytest.mark.parametrize("read", [read_row, read_cell])
def test_cells_of_an_older_version_are_refused(
    whole: tuple[Path, dict[str, Cell]], tmp_path: Path, read: Callable[[Path], object]
) -> None:
    _, found = whole
    folder = write_cell(tmp_path, next(iter(found.values())))
    content = read_json(folder / "cell.json")
    del content["scenario"]
    write_json(folder / "cell.json", content)
    with pytest.raises(BadFile, match=r"no scenario; expected a cell of this version.*Delete the cell's folder"):
        read(folder)
