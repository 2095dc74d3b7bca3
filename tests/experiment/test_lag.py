"""A method with a lag is scored at the frames that it answers, as the method without one, and never against it."""

import csv
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.commands.replay import format_score_table
from harness.compare import compare_results
from harness.core.messages import MessageError
from harness.errors import Outcome, ShapeError
from harness.experiment import engine
from harness.experiment.evaluation import evaluate_each
from harness.experiment.methods.method_messages import decode_answers, encode_answers
from harness.experiment.methods.method_run import MethodAnswers, run_method
from harness.experiment.playback import Playback, prepare_playback
from harness.experiment.recorded_takes import recorded_take
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_motion import ScenarioMotion
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.report.run.data import read_run
from harness.report.run.ranking import describe_rankings
from harness.report.run.text import run_table
from harness.results import Cell, load_results, read_cells, read_summary
from harness.stream.recording import RecordingStream, record_capture
from tests.experiment.late_methods import NAMES, SIGMA_RAD, Late, spoilt

LATE, PROMPT = NAMES
CAUSAL = "ik[towards_mean=0.0,spread=false]"
ONE_CLIP = Scenario(
    name="one_clip",
    motion=ScenarioMotion("builtin", ("walking_p1_01",), ("walking",), (), longest_s=2.0),
    stations=load_scenario("demo").stations,
    methods=(CAUSAL, LATE, PROMPT),
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("lag") / "run"
    engine.run(ONE_CLIP, out)
    return out


@pytest.fixture(scope="module")
def cells(run: Path) -> dict[str, Cell]:
    return {cell.method: cell for cell in read_cells(run)}


def test_each_answer_is_scored_at_its_frame(cells: dict[str, Cell]) -> None:
    causal, late, prompt = cells[CAUSAL], cells[LATE], cells[PROMPT]
    for cell, frames in ((late, slice(0, -2)), (prompt, slice(None))):
        for name in ("estimate_qpos", "truth_qpos", "time_s", "frame_index", "status", "origin", "quality"):
            np.testing.assert_array_equal(getattr(cell, name), getattr(causal, name)[frames], err_msg=name)
        for name, values in causal.errors.items():
            np.testing.assert_array_equal(cell.errors[name], values[frames], err_msg=name)
    assert (causal.lag, late.lag, prompt.lag) == (0, 2, 0)


def test_the_last_frames_are_expected_and_not_matched(cells: dict[str, Cell]) -> None:
    causal, late = cells[CAUSAL].metrics, cells[LATE].metrics
    assert late["frames_expected"] == causal["frames_expected"] == causal["frames_matched"]
    assert late["frames_matched"] == (causal["frames_matched"] or 0) - 2
    assert late["frames_not_finite"] == 0
    assert late["coverage"] == pytest.approx((late["frames_matched"] or 0) / (late["frames_expected"] or 1))


def test_times_are_those_of_the_steps_that_received_the_frames(cells: dict[str, Cell]) -> None:
    late = cells[LATE]
    assert late.metrics["first_step_ms"] == late.step_ms[0]
    assert len(late.step_ms) == len(cells[CAUSAL].step_ms) - 2


def test_standard_deviations_are_stored_and_scored(cells: dict[str, Cell]) -> None:
    assert cells[CAUSAL].angle_sigma_rad is None
    assert cells[CAUSAL].sigma_scores == {}
    late = cells[LATE]
    assert late.angle_sigma_rad is not None
    np.testing.assert_allclose(late.angle_sigma_rad, np.tile(SIGMA_RAD, (len(late), 1)), rtol=1e-6)
    rows = late.scores.scored
    error_rad = np.abs(late.estimate_qpos[rows, 7:] - late.truth_qpos[rows, 7:])
    assert late.sigma_scores["sigma_coverage_1"] == pytest.approx(np.mean(error_rad <= SIGMA_RAD))
    assert late.sigma_scores["sigma_lowest_coverage_1"] == np.mean(error_rad <= SIGMA_RAD, axis=0).min()
    assert late.sigma_scores["sigma_width_deg"] == pytest.approx(6.5)


def test_rows_and_tables_state_lag_and_standard_deviations(run: Path, cells: dict[str, Cell]) -> None:
    summary = read_summary(run)
    lags = {row["method"]: row["lag"] for row in summary["methods"]}
    assert lags == {CAUSAL: 0, LATE: 2, PROMPT: 0} == {row["method"]: row["lag"] for row in summary["cells"]}
    pooled = {row["method"]: row["sigma_scores"] for row in summary["behaviours"]}
    assert pooled[CAUSAL] == {}
    assert pooled[LATE] == pytest.approx(dict(cells[LATE].sigma_scores), rel=1e-5)
    with (run / "summary.csv").open() as file:
        rows = {row["method"]: row for row in csv.DictReader(file)}
    assert (rows[CAUSAL]["lag"], rows[LATE]["lag"]) == ("0", "2")
    assert rows[CAUSAL]["sigma_coverage_1"] == ""
    assert float(rows[LATE]["sigma_width_deg"]) == pytest.approx(6.5)
    text = run_table(summary)
    assert f"{LATE} (lag 2)" in text
    assert "within 1 sigma [%]" in text
    assert read_run(run).series == (CAUSAL, f"{LATE} (lag 2)", PROMPT)


def test_causal_methods_are_never_ranked_with_others(run: Path) -> None:
    causal, late, note = describe_rankings(read_summary(run), "motion")
    assert {causal[1], late[1]} <= {CAUSAL, PROMPT, f"{LATE} (lag 2)"}
    assert LATE + " " not in causal[0]
    assert late == (f"{LATE} (lag 2): {late[0].split(': ', 1)[1]}", f"{LATE} (lag 2)")
    assert "with a lag of 2 frames" in late[0]
    assert note == ("Methods that wait for later frames are ranked apart from causal ones, each lag for itself.", None)


def test_a_comparison_with_a_causal_method_is_refused_with_the_reason(run: Path) -> None:
    results = load_results(run)
    comparison = compare_results(results, results, methods=(PROMPT, LATE))
    assert comparison.inputs_that_differ == ("lag: none against 2",)
    assert comparison.outcome is Outcome.NOT_COMPARABLE


@pytest.fixture(scope="module")
def played() -> Playback:
    return prepare_playback("demo", stations=4)


def test_a_recording_is_scored_at_the_frames_that_are_answered(tmp_path: Path, played: Playback) -> None:
    simulation = played.simulation
    record_capture(tmp_path / "a.rec", simulation.wire_format, simulation.wire, {})
    late, prompt = evaluate_each((LATE, PROMPT), recorded_take(RecordingStream(tmp_path / "a.rec"), played))
    assert (late.lag, prompt.lag) == (2, 0)
    assert late.scores.expected == prompt.scores.expected == prompt.scores.matched == late.scores.matched + 2
    for name in ("joint_angle_mean_deg", "mpjpe_mm"):
        assert late.metrics[name] == pytest.approx(prompt.metrics[name], rel=0.05)
    assert late.sigma_scores == pytest.approx(prompt.sigma_scores, rel=0.05)
    text = format_score_table([late, prompt])
    assert f"{LATE} (lag 2)" in text
    assert "within 95 % region [%]" in text


def answers_of(frames: int, **options: Any) -> MethodAnswers:
    playback = prepare_playback("demo", stations=4)
    fitted: Any = Late(**options).fit(playback.body, [], None)
    return run_method(fitted, playback.calibration, playback.simulation.frames[:frames])


@pytest.mark.parametrize("wait", [0, 1, 5])
def test_answers_pass_between_processes(wait: int) -> None:
    for stated in (True, False):
        answers = answers_of(12, wait=wait, stated=stated)
        back = decode_answers(encode_answers(answers), 12)
        for name, array in answers._asdict().items():
            np.testing.assert_array_equal(getattr(back, name), array, err_msg=name)
        by_frame, lag = back.by_frame()
        assert (lag, len(by_frame.qpos), len(by_frame.step_ms)) == (wait, 12 - wait, 12 - wait)
        assert (by_frame.angle_sigma_rad is not None) == stated
        np.testing.assert_array_equal(by_frame.qpos, answers.qpos[wait:])
        for name in ("step_ms", "step_cpu_ms", "reference_cpu_ms"):
            np.testing.assert_array_equal(getattr(by_frame, name), getattr(answers, name)[: 12 - wait])


def test_a_take_shorter_than_the_lag_answers_its_first_frame() -> None:
    by_frame, lag = answers_of(3, wait=5).by_frame()
    assert (lag, len(by_frame.qpos)) == (2, 1)


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"lag": np.zeros(12, np.int64) + 1}, "lag"),
        ({"lag": np.array([0, 1, 2, 2, 2, 2, 1, 2, 2, 2, 2, 2])}, "lag at step 6"),
        ({"angle_sigma_rad": np.full((12, 48), np.nan)}, "standard deviation"),
        ({"angle_sigma_rad": np.zeros((12, 48))}, "standard deviation"),
        ({"angle_sigma_rad": np.ones((12, 47))}, "size"),
        ({"lag": np.zeros(12)}, "type"),
    ],
)
def test_impossible_answers_of_a_process_are_refused(changes: dict[str, Any], fault: str) -> None:
    good = encode_answers(answers_of(12))
    decode_answers(good, 12)
    with pytest.raises(MessageError, match=fault):
        decode_answers({**good, **changes}, 12)


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"lag": 1}, "lag at step 7"),
        ({"lag": -1}, "a lag of -1 frames"),
        ({"angle_sigma_rad": None}, "standard deviations in 11 of 12 frames"),
        ({"angle_sigma_rad": np.ones(47)}, r"shape \(47,\)"),
        ({"angle_sigma_rad": np.full(48, -1.0)}, "hinge 0 is -1 rad"),
    ],
)
def test_one_bad_answer_fails_the_cell_with_its_reason(changes: dict[str, Any], fault: str) -> None:
    playback = prepare_playback("demo", stations=4)
    fitted = Late().fit(playback.body, [], None)
    bad: Any = SimpleNamespace(begin=lambda calibration: spoilt(fitted.begin(calibration), 7, **changes))
    with pytest.raises((ValueError, ShapeError), match=fault):
        run_method(bad, playback.calibration, playback.simulation.frames[:12])
