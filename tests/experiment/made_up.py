"""Cells that are judged in no time, by made-up errors; everything around them is real."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from harness.core.seeds import generator
from harness.experiment import cells
from harness.experiment.clip_evaluation import ClipEvaluation
from harness.experiment.tasks import PlannedCell
from harness.reconstruct import Method
from harness.results import Cell
from harness.score import Scores
from tests.planted import measured_cell

FAILING = "ik:previous+ik"
"""Cells of this method fail, while the file `broken` lies where the process works."""


def judge(setting: ClipEvaluation, method: Method, planned: PlannedCell, key: str, command: str) -> Cell:
    if planned.method == FAILING and Path("broken").exists():
        raise ZeroDivisionError("on purpose")
    found = measured_cell()
    error = float(generator(planned.scenario.seed, str(planned)).uniform(1.0, 5.0))
    metrics = {**found.metrics, "joint_angle_mean_deg": error, "mpjpe_mm": 5.0 * error, "step_p50_ms": 0.1}
    return replace(
        found,
        key=key,
        method=planned.method,
        clip=str(setting.part),
        behaviour=setting.behaviour,
        inputs=planned.inputs,
        seed=planned.scenario.seed,
        noise=planned.scenario.noise,
        varied=planned.varied,
        scenario=planned.scenario.name,
        scores=Scores(metrics, found.scores.per_frame, found.scores.per_joint, found.scores.scored),
    )


@pytest.fixture
def made_up(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Where tests work; what is judged there is made up, and its page without charts, which others look at."""
    measured_cell()  # by the real evaluation
    monkeypatch.setattr(cells, "evaluate_cell", judge)
    monkeypatch.setattr("harness.report.sweep.page.sweep_chart", lambda *lines: None)
    monkeypatch.chdir(tmp_path)
    return tmp_path


SWEEP = """
schema = 1
name = "tiny"
scenarios = ["demo"]
clips = ["walking_p1_01", "boxing_p11_01"]
methods = ["ik:previous", "ik:previous+ik"]

[vary]
noise = ["clean", "default"]
tracker.rate_hz = [20.0, 40.0]
"""


def sweep_file(folder: Path, text: str = SWEEP, **changes: Any) -> Path:
    """The sweep, with some of its lines changed."""
    lines = []
    for line in text.strip().splitlines():
        key = line.partition(" = ")[0]
        lines.append(f"{key} = {changes.pop(key)}" if key in changes else line)
    first = [f"{key} = {value}" for key, value in changes.items()]
    path = folder / "tiny.toml"
    path.write_text("\n".join([*first, *lines]))
    return path
