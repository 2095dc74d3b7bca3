"""Every damaged or edited file of a run is refused, by each command that reads it, in one line that names the file."""

import io
import json
import re
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.compare import compare_runs, write_baseline
from harness.errors import BadFile, Outcome
from harness.experiment import read_status
from harness.report.figures.conditions import read_conditions
from harness.report.run.data import read_run, read_summary_only
from harness.results.cell import read_row
from harness.results.files.digests import file_digest
from harness.results.files.integrity import check_cells, check_folder
from harness.results.index import INDEX_FILE, CellIndex
from harness.results.reader import load_results, load_run
from harness.results.storage import read_cells
from tests.command import Command
from tests.planted import Plan, planted_run
from tests.results.rewrite import read_json, rewrite_digests, rewrite_json

Change = Callable[[Path], object]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two runs, `run` and `other`, of which `other` has larger errors."""
    folder = tmp_path_factory.mktemp("made")
    plan = Plan(behaviours=("walking",), methods={"ik": 1.0, "mean_pose": 9.0}, takes=2, duration_s=2.0)
    planted_run(folder / "run", plan)
    larger = Plan(behaviours=("walking",), methods={"ik": 2.0, "mean_pose": 18.0}, takes=2, duration_s=2.0)
    planted_run(folder / "other", larger)
    return folder


@pytest.fixture
def run(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(made / "run", "run")
    shutil.copytree(made / "other", "other")
    return Path("run")


def cells(out: Path) -> list[Path]:
    return sorted((out / "cells").iterdir())


def edit(path: Path, pattern: str, text: str, count: int = 1) -> None:
    """Replace text in a file, as with an editor."""
    changed, found = re.subn(pattern, text, path.read_text(), count=count)
    assert found
    path.write_text(changed)


def halve(path: Path, metric: str = "joint_angle_mean_deg") -> None:
    before = path.read_text()
    path.write_text(re.sub(rf'("{metric}": )([\d.]+)', lambda m: f"{m[1]}{float(m[2]) / 2}", before, count=1))
    assert path.read_text() != before


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flip_bit(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 4
    path.write_bytes(data)


def sql(out: Path, statement: str) -> None:
    db = sqlite3.connect(out / INDEX_FILE)
    with db:
        assert db.execute(statement).rowcount > 0
    db.close()


def halve_frames(path: Path) -> None:
    arrays = dict(np.load(path))
    np.savez(path, **{name: 0.5 * values if name.startswith("error.") else values for name, values in arrays.items()})


def swap(a: Path, b: Path) -> None:
    a.rename(a.with_name("elsewhere"))
    b.rename(a)
    a.with_name("elsewhere").rename(b)


def cell(change: Change, file: str = "cell.json") -> Change:
    return lambda out: change(cells(out)[0] / file)


def frames(change: Change) -> Change:
    return cell(change, "frames.npz")


def of_run(file: str, change: Change) -> Change:
    return lambda out: change(out / file)


def from_other(file: str) -> Change:
    return lambda out: shutil.copyfile(out.with_name("other") / file, out / file)


OF_CELLS: dict[str, tuple[Change, str]] = {
    "metric halved": (cell(halve), "cell.json"),
    "metric negative": (cell(lambda f: edit(f, r'("mpjpe_mm": )', r"\1-")), "cell.json"),
    "metric not finite": (cell(lambda f: edit(f, r'("mpjpe_mm": )[\d.]+', r"\1NaN")), "cell.json"),
    "metric removed": (cell(lambda f: edit(f, r' *"mpjpe_mm": [\d.]+,\n', "")), "cell.json"),
    "joint halved": (cell(lambda f: edit(f, r'("lowerback.rx": )[\d.]+', r"\g<1>0.5")), "cell.json"),
    "condition changed": (cell(lambda f: edit(f, '"defined_by": {', '"defined_by": {"rate": 1,')), "cell.json"),
    "method renamed": (cell(lambda f: edit(f, '"method": "', '"method": "my_')), "cell.json"),
    "blank added": (cell(lambda f: edit(f, "\n}\n", "\n }\n")), "cell.json"),
    "key twice": (cell(lambda f: edit(f, "\n}\n", ',\n "seed": 2\n}\n')), "cell.json"),
    "digest removed": (cell(lambda f: edit(f, r' "sha256".*\n', "")), "cell.json"),
    "digest of nothing": (cell(lambda f: edit(f, r'"sha256": "\w+"', f'"sha256": "{"0" * 64}"')), "cell.json"),
    "digest no text": (cell(lambda f: edit(f, r'"sha256": "\w+"', '"sha256": 5')), "cell.json"),
    "cell.json cut": (cell(cut), "cell.json"),
    "cell.json empty": (cell(lambda f: f.write_text("")), "cell.json"),
    "cell.json missing": (cell(Path.unlink), "cell.json"),
    "frames cut": (frames(cut), "frames.npz"),
    "frames with a flipped bit": (frames(flip_bit), "frames.npz"),
    "frames with halved errors": (frames(halve_frames), "frames.npz"),
    "frames empty": (frames(lambda f: f.write_bytes(b"")), "frames.npz"),
    "frames missing": (frames(Path.unlink), "frames.npz"),
    "frames of another cell": (lambda o: shutil.copyfile(*(c / "frames.npz" for c in cells(o)[1::-1])), "frames.npz"),
    "files of another cell": (lambda o: shutil.copytree(cells(o)[1], cells(o)[0], dirs_exist_ok=True), "cell.json"),
    "cells swapped": (lambda o: swap(*cells(o)[:2]), "cell.json"),
    "cell of another run": (
        lambda o: shutil.copytree(cells(o.with_name("other"))[0], cells(o)[0], dirs_exist_ok=True),
        "cell|index|summary",
    ),
}
"""Name -> what is changed, and the file that a refusal names; `status` does not read these files."""
OF_FOLDER: dict[str, tuple[Change, str]] = {
    "cell deleted": (lambda o: shutil.rmtree(cells(o)[0]), "cells/"),
    "cells deleted": (lambda o: shutil.rmtree(o / "cells"), "cells/"),
    "row halved": (lambda o: sql(o, "UPDATE cells SET joint_angle_mean_deg = joint_angle_mean_deg / 2"), INDEX_FILE),
    "row negative": (lambda o: sql(o, "UPDATE cells SET mpjpe_mm = -mpjpe_mm"), INDEX_FILE),
    "row renamed": (lambda o: sql(o, "UPDATE cells SET method = 'mine' WHERE method = 'ik'"), INDEX_FILE),
    "row deleted": (lambda o: sql(o, "DELETE FROM cells WHERE method = 'ik'"), INDEX_FILE),
    "plan shortened": (lambda o: sql(o, "DELETE FROM plan WHERE place = 1"), INDEX_FILE),
    "outcome forgotten": (lambda o: sql(o, "UPDATE plan SET key = NULL WHERE place = 1"), INDEX_FILE),
    "kind changed": (lambda o: sql(o, "UPDATE facts SET value = '\"sweep\"' WHERE name = 'kind'"), INDEX_FILE),
    "bytes of the index changed": (
        of_run(INDEX_FILE, lambda f: f.write_bytes(f.read_bytes().replace(b"walking", b"wolking"))),
        INDEX_FILE,
    ),
    "index cut": (of_run(INDEX_FILE, cut), INDEX_FILE),
    "index missing": (of_run(INDEX_FILE, Path.unlink), INDEX_FILE),
    "index of another run": (from_other(INDEX_FILE), "cells/|summary.json"),
    "mean halved": (of_run("summary.json", lambda f: halve(f, "mean")), "summary.json"),
    "mean negative": (of_run("summary.json", lambda f: edit(f, r'("mean": )', r"\1-")), "summary.json"),
    "outcome changed": (of_run("summary.json", lambda f: edit(f, '"pass"', '"incomplete"')), "summary.json"),
    "failure added": (
        of_run("summary.json", lambda f: edit(f, '"failures": {', '"failures": {"a": "b"')),
        "summary.json",
    ),
    "summary cut": (of_run("summary.json", cut), "summary.json"),
    "summary missing": (of_run("summary.json", Path.unlink), "summary.json"),
    "summary of another run": (from_other("summary.json"), "summary.json"),
    "table edited": (of_run("summary.csv", lambda f: edit(f, r"\d\.\d+", "0.5")), "summary.csv"),
    "line removed": (of_run("summary.csv", lambda f: edit(f, r"\n.*\n$", "\n")), "summary.csv"),
    "table missing": (of_run("summary.csv", Path.unlink), "summary.csv"),
    "table of another run": (from_other("summary.csv"), "summary.csv"),
    "seed changed": (of_run("manifest.json", lambda f: edit(f, '"seed": ', '"seed": 9')), "manifest.json"),
    "processor changed": (
        of_run("manifest.json", lambda f: edit(f, '"processor": "', '"processor": "x')),
        "manifest.json",
    ),
    "manifest missing": (of_run("manifest.json", Path.unlink), "manifest.json"),
    "manifest of another run": (
        lambda o: rewrite_json(o / "manifest.json", inputs={"seed": 2}),
        "manifest.json",
    ),
}


def check_sweep(out: Path) -> None:
    """What `harness report` does before it reads a sweep."""
    check_folder(out)
    check_cells(out)


READERS: dict[str, Callable[[Path], object]] = {
    "load": load_run,
    "compare": lambda out: compare_runs(out, out),
    "report": read_run,
    "baseline": lambda out: write_baseline(out, "kept"),
    "export": lambda out: list(read_cells(out)),
    "table and plot": read_conditions,
    "view": read_summary_only,
    "report of a sweep": check_sweep,
}


def test_an_untouched_run_is_read_by_all(run: Path) -> None:
    for read in (*READERS.values(), read_status):
        read(run)
    assert compare_runs("kept", run).outcome == Outcome.PASS


@pytest.mark.parametrize("name", [*OF_CELLS, *OF_FOLDER])
def test_tampering_is_refused_by_every_reader(run: Path, name: str) -> None:
    change, file = {**OF_CELLS, **OF_FOLDER}[name]
    change(run)
    readers = {**READERS, **({"status": read_status} if name in OF_FOLDER else {})}
    for reader, read in readers.items():
        with pytest.raises(BadFile, match=file) as refusal:
            read(run)
        text = str(refusal.value)
        assert "\n" not in text, (reader, text)
        assert re.search(r"[Rr]un again|Give its command again|Give the command of the run again", text), (reader, text)
    assert not Path("results/baselines/kept").exists()


@pytest.mark.parametrize(
    "words",
    [
        ("compare", "run", "other"),
        ("compare", "other", "run"),
        ("report", "run"),
        ("baseline", "save", "mine", "run"),
        ("status", "run"),
        ("export", "run", "--format", "csv"),
        ("table", "run"),
        ("plot", "run"),
    ],
)
def test_commands_refuse_in_one_line(run: Path, words: tuple[str, ...], command: Command) -> None:
    halve(run / "summary.json", "mean")
    said = command(*words, code=Outcome.REFUSED.exit_code)
    lines = said.err.strip().splitlines()
    assert len(lines) == 1 or lines[1:] == [Outcome.REFUSED.word], lines
    assert lines[0].startswith("harness: run/summary.json: damaged or edited")
    assert "Give the command of the run again" in lines[0]


@pytest.mark.parametrize("words", [("table", "run"), ("plot", "run", "--out", "a.pdf"), ("view", "run")])
@pytest.mark.parametrize("file", ["cell.json", "frames.npz"])
def test_no_number_of_a_run_with_a_damaged_cell_is_printed(
    run: Path, words: tuple[str, ...], file: str, command: Command
) -> None:
    path = cells(run)[-1] / file
    path.write_bytes(path.read_bytes()[:-1])
    said = command(*words, code=Outcome.REFUSED.exit_code)
    assert said.out.strip() in ("", Outcome.REFUSED.word)
    assert f"{file}: " in said.err
    assert not Path("a.pdf").exists()


@pytest.mark.parametrize(
    ("metric", "value"),
    [("joint_angle_mean_deg", -1.0), ("mpjpe_mm", -0.001), ("mpjpe_mm", float("inf")), ("mpjre_deg", 400.0),
     ("coverage", 1.5), ("frames_matched", 10**9), ("frames_held", 0.5), ("jitter_m_s3", "low"), ("fps", True)],
)  # fmt: skip
def test_impossible_values_are_refused_although_all_digests_fit(run: Path, metric: str, value: object) -> None:
    folder = cells(run)[0]
    content = read_json(folder / "cell.json")
    rewrite_json(folder / "cell.json", metrics={**content["metrics"], metric: value})
    rewrite_digests(run)
    for read in READERS.values():
        with pytest.raises(BadFile, match=rf"cell\.json: \w*{metric} is .*possible values"):
            read(run)


def test_negative_errors_of_frames_and_summaries_are_refused_although_all_digests_fit(run: Path) -> None:
    folder = cells(run)[0]
    arrays = dict(np.load(folder / "frames.npz"))
    packed = io.BytesIO()
    np.savez(packed, **{**arrays, "error.mpjpe_mm": -arrays["error.mpjpe_mm"]})
    (folder / "frames.npz").write_bytes(packed.getvalue())
    rewrite_json(folder / "cell.json", frames_sha256=file_digest(folder / "frames.npz", "", ""))
    with pytest.raises(BadFile, match=r"frames\.npz: mpjpe_mm is -.* in a frame"):
        read_run(run)
    shutil.rmtree(run)
    shutil.copytree("other", run)
    methods = read_json(run / "summary.json")["methods"]
    methods[0]["metrics"]["mpjpe_mm"]["mean"] = -1.0
    rewrite_json(run / "summary.json", methods=methods)
    rewrite_digests(run)
    with pytest.raises(BadFile, match=r"summary\.json: the mean of mpjpe_mm is -1"):
        read_run(run)


def test_values_that_disagree_between_files_are_refused_although_each_digest_fits(run: Path) -> None:
    with CellIndex(run) as index, index._db as db:
        db.execute("UPDATE cells SET mpjpe_mm = 0.5 * mpjpe_mm")
    rewrite_digests(run)
    with pytest.raises(BadFile, match=r"index\.sqlite: mpjpe_mm of the cell \w+ is .* as in its cell\.json"):
        load_results(run)
    rows = read_json(run / "summary.json")["cells"]
    rows[0]["mpjpe_mm"] *= 0.5
    rewrite_json(run / "summary.json", cells=rows)
    rewrite_digests(run)
    with pytest.raises(BadFile, match=r"summary\.json: mpjpe_mm of the cell \w+ is .* as in its cell\.json"):
        read_run(run)


def test_a_cell_in_the_folder_of_another_is_refused_although_its_digests_fit(run: Path) -> None:
    """A resumed run reads rows by the name of the folder alone."""
    first, second, *_ = cells(run)
    shutil.rmtree(first)
    shutil.copytree(second, first)
    with pytest.raises(BadFile, match=f"of {second.name}; expected a cell of a run, of "):
        read_row(first)


def test_an_edited_index_is_made_anew_from_the_cells(run: Path) -> None:
    """Otherwise the same command would write the edited rows into a new summary."""
    before = [dict(row) for row in rows(run)]
    sql(run, "UPDATE cells SET mpjpe_mm = 1.0")
    with CellIndex(run) as index:
        index.add_from_folders()
        index.plan([str(row["key"]) for row in before])
        index.record_outcomes([(str(row["key"]), str(row["key"]), "") for row in before])
    assert [row["mpjpe_mm"] for row in rows(run)] == [row["mpjpe_mm"] for row in before]


def test_rows_are_replaced_by_those_of_their_cells_and_keep_their_time(run: Path) -> None:
    row = rows(run)[0]
    with CellIndex(run) as index:
        index.add([{**row, "mpjpe_mm": 1.0}], [3.0])
        index.add([row])
    assert rows(run)[0] == {**row, "seconds": 3.0}


def rows(out: Path) -> list[dict[str, object]]:
    with CellIndex(out, read_only=True) as index:
        return list(index.rows())


def test_a_run_of_which_a_process_was_killed_is_read_without_a_summary(run: Path) -> None:
    with CellIndex(run) as index:  # a process that begins to write takes the digest away
        assert index.check_digest() is None
    (run / "summary.json").unlink()
    assert len(load_run(run).records) == 4
    halve(cells(run)[0] / "cell.json")
    with pytest.raises(BadFile, match=r"cell\.json"):
        load_run(run)


@pytest.mark.parametrize("file", ["cells.json", "manifest.json", "summary.json"])
@pytest.mark.parametrize("how", ["edited", "cut", "missing", "of another run", "without digest"])
def test_damaged_files_of_a_baseline_are_refused(run: Path, file: str, how: str) -> None:
    path = write_baseline(run, "main") / file
    if how == "edited":
        edit(path, r"\n}\n", ',\n "new": 1\n}\n')
    elif how == "cut":
        cut(path)
    elif how == "missing":
        path.unlink()
    elif how == "of another run":
        if file == "cells.json":  # one that has everything of its own is another baseline
            rewrite_json(path, digests={**read_json(path)["digests"], "manifest.json": "0" * 64})
        else:
            shutil.copyfile(write_baseline(Path("other"), "other") / file, path)
            rewrite_json(path, note="another")
    else:
        edit(path, r' "sha256".*\n', "")
    with pytest.raises(BadFile):
        compare_runs(path.parent, run)


def test_anyone_can_compute_the_digest(run: Path) -> None:
    """As the documentation states it: all lines but the second."""
    import hashlib

    path = run / "summary.json"
    first, second, *rest = path.read_bytes().splitlines(keepends=True)
    assert (
        json.loads("{" + second.decode().rstrip(",\n") + "}")["sha256"]
        == hashlib.sha256(first + b"".join(rest)).hexdigest()
    )
