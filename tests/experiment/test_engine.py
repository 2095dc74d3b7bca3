"""The whole loop on built-in motion: it measures, resumes, survives a failing method, and is the same every time."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.body import Body
from harness.compare import compare_runs
from harness.compare.run_summary import ExpectedOrder
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.files import TEMPORARY
from harness.core.motion import BodyMotion
from harness.errors import BadInput, Outcome, UnknownName
from harness.experiment import cells, engine
from harness.experiment.scenarios.scenario import Scenario, Station
from harness.experiment.scenarios.scenario_motion import ScenarioMotion
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.reconstruct import Reconstructor, Session
from harness.report.comparison.wording import comparison_sentence
from harness.report.run.text import run_table
from harness.results import Manifest, read_summary, select_cells
from harness.stream import TrackerFrame
from tests.interrupts import heeding_interrupts
from tests.short_demo import short_demo

SMALL = Scenario(
    name="small",
    motion=ScenarioMotion(
        "builtin", ("walking_p1_01", "boxing_p2_01"), ("walking", "boxing"), ("walking_p1_02",), longest_s=2.5
    ),
    stations=load_scenario("demo").stations,
    methods=("ik:previous", "mean_pose"),
)


def rows(out: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = read_summary(out)["cells"]
    return found


def test_a_run_measures_every_cell(tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    out = tmp_path / "run"
    outcome = engine.run(SMALL, out, progress=lambda cell, done, planned: seen.append((done, planned)))
    assert outcome is Outcome.PASS
    assert seen == [(k, 4) for k in (0, 1, 2, 3, 4)]
    found = {(row["method"], row["clip"]): row for row in rows(out)}
    assert set(found) == {(m, c) for m in SMALL.methods for c in SMALL.motion.test}
    for (method, _), row in found.items():
        assert row["motion_source"] == "built-in performer"
        assert row["split"] == ("none" if method == "ik:previous" else "sequence")
        assert row["frames_matched"] == row["frames_expected"]
        assert 0.5 < row["joint_angle_mean_deg"] < 30.0
    header = (out / "summary.csv").read_text().splitlines()[0]
    assert header.startswith(
        "method,behaviour,clip,motion_source,stations,mount,rate_hz,inputs,split,calibration,noise,seed,"
        "frames_matched,frames_expected,joint_angle_mean_deg,joint_angle_rms_deg,mpjre_deg,mpjpe_mm,mpjpe_root_mm,"
        "jitter_m_s3,step_p50_ms,step_p99_ms,fps"
    )
    performers = {"walking_p1_01": "p1", "boxing_p2_01": "p2"}
    assert Manifest.read(out / "manifest.json").performers == performers
    assert read_summary(out)["performers"] == performers
    assert "on 2 performers:" in comparison_sentence(compare_runs(out, methods=("mean_pose", "mean_pose")))
    engine.run(replace(SMALL, unit="clip"), out)  # the cells are the same, and what is said of them is not
    assert {row["key"] for row in rows(out)} == {row["key"] for row in found.values()}
    assert (Manifest.read(out / "manifest.json").unit, read_summary(out)["unit"]) == ("clip", "clip")
    counted = "on 2 clips of 2 performers, these performers only:"
    assert counted in comparison_sentence(compare_runs(out, methods=("mean_pose", "mean_pose")))


def test_a_run_goes_on_where_it_was(tmp_path: Path) -> None:
    out = tmp_path / "run"
    engine.run(SMALL, out)
    made = {path.name: path.stat().st_mtime_ns for path in (out / "cells").iterdir()}
    gone = sorted(made)[0]
    for file in (out / "cells" / gone).iterdir():
        file.unlink()
    (out / "cells" / gone).rmdir()
    engine.run(SMALL, out)
    again = {path.name: path.stat().st_mtime_ns for path in (out / "cells").iterdir()}
    assert set(again) == set(made)
    assert {name for name in made if again[name] != made[name]} == {gone}


def test_expected_orders_are_judged_and_are_no_part_of_what_a_run_is(tmp_path: Path) -> None:
    out = tmp_path / "run"
    expected = ExpectedOrder("nobody", methods=SMALL.methods)
    engine.run(replace(SMALL, expected_order=(expected,)), out)
    walking, boxing = read_summary(out)["expected_orders"]
    assert (walking["behaviour"], boxing["behaviour"], boxing["clips"]) == ("walking", "boxing", 1)
    errors = [row["joint_angle_mean_deg"] for row in rows(out) if row["behaviour"] == "boxing"]
    assert boxing["means_deg"] == errors
    assert boxing["holds"] == (round(errors[0], 2) < round(errors[1], 2))
    assert "expected orders: " in run_table(read_summary(out))
    made = {path.name: path.stat().st_mtime_ns for path in (out / "cells").iterdir()}
    engine.run(SMALL, out)
    assert {path.name: path.stat().st_mtime_ns for path in (out / "cells").iterdir()} == made
    assert read_summary(out)["expected_orders"] == []


def test_another_run_is_never_written_over(tmp_path: Path) -> None:
    out = tmp_path / "run"
    engine.run(replace(SMALL, methods=("mean_pose",)), out)
    with pytest.raises(BadInput, match="another run"):
        engine.run(replace(SMALL, seed=2), out)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("years of work")
    with pytest.raises(BadInput, match=r"thesis\.tex"):
        engine.run(SMALL, tmp_path / "mine")


def test_one_worker_or_two_give_the_same_results(tmp_path: Path) -> None:
    engine.run(SMALL, tmp_path / "one", jobs=1)
    engine.run(SMALL, tmp_path / "two", jobs=2)
    one, two = ({cell.key: cell for cell in select_cells(tmp_path / name)} for name in ("one", "two"))
    assert set(one) == set(two)
    for key, cell in one.items():
        np.testing.assert_array_equal(cell.estimate_qpos, two[key].estimate_qpos)
        np.testing.assert_array_equal(cell.truth_qpos, two[key].truth_qpos)
    assert [row["key"] for row in rows(tmp_path / "one")] == [row["key"] for row in rows(tmp_path / "two")]


@dataclass(frozen=True)
class Broken:
    """A method that dies after some frames; named as `tests.experiment.test_engine:Broken`."""

    name: str = "broken"
    summary: str = "dies on purpose"
    needs_examples: bool = False

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> Reconstructor:
        return self

    def begin(self, calibration: Calibration) -> Session:
        return self

    def step(self, frame: TrackerFrame) -> Estimate:
        raise ZeroDivisionError("on purpose")


class Exits(Broken):
    """A method that ends the program."""

    def step(self, frame: TrackerFrame) -> Estimate:
        raise SystemExit("on purpose")


@pytest.mark.parametrize("method", ["tests.experiment.test_engine:Broken", "tests.experiment.test_engine:Exits"])
def test_a_failing_method_fails_alone(tmp_path: Path, method: str) -> None:
    scenario = replace(SMALL, methods=(method, "mean_pose"))
    assert engine.run(scenario, tmp_path / "run") is Outcome.INCOMPLETE
    summary = read_summary(tmp_path / "run")
    assert (summary["cells_finished"], summary["cells_planned"]) == (2, 4)
    assert len(summary["failures"]) == 2
    assert all("on purpose" in text for text in summary["failures"].values())


def test_ctrl_c_behind_another_error_is_still_ctrl_c(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files may complain when Ctrl-C strikes them."""

    def be_struck(*_: Any) -> Any:
        try:
            raise KeyboardInterrupt
        finally:
            raise ValueError("seek of closed file")

    monkeypatch.setattr(cells, "evaluate_cell", be_struck)
    with pytest.raises(KeyboardInterrupt):
        engine.run(replace(SMALL, methods=("mean_pose",)), tmp_path / "run")


VARIED = replace(
    SMALL,
    motion=replace(SMALL.motion, test=("walking_p1_01", "walking_p2_01"), behaviours=("walking",)),
    methods=("mean_pose",),
    vary={"noise": ["clean", "noise"], "motion": {"longest_s": [2.0, 2.5]}},
)


@pytest.mark.long
def test_every_clip_runs_with_every_combination_of_varied_values(tmp_path: Path) -> None:
    """In every table: noise in its column, the values in theirs, and no row pools over them."""
    engine.run(VARIED, tmp_path / "one")
    engine.run(VARIED, tmp_path / "two", jobs=2)
    found = rows(tmp_path / "one")
    assert [row["key"] for row in found] == [row["key"] for row in rows(tmp_path / "two")]
    assert [(row["varied"]["noise"], row["varied"]["motion.longest_s"], row["clip"]) for row in found] == [
        (noise, longest_s, clip)
        for noise in ("clean", "noise")
        for longest_s in (2.0, 2.5)
        for clip in VARIED.motion.test
    ]
    assert all(row["noise"] == row["varied"]["noise"] for row in found)
    assert {row["frames_expected"] for row in found if row["varied"]["motion.longest_s"] == 2.0} <= {40, 41}
    summary = read_summary(tmp_path / "one")
    assert len(summary["methods"]) == 8  # performer p1 is known, p2 is new
    assert all(row["sequences"] == 1 for row in summary["methods"])
    text = (tmp_path / "one" / "summary.csv").read_text()
    assert ",known,noise=clean motion.longest_s=2," in text
    shown = run_table(summary)
    assert "noise=clean motion.longest_s=2.5" in shown
    assert "noise clean, noise" in shown
    assert sum(line.startswith("walking") and " known " in line for line in shown.splitlines()) == 4


def test_what_is_varied_shares_motion_and_learning_with_the_same_result_as_alone(tmp_path: Path) -> None:
    varied = replace(VARIED, vary={"components.echo.share": [0.0, 0.2]})
    engine.run(varied, tmp_path / "varied")
    engine.run(replace(VARIED, vary={}, components={"echo": {"share": 0.2}}), tmp_path / "alone")
    alone = {cell.clip: cell for cell in select_cells(tmp_path / "alone")}
    both = list(select_cells(tmp_path / "varied"))
    for cell in both[2:]:
        np.testing.assert_array_equal(cell.estimate_qpos, alone[cell.clip].estimate_qpos)
        assert cell.defined_by == alone[cell.clip].defined_by
        assert not np.array_equal(cell.estimate_qpos, both[0].estimate_qpos)
    made = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "varied" / "cells").iterdir()}
    engine.run(varied, tmp_path / "varied")
    assert made == {path.name: path.stat().st_mtime_ns for path in (tmp_path / "varied" / "cells").iterdir()}


@pytest.mark.long
def test_a_stream_has_the_stations_that_are_worn_and_no_others(tmp_path: Path) -> None:
    """What is not worn is not lost: one tracker is solved, at one worker or two, as if it were the scenario's only."""
    worn = replace(SMALL, noise="clean", vary={"worn": [["pelvis"], ["left_hand", "pelvis"]]}, methods=("kernel_cca",))
    hung = {"pelvis": Station("lhipjoint", along=0.0, around_deg=165.0), **SMALL.stations}
    engine.run(replace(worn, stations=hung), tmp_path / "one")
    engine.run(replace(worn, stations=hung), tmp_path / "two", jobs=2)
    engine.run(replace(worn, stations={"pelvis": hung["pelvis"]}, vary={}), tmp_path / "alone")
    one, two, alone = (list(select_cells(tmp_path / name)) for name in ("one", "two", "alone"))
    assert [cell.stations for cell in one] == 2 * [("pelvis",)] + 2 * [("pelvis", "left_hand")]
    assert [cell.key for cell in one] == [cell.key for cell in two]
    for cell, other in zip(one, two, strict=True):
        np.testing.assert_array_equal(cell.estimate_qpos, other.estimate_qpos)
    for cell, other in zip(one[:2], alone, strict=True):
        np.testing.assert_array_equal(cell.estimate_qpos, other.estimate_qpos)
        assert cell.defined_by == other.defined_by
        assert cell.metrics["frames_held"] == cell.metrics["frames_lost"] == 0


def test_a_value_that_changes_nothing_for_a_method_has_a_row_of_its_own(tmp_path: Path) -> None:
    vary = {"motion.examples": [["walking_p1_02"], ["walking_p2_02"]]}
    one = replace(VARIED.motion, test=("walking_p1_01",))
    engine.run(replace(VARIED, motion=one, methods=("ik:previous", "mean_pose"), vary=vary), tmp_path / "run")
    found = [(row["method"], row["performer"], row["varied"]["motion.examples"]) for row in rows(tmp_path / "run")]
    assert found == [
        (method, performer, [example])
        for performer, example in (("known", "walking_p1_02"), ("new", "walking_p2_02"))
        for method in ("ik:previous", "mean_pose")
    ]


def test_what_is_all_warm_up_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="warm-up"):
        engine.run(replace(SMALL, motion=replace(SMALL.motion, longest_s=1.0)), tmp_path / "run")


@pytest.mark.parametrize("split", ["sequence", "subject", "block"])
def test_a_whole_clip_is_never_its_own_example(tmp_path: Path, split: Any) -> None:
    own = replace(SMALL.motion, test=("walking_p1_01",), behaviours=("walking",), examples=("walking_p1_01",))
    scenario = replace(SMALL, motion=replace(own, split=split), methods=("mean_pose",))
    with pytest.raises(BadInput, match="examples"):
        engine.run(scenario, tmp_path / "run")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"methods": ("ikk",)}, "Did you mean 'ik'"),
        ({"inputs": ("position",)}, "input combination"),
        ({"motion": replace(SMALL.motion, test=("walking_p1_99", "boxing_p2_01"))}, "synthetic take"),
        ({"motion": replace(SMALL.motion, examples=("walking_p999_01",))}, "synthetic take"),
        ({"motion": replace(SMALL.motion, withheld=("walking_p999_01@0.20-0.40",))}, "synthetic take"),
        ({"stations": {"head": Station("haed")}}, "bone"),
        ({"components": {"eco": {"share": 0.1}}}, "echo"),
        ({"components": {"echo": {"shar": 0.1}}}, "share"),
        ({"components": {"lost": [{"station": "head", "from_s": 1.0, "until_s": 2.0}]}}, "to_s"),
    ],
)
def test_names_that_do_not_exist_are_refused_before_anything_is_written(
    tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    with pytest.raises(UnknownName) as caught:
        engine.run(replace(SMALL, **change), tmp_path / "run")
    assert message in str(caught.value)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("wrong", [{"echo": {"share": "much"}}, {"echo": {"share": float("nan")}}, {"lost": 3}])
def test_values_of_components_are_checked(tmp_path: Path, wrong: dict[str, object]) -> None:
    with pytest.raises(BadInput, match=r"components.*expected"):
        engine.run(replace(SMALL, components=wrong), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_noise_components_change_what_is_seen(tmp_path: Path) -> None:
    echoes = replace(SMALL, methods=("mean_pose",), components={"echo": {"share": 0.3}})
    engine.run(echoes, tmp_path / "run")
    cell = next(iter(select_cells(tmp_path / "run")))
    assert 0.15 < cell.health["echo_share"] < 0.45
    assert cell.noise == "default*"


def run_short_demo(out: Path, *words: str) -> list[str]:
    """The command; with all methods of the demo it is far from done when two cells are finished."""
    short = short_demo(out.with_name("short.toml"))
    return [sys.executable, "-m", "harness.cli", "run", str(short), "--no-report", "--out", str(out), *words]


def await_cells(out: Path, count: int, program: "subprocess.Popen[Any]") -> None:
    """Until so many are finished, which takes a busy machine a while."""
    until_s = time.monotonic() + 300.0
    while len(list(out.glob("cells/*/cell.json"))) < count:
        assert program.poll() is None, "it ended too soon"
        assert time.monotonic() < until_s
        time.sleep(0.02)


@pytest.mark.long
def test_a_killed_run_leaves_whole_cells_and_resumes(tmp_path: Path) -> None:
    out, methods = tmp_path / "run", ("ik", "mean_pose", "best_match")
    command = run_short_demo(out, "--methods", ",".join(methods))
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as program:
        await_cells(out, 3, program)
        program.send_signal(signal.SIGKILL)
    finished = {path.name for path in (out / "cells").iterdir() if not path.name.startswith(TEMPORARY)}
    assert len(finished) >= 2
    scenario = replace(load_scenario(tmp_path / "short.toml"), methods=methods)
    assert engine.run(scenario, out) is Outcome.PASS
    assert finished <= {str(row["key"]) for row in rows(out)}
    assert len(rows(out)) == len(scenario.methods) * len(scenario.motion.test)


def test_ctrl_c_keeps_what_is_finished(tmp_path: Path) -> None:
    out = tmp_path / "run"
    with subprocess.Popen(
        run_short_demo(out), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heeding_interrupts
    ) as program:
        await_cells(out, 2, program)
        program.send_signal(signal.SIGINT)
        said, complained = program.communicate(timeout=120)
    assert program.returncode == 130
    assert said.strip().splitlines()[-1] == "interrupted"
    assert "Traceback" not in complained
    summary = json.loads((out / "summary.json").read_text())
    assert 0 < summary["cells_finished"] < summary["cells_planned"]


@pytest.mark.long
@pytest.mark.parametrize(("end", "code"), [(signal.SIGINT, 130), (signal.SIGKILL, -9)])
def test_workers_end_with_the_run(tmp_path: Path, end: signal.Signals, code: int) -> None:
    out = tmp_path / "run"
    with subprocess.Popen(
        run_short_demo(out, "--jobs", "2"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=heeding_interrupts,
    ) as program:
        await_cells(out, 2, program)
        if end is signal.SIGINT:
            os.killpg(program.pid, end)  # as a terminal does
        else:
            program.kill()
        _, complained = program.communicate(timeout=120)  # returns when no process holds our pipes any more
    assert program.returncode == code
    assert "Traceback" not in complained


def test_real_motion_runs_the_same_way(tmp_path: Path, mocap: Path) -> None:
    scenario = load_scenario("golf")
    assert engine.run(scenario, tmp_path / "run", folder=mocap) is Outcome.PASS
    found = {str(row["method"]): row for row in rows(tmp_path / "run")}
    assert found["ik"]["motion_source"] == "cmu"
    assert found["best_match"]["split"] == "block"
    assert all(row["joint_angle_mean_deg"] is not None for row in rows(tmp_path / "run"))
    assert os.path.exists(tmp_path / "run" / "summary.csv")


def test_a_line_that_is_too_slow_is_told_and_measures_nothing(tmp_path: Path) -> None:
    """Six stations at 1000 Hz are nineteen times what 115200 baud carry."""
    fast = replace(SMALL, methods=("mean_pose",), tracker=replace(SMALL.tracker, rate_hz=1000.0))
    assert engine.run(fast, tmp_path / "run") is Outcome.NOT_COMPARABLE
    said = run_table(read_summary(tmp_path / "run"))
    assert "THE LINK IS TOO SLOW: 9" in said
    assert "not measured" in said


def test_more_stations_than_the_device_has_are_refused_at_once(tmp_path: Path) -> None:
    many = replace(SMALL, stations={f"s{k}": Station("head") for k in range(13)})
    with pytest.raises(BadInput, match="12"):
        engine.run(many, tmp_path / "run")
    assert not (tmp_path / "run").exists()
