"""The filter in use: it starts from a fix, is lost and found again, and never claims what it does not know."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.errors import ShapeError
from harness.simulate.physics.constellation import Constellation
from harness.simulate.physics.filter_settings import Fusion
from harness.simulate.physics.filter_state import Outputs
from harness.simulate.physics.fusion import FusionFilter
from harness.simulate.physics.inertial import Inertial
from harness.simulate.physics.schedule import NEAR_EMITTERS, Schedule
from harness.simulate.physics.sound import Sound
from tests.simulate.physics.free_station import (
    EMITTER_M,
    EXACT,
    RANGE_NOISE_M,
    TICK_HZ,
    FreeStation,
    exact_inertial,
    free_station,
    new_filter,
    noisy,
    records_every,
    run,
    start,
)
from tests.simulate.physics.rooms import emitters_in_turn

SLOTS_PER_S = 80


def errors_m(outputs: Outputs, station: FreeStation, s: int = 0) -> Floats:
    """(E,) error of the position in mode 0."""
    truth = station.position_m[outputs.tick[:, s]]
    return np.asarray(np.linalg.norm(outputs.position_m[:, s, 0] - truth, axis=1))


def errors_deg(outputs: Outputs, station: FreeStation) -> Floats:
    """(E,) error of the orientation in mode 0."""
    truth = station.tracker_from_station[outputs.tick[:, 0]]
    return np.degrees(rotations.angle_between_rad(outputs.tracker_from_station[:, 0, 0], truth))


def quality(outputs: Outputs) -> Floats:
    """(E,) of the first station."""
    return np.asarray(outputs.report[:, 0, 0])


def silent(station: FreeStation, begin_s: float, end_s: float) -> FreeStation:
    """The station without ranges for some time."""
    heard = station.range_m.copy()
    heard[round(begin_s * SLOTS_PER_S) : round(end_s * SLOTS_PER_S)] = np.nan
    return replace(station, range_m=heard)


def longest_run(flags: Bools) -> int:
    """Largest number of true values in a row."""
    longest = current = 0
    for flag in flags:
        current = current + 1 if flag else 0
        longest = max(longest, current)
    return longest


def test_noise_free_measurements_give_the_motion() -> None:
    station = free_station(10.0, 3)
    fusion_filter = new_filter(inertial=exact_inertial())
    start(fusion_filter, station, np.zeros(15))
    outputs = run(fusion_filter, station)
    assert errors_m(outputs, station).max() < 0.002
    assert errors_deg(outputs, station).max() < 0.01
    # Finite differences of the path, at the ticks.
    tick = outputs.tick[1:, 0]
    np.testing.assert_allclose(outputs.velocity_m_s[1:, 0], station.velocity_m_s[tick], atol=0.02)


def test_misplaced_microphones_turn_their_own_station() -> None:
    """The device of the second station believes its microphones 2 deg about z from where they are."""
    station = free_station(8.0, 3, speed=0.0)
    fusion_filter = new_filter(2, inertial=exact_inertial())
    turn = rotations.about_z(np.deg2rad(2.0))
    arm_m = fusion_filter.model.ranging.arm_m
    arm_m[1] = rotations.rotate(turn, arm_m[1])
    outputs = run(fusion_filter, station, station)
    for s, off in ((0, rotations.IDENTITY), (1, rotations.inverse(turn))):
        expected = rotations.multiply(station.tracker_from_station[-1], off)
        turned = rotations.angle_between_rad(outputs.tracker_from_station[-1, s, 0], expected)
        assert np.degrees(turned) < 0.3


@pytest.mark.parametrize("speed", [0.0, 1.0, 3.0])
@pytest.mark.parametrize("seed", range(4))
def test_starts_from_a_fix_within_two_seconds(seed: int, speed: float) -> None:
    station = free_station(4.0, seed, speed=speed)
    measured, _ = noisy(station, seed, Inertial())
    outputs = run(new_filter(fusion=Fusion()), measured)
    known = quality(outputs) > 0.0
    assert not known[0]
    assert known[outputs.tick[:, 0] > 2.0 * TICK_HZ].all()
    assert errors_m(outputs, station)[known].max() < 0.05
    assert errors_deg(outputs, station)[-1] < 3.0


def test_records_between_ticks_follow_the_motion() -> None:
    station = free_station(3.0, 2, speed=2.0)
    fusion_filter = new_filter(inertial=exact_inertial())
    start(fusion_filter, station, np.zeros(15))
    outputs = records_every(7, len(station.range_m), fraction=0.5)
    fusion_filter.filter_block(
        0,
        emitters_in_turn(0, len(station.range_m)),
        station.angle_rad[:, None],
        station.gain_m_s[:, None],
        station.range_m[:, None],
        outputs,
    )
    k = outputs.tick[1:, 0]
    between = 0.5 * (station.position_m[k] + station.position_m[k + 1])
    assert np.abs(outputs.position_m[1:, 0, 0] - between).max() < 2e-4
    turn = rotations.multiply(station.tracker_from_station[k + 1], rotations.inverse(station.tracker_from_station[k]))
    np.testing.assert_allclose(outputs.turn_rad_s[1:, 0], rotations.log(turn) * TICK_HZ, atol=0.1)


def test_the_gate_keeps_outliers_out() -> None:
    station = free_station(10.0, 1)
    measured, _ = noisy(station, 1, Inertial())
    heard = measured.range_m.copy()
    heard[np.random.default_rng(0).random(heard.shape) < 0.1] += 0.3
    largest = {}
    for gate in (4.0, 100.0):
        fusion_filter = new_filter(fusion=Fusion(gate=gate), inertial=exact_inertial())
        start(fusion_filter, station, np.zeros(15))
        outputs = run(fusion_filter, replace(measured, range_m=heard))
        largest[gate] = errors_m(outputs, station).max()
        assert (outputs.report[:, 0, 3].max() > 0) == (gate == 4.0)
    assert largest[4.0] < 0.02
    assert largest[100.0] > 0.04


@pytest.mark.parametrize("seed", range(5))
def test_is_lost_without_ranges_and_found_again(seed: int) -> None:
    station = free_station(12.0, seed)
    measured, _ = noisy(silent(station, 5.0, 8.0), seed, Inertial())
    outputs = run(new_filter(fusion=Fusion()), measured)
    known, second = quality(outputs) > 0.0, outputs.tick[:, 0] / TICK_HZ
    assert known[(second > 3.0) & (second < 5.0)].all()
    assert not known[(second > 6.6) & (second < 8.0)].any()
    assert known[second > 9.5].all()
    assert errors_m(outputs, station)[known].max() < 0.1
    assert np.isfinite(outputs.position_m).all()


def test_a_lost_station_coasts_and_then_stays() -> None:
    station = free_station(90.0, 4)
    measured, _ = noisy(silent(station, 5.0, 90.0), 4, Inertial())
    outputs = run(new_filter(fusion=Fusion()), measured)
    late = outputs.tick[:, 0] > 60.0 * TICK_HZ
    assert not quality(outputs)[late].any()
    assert np.abs(outputs.position_m[:, 0]).max() < 10.0
    assert np.ptp(outputs.position_m[late, 0, 0], axis=0).max() < 0.05  # the origin still turns about the unit
    assert errors_deg(outputs, station)[-1] < 20.0
    assert np.isfinite(outputs.tracker_from_station).all()


@pytest.mark.parametrize(("later_m", "lost"), [(-0.4, True), (0.4, False)])
def test_early_ranges_refute_a_fix_and_late_ones_do_not(later_m: float, lost: bool) -> None:
    station = free_station(8.0, 2)
    measured, _ = noisy(station, 2, Inertial())
    heard = measured.range_m.copy()
    heard[4 * SLOTS_PER_S :, :] += np.where(np.arange(4 * SLOTS_PER_S) % 9 < 6, later_m, 0.0)[:, None]
    outputs = run(new_filter(fusion=Fusion()), replace(measured, range_m=heard))
    second = outputs.tick[:, 0] / TICK_HZ
    assert (quality(outputs)[(second > 2.0) & (second < 4.0)] > 0.0).all()
    known = quality(outputs)[(second > 5.0) & (second < 6.0)] > 0.0
    assert not known.any() if lost else known.all()
    assert errors_m(outputs, station)[quality(outputs) > 0.0].max() < 0.05
    assert (outputs.report[second > 5.0, 0, 3].max() > 0) or lost  # late ranges count as rejected in the records


def test_a_fix_is_confirmed_by_four_emitters() -> None:
    measured, _ = noisy(free_station(6.0, 3, speed=0.0), 3, Inertial())
    emitter = np.arange(len(measured.range_m)) % 9
    for heard, confirmed in (((0, 1, 4), False), ((0, 1, 4, 5), True)):
        some = np.where(np.isin(emitter, heard)[:, None], measured.range_m, np.nan)
        outputs = run(new_filter(fusion=Fusion()), replace(measured, range_m=some))
        assert (quality(outputs) > 0.0).any() == confirmed


def test_a_suspect_station_is_sure_again_with_three_emitters() -> None:
    measured, _ = noisy(free_station(8.0, 3, speed=0.0), 3, Inertial())
    slot = np.arange(len(measured.range_m))
    heard = (slot < 4 * SLOTS_PER_S) | ((slot > 5 * SLOTS_PER_S) & np.isin(slot % 9, (0, 1, 4)))
    some = np.where(heard[:, None], measured.range_m, np.nan)
    outputs = run(new_filter(fusion=Fusion()), replace(measured, range_m=some))
    second = outputs.tick[:, 0] / TICK_HZ
    assert not quality(outputs)[(second > 4.8) & (second < 5.0)].any()
    assert (quality(outputs)[second > 6.0] > 0.0).all()


@pytest.mark.parametrize("seed", range(6))
def test_exchanged_emitters_give_no_confident_error(seed: int) -> None:
    station = free_station(12.0, seed, speed=(0.0, 1.0, 2.0)[seed % 3])
    measured, _ = noisy(station, seed, Inertial())
    emitters = EMITTER_M.copy()
    first, second = np.random.default_rng(seed).choice(len(emitters), 2, replace=False)
    emitters[[first, second]] = emitters[[second, first]]
    outputs = run(new_filter(fusion=Fusion(), emitter_m=emitters), measured)
    wrong = (quality(outputs) > 0.0) & (errors_m(outputs, station) > 1.0)
    assert longest_run(wrong) * 10 < TICK_HZ


def test_the_spread_at_rest_is_the_published_one() -> None:
    """The default noise of ranges gives 1 to 2 mm of spread of the 3-D position (docs/is900.md 13.1)."""
    spreads = []
    for seed in range(5):
        measured, _ = noisy(free_station(30.0, seed, speed=0.0), seed, Inertial())
        outputs = run(new_filter(fusion=Fusion()), measured)
        settled = outputs.position_m[outputs.tick[:, 0] > 5.0 * TICK_HZ, 0, 0]
        spreads.append(float(np.sqrt(np.sum(np.var(settled, axis=0)))))
    print("spread at rest [mm]:", *(f"{1e3 * spread:.2f}" for spread in spreads))
    assert 0.001 < np.median(spreads) < 0.002


def test_windows_do_not_grow_with_emitters_that_do_not_fire() -> None:
    models = []
    for count in (NEAR_EMITTERS, 4 * NEAR_EMITTERS):
        numbers, normal = np.arange(count), np.tile([0.0, 0.0, 1.0], (count, 1))
        constellation = Constellation(numbers, np.zeros((count, 3)), normal, numbers, 1.2, 4.0)
        device = constellation, np.zeros((1, 2, 3)), Schedule(TICK_HZ, count), ["a"]
        models.append(FusionFilter(Fusion(), Sound(), Inertial(), *device).model)
    assert models[0].window_s == models[1].window_s
    assert models[0].confirmation_slots == models[1].confirmation_slots


def test_wrong_shapes_are_refused() -> None:
    station = free_station(1.0, 0)
    with pytest.raises(ShapeError, match="range_m"):
        new_filter().filter_block(
            0,
            emitters_in_turn(0, 80),
            station.angle_rad[:, None],
            station.gain_m_s[:, None],
            station.range_m,
            records_every(5, 80),
        )


def filter_of(fusion: Fusion) -> FusionFilter:
    return new_filter(fusion=fusion, inertial=exact_inertial())


def test_enhancement_turns_jumps_into_slopes() -> None:
    station = free_station(8.0, 7, speed=0.0)
    jumping = silent(station, 4.0, 5.2)
    measured, _ = noisy(jumping, 7, Inertial(), 1.5 * RANGE_NOISE_M)
    outputs = run(filter_of(EXACT), measured, ticks=5)
    settled = outputs.tick[:, 0] > 2.0 * TICK_HZ
    steps = np.linalg.norm(np.diff(outputs.position_m[settled, 0], axis=0), axis=-1).max(axis=0)
    assert steps[1] < 0.5 * steps[0]
    assert steps[2] < 0.5 * steps[0]
    apart = np.linalg.norm(outputs.position_m[settled, 0, 1] - outputs.position_m[settled, 0, 0], axis=-1)
    assert 0.0 < apart.max() < 0.05


@pytest.mark.parametrize("silent_after", range(8))
def test_a_fix_comes_whichever_slots_are_heard(silent_after: int) -> None:
    """Every eighth slot is silent. Attempts must not fall on those slots alone, as with a turn of 36 emitters."""
    measured, _ = noisy(free_station(4.0, 3), 3, Inertial())
    measured.range_m[silent_after::8] = np.nan
    outputs = run(new_filter(fusion=Fusion()), measured)
    assert quality(outputs)[-1] > 0.0
