"""Cells are counted once, from the folder and from the outcomes of tasks."""

import shutil
from pathlib import Path
from threading import Event

import pytest

from harness.core.files import TEMPORARY
from harness.experiment.workers.cell_watcher import ProgressCount
from tests.planted import Plan, planted_run


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of one finished cell."""
    plan = Plan(behaviours=("walking",), methods={"ik": 2.0}, duration_s=2.0)
    (cell,) = (planted_run(tmp_path_factory.mktemp("watched") / "run", plan) / "cells").iterdir()
    return cell


def test_a_cell_is_counted_once(tmp_path: Path, finished: Path) -> None:
    (tmp_path / "cells" / "of-before").mkdir(parents=True)
    said: list[tuple[str, int]] = []
    count = ProgressCount(tmp_path, lambda last, ended: said.append((last, ended)))
    (tmp_path / "cells" / f"{TEMPORARY}half").mkdir()
    count.look()
    assert said == []
    shutil.copytree(finished, tmp_path / "cells" / finished.name)
    count.look()
    ((text, ended),) = said
    assert ended == 1
    assert text.startswith("ik on walking_p1_01: ")
    assert text.endswith("°")
    count.look()
    assert len(said) == 1
    count.add("the same", finished.name)
    count.add("one that failed", "")
    count.add("one of before", "of-before")
    assert said[1:] == [("the same", 1), ("one that failed", 2), ("one of before", 3)]


def test_a_thread_counts_while_tasks_run(tmp_path: Path, finished: Path) -> None:
    (tmp_path / "cells").mkdir()
    counted, said = Event(), list[int]()

    def hear(last: str, ended: int) -> None:
        said.append(ended)
        counted.set()

    count = ProgressCount(tmp_path, hear)
    with count.watching():
        shutil.copytree(finished, tmp_path / "cells" / "whole")
        assert counted.wait(20.0)
    assert said == [1]
