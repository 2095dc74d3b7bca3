"""Which records make a frame, and which of them are suspect."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.stream.codec.assembler import FrameAssembler
from harness.stream.codec.readings import Readings
from harness.stream.frame import TrackerFrame
from tests.stream.wire import columns

PERIOD_S, SLOT_S, LATE_S = 0.025, 0.003, 500.0


def told(*what: tuple[float, int], delay_s: float | Floats = 0.005) -> Readings:
    """Sound readings of (round, station) pairs; a round is a period, a station a slot."""
    station = np.array([s for _, s in what])
    measured_s = np.array([r * PERIOD_S + s * SLOT_S for r, s in what])
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (len(what), 1))
    place_m = np.stack([station, measured_s, measured_s], axis=1).astype(float)
    one, none = np.ones(len(what)), np.zeros(len(what), bool)
    return Readings(station, LATE_S + measured_s + delay_s, measured_s, place_m, turn, one, none)


def changed(given: Readings, **columns: object) -> Readings:
    own = {name: getattr(given, name) for name in Readings.__dataclass_fields__}
    return Readings(**{**own, **{name: np.asarray(value) for name, value in columns.items()}})


def rounds(count: int, stations: int = 4) -> list[tuple[float, int]]:
    return [(r, s) for r in range(count) for s in range(stations)]


def frames(given: Readings, stations: int = 4) -> list[TrackerFrame]:
    one = FrameAssembler(stations, PERIOD_S)
    return [*one.add(given), *one.finish()]


def came(out: list[TrackerFrame]) -> list[list[int]]:
    return [np.flatnonzero(frame.position_valid).tolist() for frame in out]


def suspects(out: list[TrackerFrame]) -> list[tuple[int, int]]:
    return [(f, int(s)) for f, frame in enumerate(out) for s in np.flatnonzero(frame.suspect)]


def test_one_round_is_one_frame() -> None:
    out = frames(told(*rounds(5)))
    assert came(out) == [[0, 1, 2, 3]] * 5
    assert suspects(out) == []
    for r, frame in enumerate(out):
        np.testing.assert_allclose(frame.measured_s, r * PERIOD_S + SLOT_S * np.arange(4))
        np.testing.assert_array_equal(frame.position_m[:, 0], np.arange(4))
        assert frame.received_s == LATE_S + frame.measured_s[-1] + 0.005


def test_a_full_frame_closes_at_once_and_another_with_the_next_round() -> None:
    one = FrameAssembler(4, PERIOD_S)
    assert len(one.add(told((0, 0), (0, 1), (0, 2)))) == 0
    assert len(one.add(told((0, 3)))) == 1
    assert len(one.add(told((1, 0), (1, 2)))) == 0
    assert came(one.add(told((2, 0)))) == [[0, 2]]


@pytest.mark.parametrize("silent", [[0], [1], [3], [0, 1, 2], [1, 2, 3]])
def test_a_silent_station_is_an_invalid_row_never_a_repeated_one(silent: list[int]) -> None:
    out = frames(told(*[(r, s) for r, s in rounds(6) if s not in silent or r in (0, 5)]))
    assert came(out) == [[s for s in range(4) if s not in silent or r in (0, 5)] for r in range(6)]
    assert len(suspects(out)) <= (2 if silent == [0, 1, 2] else 0), "coming back early in a round may look odd"
    for frame in out[1:5]:
        for column in (frame.measured_s, frame.position_m, frame.tracker_from_station):
            assert np.isnan(column[silent]).all()
        assert (frame.quality[silent] == 0.0).all()
        assert not frame.orientation_valid[silent].any()


def test_rounds_without_records_leave_no_frame() -> None:
    assert came(frames(told(*rounds(2), (7, 0), (7, 1), (7, 2), (7, 3)))) == [[0, 1, 2, 3]] * 3


def test_halves_of_different_rounds_are_not_put_together() -> None:
    """Stations 3 and 4 of one round are missing, and 1 and 2 of the next: numbers alone would make one frame."""
    assert came(frames(told((0, 0), (0, 1), (1, 2), (1, 3), (2, 0), (2, 1)))) == [[0, 1], [2, 3], [0, 1]]


def test_without_stamps_the_host_clock_closes_a_frame_after_one_and_a_half_periods() -> None:
    given = told((0, 0), (0, 1), (2, 2), (2, 3))
    assert came(frames(changed(given, measured_s=np.full(4, np.nan)))) == [[0, 1], [2, 3]]


def test_an_unfinished_frame_expires_after_one_and_a_half_periods() -> None:
    one = FrameAssembler(4, PERIOD_S)
    one.add(told((0, 0), (0, 1)))
    assert one.expire(LATE_S + 0.005 + 1.49 * PERIOD_S) == []
    assert came(one.expire(LATE_S + 0.005 + 1.51 * PERIOD_S)) == [[0, 1]]
    assert one.expire(LATE_S + 100.0) == []
    assert came(one.add(told(*rounds(3)[4:]))) == [[0, 1, 2, 3]] * 2


def test_the_end_gives_what_is_there() -> None:
    one = FrameAssembler(4, PERIOD_S)
    one.add(told((0, 0), (0, 2)))
    assert came(one.finish()) == [[0, 2]]
    assert one.finish() == []


@pytest.mark.parametrize("timed", [True, False])
@pytest.mark.parametrize("seed", range(20))
def test_pieces_do_not_matter(seed: int, timed: bool) -> None:
    """With stations missing, doubtful readings and stamps that step back, or without stamps."""
    rng = np.random.default_rng(seed)
    given = told(*[pair for pair in rounds(30) if rng.random() < 0.85])
    measured_s = np.where(rng.random(len(given)) < 0.05, rng.uniform(0.0, 0.7, len(given)), given.measured_s)
    measured_s[rng.random(len(given)) < (0.03 if timed else 1.0)] = np.nan
    station = np.where(rng.random(len(given)) < 0.03, rng.integers(0, 4, len(given)), given.station)
    given = changed(given, measured_s=measured_s, station=station, suspect=rng.random(len(given)) < 0.05)
    whole = frames(given)
    one, out = FrameAssembler(4, PERIOD_S), []
    at = 0
    while at < len(given):
        step = int(rng.integers(1, 9))
        out += one.add(given[at : at + step])
        at += step
    out += one.finish()
    assert came(out) == came(whole)
    for ours, theirs in zip(out, whole, strict=True):
        for a, b in zip(columns(ours), columns(theirs), strict=True):
            np.testing.assert_array_equal(a, b)


def test_what_is_doubtful_by_itself_is_suspect() -> None:
    given = told(*rounds(3))
    doubtful = np.zeros(12, bool)
    doubtful[6] = True
    assert suspects(frames(changed(given, suspect=doubtful))) == [(1, 2)]


@pytest.mark.parametrize("timed", [True, False])
@pytest.mark.parametrize("wrong", range(4))
@pytest.mark.parametrize("right", range(4))
def test_a_wrong_station_that_order_could_show_is_marked(right: int, wrong: int, timed: bool) -> None:
    """Every record of round 3 in turn is taken for another station's."""
    if right == wrong:
        return
    given = told(*rounds(8))
    if not timed:
        given = changed(given, measured_s=np.full(len(given), np.nan))
    station = given.station.copy()
    station[12 + right] = wrong
    out = frames(changed(given, station=station))
    bad = [
        (f, int(s))
        for f, frame in enumerate(out)
        for s in np.flatnonzero(frame.position_valid)
        if frame.position_m[s, 0] != s
    ]
    assert set(bad) <= set(suspects(out)), "the wrong one is marked"
    assert len(suspects(out)) <= 4, "few of the others are"
    assert sum(len(rows) for rows in came(out)) >= 8 * 4 - 2


def test_a_stamp_that_steps_back_is_suspect() -> None:
    given = told(*rounds(6))
    measured_s = given.measured_s.copy()
    measured_s[13] -= 1.4 * PERIOD_S
    out = frames(changed(given, measured_s=measured_s))
    marked = suspects(out)
    assert len(marked) >= 1
    assert any(out[f].measured_s[s] == measured_s[13] or np.isnan(out[f].measured_s[s]) for f, s in marked)
    assert len(marked) <= 3


def test_quality_nought_is_invalid() -> None:
    given = told(*rounds(2))
    quality = np.ones(8)
    quality[5] = 0.0
    out = frames(changed(given, quality=quality))
    assert came(out) == [[0, 1, 2, 3], [0, 2, 3]]
    assert np.isnan(out[1].position_m[1]).all()
    assert np.isnan(out[1].tracker_from_station[1]).all()
    assert not np.isnan(out[1].measured_s[1])


@pytest.mark.parametrize("damage", [np.nan, np.inf, 3e38])
def test_numbers_that_cannot_be_make_no_frame_unsound(damage: float) -> None:
    given = told(*rounds(2))
    place_m, turn = given.position_m.copy(), given.tracker_from_station.copy()
    place_m[1], turn[2] = damage, damage
    for frame in frames(changed(given, position_m=place_m, tracker_from_station=turn)):
        assert np.isfinite(frame.position_m[frame.position_valid]).all()
        lengths = np.linalg.norm(frame.tracker_from_station[frame.orientation_valid], axis=1)
        np.testing.assert_allclose(lengths, 1.0)


@pytest.mark.parametrize("stations", [1, 2, 12])
def test_any_number_of_stations(stations: int) -> None:
    slot_s = PERIOD_S / stations
    pairs = rounds(5, stations)
    given = told(*pairs)
    measured_s = np.array([r * PERIOD_S + s * slot_s for r, s in pairs])
    out = frames(changed(given, measured_s=measured_s, received_s=LATE_S + measured_s), stations)
    assert came(out) == [list(range(stations))] * 5
    assert suspects(out) == []
    assert frames(given[:0], stations) == []


@pytest.mark.parametrize("silent", [[0], [1], [3], [0, 2]])
@pytest.mark.parametrize("at_once", [True, False])
def test_without_stamps_a_station_that_stays_silent_is_no_sign_of_damage(silent: list[int], at_once: bool) -> None:
    given = told(*[(r, s) for r, s in rounds(6) if s not in silent])
    received_s = np.full(len(given), LATE_S) if at_once else given.received_s
    out = frames(changed(given, measured_s=np.full(len(given), np.nan), received_s=received_s))
    assert came(out) == [[s for s in range(4) if s not in silent]] * 6
    assert suspects(out) == []
