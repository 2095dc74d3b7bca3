"""A study measures, resumes, refuses another's folder, survives failures, and is read back as it was."""

import json
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.cli import main
from harness.core.files import TEMPORARY
from harness.errors import BadFile, BadInput, Outcome, UnknownName
from harness.experiment import read_status
from harness.results import open_study
from harness.results.files import folder_lock, read_result_json, write_result_json
from harness.results.findings import BarChart, LineChart, PaperExperiment, read_findings
from harness.study.papers.paper import Paper, reproduce
from harness.study.papers.paper_study import PaperStudy, count_cells, run_scenarios
from harness.study.papers.tables import errors_by_unit
from tests.interrupts import heeding_interrupts
from tests.results.finish import folder_bytes
from tests.study.papers.tiny import BOUTS, TINY, WALKS


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("studies") / "tiny"
    findings, outcome = reproduce(TINY, out, command="harness paper tiny")
    assert outcome is Outcome.PASS
    assert read_findings(out / "findings.json") == findings
    return out


def test_findings_hold_what_the_cells_say(finished: Path) -> None:
    findings = read_findings(finished / "findings.json")
    walks, bouts = findings.experiments
    study = PaperStudy(finished, "builtin", 1, TINY.plan("builtin", 1))
    errors = {method: errors_by_unit(study.rows("walks", method=method)) for method in WALKS.methods}
    assert {unit for each in errors.values() for unit in each} == {"performer p1", "performer p2"}
    for row, cell in study.cells("walks"):
        of_frames = float(np.mean(cell.errors["joint_angle_mean_deg"][cell.scores.scored]))
        assert of_frames == pytest.approx(errors[cell.method][row["unit"]], rel=1e-4)
    claim = walks.claims[0]
    assert (claim.clips, claim.verdict, claim.low) == (2, "cannot tell", None)
    off = [errors["ik:previous"][unit] - errors["mean_pose"][unit] for unit in errors["mean_pose"]]
    assert claim.value == pytest.approx(np.mean(off))
    bars, lines = walks.figures
    assert isinstance(bars, BarChart)
    assert isinstance(lines, LineChart)
    assert list(bars.series["mean_pose"]) == pytest.approx([np.mean(list(errors["mean_pose"].values()))])
    drawn = np.array(lines.series["mean_pose"], float)
    assert np.mean(drawn) == pytest.approx(errors["mean_pose"]["performer p1"], rel=1e-4)
    assert lines.x[0] >= 1.0  # the warm-up is not drawn
    assert bouts.claims[0].clips == 1
    assert walks.notes == ("4 cells", "Units of the statistics: walks: 2 performers.")


def test_the_study_says_what_it_rests_on(finished: Path) -> None:
    tables = {table.title.split(" (")[0]: table for table in read_findings(finished / "findings.json").tables}
    (left_out,) = {row[1:] for row in tables["Left out"].rows}
    assert left_out == ("walking_p3_01", "two clips are enough")
    databases = {row[0]: row for row in tables["Test clips and examples"].rows}
    tested, learnt = "walking_p1_01, walking_p2_01", "2: walking_p1_02, walking_p2_02"
    assert databases["walks"][2:] == (tested, "2 performers", learnt, "1,600")
    constants = {row[0]: row[1] for row in tables["Constants of the methods"].rows}
    assert set(constants) == set(WALKS.methods)
    manifest = json.loads((finished / "walks" / "manifest.json").read_text())
    assert manifest["circumstances"]["constants"] == constants
    assert manifest["circumstances"]["left_out"] == WALKS.left_out
    assert manifest["inputs"]["motion"]["examples"] == list(WALKS.motion.examples)
    assert manifest["inputs"]["seed"] == 1


def made(out: Path) -> dict[str, int]:
    cells = (path for path in out.glob("*/cells/*") if not path.name.startswith(TEMPORARY))
    return {path.name: path.stat().st_mtime_ns for path in cells}


def test_a_finished_study_runs_and_measures_nothing_again(finished: Path) -> None:
    before, measured = made(finished), (finished / "measured" / "count.json").stat().st_mtime_ns
    assert reproduce(TINY, finished)[1] is Outcome.PASS
    assert made(finished) == before
    assert (finished / "measured" / "count.json").stat().st_mtime_ns == measured


def stopped(out: Path) -> tuple[int, str]:
    """The verb's exit code and all it printed, with Ctrl-C when the first cell was finished."""
    command = [sys.executable, "-m", "tests.study.papers.tiny", "--out", str(out)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, preexec_fn=heeding_interrupts
    ) as program:
        until_s = time.monotonic() + 300.0
        while not made(out) and time.monotonic() < until_s:
            assert program.poll() is None, "it ended too soon"
            time.sleep(0.005)
        program.send_signal(signal.SIGINT)
        said = program.communicate(timeout=120)[0]
    assert made(out)
    assert not (out / "findings.json").exists()
    return program.returncode, said


@pytest.mark.long
def test_ctrl_c_keeps_cells_and_says_how_to_go_on(tmp_path: Path) -> None:
    out = tmp_path / "tiny"
    code, said = stopped(out)
    assert code == 130
    assert "the same command resumes" in said
    assert said.splitlines()[-1] == "interrupted"
    assert "Traceback" not in said
    kept = made(out)
    assert reproduce(TINY, out)[1] is Outcome.PASS
    assert kept.items() <= made(out).items()
    assert len(made(out)) == count_cells(TINY.plan("builtin", 1)) == 6


def test_a_paper_is_running_while_its_experiments_are_evaluated(finished: Path, tmp_path: Path) -> None:
    out, seen = shutil.copytree(finished, tmp_path / "copy"), []

    def look(study: PaperStudy) -> PaperExperiment:
        seen.append(read_status(study.out).running)
        return PaperExperiment("look", "", "", ())

    reproduce(replace(TINY, experiments={"look": look}), out)
    assert seen == [True]
    assert not read_status(out).running


def test_a_full_disk_is_no_failed_experiment(finished: Path, tmp_path: Path) -> None:
    out = shutil.copytree(finished, tmp_path / "copy")

    def fail(study: PaperStudy) -> PaperExperiment:
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space"):
        reproduce(replace(TINY, experiments={"fail": fail}), out)


def test_a_second_command_changes_nothing_while_the_first_writes(finished: Path) -> None:
    before = folder_bytes(finished)
    with folder_lock(finished), pytest.raises(BadInput, match="Another process uses"):
        reproduce(TINY, finished, command="second")
    assert folder_bytes(finished) == before


def test_a_folder_of_another_study_is_refused(finished: Path, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="seed: 1, not 2"):
        reproduce(TINY, finished, seed=2)
    with pytest.raises(BadInput, match="paper: tiny, not other"):
        reproduce(replace(TINY, name="other"), finished)
    motion = {"paper": "tiny", "motion": "cmu", "seed": 1}
    with pytest.raises(BadInput, match="motion: built-in performer, not cmu"), open_study(finished, motion):
        pass
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(BadInput, match=r"thesis\.tex"):
        reproduce(TINY, tmp_path)
    with pytest.raises(BadInput, match="is a file"):
        reproduce(TINY, tmp_path / "thesis.tex")
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_names_that_do_not_exist_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    wrong = replace(BOUTS, motion=replace(BOUTS.motion, test=("boxing_p999_01",)))
    with pytest.raises(UnknownName):
        reproduce(replace(TINY, runs=(WALKS, wrong)), tmp_path / "tiny")
    assert not (tmp_path / "tiny").exists()


def test_what_fails_is_told_and_stops_nothing(tmp_path: Path) -> None:
    """One method's cells, a run that is refused whole, and an experiment that cannot be judged."""
    broken = replace(WALKS, methods=("mean_pose", "tests.experiment.test_engine:Broken"))
    refused = replace(BOUTS, motion=replace(BOUTS.motion, longest_s=0.5))  # all of it warm-up

    def judge(study: PaperStudy) -> PaperExperiment:
        raise ZeroDivisionError("by nothing")

    paper = replace(TINY, runs=(broken, refused), experiments={"judge": judge, "bouts": TINY.experiments["bouts"]})
    seen: list[tuple[int, int]] = []
    findings, outcome = reproduce(
        paper, tmp_path / "tiny", progress=lambda last, done, planned: seen.append((done, planned))
    )
    assert outcome is Outcome.INCOMPLETE
    assert len(made(tmp_path / "tiny")) == 2
    judged, bouts = findings.experiments
    assert "ZeroDivisionError: by nothing" in judged.notes[0]
    assert bouts.claims[0].verdict == "not run"
    assert "warm-up" in " ".join(bouts.notes)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    assert seen[-1] == (8, 8)
    study = PaperStudy(tmp_path / "tiny", "builtin", 1, {"walks": broken})
    assert errors_by_unit(study.rows("walks", method="tests.experiment.test_engine:Broken")) == {}
    failures = run_scenarios({"walks": broken}, tmp_path / "tiny")
    assert len(failures) == 2
    assert all("on purpose" in text for text in failures.values())


def test_known_and_new_performers_are_never_pooled(finished: Path) -> None:
    rows = PaperStudy(finished, "builtin", 1, {"walks": WALKS}).rows("walks", method="mean_pose")
    assert len(errors_by_unit(rows)) == 2
    with pytest.raises(BadInput, match="performer"):
        errors_by_unit([rows[0], {**rows[1], "performer": "new"}])
    with pytest.raises(BadInput, match="method"):
        errors_by_unit([rows[0], {**rows[1], "method": "ik"}])
    with pytest.raises(BadInput, match="Two errors"):
        errors_by_unit([rows[0], rows[0]])


def test_a_paper_without_runs_on_a_motion_says_so(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no runs on builtin"):
        reproduce(Paper("unheard", "", {}), tmp_path / "out")


def test_the_verb_prints_claims_and_where_the_report_lies(
    finished: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("harness.study.papers.paper.load_paper", lambda name: TINY)
    words = ["paper", "liu2011", "--out", str(finished), "--jobs", "1"]
    assert main(words) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[-1] == "pass"
    assert said[-2] == f"report: {finished / 'report.html'}"
    assert any("mean_pose errs less" in line and "cannot tell" in line for line in said)
    assert main([*words, "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["outcome"] == "pass"
    assert content["experiments"][0]["claims"][0]["clips"] == 2
    assert Path(content["report"]).is_file()
    assert main([*words, "--seed", "2"]) == 2
    assert "another study (seed: 1, not 2)" in capsys.readouterr().err


def test_cells_are_counted_over_clips_methods_inputs_and_variants() -> None:
    """Two clips, two methods, two kinds of inputs and three values of an option; and one clip with two methods."""
    varied = replace(WALKS, inputs=("pos+ori", "pos"), vary={"tracker.rate_hz": [40.0, 60.0, 90.0]})
    assert count_cells({"walks": varied, "bouts": BOUTS}) == 2 * 2 * 2 * 3 + 1 * 2


def test_no_number_comes_from_a_folder_that_holds_another_run(tmp_path: Path) -> None:
    """The run is refused, and its folder is not read."""
    (tmp_path / "walks").mkdir()
    (tmp_path / "walks" / "thesis.tex").write_text("years of work")
    (tmp_path / "walks" / "summary.json").write_text("of another run")
    failures = run_scenarios({"walks": WALKS}, tmp_path)
    assert "files that are no run" in failures["walks"]
    study = PaperStudy(tmp_path, "builtin", 1, {"walks": WALKS}, failures=failures)
    assert (study.rows("walks"), list(study.cells("walks"))) == ([], [])


def test_a_measurement_in_the_place_of_another_is_refused(tmp_path: Path) -> None:
    study = PaperStudy(tmp_path, "builtin", 1, TINY.plan("builtin", 1))
    assert study.cached_measurement("golf", lambda: (1.0, float("nan"))) == [1.0, None]
    assert study.cached_measurement("walking", lambda: 2.0) == 2.0
    assert study.cached_measurement("golf", lambda: 3.0) == [1.0, None]
    golf, walking = (tmp_path / "measured" / f"{name}.json" for name in ("golf", "walking"))
    shutil.copy(walking, golf)
    with pytest.raises(BadFile, match=r"golf\.json: of walking; expected a cached measurement of this study, of golf"):
        study.cached_measurement("golf", lambda: 1.0)
    golf.unlink()
    for other in (replace(study, seed=2), replace(study, motion="cmu"), replace(study, runs={"bouts": BOUTS})):
        with pytest.raises(BadFile, match=r"walking\.json"):
            other.cached_measurement("walking", lambda: 3.0)
    earlier = read_result_json(walking, "", "") | {"source_hash": "0" * 16}
    write_result_json(walking, {"value": earlier["value"], "source_hash": earlier["source_hash"]})
    assert study.cached_measurement("walking", lambda: 4.0) == 4.0  # of other source: measured again
