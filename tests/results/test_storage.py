"""The folder of a run: whole cells or none, the same run goes on, another is refused."""

import csv
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from shutil import rmtree as remove_folder
from typing import Any

import numpy as np
import pytest

from harness.core.files import TEMPORARY, to_json_types
from harness.errors import BadFile, BadInput, ShapeError
from harness.results import manifest as manifests
from harness.results import storage
from harness.results.cell import as_row, cell_folder, read_row
from harness.results.files.digests import file_digest
from harness.results.files.folder_kind import LOCK_FILE
from harness.results.files.integrity import check_row
from harness.results.index import CellIndex
from tests.results.finish import finish_run, folder_bytes, make_run, write_run
from tests.results.rewrite import read_json, rewrite_json, write_json

MakeCell = Callable[..., storage.Cell]
ISSUE_COLUMNS = (
    "method,behaviour,clip,motion_source,stations,mount,rate_hz,inputs,split,calibration,noise,seed,"
    "frames_matched,frames_expected,joint_angle_mean_deg,joint_angle_rms_deg,mpjre_deg,mpjpe_mm,mpjpe_root_mm,"
    "jitter_m_s3,step_p50_ms,step_p99_ms,fps"
)


def manifest(**changes: object) -> manifests.Manifest:
    scenario = {"name": "demo", "seed": 1, "motion": {"test": ["a", "b"]}, "methods": ["ik"], **changes}
    return manifests.describe_run(scenario, motion_source="built-in performer", command="harness run demo")


def test_a_cell_reads_back_as_it_was_written(run_folder: Path, make_cell: MakeCell) -> None:
    cell = make_cell()
    make_run(run_folder, manifest())
    assert not storage.has_cell(run_folder, cell.key)
    back = storage.read_cell(storage.write_cell(run_folder, cell))
    assert storage.has_cell(run_folder, cell.key)
    for name in storage.Cell.__dataclass_fields__:
        if name != "scores":
            np.testing.assert_array_equal(getattr(back, name), getattr(cell, name), err_msg=name)
    assert back.metrics == to_json_types(cell.metrics)
    assert back.scores.per_joint == cell.scores.per_joint
    assert back.truth_qpos.dtype == np.float64
    for name, values in cell.scores.per_frame.items():
        np.testing.assert_allclose(back.scores.per_frame[name], values, rtol=1e-6, err_msg=name)


def test_what_calibration_found_is_kept(run_folder: Path, make_cell: MakeCell) -> None:
    """The estimate stands on the true bones unless others are named."""
    make_run(run_folder, manifest())
    known, found = make_cell(), make_cell(0.02, calibration_errors={"length_mm": 4.0})
    np.testing.assert_array_equal(known.estimate_bone_m, known.bone_m)
    longer = make_cell(0.03, calibration_errors={"length_mm": 4.0}, estimate_bone_m=1.05 * known.bone_m)
    for cell in (known, found, longer):
        back = storage.read_cell(storage.write_cell(run_folder, cell))
        np.testing.assert_array_equal(back.bone_m, known.bone_m)
        np.testing.assert_array_equal(back.estimate_bone_m, cell.estimate_bone_m)
        assert as_row(back)["calibration_errors"] == cell.calibration_errors
    with pytest.raises(ShapeError, match="estimate_bone_m"):
        make_cell(estimate_bone_m=known.bone_m[:5])


def stating(make_cell: MakeCell, judge: Callable[..., Any], **fields: Any) -> storage.Cell:
    """A cell of a method that states standard deviations and has a lag of two frames."""
    plain = make_cell()
    sigma_rad = np.full((400, 48), 0.25)
    scores = judge(plain.estimate_qpos, angle_sigma_rad=sigma_rad)
    conditions = {**plain.defined_by, "lag": 2}
    return make_cell(angle_sigma_rad=sigma_rad, scores=scores, defined_by=conditions, **fields)


def test_lag_and_standard_deviations_are_kept(run_folder: Path, make_cell: MakeCell, judge: Callable[..., Any]) -> None:
    make_run(run_folder, manifest())
    cell = stating(make_cell, judge)
    back = storage.read_cell(storage.write_cell(run_folder, cell))
    assert back.angle_sigma_rad is not None
    np.testing.assert_array_equal(back.angle_sigma_rad, cell.angle_sigma_rad)
    assert (back.lag, dict(back.sigma_scores)) == (2, dict(cell.sigma_scores))
    assert as_row(back) == to_json_types(as_row(cell)) == read_row(run_folder / "cells" / cell.key)
    with pytest.raises(ShapeError, match="angle_sigma_rad"):
        make_cell(angle_sigma_rad=np.ones((400, 47)))


def test_rows_of_versions_without_lag_and_standard_deviations_are_read(run_folder: Path, make_cell: MakeCell) -> None:
    """A folder that such a version wrote has neither column in cell.json, index, summary.json and summary.csv."""
    cell = make_cell()
    write_run(run_folder, [cell])
    folder = cell_folder(run_folder, cell.key)
    assert not {"lag", "sigma_scores"} & set(read_json(folder / "cell.json"))
    head, _ = (run_folder / "summary.csv").read_text().splitlines()
    assert not {"lag", "sigma_coverage_1"} & set(head.split(","))

    def strip(content: dict[str, Any]) -> None:
        for row in (*content["cells"], *content["methods"], *content["behaviours"]):
            row.pop("lag")
            row.pop("sigma_scores")

    content = read_json(run_folder / "summary.json")
    strip(content)
    write_json(run_folder / "summary.json", content)
    summary = storage.read_summary(run_folder)
    assert "lag" not in summary["cells"][0]
    check_row(run_folder / "summary.json", summary["cells"][0], as_row(storage.read_cell(folder)))
    with CellIndex(run_folder, read_only=True) as index:
        ((rest,),) = index.columns("rest")
        assert "lag" not in rest
        assert [(row["lag"], row["sigma_scores"]) for row in index.rows()] == [(0, {})]


@pytest.mark.parametrize(
    ("part", "name", "value", "found"),
    [
        ("sigma_scores", "sigma_coverage_1", 1.5, "sigma_coverage_1 is 1.5"),
        ("sigma_scores", "sigma_width_deg", -1.0, "sigma_width_deg is -1.0"),
        ("sigma_scores", "sigma_log_score", None, "sigma_log_score is None"),
        ("defined_by", "lag", -2, "defined_by.lag: expected a number of frames, found -2"),
    ],
)
def test_impossible_scores_of_standard_deviations_and_lags_are_refused(
    run_folder: Path, make_cell: MakeCell, judge: Callable[..., Any], part: str, name: str, value: object, found: str
) -> None:
    folder = storage.write_cell(run_folder, stating(make_cell, judge))
    rewrite_json(folder / "cell.json", **{part: {**read_json(folder / "cell.json")[part], name: value}})
    with pytest.raises(BadFile, match=found):
        storage.read_cell(folder)


@pytest.mark.parametrize(
    ("part", "changes", "found"),
    [
        ("cells", {"lag": "two"}, r"cells\[0\].lag: expected a number of frames, found two"),
        ("behaviours", {"lag": -1}, r"behaviours\[0\].lag: expected a number of frames, found -1"),
        ("cells", {"sigma_scores": {"sigma_coverage_1": 2.0}}, "sigma_coverage_1 is 2.0"),
        ("methods", {"sigma_scores": 5}, "the pooled sigma_scores is 5"),
    ],
)
def test_impossible_rows_of_a_summary_are_refused(
    run_folder: Path, make_cell: MakeCell, judge: Callable[..., Any], part: str, changes: dict[str, Any], found: str
) -> None:
    write_run(run_folder, [stating(make_cell, judge)])
    content = read_json(run_folder / "summary.json")
    content[part][0].update(changes)
    write_json(run_folder / "summary.json", content)
    with pytest.raises(BadFile, match=found):
        storage.read_summary(run_folder)


def far_off(column: int, value: float) -> Callable[[MakeCell], storage.Cell]:
    """A cell with one value of one scored estimate replaced."""

    def make(make_cell: MakeCell) -> storage.Cell:
        qpos = make_cell().estimate_qpos.copy()
        qpos[60, column] = value
        return make_cell(estimate_qpos=qpos)

    return make


def without_orientation(make_cell: MakeCell) -> storage.Cell:
    qpos = make_cell().estimate_qpos.copy()
    qpos[60, 3:7] *= 1e-160
    return make_cell(estimate_qpos=qpos)


def with_sigma(value: float) -> Callable[[MakeCell], storage.Cell]:
    def make(make_cell: MakeCell) -> storage.Cell:
        sigma_rad = np.full((400, 48), 0.1)
        sigma_rad[7, 3] = value
        return make_cell(angle_sigma_rad=sigma_rad)

    return make


def with_long_bone(make_cell: MakeCell) -> storage.Cell:
    bone_m = make_cell().bone_m.copy()
    bone_m[3, 2] = 11.0
    return make_cell(estimate_bone_m=bone_m)


def with_negative_metric(make_cell: MakeCell) -> storage.Cell:
    scores = make_cell().scores
    return make_cell(scores=replace(scores, metrics={**scores.metrics, "mpjpe_mm": -1.0}))


IMPOSSIBLE: dict[str, tuple[Callable[[MakeCell], storage.Cell], str]] = {
    "an angle": (far_off(10, 1e17), "1e[+]17 at place 10 of a pose"),
    "a negative angle": (far_off(54, -1e6), "-1e[+]06 at place 54"),
    "a position": (far_off(0, 1e308), "1e[+]308 at place 0"),
    "no number": (far_off(0, np.nan), "estimate_qpos that is no pose"),
    "a quaternion": (without_orientation, "a root quaternion"),
    "no standard deviation": (with_sigma(0.0), "hinge 3 is 0 rad"),
    "a negative one": (with_sigma(-0.1), "hinge 3 is -0.1 rad"),
    "an undefined one": (with_sigma(np.nan), "hinge 3 is nan rad"),
    "an infinite one": (with_sigma(np.inf), "hinge 3 is inf rad"),
    "one below single precision": (with_sigma(1e-50), "hinge 3 is 0 rad"),
    "one beyond all angles": (with_sigma(1e6), "hinge 3 is 1e[+]06 rad"),
    "a bone": (with_long_bone, "a bone of more than 10 m"),
    "a metric": (with_negative_metric, "mpjpe_mm is -1"),
}


@pytest.mark.parametrize(("make", "fault"), IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_what_could_not_be_read_is_not_written_and_not_read_either(
    run_folder: Path,
    make_cell: MakeCell,
    make: Callable[[MakeCell], storage.Cell],
    fault: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    make_run(run_folder, manifest())
    cell = make(make_cell)
    with pytest.raises(ValueError, match=f"ik on walk_01 cannot be stored: .*{fault}"):
        storage.write_cell(run_folder, cell)
    assert list((run_folder / "cells").iterdir()) == []
    with monkeypatch.context() as careless:
        for name in ("find_cell_fault", "_find_impossible_content", "_find_impossible_frames"):
            careless.setattr(f"harness.results.cell.{name}", lambda content: "")
        folder = storage.write_cell(run_folder, cell)
    with pytest.raises(BadFile, match=fault):
        storage.read_cell(folder)


def test_the_largest_values_are_written_and_read(run_folder: Path, make_cell: MakeCell) -> None:
    make_run(run_folder, manifest())
    for make in (far_off(10, 0.999e6), far_off(0, -0.999e6), with_sigma(0.999e6), with_sigma(1.2e-38)):
        cell = make(make_cell)
        back = storage.read_cell(storage.write_cell(run_folder, cell))
        np.testing.assert_array_equal(back.estimate_qpos, cell.estimate_qpos)
        remove_folder(run_folder / "cells" / cell.key)


def test_a_cell_refuses_arrays_that_disagree(make_cell: MakeCell) -> None:
    with pytest.raises(ShapeError, match="quality"):
        make_cell(quality=np.ones((3, 2)))


def test_the_table_has_the_issues_columns_first(run_folder: Path, make_cell: MakeCell) -> None:
    cells = [make_cell(0.01), make_cell(0.03, clip="walk_02", stations=("head", "torso"))]
    write_run(run_folder, cells)
    text = (run_folder / "summary.csv").read_text()
    assert text.startswith(ISSUE_COLUMNS + ",")
    rows = list(csv.reader(text.splitlines()))
    first = dict(zip(rows[0], rows[1], strict=True))
    assert first["stations"] == "head torso"
    assert float(first["mpjpe_mm"]) == pytest.approx(10.0, abs=1e-6)
    assert [row[2] for row in rows[1:]] == ["walk_01", "walk_02"]
    assert [c.key for c in storage.read_cells(run_folder)] == [c.key for c in cells]


def test_no_name_in_the_table_is_a_formula(run_folder: Path, make_cell: MakeCell) -> None:
    """A spreadsheet runs what begins with such a sign; numbers below 0 stay numbers."""
    names = {"clip": "=1+1", "method": "-2+3", "behaviour": "@SUM(A1)", "scenario": "+cmd"}
    write_run(run_folder, [make_cell(0.01, **names, varied={"-k": -0.5, "name": "=x"})])
    (row,) = csv.DictReader((run_folder / "summary.csv").read_text().splitlines())
    assert {name: row[name] for name in names} == {name: f"'{text}" for name, text in names.items()}
    assert (row["vary.-k"], row["vary.name"], row["varied"]) == ("-0.5", "'=x", "'-k=-0.5 name==x")
    assert not [text for text in row.values() if text[:1] in "=+@" and text]


def test_means_over_sequences_and_over_frames_differ_when_takes_do(run_folder: Path, make_cell: MakeCell) -> None:
    content = write_run(run_folder, [make_cell(0.01, frames=300), make_cell(0.05, frames=100, clip="walk_02")])
    (method,) = content["methods"]
    mpjpe = method["metrics"]["mpjpe_mm"]
    assert mpjpe["mean"] == pytest.approx(30.0)
    assert mpjpe["sd"] == pytest.approx(np.std([10.0, 50.0], ddof=1))
    assert mpjpe["frame_weighted"] == pytest.approx((300 * 10.0 + 100 * 50.0) / 400, rel=1e-5)
    assert method["metrics"]["step_p50_ms"]["frame_weighted"] == pytest.approx(2.0)
    assert (method["frames_matched"], method["frames_expected"]) == (400, 800)
    assert read_json(run_folder / "summary.json") == to_json_types(content)


def test_a_root_mean_square_over_frames_is_no_mean_of_means(run_folder: Path, make_cell: MakeCell) -> None:
    cell = make_cell()
    uneven = {**cell.scores.per_frame, "joint_angle_rms_deg": np.where(np.arange(400) < 100, 2.0, 0.0)}
    scores = type(cell.scores)(cell.metrics, uneven, cell.scores.per_joint, cell.scores.scored)
    content = write_run(run_folder, [make_cell(scores=scores)])
    assert content["methods"][0]["metrics"]["joint_angle_rms_deg"]["frame_weighted"] == pytest.approx(1.0)


def test_protocols_and_inputs_are_never_pooled(run_folder: Path, make_cell: MakeCell) -> None:
    cells = [make_cell(0.01 * n, clip=f"c{n}", inputs=i, split=p) for n, (i, p) in
             enumerate([("pos", "block"), ("pos", "subject"), ("pos+ori", "block")])]  # fmt: skip
    content = write_run(run_folder, cells, failures={"ik on d": "boom"})
    assert [row["sequences"] for row in content["methods"]] == [1, 1, 1]
    assert content["outcome"] == "incomplete"
    assert (content["cells_finished"], content["cells_planned"]) == (3, 4)
    assert content["failures"] == {"ik on d": "boom"}


def test_a_run_goes_on_where_it_was_and_clears_what_a_kill_left(run_folder: Path, make_cell: MakeCell) -> None:
    make_run(run_folder, manifest())
    cell = make_cell()
    storage.write_cell(run_folder, cell)
    half = run_folder / "cells" / f"{TEMPORARY}12345-abc"
    half.mkdir()
    (half / "cell.json").write_text("{")
    (run_folder / f"{TEMPORARY}12345-summary.json").write_text("{")
    make_run(run_folder, manifest(methods=["ik", "local_pca"]))
    storage.remove_leftovers(run_folder)
    assert sorted(os.listdir(run_folder)) == [LOCK_FILE, "cells", "manifest.json"]
    assert os.listdir(run_folder / "cells") == [cell.key]
    assert storage.has_cell(run_folder, cell.key)


def test_writing_a_finished_cell_again_keeps_the_first(run_folder: Path, make_cell: MakeCell) -> None:
    folder = storage.write_cell(run_folder, make_cell())
    before = (folder / "cell.json").stat().st_mtime_ns
    storage.write_cell(run_folder, make_cell())
    assert (folder / "cell.json").stat().st_mtime_ns == before
    assert os.listdir(run_folder / "cells") == [folder.name]


def test_another_run_is_refused_and_says_in_what_it_differs(run_folder: Path) -> None:
    make_run(run_folder, manifest())
    before = (run_folder / "manifest.json").read_bytes()
    with pytest.raises(BadInput, match=r"motion\.test.*--out"):
        make_run(run_folder, manifest(motion={"test": ["a"]}))
    with pytest.raises(BadInput, match="seed"):
        make_run(run_folder, manifest(seed=2))
    assert (run_folder / "manifest.json").read_bytes() == before


def test_a_second_command_changes_nothing_while_another_process_writes(run_folder: Path) -> None:
    """The manifest of the first stays, though the second would write other circumstances into it."""
    with storage.open_run(run_folder, manifest(methods=["first"])):
        before = folder_bytes(run_folder)
        assert "first" in before["manifest.json"].decode()
        with pytest.raises(BadInput, match="Another process uses"):
            make_run(run_folder, manifest(methods=["second"]))
        assert folder_bytes(run_folder) == before
    make_run(run_folder, manifest(methods=["second"]))
    assert b"second" in folder_bytes(run_folder)["manifest.json"]


def test_a_refused_folder_gets_no_lock_file(run_folder: Path, tmp_path: Path) -> None:
    make_run(run_folder, manifest())
    (run_folder / LOCK_FILE).unlink()
    with pytest.raises(BadInput, match="another run"):
        make_run(run_folder, manifest(seed=2))
    assert not (run_folder / LOCK_FILE).exists()
    new = tmp_path / "killed"
    new.mkdir()
    (new / LOCK_FILE).touch()  # of a process that was killed before it wrote the manifest
    make_run(new, manifest())
    assert (new / "manifest.json").exists()


def test_a_folder_of_other_files_is_refused_untouched(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(BadInput, match=r"thesis\.tex"):
        make_run(tmp_path, manifest())
    assert os.listdir(tmp_path) == ["thesis.tex"]
    with pytest.raises(BadInput, match="is a file"):
        make_run(tmp_path / "thesis.tex", manifest())


@pytest.mark.parametrize(
    ("file", "content"),
    [
        ("cell.json", b""),
        ("cell.json", b"[1]"),
        ("cell.json", b"{}"),
        ("cell.json", b"\xff\xfe"),
        ("frames.npz", b""),
        ("frames.npz", b"PK\x03\x04cut"),
        ("frames.npz", None),
        ("bone_m", "long"),
        ("bone_m", [[1, 2]]),
        ("notes", 3),
        ("key", None),
    ],
)
def test_a_broken_file_or_field_of_a_cell_is_a_clear_refusal(
    run_folder: Path, make_cell: MakeCell, file: str, content: Any
) -> None:
    folder = storage.write_cell(run_folder, make_cell())
    if "." not in file:
        fields = {**read_json(folder / "cell.json"), file: content}
        write_json(folder / "cell.json", {name: value for name, value in fields.items() if value is not None})
    elif content is None:
        (folder / file).unlink()
    else:
        (folder / file).write_bytes(content)
    with pytest.raises(BadFile, match=r"cell\.json|frames\.npz|" + folder.name):
        storage.read_cell(folder)


WRITE_FOR_EVER = """
import dataclasses, itertools, pathlib, sys
from harness.results import storage
from harness.results.cell import as_row
from harness.results.files.digests import file_digest
run, key = pathlib.Path(sys.argv[1]), sys.argv[2]
cell = storage.read_cell(run / "cells" / key)
for n in itertools.count():
    storage.write_cell(run, dataclasses.replace(cell, key=f"{sys.argv[3]}-{n}"))
"""


def test_a_kill_at_any_moment_leaves_whole_cells_only(run_folder: Path, make_cell: MakeCell) -> None:
    make_run(run_folder, manifest())
    key = storage.write_cell(run_folder, make_cell()).name
    for turn, delay_s in enumerate((0.0, 0.013, 0.029)):
        child = subprocess.Popen([sys.executable, "-c", WRITE_FOR_EVER, str(run_folder), key, str(turn)])
        try:
            while not storage.has_cell(run_folder, f"{turn}-0"):
                assert child.poll() is None, "the child writes nothing"
                time.sleep(0.002)
            time.sleep(delay_s)
        finally:
            child.kill()
            child.wait()
    storage.remove_leftovers(run_folder)
    cells = [storage.read_cell(folder) for folder in (run_folder / "cells").iterdir()]
    assert len(cells) >= 4


def test_pickles_are_refused(run_folder: Path, make_cell: MakeCell) -> None:
    folder = storage.write_cell(run_folder, make_cell())
    np.savez(folder / "frames.npz", time_s=np.array([{"a": 1}], dtype=object))
    rewrite_json(folder / "cell.json", frames_sha256=file_digest(folder / "frames.npz", "", ""))
    with pytest.raises(BadFile, match="pickle"):
        storage.read_cell(folder)


@pytest.mark.parametrize(
    ("change", "message"), [({"cells": None}, "no cells"), ({"cells": [{"key": "../../elsewhere"}]}, "elsewhere")]
)
def test_a_summary_that_is_none_or_leads_elsewhere_is_refused(
    run_folder: Path, make_cell: MakeCell, change: dict[str, object], message: str
) -> None:
    content = write_run(run_folder, [make_cell()]) | change
    write_json(run_folder / "summary.json", {name: value for name, value in content.items() if value is not None})
    with pytest.raises(BadFile, match=message):
        storage.read_summary(run_folder)


def test_a_recovery_row_of_an_earlier_version_has_its_key_renamed(run_folder: Path, make_cell: MakeCell) -> None:
    storage.write_cell(run_folder, make_cell())
    content = finish_run(run_folder, keys=[make_cell().key], planned=1)
    names = ("method", "inputs", "split", "behaviour", "clip", "disturbance")
    numbers = ("disturbed_deg", "undisturbed_deg", "during", "ratio", "back_after_s", "status_right")
    row = {**dict.fromkeys(names, "a"), **dict.fromkeys(numbers, 1.0), "judged": 40}
    write_json(run_folder / "summary.json", content | {"recovery": [row]})
    (read,) = storage.read_summary(run_folder)["recovery"]
    assert (read["evaluated_frames"], "judged" in read) == (40, False)


def test_a_run_without_an_index_is_refused_with_advice(run_folder: Path, make_cell: MakeCell) -> None:
    make_run(run_folder, manifest())
    storage.write_cell(run_folder, make_cell())
    with pytest.raises(BadFile, match=r"index\.sqlite.*Give its command again"):
        storage.read_cells(run_folder)


def test_no_run_in_a_folder_is_said_at_once(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="harness run"):
        storage.read_cells(tmp_path)
    with pytest.raises(BadFile, match="the summary of a run"):
        storage.read_summary(tmp_path)


def test_a_key_depends_on_inputs_method_and_source_and_on_nothing_else() -> None:
    key = storage.cell_key({"a": 1, "b": {"c": 2.0}}, {"name": "ik"}, "s")
    assert key == storage.cell_key({"b": {"c": 2.0}, "a": 1}, {"name": "ik"}, "s")
    others = [
        storage.cell_key({"a": 2, "b": {"c": 2.0}}, {"name": "ik"}, "s"),
        storage.cell_key({"a": 1, "b": {"c": 2.0}}, {"name": "pca"}, "s"),
        storage.cell_key({"a": 1, "b": {"c": 2.0}}, {"name": "ik"}, "t"),
    ]
    assert len({key, *others}) == 4
    assert storage.digest(np.zeros((2, 3))) != storage.digest(np.zeros((3, 2)))


def test_a_manifest_survives_its_file_and_names_the_machine(run_folder: Path) -> None:
    make_run(run_folder, manifest())
    back = manifests.Manifest.read(run_folder / "manifest.json")
    assert back.differences(manifest()) == []
    assert back.metric_versions["mpjpe_mm"] >= 1
    assert back.circumstances["source_hash"] == manifests.source_hash()
    assert back.circumstances["packages"]["numpy"] == np.__version__
    assert back.circumstances["methods"] == ["ik"]
    write_json(run_folder / "manifest.json", {"seed": 1})
    with pytest.raises(BadFile, match="inputs"):
        manifests.Manifest.read(run_folder / "manifest.json")


def test_known_and_new_performers_and_varied_values_are_never_pooled(run_folder: Path, make_cell: MakeCell) -> None:
    shares = [0.0, 0.02, 0.02]
    cells = [
        make_cell(0.01, clip=f"c{n}", performer=who, varied={"components.echo.share": share, "noise": "clean"})
        for n, (who, share) in enumerate(zip(("known", "known", "new"), shares, strict=True))
    ]
    content = write_run(run_folder, cells)
    assert [row["sequences"] for row in content["methods"]] == [1, 1, 1]
    assert [row["varied"]["components.echo.share"] for row in content["behaviours"]] == shares
    assert [row["performer"] for row in content["cells"]] == ["known", "known", "new"]
    first, *table = csv.DictReader((run_folder / "summary.csv").read_text().splitlines())
    assert (first["performer"], first["varied"]) == ("known", "components.echo.share=0 noise=clean")
    assert [row["varied"] for row in table] == ["components.echo.share=0.02 noise=clean"] * 2
