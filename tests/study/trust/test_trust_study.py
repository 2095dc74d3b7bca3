"""A whole trust study on short clips: its findings, each outcome, and going on after a stop."""

import json
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.errors import BadFile, BadInput, HarnessError, Outcome, UnknownName
from harness.experiment import prepare_playback
from harness.experiment.methods import run_over_frames
from harness.measure import UnitFile, write_unit_file
from harness.results.files import FINDINGS, folder_lock, read_result_json, write_result_json
from harness.results.findings import Equivalence, PairAgreement, SideDifference
from harness.stream.recording import NOTE, RecordingBlock, encode_block, record_capture
from harness.study.trust.arm_results import Arm, TrustTask, read_cell_errors, run_capture
from harness.study.trust.characterization import preset_components
from harness.study.trust.plan import plan_digest
from harness.study.trust.trust_study import (
    OtherPlan,
    comparable_pairs,
    judge_outcome,
    run_trust_study,
)
from tests.results.finish import folder_bytes
from tests.study.trust.conftest import CLIPS, SmallStudy, write_log

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def finished(small_study: SmallStudy, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a finished study."""
    out = tmp_path_factory.mktemp("finished") / "out"
    run_trust_study(small_study.plan, small_study.captures, out)
    return out


def read_findings(out: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((out / FINDINGS).read_text(encoding="utf-8"))
    return content


def test_the_same_profile_on_both_sides_passes(finished: Path) -> None:
    found = read_findings(finished)
    assert found["outcome"] == "pass", found["why"]
    assert len(list((finished / "cells").iterdir())) == len(CLIPS) * 6 * 3
    assert [line["verdict"] for line in found["equivalences"]] == ["equivalent"] * 12
    assert all(line["clips"] == len(CLIPS) for line in found["equivalences"])
    assert {pair["verdict"] for pair in found["pairs"]} >= {"agree"}
    assert not any(pair["verdict"] == "contradict" for pair in found["pairs"])
    assert len(found["pairs"]) == 9
    assert [capture["clip"] for capture in found["captures"]] == list(CLIPS)
    assert found["rank_correlations"][1]["value"] > 0.9


def test_errors_of_the_simulation_are_not_those_of_the_device_though_the_seed_is_the_same(
    small_study: SmallStudy, tmp_path: Path
) -> None:
    """The captures were simulated with seed 1, which is a seed of the plan too."""
    arm = Arm("mean_pose", "two", ("head", "torso"))
    (tmp_path / "cells").mkdir()
    scenario = small_study.plan.with_name("small.toml")
    task = TrustTask(small_study.captures[0], "", scenario, (arm,), {}, ("mpjpe_mm",), (1,), None, tmp_path, None)
    device, simulated = (side["position error"][0].reshape(-1) for side in run_capture(task).readings)
    both = np.isfinite(device[: len(simulated)]) & np.isfinite(simulated[: len(device)])
    assert both.sum() > 1000
    assert abs(np.corrcoef(device[: len(both)][both], simulated[: len(both)][both])[0, 1]) < 0.3


def test_a_capture_of_a_performer_is_registered_with_the_clip(small_study: SmallStudy, tmp_path: Path) -> None:
    """The room is not that of the scenario, so that only a registration relates the capture to the clip.

    Then the same poses are a log of another program, with a clock of its own.
    """
    text = small_study.plan.with_name("small.toml").read_text(encoding="utf-8").replace("= 3.0", "= 20.0")
    (tmp_path / "long.toml").write_text(text, encoding="utf-8")
    (tmp_path / "room.toml").write_text(text + "[tracker]\norigin_m = [0.3, -0.2, 2.6]\n", encoding="utf-8")
    (tmp_path / "cells").mkdir()
    found = []
    for room in ("long.toml", "room.toml"):
        simulation = prepare_playback(tmp_path / room, clip="boxing_p1_01").simulation
        capture = tmp_path / f"{room}.rec"
        record_capture(capture, simulation.wire_format, simulation.wire, {"source": "port"})
        arm = Arm("ik:previous", "all", simulation.stations)
        metrics = ("joint_angle_mean_deg",)
        scenario = tmp_path / "long.toml"
        task = TrustTask(capture, "boxing_p1_01", scenario, (arm,), {}, metrics, (1,), None, tmp_path, None)
        found.append(run_capture(task))
        with pytest.raises(BadInput, match="Name the clip"):
            run_capture(replace(task, clip=""))
    found.append(run_capture(replace(task, capture=write_log(capture, tmp_path / "poses.csv"))))
    played, *registered = found
    assert played.notes == ()
    for result, name in zip(registered, ("room.toml.rec", "poses.csv"), strict=True):
        (note,) = result.notes
        assert f"{name} was registered with boxing_p1_01" in note
        errors = [one.device["ik:previous, all"]["joint_angle_mean_deg"] for one in (played, result)]
        assert errors[1] == pytest.approx(errors[0], rel=0.15)
        for feature in ("position error", "orientation error"):
            spread = [float(np.nanstd(one.readings[0][feature][0])) for one in (played, result)]
            assert spread[1] == pytest.approx(spread[0], rel=0.15)


def test_readings_and_health_of_both_sides_are_alike(finished: Path) -> None:
    found = read_findings(finished)
    assert len(found["distances"]) == 12
    for row in found["distances"]:
        assert row["p_holm"] > 0.01, row
        assert min(row["blocks"]) >= 4
        assert row["distance"] < 3.0 * row["split_half"]
    for row in found["health"]:
        for side in (row["device"], row["simulated"]):
            assert side["rate_hz"] == pytest.approx(40.0, rel=0.01)
            assert side["quality"] > 0.8
            assert side["lost_share"] < 0.2


def test_finished_cells_are_read_and_the_findings_have_the_same_bytes(
    finished: Path, small_study: SmallStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    shutil.copytree(finished, out)
    (out / FINDINGS).unlink()
    cells = sorted((out / "cells").iterdir())
    for cell in cells[::5]:
        cell.unlink()
    ran: list[Any] = []

    def count_runs(fitted: Any, calibration: Any, frames: Any) -> Any:
        ran.append(calibration)
        return run_over_frames(fitted, calibration, frames)

    monkeypatch.setattr("harness.experiment.evaluation.run_over_frames", count_runs)
    run_trust_study(small_study.plan, small_study.captures, out)
    assert len(ran) == len(cells[::5])
    assert (out / FINDINGS).read_bytes() == (finished / FINDINGS).read_bytes()
    assert {cell.name: cell.read_bytes() for cell in (out / "cells").iterdir()} == {
        cell.name: cell.read_bytes() for cell in (finished / "cells").iterdir()
    }


@pytest.mark.slow
def test_a_study_that_is_killed_goes_on_to_the_same_bytes(
    finished: Path, small_study: SmallStudy, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-m", "harness", "trust", str(small_study.plan), *map(str, small_study.captures)]
    killed = 0
    for wanted in range(5, 105, 10):
        process = subprocess.Popen([*command, "--out", str(out)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while process.poll() is None and len(list(out.glob("cells/*.json"))) < wanted:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
        killed += process.wait() == -signal.SIGKILL
    assert killed == 10
    assert subprocess.run([*command, "--out", str(out)], check=False, capture_output=True).returncode == 0
    assert (out / FINDINGS).read_bytes() == (finished / FINDINGS).read_bytes()


def test_a_refused_study_changes_nothing(finished: Path, small_study: SmallStudy, tmp_path: Path) -> None:
    before = folder_bytes(finished)
    with folder_lock(finished), pytest.raises(BadInput, match="Another process uses"):
        run_trust_study(small_study.plan, small_study.captures, finished)
    assert folder_bytes(finished) == before
    simulation = prepare_playback(small_study.plan.with_name("small.toml"), clip=CLIPS[0], stations=2).simulation
    note = {"scenario": "small", "plan": plan_digest(small_study.plan), "clip": CLIPS[0]}
    record_capture(tmp_path / "two.rec", simulation.wire_format, simulation.wire, note)
    with pytest.raises(HarnessError, match="station"):
        run_trust_study(small_study.plan, [small_study.captures[0], tmp_path / "two.rec"], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_damaged_cell_has_no_result(finished: Path, small_study: SmallStudy, tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(finished, out)
    cell = min((out / "cells").iterdir())
    cell.write_bytes(cell.read_bytes().replace(b'"joint_angle_mean_deg": ', b'"joint_angle_mean_deg": 1'))
    found = run_trust_study(small_study.plan, small_study.captures, out).findings
    assert found.outcome is Outcome.INCOMPLETE
    assert [cell.name in why and "digest" in why for why in found.failures.values()] == [True]


def test_a_cell_in_the_place_of_another_has_no_result(finished: Path, small_study: SmallStudy, tmp_path: Path) -> None:
    """Its digest fits, but it is of another method, of the other side, or of an earlier version without a key."""
    out = tmp_path / "out"
    shutil.copytree(finished, out)
    cells = {}
    for path in (out / "cells").iterdir():
        content = json.loads(path.read_text(encoding="utf-8"))
        if content["clip"] == CLIPS[0]:
            cells[content["arm"], content["side"]] = path
    shutil.copy(cells["mean_pose, all", "device"], cells["best_match, all", "device"])
    shutil.copy(cells["ik:previous, all", "seed 1"], cells["ik:previous, all", "device"])
    shutil.copy(cells["ik:previous, four", "seed 1"], cells["ik:previous, four", "seed 2"])
    keyless = read_result_json(cells["mean_pose, four", "device"], "", "")
    del keyless["key"]
    write_result_json(cells["mean_pose, four", "device"], keyless)
    found = run_trust_study(small_study.plan, small_study.captures[:1], _of_first_capture(out)).findings
    assert set(found.failures) == {
        f"best_match, all on {CLIPS[0]}, device",
        f"ik:previous, all on {CLIPS[0]}, device",
        f"ik:previous, four on {CLIPS[0]}, seed 2",
        f"mean_pose, four on {CLIPS[0]}, device",
    }
    assert "no word of what it is of" in found.failures[f"mean_pose, four on {CLIPS[0]}, device"]
    path = cells["ik:previous, all", "seed 1"]
    with pytest.raises(BadFile, match="of seed 1; expected the errors of a finished cell, of device"):
        read_cell_errors(path, {"key": path.stem, "side": "device"}, ("joint_angle_mean_deg", "mpjpe_mm"))


def _of_first_capture(out: Path) -> Path:
    """The folder with the identity of a study of the first capture alone, whose cells are the same."""
    study = read_result_json(out / "study.json", "", "")
    write_result_json(out / "study.json", {**study, "captures": study["captures"][:1]})
    return out


def test_a_changed_plan_is_not_comparable_unless_exploratory(small_study: SmallStudy, tmp_path: Path) -> None:
    changed = small_study.another_plan("changed.toml", "200.0", "199.0")
    with pytest.raises(OtherPlan, match="another plan") as caught:
        run_trust_study(changed, small_study.captures, tmp_path / "refused")
    assert caught.value.outcome is Outcome.NOT_COMPARABLE
    assert not (tmp_path / "refused").exists()
    found = run_trust_study(changed, small_study.captures[:1], tmp_path / "out", exploratory=True).findings
    assert found.exploratory
    assert (found.outcome, found.equivalences[0].why) == (Outcome.NOT_COMPARABLE, "too few units: 1, of at least 6")


def test_a_renewed_plan_is_not_that_of_the_capture(small_study: SmallStudy, tmp_path: Path) -> None:
    """A note of the new plan behind the data, as versions before wrote it, does not make the capture one of it."""
    changed = small_study.another_plan("renewed.toml", "200.0", "198.0")
    capture = tmp_path / "renewed.rec"
    renewed = RecordingBlock(NOTE, 9.0, 9.0, json.dumps({"clip": CLIPS[0], "plan": plan_digest(changed)}).encode())
    capture.write_bytes(small_study.captures[0].read_bytes() + encode_block(renewed))
    for plan in (changed, small_study.plan):
        with pytest.raises(OtherPlan, match="written after data, or renewed"):
            run_trust_study(plan, [capture], tmp_path / "out")
    note = RecordingBlock(
        NOTE, 9.0, 9.0, json.dumps({"clip": CLIPS[1], "plan": plan_digest(small_study.plan)}).encode()
    )
    capture.write_bytes(small_study.captures[0].read_bytes() + encode_block(note))
    with pytest.raises(BadFile, match=f"notes of different clips .{CLIPS[0]}, {CLIPS[1]}."):
        run_trust_study(small_study.plan, [capture], tmp_path / "out", exploratory=True)
    assert not (tmp_path / "out").exists()


def test_the_plan_of_the_captures_is_not_exploratory(small_study: SmallStudy, tmp_path: Path) -> None:
    found = run_trust_study(small_study.plan, small_study.captures[:1], tmp_path / "out", exploratory=True).findings
    assert not found.exploratory


def test_a_unit_that_is_worse_than_the_device_is_beyond_the_margin(small_study: SmallStudy, tmp_path: Path) -> None:
    components = preset_components()
    components["white"] = {**components["white"], "orientation_rad": 0.2}
    write_unit_file(small_study.plan.with_name("noisy.toml"), UnitFile("noisy", components, {}))
    plan = small_study.another_plan("noisy_plan.toml", "seeds = [1, 2]", 'seeds = [1]\nunit = "noisy.toml"')
    plan.write_text(plan.read_text().replace("20.0", "0.5").replace('"mean_pose", "best_match", ', ""))
    found = run_trust_study(plan, small_study.captures, tmp_path / "out", exploratory=True).findings
    assert found.outcome is Outcome.REGRESSED, found.why
    lines = {(line.arm, line.metric): line for line in found.equivalences}
    worse = lines["ik:previous, all", "joint_angle_mean_deg"]
    assert worse.verdict == "beyond the margin"
    assert worse.difference is not None
    assert worse.difference > 0.5
    assert found.unit_digest
    turned = [row.p_holm for row in found.distances if row.feature == "orientation error"]
    assert all(p is not None and p < 0.1 for p in turned)


def test_a_method_that_fails_costs_its_cells(
    small_study: SmallStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail_for_four(fitted: Any, calibration: Any, frames: Any) -> Any:
        if len(calibration.stations) == 4:
            raise ZeroDivisionError("the method divides by zero")
        return run_over_frames(fitted, calibration, frames)

    monkeypatch.setattr("harness.experiment.evaluation.run_over_frames", fail_for_four)
    found = run_trust_study(small_study.plan, small_study.captures, tmp_path / "out").findings
    assert found.outcome is Outcome.INCOMPLETE
    assert len(found.failures) == len(CLIPS) * 3 * 3
    assert "divides by zero" in found.failures["best_match, four on golf_p1_01, seed 2"]
    whole = {line.arm: line.verdict for line in found.equivalences}
    assert whole["best_match, all"] == "equivalent"
    assert whole["best_match, four"] == "cannot tell"


@pytest.mark.parametrize(
    ("captures", "clips", "error", "words"),
    [
        ([], [], BadInput, "captures"),
        ([0, 0], [], BadInput, "twice"),
        ([0, 1], ["walking_p1_01"], BadInput, "1 clips for 2 captures"),
        ([0], ["boxing_p1_01"], BadInput, "another motion"),
        ([0], ["nothing"], UnknownName, "nothing"),
    ],
)
def test_captures_that_are_refused(
    small_study: SmallStudy, tmp_path: Path, captures: list[int], clips: list[str], error: type, words: str
) -> None:
    given = [small_study.captures[k] for k in captures]
    with pytest.raises(error, match=words):
        run_trust_study(small_study.plan, given, tmp_path / "out", clips=clips)


def test_a_copy_of_a_capture_is_refused(small_study: SmallStudy, tmp_path: Path) -> None:
    copy = shutil.copy(small_study.captures[0], tmp_path / "copy.rec")
    with pytest.raises(BadInput, match="or a copy of it"):
        run_trust_study(small_study.plan, [small_study.captures[0], Path(copy)], tmp_path / "out")


def test_a_folder_of_another_study_is_refused(finished: Path, small_study: SmallStudy) -> None:
    with pytest.raises(BadInput, match="another study"):
        run_trust_study(small_study.plan, small_study.captures[:3], finished)


def test_parameters_are_arms_of_their_own(small_study: SmallStudy, tmp_path: Path) -> None:
    plan = small_study.another_plan(
        "varied.toml", "[stations]", '[parameters]\n"motion.thin_to" = [5, 200]\n[stations]'
    )
    found = run_trust_study(plan, small_study.captures[:1], tmp_path / "out", exploratory=True).findings
    assert len(found.arms) == 12
    lines = {line.arm: line.device for line in found.equivalences if line.metric == "joint_angle_mean_deg"}
    assert lines["best_match, all, thin_to = 5"] != lines["best_match, all, thin_to = 200"]
    assert lines["ik:previous, all, thin_to = 5"] == lines["ik:previous, all, thin_to = 200"]
    assert ("best_match, all, thin_to = 5", "best_match, all, thin_to = 200") in {(p.a, p.b) for p in found.pairs}
    assert ("mean_pose, all, thin_to = 5", "best_match, all, thin_to = 200") not in {(p.a, p.b) for p in found.pairs}


def test_pairs_differ_in_one_thing() -> None:
    arms = [Arm("a", "x", ("1",)), Arm("b", "x", ("1",)), Arm("a", "y", ("2",)), Arm("b", "y", ("2",))]
    assert comparable_pairs(arms) == [("a, x", "b, x"), ("a, x", "a, y"), ("b, x", "b, y"), ("a, y", "b, y")]


EQUIVALENT = Equivalence("ik", "mpjpe_mm", 1.0, 9, 1.0, 1.0, 0.0, -0.1, 0.1, "equivalent", "within")
SIDE = SideDifference(1.0, 0.5, 1.5, 0.001)
AGREE = PairAgreement("a", "b", 9, SIDE, SIDE, 0.001, 0.001, "agree", "same order")
UNTOLD, UNTOLD_PAIR = replace(EQUIVALENT, verdict="cannot tell"), replace(AGREE, verdict="cannot tell")


@pytest.mark.parametrize(
    ("equivalences", "pairs", "failures", "outcome"),
    [
        ([EQUIVALENT], [AGREE, UNTOLD_PAIR], {}, Outcome.PASS),
        ([EQUIVALENT], [], {}, Outcome.PASS),
        ([EQUIVALENT], [UNTOLD_PAIR], {}, Outcome.NOT_COMPARABLE),
        ([EQUIVALENT, UNTOLD], [AGREE], {}, Outcome.NOT_COMPARABLE),
        ([EQUIVALENT], [AGREE], {"cell": "why"}, Outcome.INCOMPLETE),
        ([EQUIVALENT], [AGREE, replace(AGREE, verdict="contradict")], {"cell": "why"}, Outcome.REGRESSED),
        ([UNTOLD, replace(EQUIVALENT, verdict="beyond the margin")], [AGREE], {}, Outcome.REGRESSED),
    ],
)
def test_each_outcome(
    equivalences: list[Equivalence], pairs: list[PairAgreement], failures: dict[str, str], outcome: Outcome
) -> None:
    found, why = judge_outcome(equivalences, pairs, failures)
    assert found is outcome
    assert why.endswith(".")


def test_methods_take_most_of_the_time(small_study: SmallStudy, tmp_path: Path) -> None:
    """The methods' own time is counted; `harness bench lab` measures the ratio with longer clips."""
    start = time.perf_counter()
    study = run_trust_study(small_study.plan, small_study.captures[:1], tmp_path / "out")
    assert 0.0 < study.methods_s < time.perf_counter() - start
    assert np.isfinite(study.methods_s)
