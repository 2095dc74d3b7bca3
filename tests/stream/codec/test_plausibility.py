"""Which readings no body could reach, and that sound ones are never marked."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from harness.body import mounts, retargeting
from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.mocap import synthetic
from harness.simulate import noise
from harness.simulate.disturbance import KINDS, Disturbance, Kind
from harness.simulate.simulation import TrackerConfig, simulate_tracker
from harness.stream.codec.capture import ByteCapture
from harness.stream.codec.items import STATION_CHARACTERS
from harness.stream.codec.plausibility import PlausibilityCheck
from harness.stream.codec.reader import FrameReader, WireFormat
from harness.stream.codec.readings import Readings, concatenate_readings
from harness.stream.codec.records import RecordValues, encode_records

RATE_HZ = 40.0
STATIONS = ("left_wrist", "right_wrist", "left_ankle", "right_ankle", "torso", "head")


def readings(rounds: int = 40, stations: int = 3, seed: int = 1) -> Readings:
    """Stations that go at up to 10 m/s and 1000 deg/s."""
    rng = np.random.default_rng(seed)
    station = np.tile(np.arange(stations), rounds)
    time_s = np.repeat(np.arange(rounds), stations) / RATE_HZ + 0.003 * station
    sway = np.sin(2.0 * np.pi * 2.0 * time_s + station)
    place_m = 0.8 * sway[:, None] * np.array([0.6, 0.8, 0.0]) + station[:, None]
    turn = (
        rotations.exp(1.4 * sway[:, None] * np.array([0.0, 0.6, 0.8])) * rng.choice([-1.0, 1.0], len(station))[:, None]
    )
    one, none = np.ones(len(station)), np.zeros(len(station), bool)
    return Readings(station, 100.0 + time_s, time_s, place_m, turn, one, none)


def judged(given: Readings, pieces: list[int] | None = None, stations: int = 3) -> Bools:
    motion, cuts = PlausibilityCheck(stations, 1.0 / RATE_HZ), [0, *(pieces or []), len(given)]
    return np.concatenate([motion.mark_suspect(given[a:b]).suspect for a, b in pairwise(cuts) if b > a])


def moved(given: Readings, rows: list[int], by_m: Floats) -> Readings:
    place_m = given.position_m.copy()
    place_m[rows] += by_m
    return replace(given, position_m=place_m)


def test_sound_motion_is_left_alone() -> None:
    assert not judged(readings()).any()


def test_a_single_reading_far_away_is_marked_and_no_other() -> None:
    assert np.flatnonzero(judged(moved(readings(), [61], np.array([3.0, 0.0, 0.0])))).tolist() == [61]


def test_a_single_reading_turned_about_is_marked_and_no_other() -> None:
    given = readings()
    turn = given.tracker_from_station.copy()
    turn[61] = rotations.multiply(turn[61], rotations.exp(np.array([np.pi, 0.0, 0.0])))
    assert np.flatnonzero(judged(replace(given, tracker_from_station=turn))).tolist() == [61]


def test_a_place_that_the_next_reading_agrees_with_is_real() -> None:
    rows = list(range(61, 120, 3))
    assert np.flatnonzero(judged(moved(readings(), rows, np.array([0.0, 5.0, 0.0])))).tolist() == [61]


def test_two_odd_readings_that_disagree_are_both_marked() -> None:
    given = moved(moved(readings(), [61], np.array([4.0, 0.0, 0.0])), [64], np.array([-4.0, 0.0, 0.0]))
    assert np.flatnonzero(judged(given)).tolist() == [61, 64]


def test_a_long_silence_allows_a_long_way() -> None:
    given = moved(readings(), list(range(61, 120, 3)), np.array([5.0, 0.0, 0.0]))
    later = np.where(np.arange(120) >= 60, 0.2, 0.0)
    assert not judged(replace(given, measured_s=given.measured_s + later)).any()


def test_lost_and_doubtful_readings_are_no_evidence() -> None:
    given = moved(readings(), [61, 64], np.array([4.0, 0.0, 0.0]))
    quality, doubtful = given.quality.copy(), given.suspect.copy()
    quality[61], doubtful[64] = 0.0, True
    assert np.flatnonzero(judged(replace(given, quality=quality, suspect=doubtful))).tolist() == [64]


def test_without_stamps_the_host_clock_serves() -> None:
    given = moved(readings(), [61], np.array([9.0, 0.0, 0.0]))
    untimed = replace(given, measured_s=np.full(len(given), np.nan))
    assert np.flatnonzero(judged(untimed)).tolist() == [61]
    at_once = replace(untimed, received_s=np.full(len(given), 100.0))
    assert np.flatnonzero(judged(at_once)).tolist() == [61], "many records read at one moment"


@pytest.mark.parametrize("seed", range(20))
def test_pieces_do_not_matter(seed: int) -> None:
    """Batches and single readings, near the limits and beyond."""
    rng = np.random.default_rng(seed)
    given = readings(60, seed=seed)
    far = rng.random(len(given)) < 0.2
    place_m = given.position_m + far[:, None] * rng.normal(0.0, 2.0, (len(given), 3))
    measured_s = np.where(rng.random(len(given)) < 0.1, np.nan, given.measured_s)
    quality = np.where(rng.random(len(given)) < 0.1, 0.0, 1.0)
    given = replace(given, position_m=place_m, measured_s=measured_s, quality=quality)
    whole = judged(given)
    assert 0 < whole.sum() < len(given)
    for _ in range(5):
        cuts = sorted(rng.integers(0, len(given), int(rng.integers(1, 40))).tolist())
        np.testing.assert_array_equal(judged(given, cuts), whole)
    np.testing.assert_array_equal(judged(given, list(range(1, len(given)))), whole)


def test_orientation_alone_or_place_alone_is_judged_too() -> None:
    given = moved(readings(), [61], np.array([4.0, 0.0, 0.0]))
    no_turn = replace(given, tracker_from_station=np.full((len(given), 4), np.nan))
    assert np.flatnonzero(judged(no_turn)).tolist() == [61]
    assert not judged(replace(given, position_m=np.full((len(given), 3), np.nan))).any()


def test_readings_join_as_they_were() -> None:
    given = readings()
    np.testing.assert_array_equal(concatenate_readings([given[:7], given[7:]]).position_m, given.position_m)


@pytest.mark.parametrize(("behaviour", "rate_hz"), [("boxing", 120.0), ("jumping", 40.0)])
def test_no_sound_reading_of_a_simulation_is_marked(behaviour: str, rate_hz: float) -> None:
    """At any level and under any disturbance, and for the 16-bit list too."""
    body, take = retargeting.retarget_to_own_body(
        synthetic.generate(behaviour, synthetic.performer_names()[0], 1, seed=1)
    )
    worn = [mounts.DEFAULT_MOUNTS[station] for station in STATIONS]
    setups: list[tuple[str, Kind]] = [("clean", "none"), ("noise", "none"), *(("default", kind) for kind in KINDS)]
    for level, kind in setups:
        for items in ((40, 2, 11, 21, 1), (40, 18, 19, 21, 1)) if kind == "none" else ((40, 2, 11, 21, 1),):
            spoilt = Disturbance(kind=kind).add_to(noise.noise_preset(level), STATIONS)
            tracker = TrackerConfig(rate_hz=rate_hz, baud=921600, items=items)
            seen = simulate_tracker(body, take, worn, tracker, spoilt, seed=3)
            assert not any(frame.suspect.any() for frame in seen.frames), (level, kind, items)


def test_a_damaged_place_is_suspect_in_its_frame_alone() -> None:
    """Through the whole reader: the sign and the exponent of a float are caught where they throw the station far."""
    number = np.tile(np.arange(4), 20)
    time_s = np.repeat(np.arange(20), 4) / RATE_HZ + 0.003 * number
    place_m = np.tile([2.0, 0.1, -1.5], (80, 1)) + 0.1 * number[:, None]
    said = RecordValues(time_s, place_m, np.tile([1.0, 0.0, 0.0, 0.0], (80, 1)), np.ones(80))
    wire = WireFormat(tuple("abcd"), RATE_HZ)
    table = encode_records(wire.items, np.frombuffer(STATION_CHARACTERS, np.uint8)[number], said, wire.settings)
    table["position"][42] *= [-1.0, 1.0, 1.0]
    reader = FrameReader(wire)
    capture = ByteCapture(table.tobytes(), 38 * np.arange(1, 81), 100.0 + time_s)
    frames = [*reader.feed_all(capture), *reader.finish()]
    assert [(k, s) for k, frame in enumerate(frames) for s in np.flatnonzero(frame.suspect).tolist()] == [(10, 2)]
