"""Cells of a scenario with the table [physics]: conditions, processes, calibration, notes and recordings."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from harness.core.split import ClipPart
from harness.experiment import engine
from harness.experiment.clip_evaluation import ClipEvaluation
from harness.experiment.evaluation import evaluate_each
from harness.experiment.observed_take import simulated_take
from harness.experiment.playback import prepare_playback
from harness.experiment.recorded_takes import recorded_take
from harness.experiment.scenarios.motion_source import open_scenario_motion
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_motion import ScenarioMotion
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.reconstruct import make_method
from harness.report.run.text import run_table
from harness.results import read_summary
from harness.simulate.physics import ConstellationSettings, Physics, Sound
from harness.stream.polhemus import DEFAULT_EMITTERS
from harness.stream.recording import RecordingStream, record_capture

PLAIN = Scenario(
    name="small",
    motion=ScenarioMotion("builtin", ("boxing_p1_01",), ("boxing",), ("boxing_p1_02",), longest_s=2.0),
    stations=load_scenario("demo").stations,
    methods=("ik:previous", "mean_pose"),
)
PHYSICAL = replace(PLAIN, physics=Physics(), noise="noise")


def evaluation(scenario: Scenario) -> ClipEvaluation:
    source = open_scenario_motion(scenario.motion, None, scenario.seed)
    return ClipEvaluation(scenario, source, ClipPart("boxing_p1_01"), "boxing")


def conditions(scenario: Scenario) -> dict[str, Any]:
    return evaluation(scenario).conditions_of(make_method("ik:previous"), "pos+ori")


def test_without_physics_conditions_do_not_name_it() -> None:
    found = conditions(PLAIN)
    assert "physics" not in found
    assert "physics" not in found["components"]


def test_conditions_have_the_causes_that_act() -> None:
    """Those that the preset leaves out are zero, so that results stay comparable when defaults change."""
    acting = conditions(PHYSICAL)["physics"]
    assert acting["sound"]["range_noise_m"] == Sound().range_noise_m
    assert acting["sound"]["bursts_per_min"] == 0.0
    assert not acting["room"]["echoes"]
    assert conditions(replace(PHYSICAL, noise="clean"))["physics"]["sound"]["range_noise_m"] == 0.0
    assert conditions(replace(PHYSICAL, noise="default"))["physics"]["sound"]["bursts_per_min"] > 0.0


@pytest.mark.parametrize(
    ("kind", "noise"),
    [("tpose", "clean"), ("tpose", "noise"), ("tpose", "default"), ("poses", "clean"), ("poses", "noise")],
)
def test_calibration_poses_are_held_below_the_same_constellation(kind: Any, noise: Any) -> None:
    """Poses are held at the world's origin, the take is boxed elsewhere: the constellation hangs above either.

    Errors of the calibration are little more than with statistical errors. Under `default` the last of the eight poses
    cannot be held: the chest's station hears no emitter while the performer bows.
    """
    scenario = replace(PHYSICAL, calibration=kind, noise=noise)
    physical = evaluation(scenario).performer_calibration
    statistical = evaluation(replace(scenario, physics=None)).performer_calibration
    assert physical.calibration.kind == statistical.calibration.kind == kind
    assert physical.errors["mount_mm"] < statistical.errors["mount_mm"] + 5.0
    assert physical.errors["mount_deg"] < statistical.errors["mount_deg"] + 3.0


def test_a_station_that_hears_too_little_is_noted(tmp_path: Path) -> None:
    """Emitters that reach 1.6 m: none is heard at the ankles."""
    deaf = replace(PHYSICAL, physics=Physics(ConstellationSettings(range_m=1.6)), methods=("ik:previous",))
    made = evaluation(deaf)
    note = next(text for text in made.notes(make_method("ik:previous")) if "hears" in text)
    assert note.startswith("left_ankle hears three emitters for 0 % of the time, right_ankle for 0 %")
    assert not any("hears" in text for text in evaluation(PHYSICAL).notes(make_method("ik:previous")))
    engine.run(deaf, tmp_path / "out")
    assert f"TOO FEW EMITTERS IN boxing_p1_01: {note}" in run_table(read_summary(tmp_path / "out"))


def test_a_room_whose_walls_moved_is_noted() -> None:
    far = replace(DEFAULT_EMITTERS[0], number=10, position_m=(7.0, 0.0, 0.0))
    physics = Physics(ConstellationSettings(emitters=(*DEFAULT_EMITTERS, far)))
    notes = [evaluation(replace(PHYSICAL, physics=p)).notes(make_method("ik:previous")) for p in (physics, Physics())]
    note = "the room is 15 m by 12 m and 2.60 m high, with 10 emitters"
    assert [note in each for each in notes] == [True, False]


SCENARIO = """
methods = ["ik:previous"]
stations = "liu2011"
[motion]
source = "builtin"
behaviours = ["boxing"]
test = ["boxing_p1_01"]
longest_s = 3.0
[physics]
fusion.prediction_ms = { head = 20 }
"""


def test_a_recording_of_a_physical_tracker_is_scored_as_its_simulation(tmp_path: Path) -> None:
    path = tmp_path / "physical.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    playback = prepare_playback(path)
    simulation = playback.simulation
    record_capture(tmp_path / "a.rec", simulation.wire_format, simulation.wire, {"scenario": str(path)})
    takes = (
        recorded_take(RecordingStream(tmp_path / "a.rec"), playback),
        simulated_take(playback.clip_evaluation, "pos+ori"),
    )
    recorded, whole = (evaluate_each(["ik:previous"], take)[0] for take in takes)
    assert recorded.scores.matched == recorded.scores.expected == whole.scores.matched
    for name in ("joint_angle_mean_deg", "mpjpe_mm"):
        assert recorded.metrics[name] == whole.metrics[name] is not None
