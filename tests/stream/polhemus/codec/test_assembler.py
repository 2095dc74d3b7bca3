"""Which records make a frame, and which of them are suspect."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.stream.frame import TrackerFrame
from harness.stream.polhemus.codec.assembler import FrameAssembler
from harness.stream.polhemus.codec.readings import Readings
from tests.stream.wire import station_columns

PERIOD_S, SLOT_S, HOST_OFFSET_S = 0.025, 0.003, 500.0


def make_readings(*pairs: tuple[float, int], delay_s: float | Floats = 0.005) -> Readings:
    """Sound readings of (round, station) pairs; a round is a period, a station a slot."""
    station = np.array([s for _, s in pairs])
    measured_s = np.array([r * PERIOD_S + s * SLOT_S for r, s in pairs])
    quaternions = np.tile([1.0, 0.0, 0.0, 0.0], (len(pairs), 1))
    position_m = np.stack([station, measured_s, measured_s], axis=1).astype(float)
    assembler, no_flags = np.ones(len(pairs)), np.zeros(len(pairs), bool)
    return Readings(
        station, HOST_OFFSET_S + measured_s + delay_s, measured_s, position_m, quaternions, assembler, no_flags
    )


def with_columns(readings: Readings, **station_columns: object) -> Readings:
    columns_by_name = {name: getattr(readings, name) for name in Readings.__dataclass_fields__}
    return Readings(**{**columns_by_name, **{name: np.asarray(value) for name, value in station_columns.items()}})


def rounds(count: int, stations: int = 4) -> list[tuple[float, int]]:
    return [(r, s) for r in range(count) for s in range(stations)]


def assemble(readings: Readings, stations: int = 4) -> list[TrackerFrame]:
    assembler = FrameAssembler(stations, PERIOD_S)
    return [*assembler.add(readings), *assembler.finish()]


def valid_stations(out: list[TrackerFrame]) -> list[list[int]]:
    return [np.flatnonzero(frame.position_valid).tolist() for frame in out]


def suspect_rows(out: list[TrackerFrame]) -> list[tuple[int, int]]:
    return [(f, int(s)) for f, frame in enumerate(out) for s in np.flatnonzero(frame.suspect)]


def test_one_round_is_one_frame() -> None:
    out = assemble(make_readings(*rounds(5)))
    assert valid_stations(out) == [[0, 1, 2, 3]] * 5
    assert suspect_rows(out) == []
    for r, frame in enumerate(out):
        np.testing.assert_allclose(frame.measured_s, r * PERIOD_S + SLOT_S * np.arange(4))
        np.testing.assert_array_equal(frame.position_m[:, 0], np.arange(4))
        assert frame.received_s == HOST_OFFSET_S + frame.measured_s[-1] + 0.005


def test_a_full_frame_closes_at_once_and_another_with_the_next_round() -> None:
    assembler = FrameAssembler(4, PERIOD_S)
    assert len(assembler.add(make_readings((0, 0), (0, 1), (0, 2)))) == 0
    assert len(assembler.add(make_readings((0, 3)))) == 1
    assert len(assembler.add(make_readings((1, 0), (1, 2)))) == 0
    assert valid_stations(assembler.add(make_readings((2, 0)))) == [[0, 2]]


@pytest.mark.parametrize("silent", [[0], [1], [3], [0, 1, 2], [1, 2, 3]])
def test_a_silent_station_is_an_invalid_row_never_a_repeated_one(silent: list[int]) -> None:
    out = assemble(make_readings(*[(r, s) for r, s in rounds(6) if s not in silent or r in (0, 5)]))
    assert valid_stations(out) == [[s for s in range(4) if s not in silent or r in (0, 5)] for r in range(6)]
    assert len(suspect_rows(out)) <= (2 if silent == [0, 1, 2] else 0), "coming back early in a round may look odd"
    for frame in out[1:5]:
        for column in (frame.measured_s, frame.position_m, frame.tracker_from_station):
            assert np.isnan(column[silent]).all()
        assert (frame.quality[silent] == 0.0).all()
        assert not frame.orientation_valid[silent].any()


def test_rounds_without_records_leave_no_frame() -> None:
    assert valid_stations(assemble(make_readings(*rounds(2), (7, 0), (7, 1), (7, 2), (7, 3)))) == [[0, 1, 2, 3]] * 3


def test_halves_of_different_rounds_are_not_put_together() -> None:
    """Stations 3 and 4 of one round are missing, and 1 and 2 of the next: numbers alone would make one frame."""
    assert valid_stations(assemble(make_readings((0, 0), (0, 1), (1, 2), (1, 3), (2, 0), (2, 1)))) == [
        [0, 1],
        [2, 3],
        [0, 1],
    ]


def test_without_stamps_the_host_clock_closes_a_frame_after_one_and_a_half_periods() -> None:
    readings = make_readings((0, 0), (0, 1), (2, 2), (2, 3))
    assert valid_stations(assemble(with_columns(readings, measured_s=np.full(4, np.nan)))) == [[0, 1], [2, 3]]


def test_an_unfinished_frame_expires_after_one_and_a_half_periods() -> None:
    assembler = FrameAssembler(4, PERIOD_S)
    assembler.add(make_readings((0, 0), (0, 1)))
    assert assembler.expire(HOST_OFFSET_S + 0.005 + 1.49 * PERIOD_S) == []
    assert valid_stations(assembler.expire(HOST_OFFSET_S + 0.005 + 1.51 * PERIOD_S)) == [[0, 1]]
    assert assembler.expire(HOST_OFFSET_S + 100.0) == []
    assert valid_stations(assembler.add(make_readings(*rounds(3)[4:]))) == [[0, 1, 2, 3]] * 2


def test_finish_returns_the_unfinished_frame() -> None:
    assembler = FrameAssembler(4, PERIOD_S)
    assembler.add(make_readings((0, 0), (0, 2)))
    assert valid_stations(assembler.finish()) == [[0, 2]]
    assert assembler.finish() == []


@pytest.mark.parametrize("has_stamps", [True, False])
@pytest.mark.parametrize("seed", range(20))
def test_splitting_does_not_matter(seed: int, has_stamps: bool) -> None:
    """With stations missing, suspect readings and stamps that step back, or without stamps."""
    rng = np.random.default_rng(seed)
    readings = make_readings(*[pair for pair in rounds(30) if rng.random() < 0.85])
    measured_s = np.where(rng.random(len(readings)) < 0.05, rng.uniform(0.0, 0.7, len(readings)), readings.measured_s)
    measured_s[rng.random(len(readings)) < (0.03 if has_stamps else 1.0)] = np.nan
    station = np.where(rng.random(len(readings)) < 0.03, rng.integers(0, 4, len(readings)), readings.station)
    readings = with_columns(readings, measured_s=measured_s, station=station, suspect=rng.random(len(readings)) < 0.05)
    all_at_once = assemble(readings)
    assembler, out = FrameAssembler(4, PERIOD_S), []
    at = 0
    while at < len(readings):
        step = int(rng.integers(1, 9))
        out += assembler.add(readings[at : at + step])
        at += step
    out += assembler.finish()
    assert valid_stations(out) == valid_stations(all_at_once)
    for piecewise, expected in zip(out, all_at_once, strict=True):
        for a, b in zip(station_columns(piecewise), station_columns(expected), strict=True):
            np.testing.assert_array_equal(a, b)


def test_a_reading_that_is_already_suspect_stays_suspect() -> None:
    readings = make_readings(*rounds(3))
    suspect = np.zeros(12, bool)
    suspect[6] = True
    assert suspect_rows(assemble(with_columns(readings, suspect=suspect))) == [(1, 2)]


@pytest.mark.parametrize("has_stamps", [True, False])
@pytest.mark.parametrize("wrong", range(4))
@pytest.mark.parametrize("right", range(4))
def test_a_wrong_station_that_sequence_or_time_reveals_is_marked(right: int, wrong: int, has_stamps: bool) -> None:
    """Every record of round 3 in turn is given to another station."""
    if right == wrong:
        return
    readings = make_readings(*rounds(8))
    if not has_stamps:
        readings = with_columns(readings, measured_s=np.full(len(readings), np.nan))
    station = readings.station.copy()
    station[12 + right] = wrong
    out = assemble(with_columns(readings, station=station))
    bad = [
        (f, int(s))
        for f, frame in enumerate(out)
        for s in np.flatnonzero(frame.position_valid)
        if frame.position_m[s, 0] != s
    ]
    assert set(bad) <= set(suspect_rows(out)), "the wrong one is marked"
    assert len(suspect_rows(out)) <= 4, "few of the others are"
    assert sum(len(rows) for rows in valid_stations(out)) >= 8 * 4 - 2


def test_a_stamp_that_steps_back_is_suspect() -> None:
    readings = make_readings(*rounds(6))
    measured_s = readings.measured_s.copy()
    measured_s[13] -= 1.4 * PERIOD_S
    out = assemble(with_columns(readings, measured_s=measured_s))
    marked = suspect_rows(out)
    assert len(marked) >= 1
    assert any(out[f].measured_s[s] == measured_s[13] or np.isnan(out[f].measured_s[s]) for f, s in marked)
    assert len(marked) <= 3


def test_quality_zero_is_invalid() -> None:
    readings = make_readings(*rounds(2))
    quality = np.ones(8)
    quality[5] = 0.0
    out = assemble(with_columns(readings, quality=quality))
    assert valid_stations(out) == [[0, 1, 2, 3], [0, 2, 3]]
    assert np.isnan(out[1].position_m[1]).all()
    assert np.isnan(out[1].tracker_from_station[1]).all()
    assert not np.isnan(out[1].measured_s[1])


@pytest.mark.parametrize("damage", [np.nan, np.inf, 3e38])
def test_impossible_numbers_leave_every_frame_sound(damage: float) -> None:
    readings = make_readings(*rounds(2))
    position_m, quaternions = readings.position_m.copy(), readings.tracker_from_station.copy()
    position_m[1], quaternions[2] = damage, damage
    for frame in assemble(with_columns(readings, position_m=position_m, tracker_from_station=quaternions)):
        assert np.isfinite(frame.position_m[frame.position_valid]).all()
        lengths = np.linalg.norm(frame.tracker_from_station[frame.orientation_valid], axis=1)
        np.testing.assert_allclose(lengths, 1.0)


@pytest.mark.parametrize("stations", [1, 2, 12])
def test_any_number_of_stations(stations: int) -> None:
    slot_s = PERIOD_S / stations
    pairs = rounds(5, stations)
    readings = make_readings(*pairs)
    measured_s = np.array([r * PERIOD_S + s * slot_s for r, s in pairs])
    out = assemble(with_columns(readings, measured_s=measured_s, received_s=HOST_OFFSET_S + measured_s), stations)
    assert valid_stations(out) == [list(range(stations))] * 5
    assert suspect_rows(out) == []
    assert assemble(readings[:0], stations) == []


@pytest.mark.parametrize("silent", [[0], [1], [3], [0, 2]])
@pytest.mark.parametrize("at_once", [True, False])
def test_without_stamps_a_station_that_stays_silent_is_no_sign_of_damage(silent: list[int], at_once: bool) -> None:
    readings = make_readings(*[(r, s) for r, s in rounds(6) if s not in silent])
    received_s = np.full(len(readings), HOST_OFFSET_S) if at_once else readings.received_s
    out = assemble(with_columns(readings, measured_s=np.full(len(readings), np.nan), received_s=received_s))
    assert valid_stations(out) == [[s for s in range(4) if s not in silent]] * 6
    assert suspect_rows(out) == []


def _split_state(assembler: FrameAssembler) -> tuple[object, object]:
    return assembler._round, assembler._round_after


@pytest.mark.parametrize("stations", [1, 2, 4])
@pytest.mark.parametrize("count", [25, 26, 27, 28, 57])
def test_whole_rounds_are_split_at_once_as_one_by_one(stations: int, count: int, rng: np.random.Generator) -> None:
    """Frames, doubts and the state for the next readings are the same, at the beginning and later."""
    early = rng.uniform(0.0, 0.1, 100)
    readings = make_readings(*[(r - float(early[int(r)]), s) for r, s in rounds(100, stations)])
    readings = with_columns(readings, suspect=rng.random(len(readings)) < 0.1)
    at_once, one_by_one = FrameAssembler(stations, PERIOD_S), FrameAssembler(stations, PERIOD_S)
    for part in (readings[:28], readings[28 : 28 + count]):
        split, expected = at_once._split_whole_rounds(part), one_by_one._split(part)
        assert split is not None
        for a, b in zip(split, expected, strict=True):
            np.testing.assert_array_equal(a, b)
        assert _split_state(at_once) == _split_state(one_by_one)
        for assembler in (at_once, one_by_one):
            assembler._round = assembler._round_after


DOUBTS = {
    "steps back": (13, -1.6 * PERIOD_S),
    "late in its round": (14, PERIOD_S),
    "next round too early": (16, -0.6 * PERIOD_S),
    "no stamp": (14, np.nan),
    "no stamp at first": (0, np.nan),
    "no stamp at last": (31, np.nan),
}


@pytest.mark.parametrize("doubt", DOUBTS)
def test_rounds_with_a_doubt_are_split_one_by_one(doubt: str) -> None:
    readings = make_readings(*rounds(8))
    at, shift_s = DOUBTS[doubt]
    measured_s = readings.measured_s.copy()
    measured_s[at] += shift_s
    assert FrameAssembler(4, PERIOD_S)._split_whole_rounds(readings) is not None
    assert FrameAssembler(4, PERIOD_S)._split_whole_rounds(with_columns(readings, measured_s=measured_s)) is None


def test_rounds_that_follow_too_early_are_split_one_by_one() -> None:
    assembler = FrameAssembler(4, PERIOD_S)
    assembler.add(make_readings((-0.3, 0), (-0.3, 1), (-0.3, 2), (-0.3, 3)))
    assert assembler._split_whole_rounds(make_readings(*rounds(8))) is None


def test_missing_stations_are_split_one_by_one() -> None:
    readings = make_readings(*[pair for pair in rounds(9) if pair != (4, 2)])
    assert FrameAssembler(4, PERIOD_S)._split_whole_rounds(readings) is None
