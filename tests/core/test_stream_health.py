"""Stations that hear too few emitters, in a sentence."""

from harness.core.stream_health import hearing_key, poor_hearing


def test_stations_below_half_of_the_time_are_named() -> None:
    health = {
        hearing_key("head"): 0.5,
        hearing_key("torso"): 0.314,
        hearing_key("left_wrist"): 0.0,
        "latency_p50_ms": 0.1,
    }
    assert poor_hearing(health) == "torso hears three emitters for 31 % of the time, left_wrist for 0 %"


def test_nothing_is_said_without_physics_or_with_enough_emitters() -> None:
    assert poor_hearing({"records_sent": 0.0}) == ""
    assert poor_hearing({hearing_key("head"): 0.51}) == ""
