"""Each input combination masks exactly the readings it should."""

import numpy as np
import pytest

from harness.errors import BadInput, UnknownName
from harness.stream.frame import TrackerFrame
from harness.stream.inputs import INPUT_COMBINATIONS, make_inputs

SIX = ("left_wrist", "right_wrist", "left_ankle", "right_ankle", "torso", "head")


def make_frame(stations: int) -> TrackerFrame:
    return TrackerFrame(
        received_s=0.0,
        measured_s=np.zeros(stations),
        position_m=np.ones((stations, 3)),
        tracker_from_station=np.tile([1.0, 0.0, 0.0, 0.0], (stations, 1)),
        position_valid=np.ones(stations, bool),
        orientation_valid=np.ones(stations, bool),
        quality=np.ones(stations),
        suspect=np.zeros(stations, bool),
    )


@pytest.mark.parametrize(
    ("name", "position", "orientation"),
    [
        ("pos+ori", set(SIX), set(SIX)),
        ("pos", set(SIX), set()),
        ("ori", set(), set(SIX)),
        ("pos+torso_ori", set(SIX), {"torso"}),
        ("mixed", {"torso", "left_ankle", "right_ankle"}, {"torso", "head", "left_wrist", "right_wrist"}),
    ],
)
def test_a_combination_keeps_the_named_readings(name: str, position: set[str], orientation: set[str]) -> None:
    masked = make_inputs(name, SIX).mask(make_frame(6))
    assert {s for s, is_valid in zip(SIX, masked.position_valid, strict=True) if is_valid} == position
    assert {s for s, is_valid in zip(SIX, masked.orientation_valid, strict=True) if is_valid} == orientation
    assert np.array_equal(np.isnan(masked.position_m).any(1), ~masked.position_valid)
    assert np.array_equal(np.isnan(masked.tracker_from_station).any(1), ~masked.orientation_valid)


def test_a_station_that_is_not_worn_is_named() -> None:
    with pytest.raises(BadInput, match="torso"):
        make_inputs("pos+torso_ori", ("head", "pelvis"))


def test_an_unknown_combination_is_refused() -> None:
    with pytest.raises(UnknownName, match="pos"):
        make_inputs("position", SIX)
    assert set(INPUT_COMBINATIONS) == {"pos+ori", "pos", "ori", "pos+torso_ori", "mixed"}
