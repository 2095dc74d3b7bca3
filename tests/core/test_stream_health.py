"""Stations that hear too few emitters, in a sentence."""

from harness.core.stream_health import GROWN_ROOM, describe_grown_room, hearing_key, poor_hearing


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


def test_a_room_that_grew_is_described() -> None:
    health = dict(zip(GROWN_ROOM, (16.0, 12.0, 2.6, 54.0), strict=True))
    assert describe_grown_room(health) == "the room is 16 m by 12 m and 2.60 m high, with 54 emitters"
    assert describe_grown_room({"records_sent": 0.0}) == ""
