"""A line that drops more than a tenth of the records measures nothing, unless the scenario studies the slow line."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.cli import main
from harness.compare import compare_runs
from harness.core.split import ClipPart
from harness.core.stream_health import describe_line_loss, excess_loss, mean_reading_age_s
from harness.errors import Outcome
from harness.experiment import engine
from harness.experiment.clip_evaluation import ClipEvaluation
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_motion import ScenarioMotion
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.experiment.scenarios.sweep_config import Sweep
from harness.experiment.workers.executors import process_executor
from harness.mocap import open_motion_source
from harness.results import read_summary
from harness.simulate import TrackerConfig

SCENARIO = """
schema = 1
methods = ["mean_pose"]
stations = "liu2011"

[motion]
source = "builtin"
test = ["walking_p1_01"]
behaviours = ["walking"]
examples = ["walking_p1_02"]
longest_s = 2.5

[tracker]
rate_hz = 40.0
"""
SMALL = Scenario(
    name="small",
    motion=ScenarioMotion("builtin", ("walking_p1_01",), ("walking",), ("walking_p1_02",), longest_s=2.5),
    stations=load_scenario("demo").stations,
    methods=("mean_pose",),
)


def with_tracker(**changes: Any) -> Scenario:
    return replace(SMALL, tracker=replace(SMALL.tracker, **changes))


def measured(out: Path) -> list[bool]:
    return [row["joint_angle_mean_deg"] is not None for row in read_summary(out)["cells"]]


@pytest.mark.parametrize("noise", ["clean", "default"])
def test_a_line_that_drops_most_records_is_not_comparable(
    noise: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Six stations at 40 Hz need 91,200 bit/s; 9600 baud carry a tenth. The frames that arrive have few stations."""
    path = tmp_path / "slow.toml"
    path.write_text(f"noise = '{noise}'\n{SCENARIO}baud = 9600\n")
    assert main(["run", str(path), "--out", str(tmp_path / "run"), "--no-report"]) == 3
    said = capsys.readouterr().out
    assert said.splitlines()[-1] == "not comparable"
    (line,) = [line for line in said.splitlines() if "THE LINK IS TOO SLOW" in line]
    health = read_summary(tmp_path / "run")["cells"][0]["health"]
    dropped, records = health["records_dropped"], health["records_dropped"] + health["records_sent"]
    assert f"{dropped:,.0f} of {records:,.0f} on walking_p1_01" in line
    assert "6 stations x 38 bytes x 10 bits x 40 Hz are 91,200 bit/s, but the line carries 9,600" in line
    assert "tracker.rate_hz = 4 or less" in line
    assert "tracker.overload = true" in line


@pytest.mark.long
def test_a_scenario_that_studies_the_slow_line_is_measured_and_says_how_old_readings_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, ages_ms = tmp_path / "slow.toml", []
    for baud in (9600, 19200):
        path.write_text(f"{SCENARIO}baud = {baud}\noverload = true\n")
        capsys.readouterr()
        assert main(["run", str(path), "--out", str(tmp_path / str(baud)), "--no-report"]) == 0
        assert measured(tmp_path / str(baud)) == [True]
        ages_ms.append(read_summary(tmp_path / str(baud))["cells"][0]["health"]["reading_age_ms"])
        assert f"newest readings were {ages_ms[-1]:.0f} ms old on average" in capsys.readouterr().out
    assert 70.0 < ages_ms[0] < 140.0  # a station every 200 ms
    assert 0.35 < ages_ms[1] / ages_ms[0] < 0.65


def test_ages_of_readings_count_from_the_newest_of_a_frame() -> None:
    """Frame 2 has no reading; the second station has its first one in frame 1."""
    nan = float("nan")
    measured_s = np.array([[0.0, nan], [0.1, 0.12], [nan, nan], [nan, 0.3]])
    ages_s = [0.0, 0.02, 0.0, 0.12, 0.1, 0.2, 0.0]
    assert mean_reading_age_s(measured_s, 0.1) == pytest.approx(np.mean(ages_s))
    assert np.isnan(mean_reading_age_s(np.full((3, 2), nan), 0.1))


@pytest.mark.long
@pytest.mark.parametrize(("baud", "outcome"), [(57600, Outcome.NOT_COMPARABLE), (83000, Outcome.PASS)])
def test_a_tenth_may_be_lost(baud: int, outcome: Outcome, tmp_path: Path) -> None:
    """57600 baud carry 63 % of the records, 83000 baud 91 %."""
    assert engine.run(with_tracker(baud=baud), tmp_path / "run") is outcome
    assert measured(tmp_path / "run") == [outcome is Outcome.PASS]


@pytest.mark.long
def test_a_lost_station_is_no_slow_line(tmp_path: Path) -> None:
    """Stations that are lost half of the time send their records, which say so."""
    lossy = replace(SMALL, components={"dropout": {"share": 0.6}})
    assert engine.run(lossy, tmp_path / "run") is Outcome.PASS


@pytest.mark.long
def test_one_slow_variant_makes_the_run_not_comparable(tmp_path: Path) -> None:
    both = replace(SMALL, vary={"tracker.baud": [9600, 115200]})
    assert engine.run(both, tmp_path / "run") is Outcome.NOT_COMPARABLE
    assert measured(tmp_path / "run") == [False, True]
    studied = replace(with_tracker(overload=True), vary={"tracker.baud": [19200, 115200]})
    assert engine.run(studied, tmp_path / "studied") is Outcome.PASS


@pytest.mark.long
def test_a_sweep_says_it_too(tmp_path: Path) -> None:
    with process_executor(1) as executor:
        options: dict[str, Any] = {"folder": None, "executor": executor, "workers": 1, "command": ""}
        sweep, out = Sweep("s", ("small",)), tmp_path / "out"
        assert engine.run_sweep(sweep, [with_tracker(baud=9600)], out, **options) is Outcome.NOT_COMPARABLE
    assert '"line_loss": "THE LINK IS TOO SLOW' in (out / "summary.json").read_text()


@pytest.mark.long
def test_a_comparison_names_the_line(tmp_path: Path) -> None:
    slow = replace(with_tracker(baud=19200), methods=("mean_pose", "ik:previous"))
    engine.run(slow, tmp_path / "run")
    found = compare_runs(tmp_path / "run", methods=("mean_pose", "ik:previous"))
    assert found.outcome is Outcome.NOT_COMPARABLE
    assert "the line dropped up to 77%" in found.why


@pytest.mark.long
def test_a_replay_needs_half_of_the_records(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, recording = tmp_path / "slow.toml", tmp_path / "slow.rec"
    for line, code in (("", 3), ("overload = true\n", 0)):
        path.write_text(f"{SCENARIO}baud = 19200\n{line}")
        recording.unlink(missing_ok=True)
        assert main(["record", f"sim:{path}", str(recording)]) == 0
        capsys.readouterr()
        assert main(["replay", str(recording), "--methods", "mean_pose"]) == code
        said = capsys.readouterr().out
        assert ("records arrived: the line is too slow" in said) is (code == 3)
        assert ("records arrived, which tracker.overload of" in said) is (code == 0)


def test_the_key_leaves_conditions_of_other_scenarios_as_they_were() -> None:
    """Else no result of a version without the key could be compared with a new one."""
    source, part = open_motion_source("builtin", None, seed=1, rate_hz=None), ClipPart.parse("walking_p1_01")
    for overload in (False, True):
        scenario = with_tracker(overload=overload)
        conditions = ClipEvaluation(scenario, source, part, "walking").observation.conditions
        assert ("overload" in conditions["tracker"]) is overload  # type: ignore[operator]  # a table
        assert ("overload" in scenario.content()["tracker"]) is overload


def test_a_burst_that_the_queue_does_not_hold_has_its_own_cause() -> None:
    health = {"records_sent": 50.0, "records_dropped": 50.0, "record_bytes": 38, "line_baud": 115200}
    row = {"health": health, "stations": ["a"] * 6, "rate_hz": 40.0, "clip": "c"}
    assert "tracker.queue_records" in describe_line_loss([row])
    assert describe_line_loss([]) == ""
    assert describe_line_loss([{**row, "health": {"records_sent": 5.0}}]) == ""


def test_the_share_that_a_scenario_allows() -> None:
    health = {"records_sent": 80.0, "records_dropped": 20.0}
    assert excess_loss(health, allowed=False) == 0.2
    assert excess_loss(health, allowed=True) == 0.0
    assert excess_loss({"records_sent": 91.0, "records_dropped": 9.0}, allowed=False) == 0.0
    assert excess_loss({}, allowed=False) == 0.0
    assert "overload" not in TrackerConfig().as_dict()
