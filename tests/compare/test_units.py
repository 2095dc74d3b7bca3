"""Units of statistics: performers, or takes whose performer is not known."""

import pytest

from harness.compare.units import BY_NAME, Sampling, average_units, count_clips, count_units


@pytest.mark.parametrize(
    ("clips", "performers", "words"),
    [
        (("walking_p1_01", "boxing_p1_02@0.20-0.40", "walking_p2_01"), None, "3 clips of 2 performers"),
        (("13_17", "13_18@0.2-0.4"), None, "2 clips of 1 performer"),
        (("a: 13_17", "b: 14_01"), None, "2 clips of 2 performers"),
        (("take one", "13_17"), None, "2 clips of 2 units"),
        (("take one", "two"), None, "2 clips"),
        (("take one@0.1-0.2", "take one@0.5-0.7"), None, "2 clips of 1 take"),
        (("13_17", "14_01"), {"13_17": "Anna", "14_01": "Anna"}, "2 clips of 1 performer"),
        (("a: take one@0.20-0.40", "a: two"), {"take one": "Anna", "two": "Bert"}, "2 clips of 2 performers"),
        (("walking_p1_01", "two"), {"two": "Bert"}, "2 clips of 2 units"),
    ],
)
def test_clips_and_units_are_counted(clips: tuple[str, ...], performers: dict[str, str] | None, words: str) -> None:
    assert count_clips(clips, Sampling(performers)) == words


def test_parts_of_one_take_are_one_unit_where_the_performer_is_not_known() -> None:
    assert BY_NAME.unit_of("demo: mine@0.20-0.40") == BY_NAME.unit_of("mine@0.60-0.80") == "mine"


def test_the_mean_of_a_unit_is_that_of_its_clips() -> None:
    values = {"13_17@0.2-0.4": 1.0, "14_02@0.2-0.4": 5.0, "13_17@0.6-0.8": 2.0}
    assert average_units(values) == {"performer 13": 1.5, "performer 14": 5.0}


BLOCKS = {"13_17@0.2-0.4": 1.0, "13_17@0.6-0.8": 2.0, "14_02": 5.0}
CLIPS = Sampling(unit="clip")


def test_clips_are_units_where_a_scenario_says_so_and_hold_for_these_performers_only() -> None:
    assert list(average_units(BLOCKS, CLIPS).values()) == [1.0, 2.0, 5.0]
    counted = "3 clips of 2 performers, these performers only"
    assert count_units(average_units(BLOCKS, CLIPS)) == count_clips(BLOCKS, CLIPS) == counted
    assert count_clips(["mine@0.2-0.4"], CLIPS, "sequence") == "1 sequence of 1 take, this take only"
