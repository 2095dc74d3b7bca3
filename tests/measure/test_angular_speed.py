"""Offset between clocks by angular speed."""

from collections.abc import Mapping

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.measure.angular_speed import SpeedSeries, angular_speed, identify_stations, time_offset
from harness.measure.pose_series import MeasuredPoses, TruthPoses, TruthSpline

PERIOD_S = 0.025


def series(rng: np.random.Generator, count: int) -> Floats:
    out: Floats = np.convolve(rng.normal(size=count + 8), np.hanning(9), "valid")
    return out


def test_angular_speed_of_steady_rotation_at_uneven_times(rng: np.random.Generator) -> None:
    """Steps from 10 to 60 ms, and one gap, around which nothing is known for the span of a speed."""
    time_s = 5.0 + np.cumsum(rng.uniform(0.01, 0.06, 300))
    time_s[150:] += 1.0
    turn = rotations.exp(np.array([0.0, 0.0, 3.0]) * time_s[:, None]) * rng.choice([-1.0, 1.0], 300)[:, None]
    found = angular_speed(TruthSpline(TruthPoses(time_s, np.zeros((300, 3)), turn)), PERIOD_S, 0.1)
    assert found.begin_s == pytest.approx(time_s[0] + 0.05)
    known = np.isfinite(found.rad_s)
    np.testing.assert_allclose(found.rad_s[known], 3.0, rtol=1e-3)
    unknown_s = found.begin_s + PERIOD_S * np.flatnonzero(~known)
    assert unknown_s.min() == pytest.approx(time_s[149] - 0.05, abs=PERIOD_S)
    assert unknown_s.max() == pytest.approx(time_s[150] + 0.05, abs=PERIOD_S)
    unstamped = MeasuredPoses(np.full(3, np.nan), np.zeros((3, 3)), turn[:3], np.ones(3, bool))
    with pytest.raises(BadInput, match="No pose has a time"):
        unstamped.orientations()


def test_speeds_over_a_span_find_the_offset_of_a_noisy_camera(rng: np.random.Generator) -> None:
    """Noise of 1 deg on 100 poses a second hides the speed from one pose to the next, not that over a span."""
    time_s = np.arange(3000) / 100.0
    turn = rotations.multiply(turning("a", time_s), rotations.exp(np.deg2rad(1.0) * rng.normal(size=(3000, 3))))
    noisy, exact = (
        TruthSpline(TruthPoses(time_s + s, np.zeros((3000, 3)), q))
        for s, q in ((2.0, turn), (0.0, turning("a", time_s)))
    )
    single, over = (
        time_offset([angular_speed(noisy, 0.01, span_s)], [angular_speed(exact, 0.01, span_s)])
        for span_s in (0.01, 0.2)
    )
    assert single.correlation < 0.5 < 0.9 < over.correlation
    assert over.offset_s == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize("shift", [-700, -3, 0, 12, 900])
def test_offset_of_shifted_series_with_gaps(shift: int, rng: np.random.Generator) -> None:
    signal = series(rng, 4000)
    first, second = signal[1000:3000].copy(), signal[1000 - shift : 3000 - shift] if shift else signal[1000:3000]
    first[100:130] = np.nan
    a, b = SpeedSeries(50.0, PERIOD_S, first), SpeedSeries(20.0, PERIOD_S, second)
    found = time_offset([a], [b])
    assert found.offset_s == pytest.approx(30.0 - shift * PERIOD_S, abs=0.1 * PERIOD_S)
    assert found.correlation > 0.999
    assert found.overlap_s == pytest.approx((2000 - abs(shift) - 30) * PERIOD_S, abs=31 * PERIOD_S)


def test_offset_of_a_fraction_of_a_step(rng: np.random.Generator) -> None:
    time_s = np.arange(2000.0) * PERIOD_S
    hz, phase = rng.uniform(0.2, 2.0, 12), rng.uniform(0.0, 6.28, 12)

    def speed(t: Floats) -> Floats:
        out: Floats = np.sin(6.283 * hz[:, None] * t + phase[:, None]).sum(axis=0)
        return out

    first = SpeedSeries(0.0, PERIOD_S, speed(time_s - 0.3 * PERIOD_S))
    found = time_offset([first], [SpeedSeries(0.0, PERIOD_S, speed(time_s))])
    assert found.offset_s == pytest.approx(0.3 * PERIOD_S, abs=0.02 * PERIOD_S)


def test_all_pairs_share_one_offset(rng: np.random.Generator) -> None:
    """Each pair alone is too noisy; series begin at different times."""
    first, second = [], []
    for begin in (0, 40, 100):
        signal = series(rng, 3000)
        noisy = signal[begin:2000] + 2.0 * rng.normal(size=2000 - begin) * signal.std()
        first.append(SpeedSeries(7.0 + begin * PERIOD_S, PERIOD_S, noisy))
        second.append(SpeedSeries(1.0, PERIOD_S, signal[:2000]))
    assert time_offset(first, second).offset_s == pytest.approx(6.0, abs=0.5 * PERIOD_S)


def test_little_overlap_is_refused(rng: np.random.Generator) -> None:
    short = SpeedSeries(0.0, PERIOD_S, series(rng, 100))
    with pytest.raises(BadInput, match=r"overlap by at most 2\.5 s"):
        time_offset([short], [SpeedSeries(0.0, PERIOD_S, series(rng, 4000))])
    with pytest.raises(BadInput, match="different periods"):
        time_offset([short], [SpeedSeries(0.0, 0.02, series(rng, 4000))])


NAMES = ("a", "b", "c")


def turning(name: str, time_s: Floats) -> Floats:
    """Orientations (N, 4) of a body that turns at its own frequencies."""
    rates = np.array([1.3, 0.9, 2.1]) * {"a": 1.0, "b": 1.7, "c": 0.6, "d": 2.3}[name]
    return rotations.exp(0.8 * np.sin(time_s[:, None] * rates))


def bodies(names: tuple[str, ...] = NAMES) -> dict[str, TruthPoses]:
    time_s = np.arange(4000) / 100.0
    return {name: TruthPoses(time_s, np.zeros((4000, 3)), turning(name, time_s)) for name in names}


def stations(carried: Mapping[str, str], rng: np.random.Generator, noise_rad: float = 1e-3) -> dict[str, MeasuredPoses]:
    """Stations that are worn on these bodies at any angle, in a room that is turned, and a clock that is 1.5 s late."""
    time_s, out = np.arange(1600) / 40.0, {}
    for station, body in carried.items():
        mount, room = (rotations.exp(rng.normal(size=3)) for _ in range(2))
        turn = rotations.multiply(room, rotations.multiply(turning(body, time_s), mount))
        noisy = rotations.multiply(turn, rotations.exp(noise_rad * rng.normal(size=(1600, 3))))
        valid = rng.random(1600) > 0.02
        place = np.zeros((1600, 3))
        out[station] = MeasuredPoses(time_s + 1.5, place, np.where(valid[:, None], noisy, np.nan), valid)
    return out


@pytest.mark.parametrize("carried", ["abc", "bac", "bca", "cba"])
def test_the_bodies_are_those_that_turn_as_the_stations_do(carried: str, rng: np.random.Generator) -> None:
    worn = dict(zip(NAMES, carried, strict=True))
    assert identify_stations(stations(worn, rng), bodies(), dict(zip(NAMES, NAMES, strict=True))) == worn


def test_bodies_without_a_station_are_not_considered(rng: np.random.Generator) -> None:
    """Station c is on d, of which nobody said that it carries a station: it stays where it is said to be."""
    stated = dict(zip(NAMES, NAMES, strict=True))
    found = identify_stations(stations(stated | {"c": "d"}, rng), bodies(("a", "b", "c", "d")), stated)
    assert found == stated


def test_two_stations_on_one_body_are_left_alone(rng: np.random.Generator) -> None:
    stated = {"a": "a", "b": "a"}
    assert identify_stations(stations(stated, rng), bodies(), stated) == stated


def test_one_station_is_where_it_is_said_to_be(rng: np.random.Generator) -> None:
    assert identify_stations(stations({"a": "b"}, rng), bodies(), {"a": "a"}) == {"a": "a"}


def test_noise_exchanges_nothing(rng: np.random.Generator) -> None:
    """Two bodies that turn alike cannot be told apart, and are left as stated."""
    alike = bodies()
    alike["b"] = alike["a"]
    stated = dict(zip(NAMES, NAMES, strict=True))
    for _ in range(5):
        assert identify_stations(stations(stated | {"b": "a"}, rng, noise_rad=0.02), alike, stated) == stated


def test_of_offsets_of_a_motion_that_repeats_the_longest_overlap_is_taken(rng: np.random.Generator) -> None:
    """Two cycles later readings without noise fit a little better; that is the rival."""
    cycle = series(rng, 1500)
    reference, measured = np.tile(cycle, 3), np.tile(cycle, 3)[100:4000]
    measured[:2400] += 0.1 * cycle.std() * rng.normal(size=2400)
    found = time_offset([SpeedSeries(0.0, PERIOD_S, measured)], [SpeedSeries(0.0, PERIOD_S, reference)])
    assert found.offset_s == pytest.approx(-100 * PERIOD_S, abs=PERIOD_S)
    assert found.overlap_s == pytest.approx(3900 * PERIOD_S, abs=30 * PERIOD_S)
    assert found.rival_s == pytest.approx((3000 - 100) * PERIOD_S, abs=PERIOD_S)


def test_a_motion_that_does_not_repeat_has_no_rival(rng: np.random.Generator) -> None:
    signal = series(rng, 4000)
    found = time_offset([SpeedSeries(0.0, PERIOD_S, signal[100:])], [SpeedSeries(0.0, PERIOD_S, signal)])
    assert found.rival_s is None
