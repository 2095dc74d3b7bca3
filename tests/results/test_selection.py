"""Cells are chosen by names and patterns of clips and methods."""

from collections.abc import Callable
from pathlib import Path

import pytest

from harness.errors import BadFile, BadInput, UnknownName
from harness.results import storage
from harness.results.reader import select_cells
from tests.results.finish import write_run

CELLS = [
    ("ik", "13_17@0.20-0.40"),
    ("ik", "walking_p1_01"),
    ("local_pca[neighbours=100]", "13_17@0.20-0.40"),
    ("local_pca[neighbours=100]", "walking_p1_01"),
    ("upright:Upright+ik", "walking_p1_02"),
]


@pytest.fixture
def run(run_folder: Path, make_cell: Callable[..., storage.Cell]) -> Path:
    cells = [make_cell(0.01 * (n + 1), frames=60, method=method, clip=clip) for n, (method, clip) in enumerate(CELLS)]
    write_run(run_folder, cells)
    return run_folder


@pytest.mark.parametrize(
    ("clips", "methods", "chosen"),
    [
        ([], [], [0, 1, 2, 3, 4]),
        (["walking_p1_01"], [], [1, 3]),
        (["walking_*"], [], [1, 3, 4]),
        (["walking_p?_02", "13_17"], [], [0, 2, 4]),
        (["13_17@0.20-0.40"], ["ik"], [0]),
        (["13_*"], ["local_pca[neighbours=100]"], [2]),
        ([], ["local_pca*"], [2, 3]),
        ([], ["*+ik"], [4]),
        (["*"], ["*"], [0, 1, 2, 3, 4]),
    ],
)
def test_names_and_patterns_choose(run: Path, clips: list[str], methods: list[str], chosen: list[int]) -> None:
    found = [(cell.method, cell.clip) for cell in select_cells(run, clips=clips, methods=methods)]
    assert found == [CELLS[n] for n in chosen]


@pytest.mark.parametrize(
    ("clips", "methods", "message"),
    [
        (["walking_p9_*"], [], r"no clip called 'walking_p9_\*'.*Known: 13_17@0\.20-0\.40, walking_p1_01, walking_p1"),
        (["walking_*", "13_18"], [], "no clip called '13_18'"),
        ([], ["ik["], r"no method called 'ik\['.*Known: ik, local_pca\[neighbours=100\], upright:Upright\+ik"),
        ([], ["local_pca"], "no method called 'local_pca'"),
        ([], [""], "no method called ''"),
    ],
)
def test_an_entry_that_fits_nothing_is_refused(run: Path, clips: list[str], methods: list[str], message: str) -> None:
    with pytest.raises(UnknownName, match=message):
        select_cells(run, clips=clips, methods=methods)


def test_entries_that_never_meet_are_refused(run: Path) -> None:
    with pytest.raises(BadInput, match=r"No finished cell of .*run has clip 13_17 with method upright:Upright\+ik"):
        select_cells(run, clips=["13_17"], methods=["upright:Upright+ik"])


def test_only_chosen_cells_are_read(run: Path) -> None:
    """A damaged cell does not matter to those who leave it out."""
    (damaged,) = (cell.key for cell in select_cells(run, methods=["*Upright*"]))
    (run / "cells" / damaged / "frames.npz").write_bytes(b"")
    assert len(list(select_cells(run, methods=["ik"]))) == 2
    with pytest.raises(BadFile, match=damaged):
        list(select_cells(run))


def test_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadFile):
        select_cells(tmp_path)
