"""What a serial line can carry, by the table of the protocol (docs/is900.md 10)."""

import pytest

from harness.errors import BadInput
from harness.stream.polhemus.codec.capacity import check_capacity, emitter_reach_m, required_bit_rate
from harness.stream.polhemus.codec.items import SHORT_LIST, STANDARD_LIST, record_size
from harness.stream.polhemus.codec.replies import Emitter
from harness.stream.polhemus.emulator.settings import DEFAULT_EMITTERS

BAUD = 115200


@pytest.mark.parametrize(
    ("items", "records"),
    [((2, 4, 1), 397), ((2, 11, 0), 360), ((2, 11, 1), 349), ((2, 11, 21, 0), 320), ((2, 11, 21, 22, 23, 0), 295)],
)
def test_records_per_second_are_those_of_the_protocol(items: tuple[int, ...], records: int) -> None:
    check_capacity("port", BAUD, 1, items, records, 0.0)
    with pytest.raises(BadInput, match=f"1 stations x {record_size(items)} bytes"):
        check_capacity("port", BAUD, 1, items, records + 1, 0.0)


@pytest.mark.parametrize(
    ("stations", "rate_hz", "items"), [(4, 75, STANDARD_LIST), (6, 50, STANDARD_LIST), (4, 120, SHORT_LIST)]
)
def test_typical_live_configurations_fit(stations: int, rate_hz: float, items: tuple[int, ...]) -> None:
    check_capacity("port", BAUD, stations, items, rate_hz, 0.0)
    assert required_bit_rate(stations, items, rate_hz) > 0.9 * BAUD


def test_polling_mp_adds_to_the_load() -> None:
    assert required_bit_rate(1, (2, 11, 1), 100.0, poll_hz=1.0) - required_bit_rate(1, (2, 11, 1), 100.0) == 480.0


def test_over_tcp_there_is_no_limit() -> None:
    check_capacity("tcp://a:1", None, 12, STANDARD_LIST, 180.0, 1.0)


def test_the_suggested_remedies_do_fit() -> None:
    with pytest.raises(BadInput) as raised:
        check_capacity("port", 9600, 2, STANDARD_LIST, 20.0, 0.0)
    assert "1 station," in raised.value.advice
    assert "runs at 12 Hz" in raised.value.advice
    assert "--items 40,18,19,21,1 (22 bytes, range 3 m: positions farther than 3 m" in raised.value.advice
    with pytest.raises(BadInput) as raised:
        check_capacity("port", 9600, 2, STANDARD_LIST, 20.0, 0.0, reach_m=4.7)
    assert "40,18,19,21,1" not in raised.value.advice
    check_capacity("port", 9600, 1, STANDARD_LIST, 20.0, 0.0)
    check_capacity("port", 9600, 2, STANDARD_LIST, 12.0, 0.0)
    check_capacity("port", 9600, 2, SHORT_LIST, 20.0, 0.0)


DOWN = (0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("position_m", "normal", "reach_m"),
    [
        ((0.5, -3.5, 0.0), DOWN, 3.5),  # beside the origin
        ((0.5, -1.0, 0.2), DOWN, 1.0),  # at the ceiling, as the origin
        ((0.5, -1.0, -3.2), DOWN, 1.0),  # at the ceiling, the origin at the floor
        ((0.5, -1.0, -9.0), DOWN, 5.0),  # too high to be heard at the origin
        ((3.2, 0.0, 0.0), (-1.0, 0.0, 0.0), 0.0),  # at a wall, towards the origin
        ((3.2, 0.0, 0.0), (1.0, 0.0, 0.0), 3.2),  # at a wall, away from it
    ],
)
def test_stations_stand_before_an_emitter(
    position_m: tuple[float, float, float], normal: tuple[float, float, float], reach_m: float
) -> None:
    far = Emitter(1, position_m, normal, 5001)
    near = Emitter(2, (0.0, 0.0, 0.0), DOWN, 5002)
    assert emitter_reach_m([far]) == pytest.approx(reach_m)
    assert emitter_reach_m([near, far, near]) == pytest.approx(reach_m)


def test_the_largest_emitter_counts() -> None:
    assert emitter_reach_m(DEFAULT_EMITTERS) == pytest.approx(0.9144)
    assert emitter_reach_m([]) == 0.0
