"""A take under the physics of the tracker, from true motion to frames."""

import hashlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.stream_health import describe_grown_room
from harness.errors import BadInput
from harness.simulate.components.mount import MountOffset, MountSlip, StrapSlip
from harness.simulate.components.soft_tissue import SoftTissueArtefact
from harness.simulate.link import TrackerConfig
from harness.simulate.noise import Noise, noise_preset
from harness.simulate.physics.constellation import ConstellationSettings
from harness.simulate.physics.filter_settings import Fusion
from harness.simulate.physics.room import Room
from harness.simulate.physics.settings import Physics
from harness.simulate.physics.sound import Sound
from harness.simulate.simulation import simulate_tracker
from tests.simulate.conftest import SIX, worn
from tests.simulate.physical_takes import SEED, TRACKER, errors, observed, performed, physical, positions_m

CLEAN = Physics().with_preset("clean")


def error_m(physics: Physics, tracker: TrackerConfig = TRACKER) -> Floats:
    """(F, S) distance of the reported positions from the true ones [m]; NaN where a station is lost."""
    return errors(observed(Noise(physics=physics), tracker=tracker), observed(Noise(), tracker=tracker))[0]


@pytest.mark.parametrize(
    ("behaviour", "noise", "digest"),
    [
        ("boxing", "clean", "a0f5e1a30e06b4bd"),
        ("boxing", "noise", "9b288662b245392e"),
        ("boxing", "default", "656c2bd41f6fbcd3"),
        ("walking", "clean", "ba4605b860661731"),
        ("walking", "noise", "b2c75bd78ce90f92"),
        ("walking", "default", "73e51f95a0498062"),
    ],
)
def test_without_physics_the_bytes_are_those_of_before(behaviour: str, noise: str, digest: str) -> None:
    """The digests are those of the commit before the physics, fccf59d."""
    body, take = performed(behaviour, 5.0)
    wire = simulate_tracker(body, take, worn(*SIX), TrackerConfig(), noise_preset(noise), seed=SEED).wire
    assert hashlib.sha256(wire.data).hexdigest()[:16] == digest


def test_clean_is_exact() -> None:
    """Without a cause of errors the filter follows punches within a tenth of a millimetre."""
    off_m, off_rad = errors(observed(physical("clean")), observed(Noise()))
    assert np.nanmax(off_m) < 1.5e-4
    assert np.nanmedian(off_m) < 1e-5
    assert np.nanmax(off_rad) < 1e-3
    assert np.mean(np.isnan(off_m)) < 0.02, "a station may still search its first fix"


def test_noise_has_no_gaps() -> None:
    simulation = observed(physical("noise"))
    assert simulation.health["readings_invalid"] == 0.0
    off_m = errors(simulation, observed(Noise()))[0]
    assert 1e-3 < np.median(off_m) < 8e-3
    assert all(simulation.health[f"{station} echoes"] == 0.0 for station in SIX)


def test_default_has_shadow_and_echoes() -> None:
    health = observed(physical("default")).health
    assert max(health[f"{station} echoes"] for station in SIX) > 0.05
    assert min(health[f"{station} hears 3 emitters"] for station in SIX) < 1.0
    silent = observed(physical("default", Physics(room=Room(echoes=False)))).health
    assert max(silent[f"{station} echoes"] for station in SIX) == 0.0
    open_air = observed(physical("default", Physics(room=Room(shadow=False)))).health
    assert min(open_air[f"{station} hears 3 emitters"] for station in SIX) == 1.0


@pytest.mark.parametrize(("preset", "name"), [("noise", "cave"), ("default", "cave"), ("default", "hall")])
def test_one_station_more_leaves_the_others_as_they_are(preset: str, name: str) -> None:
    rows = [SIX.index("left_ankle"), SIX.index("head")]
    slot_s = replace(TRACKER, slot_s=0.0)
    noise = physical(preset, Physics(ConstellationSettings(name)))
    whole, few = (observed(noise, stations, slot_s) for stations in (SIX, ("left_ankle", "head")))
    np.testing.assert_array_equal(positions_m(whole)[:, rows], positions_m(few))
    for station in few.stations:
        assert few.health[f"{station} hears 3 emitters"] == whole.health[f"{station} hears 3 emitters"]


def test_another_seed_draws_other_errors() -> None:
    one, other = (positions_m(observed(physical("noise"), seed=seed)) for seed in (1, 2))
    assert not np.array_equal(one, other)


def test_the_survey_s_errors_move_positions() -> None:
    physics = replace(CLEAN, constellation=replace(CLEAN.constellation, survey_sd_m=0.005))
    assert np.nanmedian(error_m(physics)) > 1e-3


def test_a_wrong_temperature_scales_ranges() -> None:
    """3 K warm: ranges are 0.5 % too short, so that a station h below the emitters seems to be higher.

    A range r to an emitter aside raises it by 0.5 % of r^2 / h, which is more than 0.5 % of h.
    """
    physics = replace(CLEAN, sound=replace(CLEAN.sound, temperature_c=23.0))
    warm, true = observed(Noise(physics=physics)), observed(Noise())
    up_m = np.nanmedian((positions_m(true) - positions_m(warm))[..., 2], axis=0)
    below_m = np.nanmedian(positions_m(true)[..., 2], axis=0)
    share = up_m / below_m / (np.sqrt(296.15 / 293.15) - 1.0)
    assert share.min() > 1.0
    assert share.max() < 1.5


def test_the_lever_arm_is_compensated() -> None:
    """An inertial unit far from the station's origin measures another motion, which the filter knows."""
    physics = replace(CLEAN, inertial=replace(CLEAN.inertial, lever_m=(0.0, 0.1, 0.05)))
    assert np.nanmax(error_m(physics)) < 5e-4


def test_the_gate_keeps_wrong_ranges_out() -> None:
    wrong = replace(CLEAN.sound, range_noise_m=Sound().range_noise_m, wrong_cycle_share=0.05, frequency_hz=10e3)
    gated, open_gate = (
        np.nanmedian(error_m(replace(CLEAN, sound=wrong, fusion=Fusion(gate=gate)))) for gate in (4.0, 100.0)
    )
    assert open_gate > 1.3 * gated


@pytest.mark.parametrize(
    "worn_component",
    [
        {"mount": MountOffset(position_m=0.01, orientation_rad=0.05)},
        {"mount_slip": (MountSlip("head", from_s=0.5, along_m=0.02, around_rad=0.2, over_s=0.5),)},
    ],
    ids=lambda component: next(iter(component)),
)
def test_what_is_worn_moves_the_tracker_as_with_statistics(worn_component: dict[str, Any]) -> None:
    """After a slip the tracker is where the statistical error model has it; slips differ in profile while they last."""
    shift_m = positions_m(observed(Noise(**worn_component))) - positions_m(observed(Noise()))
    moved_m = positions_m(observed(physical("clean", **worn_component))) - positions_m(observed(physical("clean")))
    after = slice(round(1.2 * TRACKER.rate_hz), None)
    assert np.abs(shift_m[after]).max() > 5e-3
    np.testing.assert_allclose(moved_m[after], shift_m[after], atol=3e-4)


@pytest.mark.parametrize(
    "component",
    [{"soft_tissue": SoftTissueArtefact()}, {"strap_slip": StrapSlip(share=1.0)}],
    ids=lambda c: next(iter(c)),
)
def test_tissue_and_straps_move_the_tracker_nearly_as_with_statistics(component: dict[str, Any]) -> None:
    """The statistical model samples oscillations at the tracker's rate, so the rate is high here.

    It begins them at once; the physical tracker is not yet compared then.
    """
    fast = TrackerConfig(rate_hz=160.0, baud=10_000_000, slot_s=0.0)
    with_it, without = (observed(Noise(**c), tracker=fast) for c in (component, {}))
    shift_m = positions_m(with_it) - positions_m(without)
    with_it, without = (observed(physical("clean", **c), tracker=fast) for c in (component, {}))
    off_m = positions_m(with_it) - positions_m(without) - shift_m
    assert np.sqrt(np.nanmean(off_m[round(0.5 * fast.rate_hz) :] ** 2)) < 0.2 * np.sqrt(np.mean(shift_m**2))


def test_prediction_and_enhancement_act_per_station() -> None:
    set_up = replace(CLEAN, fusion=Fusion(prediction_ms={"head": 50}, enhancement={"torso": 1}))
    plain, changed = (positions_m(observed(Noise(physics=p))) for p in (CLEAN, set_up))
    differs = [bool(np.nanmax(np.abs(changed[:, row] - plain[:, row])) > 0.0) for row in range(len(SIX))]
    assert differs == [station in ("head", "torso") for station in SIX]


def test_a_station_out_of_range_hears_nothing() -> None:
    """A range of 1.6 m reaches the hands and the head."""
    health = observed(physical("default", Physics(constellation=ConstellationSettings(range_m=1.6)))).health
    assert health["left_ankle hears 3 emitters"] == health["right_ankle hears 3 emitters"] == 0.0
    assert health["head hears 3 emitters"] > 0.9


@pytest.mark.parametrize(
    ("physics", "says"),
    [
        (Physics(ConstellationSettings(centre_m=(50.0, 0.0)), Room(size_m=(150.0, 150.0))), "within reach"),
        (Physics(ConstellationSettings(range_m=0.2)), "within reach"),
        (
            Physics(room=Room(size_m=(3.0, 3.0)), constellation=ConstellationSettings(centre_m=(2.0, 0.0))),
            "station head reaches x",
        ),
        (Physics(room=Room(height_m=2.0)), "emitter 1 reaches z"),
        (Physics(room=Room(size_m=(1.5, 1.5))), "emitter 1 reaches x"),
    ],
)
def test_a_room_that_does_not_fit_is_refused(physics: Physics, says: str) -> None:
    with pytest.raises(BadInput, match=says):
        observed(Noise(physics=physics), ("head",))


@pytest.mark.parametrize(("seconds", "grown"), [(5.0, False), (30.0, True)])
def test_a_long_walk_has_a_hall_that_fits(seconds: float, grown: bool) -> None:
    body, take = performed("walking", seconds)
    noise = physical("clean", Physics(ConstellationSettings("hall")))
    health = simulate_tracker(body, take, worn("head", "torso"), TrackerConfig(), noise, seed=SEED).health
    assert (describe_grown_room(health) != "") == grown
    extent_m = np.ptp(take.qpos[:, :2], axis=0)
    if grown:
        assert extent_m.max() > 11.0
        assert health["room_emitters"] > 36
        assert np.all(extent_m + 1.0 <= [health["room_length_m"], health["room_width_m"]])
    assert min(health["head hears 3 emitters"], health["torso hears 3 emitters"]) > 0.95


def test_a_bone_without_a_station_may_not_pass_the_ceiling_either() -> None:
    low, noise = TrackerConfig(origin_m=(0.0, 0.0, 1.4)), physical("clean", Physics(room=Room(height_m=1.5)))
    with pytest.raises(BadInput, match=r"bone .* reaches z"):
        simulate_tracker(*performed("jumping"), worn("torso"), low, noise, seed=SEED)


def test_a_take_shorter_than_one_frame_is_refused() -> None:
    body, take = performed()
    short = replace(take, qpos=take.qpos[:2])
    with pytest.raises(BadInput, match="shorter than one frame"):
        simulate_tracker(
            body, short, worn("head", "torso"), TrackerConfig(rate_hz=20.0, slot_s=0.02), physical("clean"), seed=1
        )


def test_the_rate_of_the_inertial_sensors_may_be_odd() -> None:
    assert np.nanmedian(error_m(replace(CLEAN, inertial=replace(CLEAN.inertial, rate_hz=333.3)))) < 1e-3
