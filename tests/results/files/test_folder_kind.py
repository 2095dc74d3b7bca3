"""Every folder that a verb wrote is known by its files, and a verb that cannot use one says what it is."""

import argparse
from pathlib import Path

import pytest

from harness.commands.report import run_report
from harness.errors import BadFile
from harness.results.files.folder_kind import folder_kind, require_kind
from harness.results.files.integrity import check_folder
from harness.results.index import CellIndex
from tests.results.rewrite import write_json

FILES: dict[str, dict[str, dict[str, object]]] = {
    "trust": {"study.json": {"study": "trust"}, "findings.json": {"plan_digest": "0"}},
    "placement": {"study.json": {"placement": "where"}, "findings.json": {"kind": "placement"}},
    "paper": {"study.json": {"paper": "liu2011"}, "findings.json": {"paper": "liu2011"}},
    "benchmark": {"study.json": {"benchmark": "accuracy"}},
    "baseline": {"cells.json": {"schema": 2}, "manifest.json": {"inputs": {}}},
    "": {"clip.json": {"rate_hz": 40}},
}
SHOWN = {
    "trust": r"a trust study; .*harness trust.*report\.html",
    "placement": "a placement study; .*harness plot",
    "paper": "the study of a paper; .*harness report",
    "benchmark": "the work of a benchmark; .*harness bench",
    "baseline": "a baseline; .*harness compare",
    "": "no results of the harness; .*--out",
}


def fill(folder: Path, kind: str) -> Path:
    """A folder with the files that tell this kind."""
    folder.mkdir()
    for name, content in FILES[kind].items():
        write_json(folder / name, content)
    return folder


@pytest.mark.parametrize("kind", FILES)
def test_a_folder_is_known_by_its_files_and_by_each_of_them(tmp_path: Path, kind: str) -> None:
    folder = fill(tmp_path / "folder", kind)
    assert folder_kind(folder) == require_kind(folder, kind) == kind
    if "findings.json" in FILES[kind]:
        for name in FILES[kind]:
            alone = fill(tmp_path / f"without_{name}", kind)
            (alone / name).unlink()
            assert folder_kind(alone) == kind


@pytest.mark.parametrize("kind", FILES)
def test_what_is_no_run_is_refused_by_what_it_is(tmp_path: Path, kind: str) -> None:
    folder = fill(tmp_path / "folder", kind)
    with pytest.raises(BadFile, match=SHOWN[kind]):
        check_folder(folder)


@pytest.mark.parametrize("kind", ["trust", "benchmark", "baseline", ""])
def test_report_names_a_folder_that_it_cannot_show(tmp_path: Path, kind: str) -> None:
    folder = fill(tmp_path / "folder", kind)
    with pytest.raises(BadFile, match=SHOWN[kind]):
        run_report(argparse.Namespace(run=folder, readme=None))


def test_the_index_tells_a_run_from_a_sweep(tmp_path: Path) -> None:
    (tmp_path / "cells").mkdir()
    with CellIndex(tmp_path) as index:
        for kind in ("run", "sweep"):
            index.note(kind=kind)
            assert folder_kind(tmp_path) == kind
    with pytest.raises(BadFile, match="a sweep; expected a run"):
        require_kind(tmp_path, "run")


def test_a_file_and_a_missing_folder_are_told_apart(tmp_path: Path) -> None:
    (tmp_path / "empty.rec").touch()
    (tmp_path / "notes.txt").write_text("words")
    kinds = {"empty.rec": "an empty file", "notes.txt": "a file, not a folder", "nowhere": "no such folder"}
    for name, found in kinds.items():
        with pytest.raises(BadFile, match=f"{found}; expected a run"):
            require_kind(tmp_path / name, "run")
