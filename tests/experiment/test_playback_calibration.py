"""A stored calibration meets the stations of a playback: fewer, more, others, another order."""

import pytest

from harness.calibrate import CalibrationFile
from harness.errors import BadInput
from harness.experiment.playback import Playback, prepare_playback


@pytest.fixture(scope="module")
def six() -> Playback:
    return prepare_playback("demo", stations=6)


@pytest.fixture(scope="module")
def four() -> Playback:
    return prepare_playback("demo", stations=4)


def test_calibrated_stations_that_are_not_worn_are_refused_with_both_lists(six: Playback, four: Playback) -> None:
    kept = CalibrationFile(six.calibration, None)
    names = six.calibration.stations
    with pytest.raises(BadInput) as refused:
        four.with_calibration(kept)
    assert f"is of {', '.join(names)}; worn are {', '.join(names[:4])}." in str(refused.value)
    assert f"--stations {','.join(names)}" in str(refused.value)
    said: list[str] = []
    chosen = four.with_calibration(kept, named=True, say=said.append)
    assert chosen.calibration.stations == names[:4]
    assert said == [f"the calibration is of {', '.join(names)}; worn are {', '.join(names[:4])}"]


def test_worn_stations_that_are_not_calibrated_are_refused_though_named(six: Playback, four: Playback) -> None:
    kept = CalibrationFile(four.calibration, None)
    with pytest.raises(BadInput, match=r"not in the calibration, which has .*; worn are left_hand, .*head"):
        six.with_calibration(kept, named=True)


def test_another_order_is_said_and_equal_lists_are_not(four: Playback) -> None:
    said: list[str] = []
    kept = CalibrationFile(four.calibration, None)
    four.with_calibration(kept, say=said.append)
    assert said == []
    turned = kept.select(four.calibration.stations[::-1])
    assert four.with_calibration(turned, say=said.append).calibration.stations == four.calibration.stations
    assert len(said) == 1


@pytest.mark.parametrize(
    ("calibrated", "clip", "said"),
    [
        ("p1", "walking_p2_01", ["the calibration is of performer p1; walking_p2_01 is of p2"]),
        ("p2", "walking_p2_01", []),
        ("", "walking_p2_01", []),
        ("13", None, []),
    ],
)
def test_a_calibration_of_another_performer_is_named_where_both_are_known(
    calibrated: str, clip: str | None, said: list[str]
) -> None:
    """Without a named clip a person wears the tracker, and the scenario's clip says nothing of who it is."""
    playback = prepare_playback("demo", clip=clip, stations=4)
    heard: list[str] = []
    kept = CalibrationFile(playback.calibration, None, performer=calibrated)
    assert playback.with_calibration(kept, say=heard.append).performer == ("p2" if clip else "")
    assert heard == said
