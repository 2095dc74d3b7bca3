"""A copy of the test clip among its examples ends the run with exit code 2, on every way into the engine."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.cli import main
from harness.core.split import ExampleLeak
from harness.experiment import engine
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.experiment.scenarios.sweep_config import Sweep
from harness.experiment.workers.executors import process_executor
from harness.mocap import synthetic
from harness.testing.regression_gate import RegressionGate
from tests.mocap.clip_copies import mirrored, take_rows
from tests.mocap.sample_files import write_clip

SCENARIO = """
schema = 1
methods = ["ik:previous", "mean_pose"]
stations = "liu2011"
[motion]
source = "cmu"
test = ["91_01"]
behaviours = ["walking"]
examples = ["91_01", "92_01", "93_01"]
rate_hz = 120.0
longest_s = 1.5
"""
MESSAGE = r"91_01 \(.* s\) and its example 93_01 \(0.0 to 3.0 s, mirrored\) are the same motion"


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scenario on a library in which 93_01 is a part of 91_01, mirrored."""
    clip, other = (synthetic.generate("walking", name, 1, seed=1, duration_s=5.0) for name in ("p1", "p2"))
    copy = mirrored(take_rows(clip, np.arange(1, 362)))
    for name, motion in {"91_01": clip, "92_01": other, "93_01": copy}.items():
        write_clip(tmp_path / "library", replace(motion, name=name, subject=name[:2]))
    monkeypatch.setenv("HARNESS_MOCAP", str(tmp_path / "library"))
    path = tmp_path / "leak.toml"
    path.write_text(SCENARIO)
    return path


def test_run_is_refused_in_one_line_that_names_both(
    scenario: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`ik:previous` learns from nothing, so that not every cell is refused; the run is."""
    assert main(["run", str(scenario), "--out", str(tmp_path / "run")]) == 2
    shown = capsys.readouterr()
    assert shown.out == "refused\n"
    _loading, line = shown.err.splitlines()
    assert "91_01" in line
    assert "93_01" in line
    assert "remove 93_01 from motion.examples" in line


def test_the_rest_runs_without_the_copy(scenario: Path, tmp_path: Path) -> None:
    loaded = load_scenario(scenario)
    clean = replace(loaded, motion=replace(loaded.motion, examples=("91_01", "92_01")))
    assert engine.run(clean, tmp_path / "run").exit_code == 0


def test_a_copy_of_the_guard_is_a_leak_and_one_of_the_rest_is_none(scenario: Path, tmp_path: Path) -> None:
    """93_01 has the first 3 s of 5: a block from 2.5 s on begins in it; one from 4.1 s on does not, nor its guard."""
    loaded = load_scenario(scenario)
    for start, leaks in ((0.5, True), (0.82, False)):
        motion = replace(loaded.motion, split="block", test=(f"91_01@{start}-1.0",), behaviours=("walking",))
        if leaks:
            with pytest.raises(ExampleLeak):
                engine.run(replace(loaded, motion=motion), tmp_path / "leaks")
        else:
            assert engine.run(replace(loaded, motion=motion), tmp_path / "clean").exit_code == 0


def _sweep(scenario: Scenario, out: Path) -> None:
    with process_executor(2) as executor:
        engine.run_sweep(Sweep("s", ("leak",)), [scenario], out, folder=None, executor=executor, workers=2, command="")


def _cells(scenario: Scenario, out: Path) -> None:
    out.mkdir()
    with process_executor(1) as executor:
        engine.run_cells([scenario], out, folder=None, executor=executor, command="")


WAYS: dict[str, Callable[[Scenario, Path], object]] = {
    "run": engine.run,
    "two workers": lambda scenario, out: engine.run(scenario, out, jobs=2),
    "sweep": _sweep,
    "cells of a study": _cells,
}


@pytest.mark.parametrize("way", WAYS)
def test_no_way_into_the_engine_leads_past_it(way: str, scenario: Path, tmp_path: Path) -> None:
    with pytest.raises(ExampleLeak, match=MESSAGE):
        WAYS[way](load_scenario(scenario), tmp_path / "out")


def test_the_gate_of_pytest_is_no_way_past_it(scenario: Path, tmp_path: Path) -> None:
    gate = RegressionGate(tmp_path / "runs", tmp_path / "baselines")
    with pytest.raises(ExampleLeak, match=MESSAGE):
        gate.save_baseline("mean_pose", "main", scenario=str(scenario))


def test_a_finished_run_is_no_way_past_it(scenario: Path, tmp_path: Path) -> None:
    """The clip 92_01 turns into a copy after the run: the same command does not report the old cells."""
    loaded = load_scenario(scenario)
    clean = replace(loaded, motion=replace(loaded.motion, examples=("92_01",)))
    assert engine.run(clean, tmp_path / "run").exit_code == 0
    library = scenario.parent / "library"
    (library / "92" / "92_01.amc").write_bytes((library / "93" / "93_01.amc").read_bytes())
    with pytest.raises(ExampleLeak, match="92_01"):
        engine.run(clean, tmp_path / "run")
