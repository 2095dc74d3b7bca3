"""Records as bytes and back, by the worked examples of docs/is900.md 5.4 and the lengths of 5.5."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadInput, UnknownName
from harness.stream.polhemus.codec import items
from harness.stream.polhemus.codec.decoder import Decoder, RecordRun, merge_adjacent
from harness.stream.polhemus.codec.readings import Readings, decode_readings
from harness.stream.polhemus.codec.records import (
    RecordFormat,
    RecordValues,
    Table,
    encode_records,
    format_records,
    from_yaw_pitch_roll_deg,
    pack_14_bit,
    parse_records,
    to_bytes,
    unpack_14_bit,
)

POSITION_M = np.array([[1.0, -0.5, 1.5]])
INCH_FORMAT, CM_FORMAT = RecordFormat(metres_per_unit=0.0254), RecordFormat(metres_per_unit=0.01)
YAW_90 = np.array([[np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]])
VALUES = RecordValues(np.array([12.3455]), POSITION_M, YAW_90, np.ones(1))
EXAMPLE_A = bytes.fromhex("303120 f67a1d42 f67a9dc1 71386c42 f304353f 00000000 00000000 f304353f 20")
EXAMPLE_C = bytes.fromhex("303220 0000c842 000048c2 00001643 0000b442 000020c1 0000b040 207f00 0d0a")


def _encode(
    station: str, codes: tuple[int, ...], settings: RecordFormat, values: RecordValues = VALUES, **columns: object
) -> bytes:
    table = encode_records(codes, np.frombuffer(station.encode(), np.uint8), values, settings)
    for name, value in columns.items():
        table[name] = value
    return table.tobytes()


def _decode(data: bytes, codes: tuple[int, ...], settings: RecordFormat, stations: bytes = b"123") -> Readings:
    table = np.frombuffer(data, items.record_type(codes))
    return decode_readings(table, np.zeros(len(table)), stations, settings)


def test_example_a_vrpn_in_inches() -> None:
    assert _encode("1", (2, 11, 0), INCH_FORMAT) == EXAMPLE_A
    readings = _decode(EXAMPLE_A, (2, 11, 0), INCH_FORMAT)
    np.testing.assert_allclose(readings.position_m, POSITION_M, atol=1e-6)
    np.testing.assert_allclose(readings.tracker_from_station, YAW_90, atol=1e-7)
    assert not readings.suspect.any()
    assert np.isnan(readings.measured_s).all()
    assert readings.quality.tolist() == [1.0]


def test_example_b_with_time_buttons_and_joystick() -> None:
    codes = (2, 11, 21, 22, 23, 0)
    encoded = _encode("1", codes, INCH_FORMAT, buttons=5, joystick=[127, 255])
    assert encoded == EXAMPLE_A[:-1] + bytes.fromhex("00e64046 05 7fff 20")
    assert _decode(encoded, codes, INCH_FORMAT).measured_s.tolist() == [12.3455]


def test_example_c_vrui_in_centimetres_with_angles() -> None:
    codes, angles = (2, 4, 22, 23, 1), np.array([[90.0, -10.0, 5.5]])
    z, y, x = np.deg2rad(angles[0])[:, None] * np.eye(3)[::-1]
    quaternion = rotations.multiply(rotations.multiply(rotations.exp(z), rotations.exp(y)), rotations.exp(x))
    values = RecordValues(np.zeros(1), POSITION_M, quaternion[None], np.ones(1))
    encoded = _encode("2", codes, CM_FORMAT, values, buttons=0x20, joystick=[127, 0])
    encoded_table, example_table = (np.frombuffer(data, items.record_type(codes)) for data in (encoded, EXAMPLE_C))
    np.testing.assert_allclose(encoded_table["yaw_pitch_roll_deg"], example_table["yaw_pitch_roll_deg"], rtol=1e-6)
    assert encoded[:15] + encoded[27:] == EXAMPLE_C[:15] + EXAMPLE_C[27:]
    readings = _decode(EXAMPLE_C, codes, CM_FORMAT)
    assert readings.station.tolist() == [1]
    np.testing.assert_allclose(readings.position_m, POSITION_M, atol=1e-6)
    assert rotations.angle_between_rad(readings.tracker_from_station[0], quaternion) < 1e-6


@pytest.mark.parametrize(
    ("full_scale", "values", "hex_bytes", "decoded"),
    [
        (3.0, [1.0, -0.5, 1.5], "aa152a750020", [0.99976, -0.50024, 1.5]),
        (180.0, [90.0, -10.0, 5.5], "8020397c7a01", [90.0, -9.9976, 5.4932]),
        (1.0, [0.70711, 0.0, 0.0, 0.70711], "a02d00000000202d", [0.70703, 0.0, 0.0, 0.70703]),
    ],
    ids=["F position", "G angles", "H quaternion"],
)
def test_sixteen_bit_examples(full_scale: float, values: list[float], hex_bytes: str, decoded: list[float]) -> None:
    packed = np.frombuffer(bytes.fromhex(hex_bytes), np.uint8)[None]
    np.testing.assert_allclose(full_scale * unpack_14_bit(packed)[0], decoded, atol=6e-5)
    assert pack_14_bit(np.array([values]) / full_scale).tobytes().hex() == hex_bytes


def test_sixteen_bit_form_is_exact_on_its_own_grid() -> None:
    grid = np.arange(-8192, 8192)[:, None] / 8192.0
    np.testing.assert_array_equal(unpack_14_bit(pack_14_bit(grid)), grid)


@pytest.mark.parametrize(
    ("codes", "ascii_length", "binary_length"),
    [
        ((2, 4, 1), 47, 29),
        ((40, 2, 4, 1), 51, 30),
        ((40, 2, 4, 22, 23, 1), 64, 33),
        ((2, 4, 22, 23, 1), 60, 32),
        ((2, 11, 1), 54, 33),
        ((2, 11, 0), 53, 32),
        ((2, 11, 21, 0), 67, 36),
        ((2, 11, 21, 22, 0), 72, 37),
        ((2, 11, 21, 22, 23, 0), 80, 39),
        ((40, 2, 4, 21, 22, 23, 1), 78, 37),
        ((40, 2, 11, 21, 1), 72, 38),
        ((40, 18, 20, 21, 1), 37, 24),
        ((18, 19, 20, 41, 42, 43, 44, 45, 46, 47, 48, 49), 3 + 20 + 20 + 24 + 28, 3 + 20 + 8 + 12 + 16),
    ],
)
def test_lengths_match_the_documented_table(codes: tuple[int, ...], ascii_length: int, binary_length: int) -> None:
    assert items.record_size(codes) == binary_length
    assert items.record_size(codes, binary=False) == ascii_length
    assert len(encode_bytes(codes, random_values(1), ascii_format())) == ascii_length


def test_an_item_without_a_known_size_is_refused() -> None:
    with pytest.raises(BadInput, match=r"item 70 \(auxiliary input\): no source gives its size"):
        items.record_type((2, 70, 1))
    with pytest.raises(UnknownName, match="output item called '17'"):
        items.record_type((2, 17, 1))
    with pytest.raises(BadInput, match="listed twice"):
        items.record_type((2, 2, 1))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("position", np.nan),
        ("position", np.inf),
        ("position", 3000.0),
        ("quaternion", np.nan),
        ("quaternion", 0.1),
        ("quaternion", 3e38),
        ("time", np.nan),
        ("time", -1.0),
        ("time", 1e30),
    ],
)
def test_impossible_numbers_are_suspect(field: str, value: float) -> None:
    values = RecordValues(np.array([5.0, 6.0]), np.ones((2, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)), np.ones(2))
    table = encode_records(items.STANDARD_LIST, np.frombuffer(b"12", np.uint8), values, CM_FORMAT)
    table[field][1] = value
    readings = decode_readings(table, np.zeros(2), b"12", CM_FORMAT)
    assert readings.suspect.tolist() == [False, True]


def test_microseconds() -> None:
    settings = RecordFormat(seconds_per_tick=1e-6)
    assert _decode(_encode("1", (21, 1), settings), (21, 1), settings).measured_s.tolist() == [12.3455]


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("place_m", [3.0, 3.4, 60.0, -3.001, -4.6])
def test_a_place_beyond_the_16_bit_range_is_no_position(place_m: float, axis: int) -> None:
    """The first and the last code of an axis say no more than that the station is there or beyond."""
    codes, position_m = (40, 18, 19, 21, 1), np.full((2, 3), 2.99)
    position_m[1, axis] = place_m
    values = RecordValues(np.array([5.0, 6.0]), position_m, np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)), np.ones(2))
    table = encode_records(codes, np.frombuffer(b"12", np.uint8), values, CM_FORMAT)
    readings = decode_readings(table, np.zeros(2), b"12", CM_FORMAT)
    assert np.abs(readings.position_m[0] - 2.99).max() < 3.0 / 8192
    assert np.isnan(readings.position_m[1]).all()
    assert np.isfinite(readings.tracker_from_station).all()
    assert not readings.suspect.any()


def test_lists_name_their_range() -> None:
    assert items.describe_list(items.SHORT_LIST) == "22 bytes, range 3 m"
    assert items.describe_list(items.STANDARD_LIST) == "38 bytes"


INCHES, CENTIMETRES = 0.0254, 0.01
POSE = np.array([[1.0, -0.5, 1.5]]), from_yaw_pitch_roll_deg(np.array([[90.0, -10.0, 5.5]]))
EXAMPLE_D = b"01   39.37 -19.69  59.06  90.00 -10.00   5.50\r\n"
EXAMPLE_E = b"03  214  39.37 -19.69  59.06  90.00 -10.00   5.50         12345   5  127 255\r\n"
CONTENT_ITEMS = tuple(code for code in items.ITEMS if code not in (0, 1, 50, 51))
"""Every item that says something."""
LISTS = (
    [(code, 1) for code in CONTENT_ITEMS]
    + [(code,) for code in CONTENT_ITEMS]
    + [(), (1,), (0, 2, 0, 4, 1), (5, 6, 1), (5, 7), (*(c for c in CONTENT_ITEMS if c not in items.EXTENDED_ITEMS), 1)]
    + [(52, 50, 61, 0, 51, 1), (52, 54, 11), (55, 56, 51), (2, 61, 1)]
)


def random_values(count: int, seed: int = 1) -> RecordValues:
    """Any places and turns."""
    rng = np.random.default_rng(seed)
    quaternions = rng.normal(size=(count, 4))
    return RecordValues(
        measured_s=np.sort(rng.uniform(1.0, 9.0, count)),
        position_m=rng.uniform(-2.9, 2.9, (count, 3)),
        tracker_from_station=quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True),
        quality=rng.uniform(0.1, 1.0, count),
        buttons=rng.integers(0, 64, count),
        joystick=rng.integers(0, 256, (count, 2)),
    )


def encode_bytes(codes: tuple[int, ...], values: RecordValues, settings: RecordFormat, stations: bytes = b"1") -> bytes:
    count = len(values.measured_s)
    characters = np.resize(np.frombuffer(stations, np.uint8), count)
    return to_bytes(codes, encode_records(codes, characters, values, settings), settings)


def decode_table(data: bytes, codes: tuple[int, ...], settings: RecordFormat, stations: bytes = b"123") -> Table:
    decoder = Decoder(dict.fromkeys(stations, codes), settings)
    (run,) = merge_adjacent([*decoder.feed(data), *decoder.finish()])
    assert isinstance(run, RecordRun)
    assert run.nbytes == len(data) == run.size * len(run.table)
    return run.table


def decode(data: bytes, codes: tuple[int, ...], settings: RecordFormat, stations: bytes = b"123") -> Readings:
    rows = decode_table(data, codes, settings, stations)
    return decode_readings(rows, np.zeros(len(rows)), stations, settings)


def ascii_format(unit: float = INCHES, tick: float = 1e-3) -> RecordFormat:
    return RecordFormat(unit, tick, binary=False)


def test_example_d_position_and_angles_in_inches() -> None:
    values = RecordValues(np.zeros(1), *POSE, np.ones(1))
    assert encode_bytes((2, 4, 1), values, ascii_format()) == EXAMPLE_D
    readings = decode(EXAMPLE_D, (2, 4, 1), ascii_format())
    np.testing.assert_allclose(readings.position_m, POSE[0], atol=0.5 * 0.01 * INCHES)
    assert rotations.angle_between_rad(readings.tracker_from_station[0], POSE[1][0]) < 1e-6


def test_example_e_quality_time_buttons_and_joystick() -> None:
    codes = (40, 2, 4, 21, 22, 23, 1)
    values = RecordValues(np.array([12.345]), *POSE, np.array([214.0 / 255.0]), np.array([5]), np.array([[127, 255]]))
    assert encode_bytes(codes, values, ascii_format(), b"3") == EXAMPLE_E
    rows = decode_table(EXAMPLE_E, codes, ascii_format())
    assert (rows["buttons"][0], rows["joystick"][0].tolist(), rows["quality"][0]) == (5, [127, 255], 214)
    readings = decode(EXAMPLE_E, codes, ascii_format())
    assert (readings.station.tolist(), readings.quality.tolist(), readings.suspect.tolist()) == (
        [2],
        [214.0 / 255.0],
        [False],
    )
    np.testing.assert_allclose(readings.measured_s, 12.345, atol=1e-6)


def test_adjacent_wide_numbers_are_cut_by_column() -> None:
    values = RecordValues(np.zeros(1), np.array([[-12.5, -100.0, -999.0]]) * 0.01, POSE[1], np.ones(1))
    data = encode_bytes((2, 1), values, ascii_format(0.01))
    assert data == b"01  -12.50-100.00-999.00\r\n"
    assert decode_table(data, (2, 1), ascii_format(0.01))["position"].tolist() == [[-12.5, -100.0, -999.0]]


def test_a_number_too_wide_for_its_column_becomes_the_widest_number() -> None:
    values = RecordValues(np.array([1e12]), np.array([[1e6, -1e6, np.inf]]), POSE[1], np.ones(1))
    data = encode_bytes((2, 21, 1), values, ascii_format(0.01, 1e-6))
    assert data == b"01 9999.99-999.999999.99" + b"99999999999999"[:14] + b"\r\n"


def test_a_nan_makes_no_record() -> None:
    values = RecordValues(np.array([1.0]), np.array([[np.nan, 0.0, 0.0]]), POSE[1], np.ones(1))
    data = encode_bytes((2, 1), values, ascii_format())
    assert data == b"01     nan   0.00   0.00\r\n"
    decoder = Decoder({ord("1"): (2, 1)}, ascii_format())
    assert not [event for event in [*decoder.feed(data), *decoder.finish()] if isinstance(event, RecordRun)]


@pytest.mark.parametrize(
    "field", [b"1 2.34 ", b"  12.3 ", b" 1-2.34", b"  1.234", b"   .123", b"   +1.0", b"1e10.00", b"--12.34"]
)
def test_a_malformed_field_makes_no_record(field: bytes) -> None:
    data = b"01 " + field + b"   0.00   0.00\r\n"
    decoder = Decoder({ord("1"): (2, 1)}, ascii_format())
    assert not [event for event in [*decoder.feed(data), *decoder.finish()] if isinstance(event, RecordRun)]


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("unit", [INCHES, CENTIMETRES])
@pytest.mark.parametrize("tick", [1e-3, 1e-6])
@pytest.mark.parametrize("codes", LISTS, ids=lambda codes: ",".join(map(str, codes)))
def test_every_item_is_encoded_and_decoded(codes: tuple[int, ...], unit: float, tick: float, binary: bool) -> None:
    """As the same bytes; the pose as exactly as its form allows."""
    settings = RecordFormat(unit, tick, binary)
    values = random_values(40)
    data = encode_bytes(codes, values, settings, b"123")
    rows = decode_table(data, codes, settings)
    assert to_bytes(codes, rows, settings) == data
    readings = decode_readings(rows, np.zeros(40), b"123", settings)
    assert not readings.suspect.any()
    assert readings.station.tolist() == [k % 3 for k in range(40)]
    position_m, angle_rad = _tolerances(codes, settings)
    if position_m < np.inf:
        assert np.abs(readings.position_m - values.position_m).max() <= position_m
    if angle_rad < np.inf:
        assert (
            rotations.angle_between_rad(readings.tracker_from_station, values.tracker_from_station).max() <= angle_rad
        )
    if 21 in codes:
        assert np.abs(readings.measured_s - values.measured_s).max() <= 1e-6 + (0.0 if binary else 0.5 * tick)
    if 22 in codes:
        assert rows["buttons"].tolist() == np.asarray(values.buttons).tolist()
    if 23 in codes:
        assert rows["joystick"].tolist() == np.asarray(values.joystick).tolist()
    if 40 in codes or 76 in codes:
        assert np.abs(readings.quality - values.quality).max() <= 0.5 / (255 if 40 in codes else 100) + 1e-9


def _tolerances(codes: tuple[int, ...], settings: RecordFormat) -> tuple[float, float]:
    """How far place [m] and turn [rad] may be off by the coarsest rounding of their item."""
    binary = settings.binary
    position_m_by_item = {2: 1e-6 if binary else 0.0051 * settings.metres_per_unit, 18: 3.0 / 8192}
    position_m_by_item[52] = 1e-6 if binary else 0.00051 * settings.metres_per_unit
    quaternions = {11: 1e-6 if binary else 3e-4, 20: 1e-3, 4: 1e-5 if binary else 3e-4, 19: 1e-3}
    quaternions |= {61: 2e-5, 54: 3e-5}
    if sum(code in codes for code in (55, 56, 57)) >= 2:
        quaternions[55] = 3e-5
    if sum(code in codes for code in (5, 6, 7)) >= 2:
        quaternions[5] = quaternions[6] = quaternions[7] = 1e-5 if binary else 3e-4
    else:
        quaternions[5] = quaternions[6] = quaternions[7] = np.inf
    position_tolerance_m = next((position_m_by_item[code] for code in codes if code in position_m_by_item), np.inf)
    by_rank = (quaternions.get(code, np.inf) for code in (11, 61, 20, 4, 54, 19, 5, 6, 7, 55) if code in codes)
    return position_tolerance_m, next(by_rank, np.inf)


def test_both_sizes_of_the_stylus_item() -> None:
    for binary in (True, False):
        for count in (1, 2):
            settings = RecordFormat(binary=binary, stylus_bytes=count)
            data = encode_bytes((16, 1), random_values(3), settings)
            assert len(data) == 3 * (3 + count + 2)
            assert to_bytes((16, 1), decode_table(data, (16, 1), settings), settings) == data


@hypothesis_settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-999.99, 9999.99), min_size=3, max_size=3))
def test_numbers_are_formatted_as_in_c(values: list[float]) -> None:
    rows: Table = np.zeros(1, items.record_type((2, 1)))
    rows["station"], rows["status"], rows["position"] = ord("1"), ord(" "), values
    rows["end_of_line"] = 13, 10
    data = format_records((2, 1), rows)
    singles: Floats = rows["position"][0].astype(float)
    assert data == b"01 " + b"".join(b"%7.2f" % value for value in singles.tolist()) + b"\r\n"
    back = parse_records((2, 1), np.frombuffer(data, np.uint8)[None])["position"][0]
    np.testing.assert_array_equal(back, np.array([float(b"%7.2f" % value) for value in singles.tolist()], np.float32))
