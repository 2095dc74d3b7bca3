"""The index of many cells: what goes in comes out, in planned order; it is worth nothing and made anew at any time."""

import json
import shutil
import sqlite3
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from harness.core import files
from harness.errors import BadFile, BadInput
from harness.results import index as index_module
from harness.results.cell import as_row, cell_folder, write_cell
from harness.results.files.folder_kind import folder_lock, is_running
from harness.results.index import INDEX_FILE, CellCounts, CellIndex
from harness.results.storage import read_cells
from harness.results.table import SUMMARY_METRICS, TIME_COLUMNS, compute_group_statistics, write_table
from tests.planted import Plan, planted_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight cells: two behaviours, two methods, two values."""
    plan = Plan(methods={"ik": 1.5, "mean_pose": 14.0}, duration_s=2.0, vary={"noise": ["clean", "noise"]})
    return planted_run(tmp_path_factory.mktemp("index") / "run", plan)


def rows_of(run: Path) -> list[dict[str, Any]]:
    return [as_row(cell) for cell in read_cells(run)]


def named(row: Mapping[str, Any]) -> str:
    return f"{row['method']} on {row['clip']} {row['varied']}"


def filled(out: Path, rows: list[dict[str, Any]]) -> None:
    """Cells added in another order than they are planned in, as workers end."""
    with CellIndex(out) as index:
        index.expect([named(row) for row in rows])
        index.add(reversed(rows), [0.5] * len(rows))
        index.record_outcomes((named(row), row["key"], "") for row in rows)


def test_rows_come_out_as_they_went_in_and_in_planned_order(run: Path, tmp_path: Path) -> None:
    rows = rows_of(run)
    filled(tmp_path, rows)
    with CellIndex(tmp_path, read_only=True) as index:
        assert list(index.rows()) == [{**row, "seconds": 0.5} for row in rows]
        assert [list(row) for row in index.rows()] == [[*row, "seconds"] for row in rows]
        keys = [row["key"] for row in rows[::-3]]
        assert [row["key"] for row in index.rows_of(keys)] == keys
        assert [row["clip"] for row in index.rows(method="ik", behaviour="walking")] == ["walking_p1_01"] * 2
        assert index.counts() == CellCounts(8, 8, 0)
        with pytest.raises(ValueError, match="no column"):
            next(index.rows(rest="x"))
        with pytest.raises(ValueError, match="no column"):
            next(index.columns("key; DROP TABLE cells"))


def test_what_failed_is_counted_and_kept_until_it_is_made_again(tmp_path: Path) -> None:
    with CellIndex(tmp_path) as index:
        index.expect(["a", "b", "c"])
        index.record_outcomes([("a", "key", ""), ("c", "", "Traceback"), ("b", "", "no such clip")])
        assert index.counts() == CellCounts(3, 1, 2)
        assert list(index.failures().items()) == [("b", "no such clip"), ("c", "Traceback")]
        index.expect(["c", "d"])
        index.reset(["c"])
        assert index.counts() == CellCounts(4, 1, 1)
        index.plan(["e", "b", "a"])
        assert index.counts() == CellCounts(3, 1, 1)
        assert list(index.failures()) == ["b"]


def test_cells_that_the_index_lacks_are_gathered_from_their_folders(run: Path, tmp_path: Path) -> None:
    rows = rows_of(run)
    run = shutil.copytree(run, tmp_path / "run")
    for file in run.glob(f"{INDEX_FILE}*"):
        file.unlink()
    (run / "cells" / ".unfinished-1-abc").mkdir()
    (run / "cells" / "of_an_older_version").mkdir()
    (run / "cells" / "of_an_older_version" / "cell.json").write_text("{}")
    with CellIndex(run) as index:
        assert index.unwritten() == 9
        assert index.add_from_folders() == 8
        assert index.add_from_folders() == 0
        assert list(index.rows_of([row["key"] for row in rows])) == [{**row, "seconds": None} for row in rows]


@pytest.mark.parametrize("damage", ["cut", "older"])
def test_a_damaged_or_older_index_is_made_anew(run: Path, tmp_path: Path, damage: str) -> None:
    filled(tmp_path, rows_of(run))
    if damage == "cut":
        (tmp_path / INDEX_FILE).write_bytes(b"no database at all" * 100)
    else:
        with sqlite3.connect(tmp_path / INDEX_FILE) as db:
            db.execute("PRAGMA user_version = 7")
        db.close()
    with pytest.raises(BadFile, match=r"index\.sqlite.*Give its command"):
        CellIndex(tmp_path, read_only=True)
    with CellIndex(tmp_path) as index:
        assert index.counts() == CellCounts(0, 0, 0)
    with CellIndex(tmp_path, read_only=True) as index:
        assert list(index.rows()) == []


def test_a_column_whose_name_is_no_text_is_damage(run: Path, tmp_path: Path) -> None:
    filled(tmp_path, rows_of(run))
    with CellIndex(tmp_path) as index:
        index.write_digest({})
    path = tmp_path / INDEX_FILE
    path.write_bytes(path.read_bytes().replace(b"failure TEXT", b"fail\xe6re TEXT"))
    with CellIndex(tmp_path, read_only=True) as index, pytest.raises(BadFile, match="damaged"):
        index.check_digest()
    with CellIndex(tmp_path, read_only=True) as index, pytest.raises(BadFile, match="damaged"):
        index.failures()
    with CellIndex(tmp_path) as index:
        assert index.counts() == CellCounts(0, 0, 0)


def test_a_folder_without_an_index_is_told(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="no such file"):
        CellIndex(tmp_path, read_only=True)
    assert not (tmp_path / INDEX_FILE).exists()


def test_the_table_is_the_same_in_whatever_order_cells_ended(run: Path, tmp_path: Path) -> None:
    rows = rows_of(run)
    for name, order in (("one", rows), ("two", rows[::-1])):
        (tmp_path / name).mkdir()
        with CellIndex(tmp_path / name) as index:
            index.expect([named(row) for row in rows])
            index.add(order)
            index.record_outcomes((named(row), row["key"], "") for row in order)
            write_table(index, tmp_path / name / "summary.csv")
            (tmp_path / name / "groups.json").write_text(json.dumps(compute_group_statistics(index)))
    for file in ("summary.csv", "groups.json"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()
    header, first, *_ = (tmp_path / "one" / "summary.csv").read_text().splitlines()
    found = dict(zip(header.split(","), first.split(","), strict=True))
    assert found["scenario"] == "run"
    assert (found["vary.noise"], found["noise"]) == ("clean", "clean")
    assert float(found["mpjpe_mm"]) == pytest.approx(rows[0]["mpjpe_mm"], rel=1e-8)
    assert set(TIME_COLUMNS) <= set(found)


def test_groups_average_each_clip_first(run: Path, tmp_path: Path) -> None:
    """Two seeds of one clip and one of another: clips count the same."""
    one, two = (row for row in rows_of(run) if row["method"] == "ik" and row["varied"] == {"noise": "clean"})
    cells = [(one, 1.0), (one, 3.0), (two, 6.0), (two, None)]
    rows = [{**row, "key": str(n), "seed": n, "mpjpe_mm": value} for n, (row, value) in enumerate(cells)]
    with CellIndex(tmp_path) as index:
        index.expect(["0", "1", "2", "3"])
        index.add(rows)
        index.record_outcomes((row["key"], row["key"], "") for row in rows)
        (group,) = compute_group_statistics(index)
    assert (group["cells"], group["clips"], group["varied"]) == (4, 2, {"noise": "clean"})
    assert group["metrics"]["mpjpe_mm"] == {"mean": 4.0, "sd": pytest.approx(8.0**0.5), "clips": 2}
    assert set(group["metrics"]) == set(SUMMARY_METRICS)


def test_files_of_a_cell_are_flushed_before_its_name_and_the_name_before_the_digest(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the index counts as finished survives a loss of power."""
    flushed: list[str] = []
    made = next(iter(read_cells(run)))
    folder = cell_folder(tmp_path, made.key)

    def note(path: Path) -> None:
        assert folder.exists() == (path.name == "cells")
        flushed.append(path.name)

    for module in (files, index_module):
        monkeypatch.setattr(module, "flush", note)
    write_cell(tmp_path, made)
    assert sorted(flushed) == sorted(["cell.json", "frames.npz", files.temporary_path(folder).name])
    assert flushed[-1] == files.temporary_path(folder).name
    with CellIndex(tmp_path) as index:
        index.write_digest({})
    assert flushed[-1] == "cells"


def test_a_folder_has_one_coordinator(tmp_path: Path) -> None:
    assert not is_running(tmp_path)
    with folder_lock(tmp_path):
        assert is_running(tmp_path)
        with pytest.raises(BadInput, match="Another process uses"), folder_lock(tmp_path):
            pass
    assert not is_running(tmp_path)
