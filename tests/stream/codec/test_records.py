"""Records as bytes and back, by the worked examples of docs/is900.md 5.4 and the lengths of 5.5."""

import numpy as np
import pytest

from harness.core import rotations
from harness.errors import BadInput, UnknownName
from harness.stream.codec import items
from harness.stream.codec.readings import Readings, decode_readings
from harness.stream.codec.records import RecordFormat, RecordValues, encode_records, pack_14_bit, unpack_14_bit

POSITION_M = np.array([[1.0, -0.5, 1.5]])
INCHES, CENTIMETRES = RecordFormat(metres_per_unit=0.0254), RecordFormat(metres_per_unit=0.01)
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
    assert _encode("1", (2, 11, 0), INCHES) == EXAMPLE_A
    readings = _decode(EXAMPLE_A, (2, 11, 0), INCHES)
    np.testing.assert_allclose(readings.position_m, POSITION_M, atol=1e-6)
    np.testing.assert_allclose(readings.tracker_from_station, YAW_90, atol=1e-7)
    assert not readings.suspect.any()
    assert np.isnan(readings.measured_s).all()
    assert readings.quality.tolist() == [1.0]


def test_example_b_with_time_buttons_and_joystick() -> None:
    codes = (2, 11, 21, 22, 23, 0)
    encoded = _encode("1", codes, INCHES, buttons=5, joystick=[127, 255])
    assert encoded == EXAMPLE_A[:-1] + bytes.fromhex("00e64046 05 7fff 20")
    assert _decode(encoded, codes, INCHES).measured_s.tolist() == [12.3455]


def test_example_c_vrui_in_centimetres_with_angles() -> None:
    codes, angles = (2, 4, 22, 23, 1), np.array([[90.0, -10.0, 5.5]])
    z, y, x = np.deg2rad(angles[0])[:, None] * np.eye(3)[::-1]
    quaternion = rotations.multiply(rotations.multiply(rotations.exp(z), rotations.exp(y)), rotations.exp(x))
    values = RecordValues(np.zeros(1), POSITION_M, quaternion[None], np.ones(1))
    encoded = _encode("2", codes, CENTIMETRES, values, buttons=0x20, joystick=[127, 0])
    encoded_table, example_table = (np.frombuffer(data, items.record_type(codes)) for data in (encoded, EXAMPLE_C))
    np.testing.assert_allclose(encoded_table["yaw_pitch_roll_deg"], example_table["yaw_pitch_roll_deg"], rtol=1e-6)
    assert encoded[:15] + encoded[27:] == EXAMPLE_C[:15] + EXAMPLE_C[27:]
    readings = _decode(EXAMPLE_C, codes, CENTIMETRES)
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
    ("codes", "length"),
    [
        ((2, 4, 1), 29),
        ((40, 2, 4, 1), 30),
        ((40, 2, 4, 22, 23, 1), 33),
        ((2, 4, 22, 23, 1), 32),
        ((2, 11, 1), 33),
        ((2, 11, 0), 32),
        ((2, 11, 21, 0), 36),
        ((2, 11, 21, 22, 0), 37),
        ((2, 11, 21, 22, 23, 0), 39),
        ((40, 2, 11, 21, 1), 38),
        ((40, 18, 20, 21, 1), 24),
    ],
)
def test_lengths_match_the_documented_table(codes: tuple[int, ...], length: int) -> None:
    assert items.record_size(codes) == length


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
    table = encode_records(items.STANDARD_LIST, np.frombuffer(b"12", np.uint8), values, CENTIMETRES)
    table[field][1] = value
    readings = decode_readings(table, np.zeros(2), b"12", CENTIMETRES)
    assert readings.suspect.tolist() == [False, True]


def test_microseconds() -> None:
    settings = RecordFormat(seconds_per_tick=1e-6)
    assert _decode(_encode("1", (21, 1), settings), (21, 1), settings).measured_s.tolist() == [12.3455]


@pytest.mark.parametrize("codes", [(40, 2, 11, 21, 1), (40, 18, 20, 21, 1), (40, 18, 19, 21, 1), (2, 4, 0)])
def test_what_was_said_is_what_is_read(codes: tuple[int, ...], rng: np.random.Generator) -> None:
    quaternions = rng.normal(size=(200, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    values = RecordValues(
        rng.uniform(0.0, 100.0, 200), rng.uniform(-2.9, 2.9, (200, 3)), quaternions, rng.uniform(0.0, 1.0, 200)
    )
    stations = np.frombuffer(b"123", np.uint8)[rng.integers(0, 3, 200)]
    readings = _decode(encode_records(codes, stations, values, CENTIMETRES).tobytes(), codes, CENTIMETRES)
    coarse = 18 in codes
    assert bytes(b"123"[row] for row in readings.station) == stations.tobytes()
    assert np.abs(readings.position_m - values.position_m).max() < (3.0 / 8192 if coarse else 1e-6)
    assert rotations.angle_between_rad(readings.tracker_from_station, quaternions).max() < (1e-3 if coarse else 2e-6)
    assert not readings.suspect.any()
    if 21 in codes:
        assert np.abs(readings.measured_s - values.measured_s).max() < 1e-5
    if 40 in codes:
        assert np.abs(readings.quality - values.quality).max() < 0.5 / 255 + 1e-12


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("place_m", [3.0, 3.4, 60.0, -3.001, -4.6])
def test_a_place_beyond_the_16_bit_range_is_no_position(place_m: float, axis: int) -> None:
    """The first and the last code of an axis say no more than that the station is there or beyond."""
    codes, position_m = (40, 18, 19, 21, 1), np.full((2, 3), 2.99)
    position_m[1, axis] = place_m
    values = RecordValues(np.array([5.0, 6.0]), position_m, np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)), np.ones(2))
    table = encode_records(codes, np.frombuffer(b"12", np.uint8), values, CENTIMETRES)
    readings = decode_readings(table, np.zeros(2), b"12", CENTIMETRES)
    assert np.abs(readings.position_m[0] - 2.99).max() < 3.0 / 8192
    assert np.isnan(readings.position_m[1]).all()
    assert np.isfinite(readings.tracker_from_station).all()
    assert not readings.suspect.any()


def test_lists_name_their_range() -> None:
    assert items.describe_list(items.SHORT_LIST) == "22 bytes, range 3 m"
    assert items.describe_list(items.STANDARD_LIST) == "38 bytes"
