"""An answer that is no pose costs its own cell, and never a run, a study or a session of another method."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.commands.replay import format_score_table
from harness.errors import Outcome
from harness.experiment import engine
from harness.experiment.evaluation import evaluate_each
from harness.experiment.playback import prepare_playback
from harness.experiment.recorded_takes import recorded_take
from harness.results import read_summary, select_cells
from harness.stream.recording import RecordingStream, record_capture
from tests.experiment.strange_answers import FAILING, SCORED, Diverges, IsComplex, method_name
from tests.experiment.test_isolation import HONEST, ONE_CLIP


@pytest.fixture(scope="module")
def outcome_and_folder(tmp_path_factory: pytest.TempPathFactory) -> tuple[Outcome, Path]:
    out = tmp_path_factory.mktemp("strange") / "run"
    methods = (*map(method_name, [*FAILING, *SCORED]), HONEST)
    return engine.run(replace(ONE_CLIP, methods=methods), out), out


@pytest.mark.long
def test_the_others_are_scored_and_the_run_has_a_summary(outcome_and_folder: tuple[Outcome, Path]) -> None:
    outcome, out = outcome_and_folder
    assert outcome is Outcome.INCOMPLETE
    cells = {cell.method: cell for cell in select_cells(out)}
    assert set(cells) == {*map(method_name, SCORED), HONEST}
    np.testing.assert_allclose(cells[method_name(SCORED[0])].estimate_qpos, cells[HONEST].estimate_qpos, rtol=1e-6)
    undefined = cells[method_name(SCORED[1])]
    assert undefined.metrics["mpjpe_mm"] == pytest.approx(cells[HONEST].metrics["mpjpe_mm"], rel=0.05)
    assert undefined.metrics["frames_not_finite"] == np.isnan(undefined.estimate_qpos[:, 0]).sum() > 5


@pytest.mark.long
@pytest.mark.parametrize(("kind", "reason"), FAILING.items(), ids=[kind.__name__ for kind in FAILING])
def test_each_is_one_failed_cell_with_its_reason(
    outcome_and_folder: tuple[Outcome, Path], kind: type[Any], reason: str
) -> None:
    failures = read_summary(outcome_and_folder[1])["failures"]
    (text,) = [text for cell, text in failures.items() if cell.startswith(f"{method_name(kind)} on ")]
    assert re.search(reason, text.strip().splitlines()[-1])


@pytest.mark.long
def test_a_run_of_diverging_methods_alone_is_incomplete(tmp_path: Path) -> None:
    """It is no refusal: the method was run. The same command tries again."""
    for _ in range(2):
        outcome = engine.run(replace(ONE_CLIP, methods=(method_name(IsComplex),)), tmp_path / "run")
        assert outcome is Outcome.INCOMPLETE
    assert read_summary(tmp_path / "run")["cells_finished"] == 0


@pytest.mark.long
def test_a_method_that_fails_on_a_recording_stops_no_other(tmp_path: Path) -> None:
    played = prepare_playback("demo", stations=4)
    simulation, path = played.simulation, tmp_path / "a.rec"
    record_capture(path, simulation.wire_format, simulation.wire, {})
    names = (method_name(Diverges), "mean_pose")
    take = recorded_take(RecordingStream(path), played)
    bad, good = evaluate_each(names, take)
    (alone,) = evaluate_each(names[1:], take)
    assert "1e+17 at place 10" in bad.failure
    assert bad.metrics["mpjpe_mm"] is None
    assert good.metrics["mpjpe_mm"] == alone.metrics["mpjpe_mm"] is not None
    text = format_score_table([bad, good])
    assert re.search(rf"^failed: {names[0]}: .*1e\+17", text, re.MULTILINE)
    assert (len(bad.answers.qpos), len(good.answers.qpos)) == (0, len(take.frames))
    assert bad.as_dict()["frames_matched"] == 0
