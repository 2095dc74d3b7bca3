"""A clip of a scenario made ready to be worn outside a run."""

from pathlib import Path

import pytest

from harness.errors import BadInput, HarnessError, UnknownName
from harness.experiment.playback import prepare_playback
from harness.experiment.scenarios.scenario_reader import find_scenario


def test_what_is_not_asked_for_is_as_the_scenario_has_it() -> None:
    made = prepare_playback("demo")
    assert str(made.clip_evaluation.part) == "walking_p1_01"
    assert made.clip_evaluation.behaviour == "walking"
    assert made.samples.stations == made.calibration.stations == tuple(made.scenario.stations)
    assert made.samples.take_frames == made.simulation.expected


def test_clip_stations_rate_and_noise_are_put_in() -> None:
    made = prepare_playback("demo", clip="boxing_p1_02", stations=4, rate_hz=75.0, noise="clean")
    assert made.samples.stations == ("left_hand", "right_hand", "left_ankle", "right_ankle")
    assert made.samples.rate_hz == made.tracker.rate_hz == 75.0
    assert made.tracker.slot_s == 0.0
    assert made.clip_evaluation.behaviour == "boxing"
    assert prepare_playback("demo", stations=["head", "torso"]).calibration.stations == ("head", "torso")


def test_only_what_the_scenario_wears_is_worn(tmp_path: Path) -> None:
    shipped = find_scenario("demo").read_text(encoding="utf-8")
    file = tmp_path / "two.toml"
    file.write_text(shipped.replace("schema = 1", 'schema = 1\nworn = ["torso", "left_hand"]'), encoding="utf-8")
    made = prepare_playback(file)
    assert made.samples.stations == made.calibration.stations == tuple(made.scenario.stations) == ("left_hand", "torso")
    with pytest.raises(UnknownName, match="Known: left_hand, torso"):
        prepare_playback(file, stations=["head"])


@pytest.mark.parametrize(
    ("asked", "kind", "says"),
    [
        ({"scenario": "dmeo"}, UnknownName, "demo"),
        ({"scenario": "demo", "clip": "nobody_p1_01"}, HarnessError, "nobody"),
        ({"scenario": "demo", "stations": 7}, BadInput, "7 stations of 6"),
        ({"scenario": "demo", "stations": 0}, BadInput, "0 stations"),
        ({"scenario": "demo", "stations": ["haed"]}, UnknownName, "head"),
        ({"scenario": "demo", "rate_hz": 0.0}, BadInput, "rate"),
        ({"scenario": "demo", "noise": "loud"}, UnknownName, "loud"),
    ],
)
def test_what_cannot_be_worn_is_refused(asked: dict[str, object], kind: type[Exception], says: str) -> None:
    with pytest.raises(kind, match=says):
        prepare_playback(**asked)  # type: ignore[arg-type]
