"""Records as text, by the worked examples of docs/is900.md 5.4 and the lengths of 5.5; every item in both formats."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.codec import ascii_records as text
from harness.stream.codec import items
from harness.stream.codec.decoder import Decoder, RecordRun, merge_adjacent
from harness.stream.codec.readings import Readings, decode_readings
from harness.stream.codec.records import (
    RecordFormat,
    RecordValues,
    Table,
    encode_records,
    from_yaw_pitch_roll_deg,
    to_bytes,
)

INCHES, CENTIMETRES = 0.0254, 0.01
POSE = np.array([[1.0, -0.5, 1.5]]), from_yaw_pitch_roll_deg(np.array([[90.0, -10.0, 5.5]]))
D = b"01   39.37 -19.69  59.06  90.00 -10.00   5.50\r\n"
E = b"03  214  39.37 -19.69  59.06  90.00 -10.00   5.50         12345   5  127 255\r\n"
WHOLE = tuple(code for code in items.ITEMS if code not in (0, 1))
"""Every item that says something."""
ALL = (
    [(code, 1) for code in WHOLE]
    + [(code,) for code in WHOLE]
    + [(), (1,), (0, 2, 0, 4, 1), (5, 6, 1), (5, 7), (*WHOLE, 1)]
)


def said(count: int, seed: int = 1) -> RecordValues:
    """Any places and turns."""
    rng = np.random.default_rng(seed)
    turn = rng.normal(size=(count, 4))
    return RecordValues(
        measured_s=np.sort(rng.uniform(1.0, 9.0, count)),
        position_m=rng.uniform(-2.9, 2.9, (count, 3)),
        tracker_from_station=turn / np.linalg.norm(turn, axis=1, keepdims=True),
        quality=rng.uniform(0.1, 1.0, count),
        buttons=rng.integers(0, 64, count),
        joystick=rng.integers(0, 256, (count, 2)),
    )


def sent(codes: tuple[int, ...], given: RecordValues, settings: RecordFormat, stations: bytes = b"1") -> bytes:
    count = len(given.measured_s)
    characters = np.resize(np.frombuffer(stations, np.uint8), count)
    return to_bytes(codes, encode_records(codes, characters, given, settings), settings)


def table(data: bytes, codes: tuple[int, ...], settings: RecordFormat, stations: bytes = b"123") -> Table:
    one = Decoder(dict.fromkeys(stations, codes), settings)
    (run,) = merge_adjacent([*one.feed(data), *one.finish()])
    assert isinstance(run, RecordRun)
    assert run.nbytes == len(data) == run.size * len(run.table)
    return run.table


def read(data: bytes, codes: tuple[int, ...], settings: RecordFormat, stations: bytes = b"123") -> Readings:
    rows = table(data, codes, settings, stations)
    return decode_readings(rows, np.zeros(len(rows)), stations, settings)


def as_text(unit: float = INCHES, tick: float = 1e-3) -> RecordFormat:
    return RecordFormat(unit, tick, binary=False)


def test_example_d_position_and_angles_in_inches() -> None:
    given = RecordValues(np.zeros(1), *POSE, np.ones(1))
    assert sent((2, 4, 1), given, as_text()) == D
    got = read(D, (2, 4, 1), as_text())
    np.testing.assert_allclose(got.position_m, POSE[0], atol=0.5 * 0.01 * INCHES)
    assert rotations.angle_between_rad(got.tracker_from_station[0], POSE[1][0]) < 1e-6


def test_example_e_quality_time_buttons_and_joystick() -> None:
    codes = (40, 2, 4, 21, 22, 23, 1)
    given = RecordValues(np.array([12.345]), *POSE, np.array([214.0 / 255.0]), np.array([5]), np.array([[127, 255]]))
    assert sent(codes, given, as_text(), b"3") == E
    rows = table(E, codes, as_text())
    assert (rows["buttons"][0], rows["joystick"][0].tolist(), rows["quality"][0]) == (5, [127, 255], 214)
    got = read(E, codes, as_text())
    assert (got.station.tolist(), got.quality.tolist(), got.suspect.tolist()) == ([2], [214.0 / 255.0], [False])
    np.testing.assert_allclose(got.measured_s, 12.345, atol=1e-6)


@pytest.mark.parametrize(
    ("codes", "length"),
    [
        ((2, 4, 1), 47),
        ((40, 2, 4, 1), 51),
        ((40, 2, 4, 22, 23, 1), 64),
        ((2, 4, 22, 23, 1), 60),
        ((2, 11, 1), 54),
        ((2, 11, 0), 53),
        ((2, 11, 21, 0), 67),
        ((2, 11, 21, 22, 0), 72),
        ((2, 11, 21, 22, 23, 0), 80),
        ((40, 2, 4, 21, 22, 23, 1), 78),
        ((18, 19, 20, 41, 42, 43, 44, 45, 46, 47, 48, 49), 3 + 20 + 20 + 24 + 28),
    ],
)
def test_lengths_are_those_of_the_table(codes: tuple[int, ...], length: int) -> None:
    assert items.record_size(codes, binary=False) == length
    assert len(sent(codes, said(1), as_text())) == length


def test_wide_numbers_run_together_and_are_cut_by_column() -> None:
    given = RecordValues(np.zeros(1), np.array([[-12.5, -100.0, -999.0]]) * 0.01, POSE[1], np.ones(1))
    data = sent((2, 1), given, as_text(0.01))
    assert data == b"01  -12.50-100.00-999.00\r\n"
    assert table(data, (2, 1), as_text(0.01))["position"].tolist() == [[-12.5, -100.0, -999.0]]


def test_what_is_wider_than_its_column_says_the_widest_number() -> None:
    given = RecordValues(np.array([1e12]), np.array([[1e6, -1e6, np.inf]]), POSE[1], np.ones(1))
    data = sent((2, 21, 1), given, as_text(0.01, 1e-6))
    assert data == b"01 9999.99-999.999999.99" + b"99999999999999"[:14] + b"\r\n"


def test_what_is_no_number_is_no_record() -> None:
    given = RecordValues(np.array([1.0]), np.array([[np.nan, 0.0, 0.0]]), POSE[1], np.ones(1))
    data = sent((2, 1), given, as_text())
    assert data == b"01     nan   0.00   0.00\r\n"
    one = Decoder({ord("1"): (2, 1)}, as_text())
    assert not [event for event in [*one.feed(data), *one.finish()] if isinstance(event, RecordRun)]


@pytest.mark.parametrize(
    "field", [b"1 2.34 ", b"  12.3 ", b" 1-2.34", b"  1.234", b"   .123", b"   +1.0", b"1e10.00", b"--12.34"]
)
def test_a_field_out_of_shape_is_no_record(field: bytes) -> None:
    data = b"01 " + field + b"   0.00   0.00\r\n"
    one = Decoder({ord("1"): (2, 1)}, as_text())
    assert not [event for event in [*one.feed(data), *one.finish()] if isinstance(event, RecordRun)]


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("unit", [INCHES, CENTIMETRES])
@pytest.mark.parametrize("tick", [1e-3, 1e-6])
@pytest.mark.parametrize("codes", ALL, ids=lambda codes: ",".join(map(str, codes)))
def test_every_item_goes_out_and_comes_back(codes: tuple[int, ...], unit: float, tick: float, binary: bool) -> None:
    """As the same bytes; the pose as exactly as its form allows."""
    settings = RecordFormat(unit, tick, binary)
    given = said(40)
    data = sent(codes, given, settings, b"123")
    rows = table(data, codes, settings)
    assert to_bytes(codes, rows, settings) == data
    got = decode_readings(rows, np.zeros(40), b"123", settings)
    assert not got.suspect.any()
    assert got.station.tolist() == [k % 3 for k in range(40)]
    position_m, turn_rad = _steps(codes, settings)
    if position_m < np.inf:
        assert np.abs(got.position_m - given.position_m).max() <= position_m
    if turn_rad < np.inf:
        assert rotations.angle_between_rad(got.tracker_from_station, given.tracker_from_station).max() <= turn_rad
    if 21 in codes:
        assert np.abs(got.measured_s - given.measured_s).max() <= 1e-6 + (0.0 if binary else 0.5 * tick)
    if 22 in codes:
        assert rows["buttons"].tolist() == np.asarray(given.buttons).tolist()
    if 23 in codes:
        assert rows["joystick"].tolist() == np.asarray(given.joystick).tolist()
    if 40 in codes or 76 in codes:
        assert np.abs(got.quality - given.quality).max() <= 0.5 / (255 if 40 in codes else 100) + 1e-9


def _steps(codes: tuple[int, ...], settings: RecordFormat) -> tuple[float, float]:
    """How far place [m] and turn [rad] may be off by the coarsest rounding of their item."""
    exact = settings.binary
    place = {2: 1e-6 if exact else 0.0051 * settings.metres_per_unit, 18: 3.0 / 8192}
    turn = {11: 1e-6 if exact else 3e-4, 20: 1e-3, 4: 1e-5 if exact else 3e-4, 19: 1e-3}
    if sum(code in codes for code in (5, 6, 7)) >= 2:
        turn[5] = turn[6] = turn[7] = 1e-5 if exact else 3e-4
    else:
        turn[5] = turn[6] = turn[7] = np.inf
    first_place = next((place[code] for code in codes if code in place), np.inf)
    return first_place, next((turn[code] for code in (11, 20, 4, 19, 5, 6, 7) if code in codes), np.inf)


def test_both_sizes_of_the_stylus_item() -> None:
    for binary in (True, False):
        for count in (1, 2):
            settings = RecordFormat(binary=binary, stylus_bytes=count)
            data = sent((16, 1), said(3), settings)
            assert len(data) == 3 * (3 + count + 2)
            assert to_bytes((16, 1), table(data, (16, 1), settings), settings) == data


@hypothesis_settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-999.99, 9999.99), min_size=3, max_size=3))
def test_any_number_is_written_as_c_writes_it(values: list[float]) -> None:
    rows: Table = np.zeros(1, items.record_type((2, 1)))
    rows["station"], rows["status"], rows["position"] = ord("1"), ord(" "), values
    rows["end_of_line"] = 13, 10
    data = text.format_records((2, 1), rows)
    singles: Floats = rows["position"][0].astype(float)
    assert data == b"01 " + b"".join(b"%7.2f" % value for value in singles.tolist()) + b"\r\n"
    back = text.parse_records((2, 1), np.frombuffer(data, np.uint8)[None])["position"][0]
    np.testing.assert_array_equal(back, np.array([float(b"%7.2f" % value) for value in singles.tolist()], np.float32))
