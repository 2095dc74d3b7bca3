"""Ranges: what is heard, the errors of what is measured, and what they do not depend on."""

import math
from dataclasses import replace

import numpy as np
import pytest

from harness.body import Body
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.simulate.physics.constellation import Constellation
from harness.simulate.physics.line_of_sight import LineOfSight
from harness.simulate.physics.motion import TrackerMotion
from harness.simulate.physics.ranging import Ranges, Ranging
from harness.simulate.physics.room import Box, Room
from harness.simulate.physics.schedule import TICKS_PER_SLOT, Schedule
from harness.simulate.physics.sound import Sound, level_db, noise_factor, speed_of_sound_m_s
from tests.simulate.physics.rooms import (
    DOWN,
    TICK_HZ,
    UP,
    block_of,
    emitters_at,
    emitters_in_turn,
    grid,
    moving,
    placed,
    still,
    worn,
)

EXACT = Sound(temperature_sd_c=0.0, range_noise_m=0.0, wrong_cycle_share=0.0, air_speed_sd_m_s=0.0, bursts_per_min=0.0)
CENTRED = replace(EXACT, microphones_m=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
QUIET = Room(echoes=False)
OPEN = Room(echoes=False, shadow=False)
SIDEWAYS = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
"""Orientation of a station whose z points along x."""
BACKWARD = (math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0)


def one(cone_deg: float = 70.0) -> Constellation:
    """One emitter at the origin that faces down."""
    return emitters_at((0.0, 0.0, 0.0), cone_deg=cone_deg)


class RangingInTurn(Ranging):
    """Ranging with emitters that fire in a fixed turn."""

    def measure(self, first_slot: int, motion: TrackerMotion, qpos: Floats | None) -> Ranges:
        slots = (len(motion.time_s) - 1) // TICKS_PER_SLOT
        return self.measure_ranges(first_slot, emitters_in_turn(first_slot, slots, len(self._position_m)), motion, qpos)


def ranging(
    sound: Sound,
    emitters: Constellation,
    room: Room = QUIET,
    stations: tuple[str, ...] = ("a",),
    *,
    body: Body | None = None,
    seed: int = 1,
    take: str = "t",
    session: str = "",
) -> RangingInTurn:
    where = placed(room)
    sight = LineOfSight(body, where) if room.shadow else None
    return RangingInTurn(
        sound, emitters, Schedule(TICK_HZ, len(emitters)), where, sight, stations, seed=seed, take=take, session=session
    )


def rest(sound: Sound, place_m: tuple[float, ...], slots: int, **options: object) -> Floats:
    """Ranges (slots,) of a station at rest that faces the ceiling, from one emitter above it."""
    out = ranging(sound, one(), OPEN, **options).measure(0, still(slots, place_m), None)  # type: ignore[arg-type]
    return np.ascontiguousarray(out.range_m[:, 0, 0])


def test_without_errors_ranges_are_distances() -> None:
    emitters = grid()
    places = ((0.3, 0.2, 1.4), (-0.5, 0.1, 2.0))
    out = ranging(EXACT, emitters, stations=("a", "b")).measure(0, still(9, *places), None)
    # A station that faces up has its x axis along x; its y and z are turned over.
    offsets = np.array(EXACT.microphones_m) * [1.0, -1.0, -1.0]
    microphones_m = np.array(places)[:, None] + offsets
    expected_m = np.linalg.norm(emitters.position_m[:, None, None] - microphones_m, axis=-1)
    np.testing.assert_allclose(out.range_m, expected_m, atol=1e-9)
    assert out.direct.all()
    assert not out.echo.any()


@pytest.mark.parametrize(
    ("place_m", "heard"),
    [
        ((2.7, 0.0, 1.0), True),  # 69.7 deg from the normal
        ((2.8, 0.0, 1.0), False),  # 70.3 deg
        ((0.0, 0.0, 3.99), True),
        ((0.0, 0.0, 4.01), False),
    ],
)
def test_sound_reaches_to_the_edge_of_the_cone_and_to_the_range(place_m: tuple[float, ...], heard: bool) -> None:
    out = ranging(CENTRED, one()).measure(0, still(1, place_m), None)
    assert np.isfinite(out.range_m).all() == heard
    assert out.direct.all() == heard


def test_a_microphone_that_faces_away_hears_nothing() -> None:
    for turn, heard in ((UP, True), (SIDEWAYS, True), (DOWN, False)):
        out = ranging(CENTRED, one()).measure(0, still(1, (0.0, 0.0, 1.5), turn=turn), None)
        assert np.isfinite(out.range_m).all() == heard


def test_the_range_is_that_at_the_arrival() -> None:
    stations = moving(1, (0.0, 0.0, 2.0), turn=UP, velocity_m_s=(0.0, 0.0, 5.0))
    speed = speed_of_sound_m_s(20.0)
    out = ranging(CENTRED, one()).measure(0, stations, None)
    np.testing.assert_allclose(out.range_m, 2.0 * speed / (speed - 5.0), atol=1e-9)


# Echoes


def test_a_station_that_faces_the_floor_hears_the_floor() -> None:
    out = ranging(CENTRED, one(), Room()).measure(0, still(1, (0.0, 0.0, 1.0), turn=DOWN), None)
    np.testing.assert_allclose(out.range_m, 4.0, atol=1e-9)  # 2.5 m down and 1.5 m up
    assert out.echo.all()
    assert not out.direct.any()


@pytest.mark.parametrize(
    "silenced",
    [
        Room(echoes=False),
        Room(reflection=0.0),
        Room(reflection=0.3),  # below the threshold: 10.5 dB of loss
        Room(furniture=(Box((0.25, 0.0, 0.1), (0.2, 0.2, 0.2)),)),  # on the place of reflection
        Room(furniture=(Box((0.34, 0.0, 0.7), (0.1, 0.1, 0.1)),)),  # on the way up
        Room(furniture=(Box((0.12, 0.0, 1.3), (0.1, 0.1, 0.1)),)),  # on the way down
    ],
)
def test_what_silences_an_echo(silenced: Room) -> None:
    station = still(1, (0.4, 0.0, 1.0), turn=DOWN)
    assert ranging(CENTRED, one(), Room()).measure(0, station, None).echo.all()
    assert np.isnan(ranging(CENTRED, one(), silenced).measure(0, station, None).range_m).all()


def test_an_echo_that_leaves_the_emitter_outside_its_cone_is_not_heard() -> None:
    """A wall 1.6 m from the emitter reflects sound that leaves it 54 degrees from its normal."""
    station = still(1, (1.3, 0.0, 1.4), turn=SIDEWAYS)
    room = Room(size_m=(3.2, 12.0), furniture=(Box((1.0, 0.0, 1.4), (0.1, 0.1, 0.1)),))
    heard = ranging(CENTRED, one(57.0), room).measure(0, station, None)
    np.testing.assert_allclose(heard.range_m, math.hypot(1.9, 1.4), atol=1e-9)  # the image lies at x = 3.2
    assert heard.echo.all()
    assert np.isnan(ranging(CENTRED, one(50.0), room).measure(0, station, None).range_m).all()


def test_direct_sound_hides_echoes() -> None:
    station = still(1, (0.5, 0.0, 1.4), turn=SIDEWAYS)
    table = Box((0.25, 0.0, 1.8), (0.1, 0.1, 0.1))
    alone = ranging(CENTRED, one(), Room()).measure(0, station, None)
    np.testing.assert_allclose(alone.range_m, math.hypot(0.5, 1.4), atol=1e-9)
    assert alone.direct.all()
    covered = ranging(CENTRED, one(), Room(furniture=(table,))).measure(0, station, None)
    np.testing.assert_allclose(covered.range_m, math.hypot(0.5, 5.0 - 1.4), atol=1e-9)
    assert covered.echo.all()


def test_the_earliest_echo_counts() -> None:
    station = still(1, (0.5, 0.0, 1.4), turn=SIDEWAYS)
    near_wall = Room(size_m=(3.0, 12.0), furniture=(Box((0.25, 0.0, 1.8), (0.1, 0.1, 0.1)),))
    out = ranging(CENTRED, one(), near_wall).measure(0, station, None)
    np.testing.assert_allclose(out.range_m, math.hypot(3.0 - 0.5, 1.4), atol=1e-9)


def test_an_echo_lasts_as_long_as_the_way_is_blocked() -> None:
    """A station slides along x at 1 m/s through the shadow of a box; the echo from the floor passes below the box."""
    slots = 100
    stations = moving(slots, (0.405, 0.0, 1.4), turn=BACKWARD, velocity_m_s=(1.0, 0.0, 0.0))
    box = Box((0.5, 0.0, 1.8), (0.2, 0.2, 0.2))
    out = ranging(CENTRED, one(), Room(furniture=(box,))).measure(0, stations, None)
    x_m = 0.405 + 0.0125 * np.arange(slots)
    # The box, 0.6 to 0.8 m below the emitter, hides what passes its lower near edge and its upper far edge.
    hidden = (x_m * 0.8 / 1.4 > 0.4) & (x_m * 0.6 / 1.4 < 0.6)
    assert 50 < hidden.sum() < 60
    np.testing.assert_array_equal(out.direct, np.repeat(~hidden[:, None, None], 2, axis=2))
    np.testing.assert_array_equal(out.echo, np.repeat(hidden[:, None, None], 2, axis=2))
    late_m = out.range_m[hidden, 0, 0] - np.hypot(x_m[hidden], 5.0 - 1.4)
    assert np.abs(late_m).max() < 0.011  # it moves about 1 cm while the sound flies


# Errors


def test_a_warm_room_shortens_ranges_by_the_ratio_of_the_speeds() -> None:
    warm = replace(CENTRED, temperature_c=23.0)
    expected_m = 2.0 * speed_of_sound_m_s(20.0) / speed_of_sound_m_s(23.0)
    np.testing.assert_allclose(rest(warm, (0.0, 0.0, 2.0), 1), expected_m, atol=1e-9)
    assert 1e-3 * expected_m < 2.0 - expected_m < 6e-3 * expected_m


def test_the_temperature_belongs_to_the_session() -> None:
    sound = replace(CENTRED, temperature_sd_c=2.0)
    drawn = [
        ranging(sound, one(), OPEN, take=take, session=session).temperature_c
        for session, take in [("x", "t"), ("x", "u"), ("y", "t"), ("", "t"), ("", "u")]
    ]
    assert drawn[0] == drawn[1]
    assert len(set(drawn)) == 4
    many = [ranging(sound, one(), OPEN, take=f"t{n}").temperature_c for n in range(400)]
    assert np.std(many) == pytest.approx(2.0, rel=0.15)


@pytest.mark.parametrize("place_m", [(0.0, 0.0, 1.0), (0.0, 0.0, 2.0), (2.0, 0.0, 1.2)])
def test_noise_grows_by_the_law_of_the_level(place_m: tuple[float, ...]) -> None:
    noisy = replace(CENTRED, range_noise_m=0.004)
    distance_m = float(np.linalg.norm(place_m))
    cosine = place_m[2] / distance_m
    factor = noise_factor(level_db(distance_m, cosine, cosine, 1.3), 1.3)
    error_m = rest(noisy, place_m, 20_000) - distance_m
    assert np.std(error_m) == pytest.approx(0.004 * factor, rel=0.03)
    assert abs(np.mean(error_m)) < 4.0 * 0.004 * factor / math.sqrt(20_000)


def test_wrong_cycles_are_one_wavelength_too_long_and_as_frequent_as_set() -> None:
    speed = speed_of_sound_m_s(20.0)
    for place_m, factor in (((0.0, 0.0, 2.0), 1.0), ((0.0, 0.0, 0.5), 0.5)):
        error_m = rest(replace(CENTRED, wrong_cycle_share=0.1), place_m, 20_000) - place_m[2]
        wrong = error_m > 1e-6
        np.testing.assert_allclose(error_m[wrong], speed / 40e3, atol=1e-9)
        np.testing.assert_allclose(error_m[~wrong], 0.0, atol=1e-9)
        share = 0.1 * factor
        assert wrong.mean() == pytest.approx(share, abs=4.0 * math.sqrt(share / 20_000))


def test_air_drifts_with_its_own_correlation_along_each_path() -> None:
    windy = replace(CENTRED, air_speed_sd_m_s=0.5, air_correlation_s=0.5)
    two = emitters_at((0.0, 0.0, 0.0), (0.1, 0.0, 0.0))
    out = ranging(windy, two, OPEN, ("a", "b")).measure(0, still(40_000, (0.05, 0.0, 2.0), (0.05, 0.0, 2.0)), None)
    np.testing.assert_array_equal(out.range_m[..., 0], out.range_m[..., 1])  # both microphones share the path
    speed, distance_m = speed_of_sound_m_s(20.0), math.hypot(0.05, 2.0)
    air = (speed * distance_m / out.range_m[..., 0] - speed).reshape(-1, 4)
    air -= air.mean(axis=0)
    assert air.std() == pytest.approx(0.5, rel=0.15)
    lag = 20  # turns of two slots: 0.5 s
    own = np.mean(air[lag:] * air[:-lag], axis=0) / air.var(axis=0)
    np.testing.assert_allclose(own, math.exp(-1.0), atol=0.15)
    across = np.corrcoef(air.T) - np.eye(4)
    assert np.abs(across).max() < 0.25


def test_a_burst_triggers_microphones_early_or_not_at_all() -> None:
    sound = replace(CENTRED, bursts_per_min=60.0, burst_s=(0.2, 0.6))
    slots, names = 8000, ("a", "b", "c", "d")
    out = ranging(sound, one(), OPEN, names).measure(-800, still(slots, *[(0.0, 0.0, 2.0)] * 4), None)
    struck = ~out.direct[:, 0, 0]
    assert not out.direct[struck].any()  # every station hears a burst
    assert not out.echo.any()
    assert struck[:800].any()  # before the take too
    # Bursts of 0.4 s begin once a second on average and touch one slot more; they may overlap.
    assert struck.mean() == pytest.approx(1.0 - math.exp(-0.4125), abs=0.1)
    range_m = out.range_m[struck]
    early = np.isfinite(range_m)
    assert early.mean() == pytest.approx(0.5, abs=0.02)
    assert np.mean(early.all(axis=(1, 2))) < 0.02  # 1 in 256: microphones do not agree
    assert np.mean(range_m[early]) == pytest.approx(1.0, abs=0.03)
    assert 0.0 <= range_m[early].min() < 0.02
    assert 1.98 < range_m[early].max() <= 2.0
    np.testing.assert_allclose(out.range_m[~struck], 2.0, atol=1e-9)


def test_bursts_disturb_echoes_too() -> None:
    sound = replace(CENTRED, bursts_per_min=60.0, burst_s=(0.2, 0.6))
    out = ranging(sound, one(), Room(shadow=False)).measure(0, still(2000, (0.0, 0.0, 1.0), turn=DOWN), None)
    assert 0.2 < out.echo.mean() < 0.9
    np.testing.assert_allclose(out.range_m[out.echo], 4.0, atol=1e-9)
    early = np.isfinite(out.range_m) & ~out.echo
    assert early.any()
    assert np.all(out.range_m[early] < 4.0)


# Independence


def measure_worn(
    stations: TrackerMotion, qpos: Floats, names: tuple[str, ...], body: Body, blocks: tuple[int, ...]
) -> Ranges:
    """The ranges of a performer with all errors, block after block."""
    room = Room(furniture=(Box((0.8, 0.0, 0.5), (0.3, 0.3, 0.2)),))
    device = ranging(Sound(bursts_per_min=60.0), grid(), room, names, body=body)
    parts, first = [], 0
    for slots in blocks:
        parts.append(device.measure(first, block_of(stations, first, slots), qpos[first : first + slots]))
        first += slots
    return Ranges(
        emitter=np.concatenate([part.emitter for part in parts]),
        range_m=np.concatenate([part.range_m for part in parts]),
        direct=np.concatenate([part.direct for part in parts]),
        echo=np.concatenate([part.echo for part in parts]),
    )


def assert_same(a: Ranges, b: Ranges) -> None:
    for one_array, other in zip(vars(a).values(), vars(b).values(), strict=True):
        assert one_array.tobytes() == other.tobytes()


def test_each_slot_sees_the_body_of_its_own_instant(boxer: tuple[Body, BodyMotion]) -> None:
    body, names = boxer[0], ("left_hand", "left_foot")
    stations, qpos = worn(*boxer, 400, *names)
    free = ranging(EXACT, grid(), OPEN, names).measure(0, stations, None)
    got = ranging(EXACT, grid(), QUIET, names, body=body).measure(0, stations, qpos)
    sight, expected = LineOfSight(body, placed()), free.direct.copy()
    for slot in range(400):
        sight.pose_body(qpos[slot])
        for m, offset_m in enumerate(EXACT.microphones_m):
            at_m = block_of(stations, slot, 1).points(np.array(offset_m))[0][0]
            expected[slot, :, m] &= ~sight.occlusion(grid().position_m[slot % 9], at_m)
    np.testing.assert_array_equal(got.direct, expected)
    assert 0.05 < np.mean(free.direct & ~got.direct) < 0.8


def test_seeds_and_takes_differ_and_the_same_ones_agree() -> None:
    noisy = Sound(bursts_per_min=0.0)
    first = rest(noisy, (0.0, 0.0, 1.5), 50)
    np.testing.assert_array_equal(rest(noisy, (0.0, 0.0, 1.5), 50), first)
    for options in ({"seed": 2}, {"take": "u"}):
        assert not np.any(rest(noisy, (0.0, 0.0, 1.5), 50, **options) == first)
