"""The parameters of every component, estimated from its effect on stations at rest.

Each bound is that of a correct component going wrong by chance once in a million seeds (`ODDS`); draws are fixed by
the seed, so a test that passes once passes always, and a component that is off by a few per cent does not pass.
"""

import dataclasses
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy import stats

from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.core.seeds import generator
from harness.errors import BadInput, UnknownName
from harness.simulate.components.faults import LostStation, OrientationOffset, PositionOffset
from harness.simulate.components.mount import MountOffset, MountSlip
from harness.simulate.components.stationary import Clock, DriftNoise, SessionBias, SpeedError, WhiteNoise
from harness.simulate.components.transient import Dropout, Echo, Excursion
from harness.simulate.noise import Noise, noise_preset
from harness.simulate.readings import SimulatedReadings
from tests.simulate.conftest import Still

ODDS = 1e-6
Z = float(stats.norm.isf(ODDS / 2))
"""A normal deviate is farther out once in a million."""


def errors(true: SimulatedReadings, seen: SimulatedReadings) -> tuple[Floats, Floats]:
    """Position error (N, S, 3) and the small rotation (N, S, 3) about the tracker's axes."""
    return shifted(true, seen), rotations.log(rotations.multiply(seen.turn, rotations.inverse(true.turn)))


def shifted(true: SimulatedReadings, seen: SimulatedReadings) -> Floats:
    """Position error (N, S, 3) alone; rotations of hours of readings take long."""
    return seen.position_m - true.position_m


def assert_sd(samples: Floats, sd: float) -> None:
    """Independent zero-mean normal samples have this standard deviation, by the chi-square law."""
    flat = np.ravel(samples)
    low, high = stats.chi2.interval(1.0 - ODDS, flat.size)
    assert low < np.sum((flat / sd) ** 2) < high, f"{np.sqrt(np.mean(flat**2))} for {sd}"


def assert_uniform(samples: Floats, low: float, high: float) -> None:
    """The samples pass a Kolmogorov-Smirnov test of uniformity."""
    assert stats.kstest(samples, stats.uniform(low, high - low).cdf).pvalue > ODDS


def renewal_share(busy: Bools, mean: float, variance: float, free: float, free_variance: float) -> tuple[float, float]:
    """The observed share, and its standard deviation by renewal theory (means and variances in rows)."""
    spread = (free**2 * variance + mean**2 * free_variance) / (mean + free) ** 3
    return float(busy.mean()), float(np.sqrt(spread / busy.size))


def runs(busy: Bools) -> list[tuple[int, int, int]]:
    """Station, first row and end row of every complete run of True in (N, S)."""
    out = []
    for s, column in enumerate(busy.T):
        edges = np.diff(column.astype(int))
        starts, stops = np.flatnonzero(edges == 1) + 1, np.flatnonzero(edges == -1) + 1
        stops = stops[stops > (starts[0] if len(starts) else 0)]
        out += [(s, int(a), int(b)) for a, b in zip(starts, stops, strict=False)]
    return out


def test_white(still: Still) -> None:
    true, seen = still(300.0), still(300.0)
    WhiteNoise(position_m=0.00075, orientation_rad=0.001).apply(seen)
    shift, turn = errors(true, seen)
    for axis in range(3):
        assert_sd(shift[..., axis], 0.00075)
        assert_sd(turn[..., axis], 0.001)
    together = np.concatenate([shift / 0.00075, turn / 0.001], axis=2)
    assert np.abs(np.mean(together[1:] * together[:-1], axis=(0, 1))).max() < Z / np.sqrt(together[1:, :, 0].size)
    across = np.corrcoef(together.reshape(len(together), -1), rowvar=False) - np.eye(24)
    assert np.abs(across).max() < stats.norm.isf(ODDS / 2 / across.size) / np.sqrt(len(together))


@pytest.mark.parametrize("correlation_s", [0.2, 1.0, 2.0])
def test_slow(still: Still, correlation_s: float) -> None:
    """Innovations are white with the right variance, and the lag-1 correlation is exp(-dt/tau)."""
    true, seen = still(600.0), still(600.0)
    slow = DriftNoise(position_m=0.0015, pitch_roll_rad=0.004, yaw_rad=0.008, correlation_s=correlation_s)
    slow.apply(seen)
    shift, turn = errors(true, seen)
    a = np.exp(-1.0 / (40.0 * correlation_s))
    unit = np.concatenate([shift / 0.0015, turn / [0.004, 0.004, 0.008]], axis=2)
    new = (unit[1:] - a * unit[:-1]) / np.sqrt(1.0 - a * a)
    for axis in range(6):
        assert_sd(new[..., axis], 1.0)
    found = float(np.sum(unit[1:] * unit[:-1]) / np.sum(unit[:-1] ** 2))
    assert abs(found - a) < Z * np.sqrt((1.0 - a * a) / unit[1:].size)


def test_slow_is_stationary_from_the_start(still: Still) -> None:
    first = []
    for seed in range(60):
        true, seen = still(0.1, seed=seed), still(0.1, seed=seed)
        DriftNoise().apply(seen)
        first.append(shifted(true, seen)[0])
    assert_sd(np.array(first), DriftNoise().position_m)


def test_session(still: Still) -> None:
    scales, offsets = [], []
    for seed in range(300):
        true, seen = still(0.1, seed=seed), still(0.1, seed=seed)
        SessionBias(scale=0.002, station_offset_m=0.0).apply(seen)
        ratio = seen.position_m / true.position_m - 1.0
        assert np.ptp(ratio) < 1e-12, "one scale for all stations and moments"
        scales.append(ratio[0, 0, 0])
        seen = still(0.1, seed=seed)
        SessionBias(scale=0.0, station_offset_m=0.001).apply(seen)
        moved = rotations.rotate(rotations.inverse(true.turn), shifted(true, seen))
        assert np.ptp(moved, axis=0).max() < 1e-12
        offsets.append(moved[0])
    assert_sd(np.array(scales), 0.002)
    assert_sd(np.array(offsets), 0.001)


def test_excursion(still: Still) -> None:
    """Onsets by Poisson's law; a busy period begins at rate r exp(-r d) for excursions of mean length d."""
    hours, stations, ramp_s = 0.5, 8, 0.2
    true, seen = still(3600.0 * hours, stations), still(3600.0 * hours, stations)
    Excursion(onsets_per_min=2.0, size_m=(0.005, 0.03), stay_s=(1.0, 5.0), ramp_s=ramp_s).apply(seen)
    shift, turn = errors(true, seen)
    size = np.linalg.norm(shift, axis=2)
    np.testing.assert_array_equal(size > 0.0, seen.affected["excursion"])
    assert np.abs(turn).max() < 1e-12
    found = runs(size > 0.0)
    expected = hours * stations * 120.0 * np.exp(-2.0 * 3.2 / 60.0)
    low, high = stats.poisson.interval(1.0 - ODDS, expected)
    assert low <= len(found) <= high
    sizes, stays, ways = [], [], []
    for s, a, b in found:
        way = shift[a:b, s] / size[a:b, s, None]
        if np.abs(way - way[0]).max() < 1e-6:  # one excursion by itself
            sizes.append(size[a:b, s].max())
            stays.append((b - a) / 40.0 - ramp_s)
            ways.append(way[0])
            assert np.abs(np.diff(size[a:b, s])).max() <= sizes[-1] / (40.0 * ramp_s) + 1e-9
    assert len(sizes) > 0.8 * expected
    assert_uniform(np.array(sizes), 0.005, 0.03)
    assert 1.0 - 0.03 < min(stays) < 1.3
    assert 4.7 < max(stays) < 5.0 + 0.03
    # Long ones meet another more often: the mean of those left alone is weighted by exp(-r length).
    u = np.linspace(1.0, 5.0, 1001)
    alone = np.exp(-2.0 * u / 60.0)
    assert abs(np.mean(stays) - np.sum(u * alone) / alone.sum()) < Z * np.sqrt(16.0 / 12.0 / len(stays)) + 0.02
    assert np.abs(np.mean(ways, axis=0)).max() < Z / np.sqrt(3.0 * len(ways))


def test_excursions_that_meet_stay_below_the_largest_size(still: Still) -> None:
    true, seen = still(600.0), still(600.0)
    Excursion(onsets_per_min=60.0).apply(seen)
    size_m = np.linalg.norm(shifted(true, seen), axis=2)
    assert 0.0299 < size_m.max() <= 0.03 + 1e-12


def test_excursions_may_be_under_way_when_the_take_begins(still: Still) -> None:
    begun = []
    for seed in range(100):
        seen = still(0.1, 8, seed=seed)
        Excursion(onsets_per_min=4.0).apply(seen)
        begun.append(seen.affected["excursion"][0])
    share = 1.0 - np.exp(-4.0 / 60.0 * 3.2)
    low, high = stats.binom.interval(1.0 - ODDS, 800, share)
    assert low <= np.sum(begun) <= high


@pytest.mark.parametrize("share", [0.03, 0.2])
def test_echo(still: Still, share: float) -> None:
    true, seen = still(1500.0), still(1500.0)
    Echo(share=share, burst_records=(1, 8), size_m=(0.05, 0.30)).apply(seen)
    shift, turn = errors(true, seen)
    size = np.linalg.norm(shift, axis=2)
    np.testing.assert_array_equal(size > 0.0, seen.affected["echo"])
    assert np.abs(turn).max() < 1e-12
    clean = 4.5 * (1.0 - share) / share
    found, sd = renewal_share(size > 0.0, 4.5, 63.0 / 12.0, clean, clean * (1.0 + clean))
    assert abs(found - share) < Z * sd
    lengths, sizes, ways = [], [], []
    for s, a, b in runs(size > 0.0):
        cuts = [a, *(a + 1 + np.flatnonzero(np.abs(np.diff(shift[a:b, s], axis=0)).max(axis=1) > 1e-9)), b]
        for start, stop in pairwise(cuts):  # bursts may touch: each has an offset of its own
            lengths.append(stop - start)
            sizes.append(size[start, s])
            ways.append(shift[start, s] / size[start, s])
    counts = np.bincount(lengths, minlength=9)
    assert len(counts) == 9
    assert counts[0] == 0
    assert stats.chisquare(counts[1:]).pvalue > ODDS
    assert_uniform(np.array(sizes), 0.05, 0.30)
    assert np.abs(np.mean(ways, axis=0)).max() < Z / np.sqrt(3.0 * len(ways))


def test_echoes_have_their_share_from_the_first_reading_on(still: Still) -> None:
    first = []
    for seed in range(150):
        seen = still(0.1, 8, seed=seed)
        Echo(share=0.1).apply(seen)
        first.append(seen.affected["echo"][0])
    low, high = stats.binom.interval(1.0 - ODDS, 1200, 0.1)
    assert low <= np.sum(first) <= high


def test_dropout(still: Still) -> None:
    share, rate_hz = 0.02, 40.0
    true, seen = still(3600.0), still(3600.0)
    Dropout(share=share, gap_s=(0.1, 0.5), coast_s=0.5, tilt_rad=0.004).apply(seen)
    lost = seen.quality == 0.0
    np.testing.assert_array_equal(lost, seen.affected["lost"])
    free = rate_hz * 0.3 * (1.0 - share) / share
    found, sd = renewal_share(lost, rate_hz * 0.3, (rate_hz * 0.4) ** 2 / 12.0, free, free**2)
    assert abs(found - share) < Z * sd
    gaps = runs(lost)
    lengths_s = np.array([(b - a) / rate_hz for _, a, b in gaps])
    assert 0.1 - 1.0 / rate_hz <= lengths_s.min()
    assert np.quantile(lengths_s, 0.98) <= 0.5 + 1.0 / rate_hz, "one gap in 600 touches the next"
    assert abs(lengths_s.mean() - 0.3) < Z * np.sqrt((0.4**2 + 1.0 / rate_hz**2) / 12.0 / len(lengths_s)) + 0.01
    shift = shifted(true, seen)
    coasts = 0
    for s, a, _ in gaps:
        before = slice(a - 20, a)
        if not lost[a - 40 : a, s].any() and a > 60:
            size = np.linalg.norm(shift[before, s], axis=1)
            assert np.all(np.diff(size) > 0.0)
            assert np.all(np.diff(seen.quality[before, s]) <= 0.0)
            assert np.abs(shift[before, s, 2]).max() == 0.0, "gravity leaks sideways"
            since_s = np.sqrt(size / (0.5 * 9.81 * np.sin(0.004)))
            np.testing.assert_allclose(np.diff(since_s), 1.0 / rate_hz, atol=1e-9)
            assert since_s[-1] <= 0.5
            coasts += 1
    assert coasts > 0.8 * len(gaps)
    known = ~lost & ~seen.affected["coast"]
    assert np.abs(shift[known]).max() == 0.0
    assert seen.quality[known].min() == 1.0
    frozen = lost[1:] & lost[:-1]
    assert np.abs(np.diff(seen.position_m, axis=0)[frozen]).max() == 0.0, "a lost station says what it said last"


@pytest.mark.parametrize(
    ("tilt_deg", "coast_s", "error_cm"),
    [(0.1, 0.5, 0.2), (0.1, 5.0, 21.0), (0.25, 1.0, 2.1), (0.25, 2.0, 8.6), (0.5, 0.5, 1.1), (0.5, 2.0, 17.0)],
)
def test_coasting_grows_as_the_protocol_says(still: Still, tilt_deg: float, coast_s: float, error_cm: float) -> None:
    """The table of docs/is900.md 13.4, to the digits it has."""
    true, seen = still(400.0, 2), still(400.0, 2)
    Dropout(share=0.005, coast_s=coast_s, tilt_rad=np.deg2rad(tilt_deg)).apply(seen)
    alone = ~seen.affected["lost"]
    worst_cm = 100.0 * np.linalg.norm(shifted(true, seen), axis=2)[alone].max()
    law_cm = 100.0 * 0.5 * 9.81 * np.sin(np.deg2rad(tilt_deg)) * coast_s**2
    assert law_cm == pytest.approx(error_cm, abs=0.5 if error_cm > 10.0 else 0.05)
    assert law_cm * (1.0 - 0.026 / coast_s) ** 2 < worst_cm <= law_cm, "the last reading is up to 25 ms before the gap"


def test_a_lost_station_repeats_its_last_reading(still: Still) -> None:
    seen = still(10.0)
    WhiteNoise().apply(seen)
    before = seen.position_m.copy()
    LostStation("s2", from_s=2.0, to_s=5.0).apply(seen)
    lost = (seen.time_s[:, 2] >= 2.0) & (seen.time_s[:, 2] < 5.0)
    np.testing.assert_array_equal(seen.quality[:, 2] == 0.0, lost)
    assert seen.quality[:, [0, 1, 3]].min() == 1.0
    last = int(np.flatnonzero(lost)[0]) - 1
    assert np.abs(seen.position_m[lost, 2] - before[last, 2]).max() == 0.0
    np.testing.assert_array_equal(seen.position_m[~lost], before[~lost])
    with pytest.raises(UnknownName, match="'s9'"):
        LostStation("s9").apply(seen)


def test_quality_falls_before_a_station_is_lost(still: Still) -> None:
    seen = still(10.0)
    LostStation("s2", from_s=4.0, fade_s=2.0).apply(seen)
    time_s, quality = seen.time_s[:, 2], seen.quality[:, 2]
    assert (quality[time_s <= 2.0] == 1.0).all()
    falling = (time_s > 2.0) & (time_s < 3.9)
    np.testing.assert_allclose(quality[falling], (4.0 - time_s[falling]) / 2.0)
    assert (quality[(time_s > 3.9) & (time_s < 4.0)] > 0.0).all()
    assert (quality[time_s >= 4.0] == 0.0).all()


def test_displaced_stations_are_off_for_a_while_and_by_so_much(still: Still) -> None:
    true, seen = still(6.0), still(6.0)
    PositionOffset(("s1", "s3"), from_s=2.0, to_s=4.0, offset_m=(0.0, -0.3, 0.1)).apply(seen)
    off = (true.time_s >= 2.0) & (true.time_s < 4.0) & np.array([False, True, False, True])
    moved_m, turned_rad = errors(true, seen)
    np.testing.assert_allclose(moved_m[off], np.tile([0.0, -0.3, 0.1], (off.sum(), 1)), atol=1e-12)
    assert np.abs(moved_m[~off]).max() == np.abs(turned_rad).max() == 0.0
    assert (seen.quality == 1.0).all()  # it does not know
    np.testing.assert_array_equal(seen.affected["position_offset"], off)
    with pytest.raises(UnknownName, match="'s9'"):
        PositionOffset(("s9",)).apply(seen)
    with pytest.raises(BadInput, match="to_s"):
        PositionOffset((), from_s=2.0, to_s=1.0)


def test_turned_stations_face_elsewhere_for_a_while_and_stay_in_place(still: Still) -> None:
    true, seen = still(6.0), still(6.0)
    OrientationOffset((), from_s=1.0, to_s=3.0, angle_rad=0.5).apply(seen)
    off = (true.time_s >= 1.0) & (true.time_s < 3.0)
    moved_m, turned_rad = errors(true, seen)
    np.testing.assert_allclose(turned_rad[off], np.tile([0.0, 0.0, 0.5], (off.sum(), 1)), atol=1e-12)
    assert np.abs(turned_rad[~off]).max() < 1e-12
    assert np.abs(moved_m).max() == 0.0
    np.testing.assert_array_equal(seen.affected["orientation_offset"], off)
    with pytest.raises(UnknownName, match="'s9'"):
        OrientationOffset(("s9",)).apply(seen)


def test_speed(still: Still, rng: np.random.Generator) -> None:
    true, seen = still(1.0), still(1.0)
    seen.velocity_m_s = rng.normal(size=seen.velocity_m_s.shape)
    SpeedError(ahead_s=0.002).apply(seen)
    np.testing.assert_allclose(shifted(true, seen), 0.002 * seen.velocity_m_s, atol=1e-15)


def test_mount_offset(still: Still) -> None:
    moved, turned = [], []
    for seed in range(200):
        true, seen = still(0.1, seed=seed), still(0.1, seed=seed)
        MountOffset(position_m=0.004, orientation_rad=0.03).apply(seen)
        shift = rotations.rotate(rotations.inverse(true.turn), shifted(true, seen))
        turn = rotations.log(rotations.multiply(rotations.inverse(true.turn), seen.turn))
        assert max(np.ptp(shift, axis=0).max(), np.ptp(turn, axis=0).max()) < 1e-12
        moved.append(shift[0])
        turned.append(turn[0])
    assert_sd(np.array(moved), 0.004)
    assert_sd(np.array(turned), 0.03)


@pytest.mark.parametrize("over_s", [0.0, 2.0])
def test_mount_slip_takes_its_time_and_stays(still: Still, over_s: float) -> None:
    true, seen = still(10.0), still(10.0)
    MountSlip("s1", from_s=3.0, over_s=over_s, around_rad=0.4, along_m=-0.02).apply(seen)
    own = rotations.log(rotations.multiply(rotations.inverse(true.turn), seen.turn))
    time_s = seen.time_s[:, 1]
    share = np.where(time_s < 3.0, 0.0, np.minimum((time_s - 3.0) / over_s, 1.0) if over_s else 1.0)
    np.testing.assert_allclose(own[:, 1], 0.4 * share[:, None] * [1.0, 0.0, 0.0], atol=1e-9)
    shift = rotations.rotate(rotations.inverse(true.turn), shifted(true, seen))[:, 1]
    np.testing.assert_allclose(shift[:, 0], -0.02 * share, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(shift[:, 1:], axis=1), 2 * 0.05 * np.sin(0.2 * share), atol=1e-12)
    assert np.abs(np.delete(shifted(true, seen), 1, axis=1)).max() == 0.0


def test_clock(still: Still) -> None:
    seen = still(100.0)
    Clock(offset_s=7.0, drift_ppm=-35.0).apply(seen)
    fit = np.polynomial.polynomial.polyfit(seen.time_s.ravel(), seen.device_s.ravel(), 1)
    np.testing.assert_allclose(fit, [7.0, 1.0 - 35e-6], atol=1e-9)


def test_more_stations_leave_the_draws_of_the_others_alone(still: Still) -> None:
    few, many = still(60.0, 2), still(60.0, 5)
    many.position_m[:, :2], many.turn[:, :2] = few.position_m, few.turn
    for readings in (few, many):
        noise_preset("default").apply(readings)
    for name in ("position_m", "turn", "quality", "device_s"):
        np.testing.assert_array_equal(getattr(few, name), getattr(many, name)[:, :2])


@pytest.mark.parametrize("left_out", ["white", "drift", "session", "excursion", "echo", "dropout", "speed", "clock"])
def test_one_component_less_leaves_the_draws_of_the_others_alone(still: Still, left_out: str) -> None:
    """A component has the same effect alone and among all: contributions to the position add up."""

    def offset(noise: Noise) -> Floats:
        true, seen = still(30.0), still(30.0)
        noise.apply(seen)
        shift: Floats = seen.position_m - true.position_m
        shift[seen.quality == 0.0] = 0.0
        return shift

    whole = dataclasses.replace(noise_preset("default"), dropout=None, session=SessionBias(scale=0.0))
    nothing: dict[str, Any] = {left_out: None}
    rest = dataclasses.replace(whole, **nothing)
    alone = dataclasses.replace(Noise(), **{left_out: getattr(whole, left_out)})
    np.testing.assert_allclose(offset(rest) + offset(alone), offset(whole), atol=1e-12)


def test_noise_differs_by_seed_take_and_station(still: Still) -> None:
    one, other, next_take = still(1.0), still(1.0, seed=2), still(1.0)
    next_take.take = "another"
    for readings in (one, other, next_take):
        WhiteNoise().apply(readings)
    shifts = [s.position_m - still(1.0).position_m for s in (one, other, next_take)]
    assert len({float(x) for shift in shifts for x in shift[0].ravel()}) == 3 * 4 * 3


def test_levels_are_the_table_of_the_protocol() -> None:
    """docs/is900.md 13.5, number by number."""
    assert noise_preset("clean") == Noise()
    noise, default = noise_preset("noise"), noise_preset("default")
    assert {name for name, part in vars(noise).items() if part} == {"white", "drift", "session", "clock"}
    assert {name for name, part in vars(default).items() if part} == {
        *("white", "drift", "session", "clock"),
        *("excursion", "echo", "dropout", "speed"),
    }
    deg = np.pi / 180.0
    assert default.white == WhiteNoise(0.00075, 0.05 * deg)
    assert default.drift == DriftNoise(0.0015, 0.25 * deg, 0.5 * deg, 1.0)
    assert default.session == SessionBias(0.001, 0.001)
    assert default.excursion == Excursion(1.0, (0.005, 0.03), (1.0, 5.0), 0.2)
    assert default.echo == Echo(0.03, (1, 8), (0.05, 0.30))
    assert default.dropout is not None
    assert (default.dropout.share, default.dropout.gap_s) == (0.01, (0.1, 0.5))
    assert default.speed == SpeedError(0.002)
    assert default.clock is not None
    assert (default.clock.offset_s, default.clock.drift_ppm) == (0.0, 20.0)
    with pytest.raises(UnknownName, match="default"):
        noise_preset("defualt")


def test_a_session_offset_turns_with_its_station(still: Still) -> None:
    """The offset is fixed in the housing: a station that turns by 120 degrees carries it to other axes of the room."""
    true, seen = still(0.5), still(0.5)
    turned = np.array([0.5, 0.5, 0.5, 0.5])  # x to y, y to z, z to x
    for readings in (true, seen):
        readings.turn[10:] = rotations.multiply(turned, readings.turn[10:])
    SessionBias(scale=0.0, station_offset_m=0.001).apply(seen)
    shift_m = shifted(true, seen)
    np.testing.assert_allclose(shift_m[10:], np.roll(shift_m[:10], 1, axis=2), atol=1e-12)
    assert np.abs(shift_m[10:] - shift_m[:10]).max() > 1e-4


def test_draws_are_named_by_take_or_session_component_and_station(still: Still) -> None:
    """Other names would be other errors at the same seed."""
    alone = still(1.0, seed=4)
    shared = dataclasses.replace(alone, session="day")
    for readings, take, session in ((alone, "still", "still"), (shared, "still", "day")):
        draws = readings.take_rng("bias", "s1").random(), readings.session_rng("bias", "s1").random()
        assert draws == tuple(generator(4, "noise", name, "bias", "s1").random() for name in (take, session))
