"""Which readings no body could reach; sound readings are never marked."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.stream.polhemus.codec.items import STATION_CHARACTERS
from harness.stream.polhemus.codec.plausibility import PlausibilityCheck
from harness.stream.polhemus.codec.reader import ByteCapture, FrameReader, WireFormat
from harness.stream.polhemus.codec.readings import Readings, concatenate_readings
from harness.stream.polhemus.codec.records import RecordValues, encode_records

RATE_HZ = 40.0


def make_readings(rounds: int = 40, stations: int = 3, seed: int = 1) -> Readings:
    """Readings of stations that move at up to 10 m/s and 1000 deg/s."""
    rng = np.random.default_rng(seed)
    station = np.tile(np.arange(stations), rounds)
    time_s = np.repeat(np.arange(rounds), stations) / RATE_HZ + 0.003 * station
    sway = np.sin(2.0 * np.pi * 2.0 * time_s + station)
    position_m = 0.8 * sway[:, None] * np.array([0.6, 0.8, 0.0]) + station[:, None]
    quaternions = (
        rotations.exp(1.4 * sway[:, None] * np.array([0.0, 0.6, 0.8])) * rng.choice([-1.0, 1.0], len(station))[:, None]
    )
    one, no_flags = np.ones(len(station)), np.zeros(len(station), bool)
    return Readings(station, 100.0 + time_s, time_s, position_m, quaternions, one, no_flags)


def suspect_after_check(readings: Readings, splits: list[int] | None = None, stations: int = 3) -> Bools:
    check, cuts = PlausibilityCheck(stations, 1.0 / RATE_HZ), [0, *(splits or []), len(readings)]
    return np.concatenate([check.mark_suspect(readings[a:b]).suspect for a, b in pairwise(cuts) if b > a])


def displaced(readings: Readings, rows: list[int], by_m: Floats) -> Readings:
    position_m = readings.position_m.copy()
    position_m[rows] += by_m
    return replace(readings, position_m=position_m)


def test_sound_motion_is_not_marked() -> None:
    assert not suspect_after_check(make_readings()).any()


def test_only_a_single_distant_reading_is_marked() -> None:
    assert np.flatnonzero(
        suspect_after_check(displaced(make_readings(), [61], np.array([3.0, 0.0, 0.0])))
    ).tolist() == [61]


def test_only_a_single_rotated_reading_is_marked() -> None:
    readings = make_readings()
    quaternions = readings.tracker_from_station.copy()
    quaternions[61] = rotations.multiply(quaternions[61], rotations.exp(np.array([np.pi, 0.0, 0.0])))
    assert np.flatnonzero(suspect_after_check(replace(readings, tracker_from_station=quaternions))).tolist() == [61]


def test_a_position_that_the_next_reading_confirms_is_accepted() -> None:
    rows = list(range(61, 120, 3))
    assert np.flatnonzero(
        suspect_after_check(displaced(make_readings(), rows, np.array([0.0, 5.0, 0.0])))
    ).tolist() == [61]


def test_two_distant_readings_that_disagree_are_both_marked() -> None:
    readings = displaced(displaced(make_readings(), [61], np.array([4.0, 0.0, 0.0])), [64], np.array([-4.0, 0.0, 0.0]))
    assert np.flatnonzero(suspect_after_check(readings)).tolist() == [61, 64]


def test_a_long_silence_allows_a_long_way() -> None:
    readings = displaced(make_readings(), list(range(61, 120, 3)), np.array([5.0, 0.0, 0.0]))
    later = np.where(np.arange(120) >= 60, 0.2, 0.0)
    assert not suspect_after_check(replace(readings, measured_s=readings.measured_s + later)).any()


def test_lost_and_suspect_readings_are_no_evidence() -> None:
    readings = displaced(make_readings(), [61, 64], np.array([4.0, 0.0, 0.0]))
    quality, suspect = readings.quality.copy(), readings.suspect.copy()
    quality[61], suspect[64] = 0.0, True
    assert np.flatnonzero(suspect_after_check(replace(readings, quality=quality, suspect=suspect))).tolist() == [64]


def test_without_stamps_the_host_clock_serves() -> None:
    readings = displaced(make_readings(), [61], np.array([9.0, 0.0, 0.0]))
    unstamped = replace(readings, measured_s=np.full(len(readings), np.nan))
    assert np.flatnonzero(suspect_after_check(unstamped)).tolist() == [61]
    at_once = replace(unstamped, received_s=np.full(len(readings), 100.0))
    assert np.flatnonzero(suspect_after_check(at_once)).tolist() == [61], "many records read at one moment"


@pytest.mark.parametrize("seed", range(20))
def test_splitting_does_not_matter(seed: int) -> None:
    """Batches and single readings, near the limits and beyond."""
    rng = np.random.default_rng(seed)
    readings = make_readings(60, seed=seed)
    is_far = rng.random(len(readings)) < 0.2
    position_m = readings.position_m + is_far[:, None] * rng.normal(0.0, 2.0, (len(readings), 3))
    measured_s = np.where(rng.random(len(readings)) < 0.1, np.nan, readings.measured_s)
    quality = np.where(rng.random(len(readings)) < 0.1, 0.0, 1.0)
    readings = replace(readings, position_m=position_m, measured_s=measured_s, quality=quality)
    all_at_once = suspect_after_check(readings)
    assert 0 < all_at_once.sum() < len(readings)
    for _ in range(5):
        cuts = sorted(rng.integers(0, len(readings), int(rng.integers(1, 40))).tolist())
        np.testing.assert_array_equal(suspect_after_check(readings, cuts), all_at_once)
    np.testing.assert_array_equal(suspect_after_check(readings, list(range(1, len(readings)))), all_at_once)


def test_orientation_or_position_alone_is_checked() -> None:
    readings = displaced(make_readings(), [61], np.array([4.0, 0.0, 0.0]))
    no_turn = replace(readings, tracker_from_station=np.full((len(readings), 4), np.nan))
    assert np.flatnonzero(suspect_after_check(no_turn)).tolist() == [61]
    assert not suspect_after_check(replace(readings, position_m=np.full((len(readings), 3), np.nan))).any()


def test_readings_are_concatenated_unchanged() -> None:
    readings = make_readings()
    np.testing.assert_array_equal(concatenate_readings([readings[:7], readings[7:]]).position_m, readings.position_m)


def test_a_damaged_position_is_suspect_only_in_its_frame() -> None:
    """Through the whole reader: a wrong sign or exponent of a float is detected where it moves the station far."""
    number = np.tile(np.arange(4), 20)
    time_s = np.repeat(np.arange(20), 4) / RATE_HZ + 0.003 * number
    position_m = np.tile([2.0, 0.1, -1.5], (80, 1)) + 0.1 * number[:, None]
    values = RecordValues(time_s, position_m, np.tile([1.0, 0.0, 0.0, 0.0], (80, 1)), np.ones(80))
    wire = WireFormat(tuple("abcd"), RATE_HZ)
    table = encode_records(wire.items, np.frombuffer(STATION_CHARACTERS, np.uint8)[number], values, wire.settings)
    table["position"][42] *= [-1.0, 1.0, 1.0]
    reader = FrameReader(wire)
    capture = ByteCapture(table.tobytes(), 38 * np.arange(1, 81), 100.0 + time_s)
    frames = [*reader.feed_all(capture), *reader.finish()]
    assert [(k, s) for k, frame in enumerate(frames) for s in np.flatnonzero(frame.suspect).tolist()] == [(10, 2)]
