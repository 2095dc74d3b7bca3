"""Baselines and runs as sides: what is kept comes back, names stay in their folder, damage is told in one line."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from harness.compare.baseline import write_baseline
from harness.compare.comparison import compare_results
from harness.compare.margins import MARGINS
from harness.errors import BadFile, BadInput, Outcome, UnknownName
from harness.results import COUNT_METRICS, Cell, CellIndex, CellResult, ResultSet, load_results
from harness.results.files import read_result_json, write_result_json
from tests.compare.sides import manifest, side, write_run
from tests.core.leftovers import leave_behind
from tests.results.finish import make_run
from tests.results.finish import write_run as write_cells
from tests.results.rewrite import read_json, rewrite_digests, rewrite_json

METHODS = {"mean_pose": 3.0, "ik": 1.0}


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return write_run(tmp_path / "run", side(methods=METHODS))


@pytest.fixture
def baselines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A place of work with no baselines yet."""
    monkeypatch.chdir(tmp_path)
    return Path("results/baselines")


def kept(judged: ResultSet) -> list[CellResult]:
    """Without metrics that nothing can be said of."""
    cells = sorted(judged.cells, key=lambda cell: (cell.method, cell.clip))
    return [replace(c, metrics={n: v for n, v in c.metrics.items() if n in (*COUNT_METRICS, *MARGINS)}) for c in cells]


def test_what_a_baseline_keeps_is_what_the_run_measured(run: Path, baselines: Path) -> None:
    assert write_baseline(run, "main") == baselines / "main"
    found, there = load_results("main"), load_results(run)
    assert kept(found) == kept(there) == kept(side(methods=METHODS))
    assert (found.title, found.manifest, found.planned) == ("baseline main", there.manifest, 16)
    assert load_results(baselines / "main") == found
    comparison = compare_results(found, there)
    assert (comparison.outcome, {line.difference for line in comparison.differences}) == (Outcome.PASS, {0.0})


def test_what_a_killed_baseline_left_is_removed_by_the_next(run: Path, baselines: Path) -> None:
    left = leave_behind(baselines / "main", folder=True)
    assert left.is_dir()
    write_baseline(run, "main")
    assert [path.name for path in baselines.iterdir()] == ["main"]


def test_a_baseline_in_the_place_of_another_is_refused(run: Path, baselines: Path, tmp_path: Path) -> None:
    write_baseline(run, "main")
    shutil.copytree(baselines / "main", baselines / "release")
    with pytest.raises(BadFile, match=r"cells.json: of main; expected the cells of a baseline, of release"):
        load_results("release")
    assert load_results(baselines / "release").title == "baseline main"  # named as a folder, it is what it is
    content = read_result_json(baselines / "release" / "cells.json", "", "")
    write_result_json(baselines / "release" / "cells.json", {k: v for k, v in content.items() if k != "name"})
    assert load_results("release").title == "baseline release"  # of a version that stored no name


def test_a_baseline_is_small_sorted_and_always_the_same(run: Path, baselines: Path, tmp_path: Path) -> None:
    first, turned = side(methods=METHODS), write_run(tmp_path / "turned", side(methods=dict(reversed(METHODS.items()))))
    one, other = write_baseline(run, "one"), write_baseline(turned, "other")
    assert sorted(path.name for path in one.iterdir()) == ["cells.json", "manifest.json", "summary.json"]
    text = (one / "cells.json").read_text()
    content, turned_content = json.loads(text), json.loads((other / "cells.json").read_text())
    assert (content.pop("name"), turned_content.pop("name")) == ("one", "other")
    del content["sha256"], turned_content["sha256"]
    assert content == turned_content
    clips = [(cell["clip"], cell["method"]) for cell in content["cells"]]
    assert clips == sorted((cell.clip, cell.method) for cell in first.cells)
    assert len(content["parts"]) == 8, "methods of a clip share what defines them"
    assert all(set(part) == {"clip"} for part in content["parts"].values()), "what all share stands once"


def test_a_run_as_the_harness_writes_it_is_a_side(run_folder: Path, make_cell: Callable[..., Cell]) -> None:
    content = manifest()
    make_run(run_folder, content)
    cells = [make_cell(off_m=0.01 * n, clip=f"walk_{n}", scenario="demo", varied={"noise": "clean"}) for n in (2, 1)]
    write_cells(run_folder, cells, failures={"ik on walk_3": "no"})
    found = load_results(run_folder)
    assert [cell.clip for cell in found.cells] == ["walk_2", "walk_1"]
    assert found.cells[0].metrics == cells[0].metrics
    assert found.cells[0].defined_by == cells[0].defined_by
    assert (found.planned, found.failed, found.manifest) == (3, ("ik on walk_3",), content)


def test_a_sweep_is_a_side_and_makes_a_baseline(run: Path, baselines: Path) -> None:
    with CellIndex(run) as index:
        names = {f"demo seed 1: {row['method']} on {row['clip']}": row["key"] for row in index.rows()}
        index.plan(list(names))
        index.record_outcomes((name, key, "") for name, key in names.items())
    rewrite_json(run / "summary.json", cells=None, groups=[{"method": "ik"}])
    rewrite_digests(run)
    assert kept(load_results(run)) == kept(side(methods=METHODS))
    summary = json.loads((write_baseline(run, "main") / "summary.json").read_text())
    assert (summary["groups"], kept(load_results("main"))) == ([{"method": "ik"}], kept(load_results(run)))
    with CellIndex(run) as index:
        index.record_outcomes([("demo seed 1: ik on walk_00", "", "no pose")])
    found = load_results(run)
    assert (found.planned, len(found.cells), found.failed) == (16, 15, ("demo seed 1: ik on walk_00",))
    run_itself = compare_results(found, found, methods=("mean_pose", "mean_pose"), metrics=["mpjpe_mm"])
    assert run_itself.outcome == Outcome.PASS, "another method's failure"
    assert compare_results(found, found, methods=("ik", "ik"), metrics=["mpjpe_mm"]).outcome == Outcome.INCOMPLETE


@pytest.mark.parametrize("name", ["", ".", "..", "../out", "a/b", "/elsewhere", ".hidden", "a b", "-f", "a\n", "a\\b"])
def test_a_name_never_leaves_its_folder(name: str, run: Path, baselines: Path, tmp_path: Path) -> None:
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(BadInput, match="not a valid name of a baseline"):
        write_baseline(run, name, force=True)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_baseline_is_replaced_only_by_force(run: Path, baselines: Path, tmp_path: Path) -> None:
    target = write_baseline(run, "main")
    before = (target / "cells.json").read_text()
    worse = write_run(tmp_path / "worse", side(methods={"ik": 1.5}))
    with pytest.raises(BadInput, match=r"Baseline main exists.*--force"):
        write_baseline(worse, "main")
    assert (target / "cells.json").read_text() == before
    write_baseline(worse, "main", force=True)
    assert load_results("main").planned == 8
    assert [path.name for path in baselines.iterdir()] == ["main"]


def test_runs_with_holes_make_no_baseline(baselines: Path, tmp_path: Path) -> None:
    failed = write_run(tmp_path / "failed", side(failed=["ik on walk_99"]))
    with pytest.raises(BadInput, match="lacks 1 of 9 cells"):
        write_baseline(failed, "main")
    empty = write_run(tmp_path / "empty", replace(side(), cells=(), planned=0))
    with pytest.raises(BadInput, match="no cells"):
        write_baseline(empty, "main")
    with pytest.raises(BadFile, match="no such folder; expected a run or a sweep"):
        write_baseline(tmp_path / "nowhere", "main")
    assert not baselines.exists()


def test_what_is_no_side_is_told(run: Path, baselines: Path, tmp_path: Path) -> None:
    write_baseline(run, "main")
    with pytest.raises(UnknownName, match=r"no folder or baseline called 'mian'.*'main'"):
        load_results("mian")
    with pytest.raises(BadFile, match="no such folder"):
        load_results("some/where")
    (tmp_path / "empty").mkdir()
    with pytest.raises(BadFile, match=r"no results of the harness; expected a run or a sweep"):
        load_results("empty")


def test_runs_of_older_versions_are_refused_with_advice(run: Path) -> None:
    with CellIndex(run) as index, index._db as db:
        db.execute("UPDATE cells SET scenario = NULL")
    with pytest.raises(BadFile, match=r"cells that name no scenario.*run again"):
        load_results(run)


@pytest.mark.parametrize(
    ("damage", "why"),
    [
        ({"schema": 1}, "schema 1; expected schema 2"),
        ({"schema": None}, "schema None"),
        *(({name: value}, "damaged") for name, value in (("parts", {}), ("cells", [1]), ("metrics", []))),
        *(({name: None}, "damaged") for name in ("metrics", "cells")),
        ({"planned": 17}, "16 cells of 17"),
        *(({"clip": None}, "clip is"), ({"seed": "1"}, "seed is"), ({"varied": None}, "varied is")),
        ({"performer": 3}, "performer is"),
        *(({"mpjpe_mm": value}, "mpjpe_mm is") for value in (float("nan"), -3.0)),
        *(({"frames_matched": None}, "frames_matched is"), ({"fps": "fast"}, "fps is")),
    ],
)
def test_damaged_baselines_are_refused(run: Path, baselines: Path, damage: dict[str, Any], why: str) -> None:
    """Keys of the file, of its first cell, and figures of that."""
    path = write_baseline(run, "main") / "cells.json"
    content = read_json(path)
    first, ((name, value),) = content["cells"][0], damage.items()
    if name in content:
        content[name] = value
    elif name in content["metrics"]:
        first["metrics"][content["metrics"].index(name)] = value
    else:
        first[name] = value
    rewrite_json(path, **content)
    with pytest.raises(BadFile, match=why):
        load_results("main")


@pytest.mark.parametrize("name", ["manifest.json", "index.sqlite", "cells"])
def test_runs_that_lack_something_are_refused(run: Path, name: str) -> None:
    (run / name).rename(run / "elsewhere")
    with pytest.raises(BadFile):
        load_results(run)
    with pytest.raises(BadFile):
        write_baseline(run, "main")
