"""Soft tissue artefact: the oscillator against closed forms, sizes against published ones; and strap slips."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from harness.body import THICKNESS_M, Body, Mount, tissue_thickness_m
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import BONES, pack
from harness.core.motion import BodyMotion
from harness.errors import BadInput, UnknownName
from harness.experiment.scenarios import load_scenario
from harness.simulate.components.mount import MountSlip, StrapSlip
from harness.simulate.components.soft_tissue import SoftTissueArtefact, simulate_oscillators, soft_limit
from harness.simulate.noise import NOISE_PRESETS, Noise, noise_preset
from harness.simulate.readings import SimulatedReadings
from harness.simulate.simulation import TrackerConfig, sampling_times_s, simulate_readings
from harness.simulate.trajectory import Trajectory
from tests.simulate.conftest import Still
from tests.simulate.test_components import ODDS, assert_sd, assert_uniform, errors

THIGH = Mount("thigh", "rfemur", 0.5, np.pi / 2)
SHIN = Mount("shin", "rtibia", 0.9, np.pi / 2)
KNEE = Mount("below_knee", "rtibia", 0.3, 0.0)


def own_axes(true: SimulatedReadings, seen: SimulatedReadings) -> Floats:
    """(N, S, 3) displacement of stations in their own axes [m]."""
    return rotations.rotate(rotations.inverse(true.turn), seen.position_m - true.position_m)


def worn_through(
    body: Body, take: BodyMotion, *mounts: Mount, wobble: SoftTissueArtefact | None = None
) -> SimulatedReadings:
    """Readings of a take with this component alone."""
    trajectory, tracker = Trajectory(body, take), TrackerConfig(rate_hz=40.0, slot_s=0.0)
    time_s = sampling_times_s(trajectory.duration_s, tracker, len(mounts))
    return simulate_readings(trajectory, mounts, tracker, Noise(soft_tissue=wobble), time_s, seed=1, take=take.name)


def test_it_is_in_no_level() -> None:
    assert all(
        (noise_preset(name).soft_tissue, noise_preset(name).strap_slip) == (None, None) for name in NOISE_PRESETS
    )


def test_a_scenario_adds_them_by_name() -> None:
    scenario = load_scenario("demo")
    noise = replace(scenario, components={"soft_tissue": {"damping": 0.5}, "strap_slip": {}}).noise_model
    assert noise == replace(
        noise_preset(scenario.noise), soft_tissue=SoftTissueArtefact(damping=0.5), strap_slip=StrapSlip()
    )


def test_where_nothing_pushes_nothing_moves(still: Still) -> None:
    true, seen = still(2.0), still(2.0)
    SoftTissueArtefact().apply(seen)
    np.testing.assert_array_equal(seen.position_m, true.position_m)
    np.testing.assert_array_equal(seen.turn, true.turn)


@pytest.mark.parametrize("damping", [0.05, 0.3, 0.8])
def test_it_rings_with_its_frequency_and_dies_down_with_its_damping(damping: float) -> None:
    """Let go, x(t) = exp(-d w t) cos(...): after one damped period it is smaller by exp(-d w T), phase for phase."""
    pace, samples = 2.0 * np.pi * 5.0, 16
    period_s = 2.0 * np.pi / (pace * np.sqrt(1.0 - damping**2))
    push = np.zeros((5 * samples, 1))
    push[0] = 3.0
    place = simulate_oscillators(push, np.array([pace]), damping, period_s / samples)[:, 0]
    assert place[0] == pytest.approx(3.0 / pace**2), "it begins where the push holds it"
    free = place[1:]
    np.testing.assert_allclose(free[samples:], free[:-samples] * np.exp(-damping * pace * period_s), atol=1e-12)
    crossings = np.flatnonzero(np.diff(np.sign(free)))
    assert len(crossings) >= 8, "it swings through its place of rest twice a period"


@pytest.mark.parametrize("damping", [0.3, 1.0, 3.0])
def test_a_ramp_of_push_is_followed_as_the_closed_form_says(damping: float) -> None:
    """x = (t - 2d/w + e(t))/w^2, e the free motion that begins with 2d/w and speed -1; also overdamped."""
    pace, step_s = 20.0, 0.025
    time_s = step_s * np.arange(60.0)
    found = simulate_oscillators(time_s[:, None], np.array([pace]), damping, step_s)[:, 0]
    root = np.sqrt(complex(damping**2 - 1.0)) if damping != 1.0 else 1e-5
    one, two = pace * (-damping + root), pace * (-damping - root)
    first = (-1.0 - two * 2.0 * damping / pace) / (one - two)
    free = first * np.exp(one * time_s) + (2.0 * damping / pace - first) * np.exp(two * time_s)
    expected = (time_s - 2.0 * damping / pace + np.real(free)) / pace**2
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_the_rate_of_sampling_does_not_change_the_motion(rng: np.random.Generator) -> None:
    """For a piecewise linear push two sampling rates agree, for stiff and soft oscillators."""
    knots = rng.normal(size=(40, 3))
    finer = np.arange(391) / 10.0
    dense = np.stack([np.interp(finer, np.arange(40.0), column) for column in knots.T], axis=1)
    pace = np.array([5.0, 60.0, 900.0])
    slow, fast = simulate_oscillators(knots, pace, 0.3, 0.025), simulate_oscillators(dense, pace, 0.3, 0.0025)
    np.testing.assert_allclose(fast[::10], slow, atol=1e-12)


def test_a_lasting_force_pulls_it_aside_in_proportion_to_the_flesh(still: Still) -> None:
    """Sag: force over the square of the pace, against the force; stiffer square to the skin."""
    true, seen = still(1.0, 2), still(1.0, 2)
    seen.force_m_s2[:] = [0.3, 0.0, 0.3]
    seen.tissue_m = np.array([0.04, 0.01])
    SoftTissueArtefact(frequency_hz=5.0).apply(seen)
    sag_m = 0.3 / (2.0 * np.pi * 5.0) ** 2
    expected = np.array([[-sag_m, 0.0, -sag_m / 4.0], [-sag_m / 4.0, 0.0, -sag_m / 16.0]])
    np.testing.assert_allclose(own_axes(true, seen)[-1], expected, rtol=1e-3, atol=1e-12)


def test_what_slides_around_the_bone_turns_about_it(still: Still) -> None:
    """As a strap that slips by the same angle does, to the second order."""
    true, seen, slipped = still(1.0, 1), still(1.0, 1), still(1.0, 1)
    seen.force_m_s2[:] = [0.0, 1.0, 0.0]
    SoftTissueArtefact().apply(seen)
    around_rad = -own_axes(true, seen)[0, 0, 1] / 0.05
    assert around_rad > 0.009
    MountSlip("s0", around_rad=float(around_rad)).apply(slipped)
    shift, turn = errors(slipped, seen)
    assert np.abs(turn).max() < 1e-9
    assert np.linalg.norm(shift, axis=2).max() < 0.05 * around_rad**2


def test_skin_never_slides_farther_than_its_flesh_is_thick(rng: np.random.Generator) -> None:
    shifts, most_m = 0.05 * rng.normal(size=(500, 4, 3)), np.full((4, 1), 0.02)
    held = soft_limit(shifts, most_m)
    assert 0.0199 < np.linalg.norm(held, axis=2).max() <= 0.02
    np.testing.assert_allclose(np.cross(held, shifts), 0.0, atol=1e-12)
    np.testing.assert_allclose(soft_limit(1e-4 * shifts, most_m), 1e-4 * shifts, rtol=1e-6)


def test_in_the_rest_pose_it_hangs_where_it_was_strapped_on(boxer: tuple[Body, BodyMotion]) -> None:
    body, take = boxer
    upright = np.array([1.0, 0.0, 0.0, 0.0])
    pose = pack(np.array([0.0, 0.0, 1.0]), upright, np.zeros(len(body.skeleton.axes)))
    standing = BodyMotion("rest", take.subject, take.source, take.behaviour, 40.0, np.tile(pose, (40, 1)))
    mounts = (THIGH, SHIN)
    still, wobbly = (worn_through(body, standing, *mounts, wobble=w) for w in (None, SoftTissueArtefact()))
    assert np.abs(still.force_m_s2).max() < 1e-9
    np.testing.assert_allclose(wobbly.position_m, still.position_m, atol=1e-12)


def test_lying_down_it_sags_towards_the_floor(boxer: tuple[Body, BodyMotion]) -> None:
    body, take = boxer
    on_the_back = np.array([np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0])
    pose = pack(np.array([0.0, 0.0, 0.2]), on_the_back, np.zeros(len(body.skeleton.axes)))
    lying = BodyMotion("lying", take.subject, take.source, take.behaviour, 40.0, np.tile(pose, (40, 1)))
    still, wobbly = (worn_through(body, lying, THIGH, wobble=w) for w in (None, SoftTissueArtefact()))
    down_m = (wobbly.position_m - still.position_m)[-1, 0, 2]  # the tracker's z points down
    assert 0.003 < down_m < tissue_thickness_m("rfemur", 0.5)


def test_in_a_walk_thighs_wobble_by_centimetres_and_shins_by_millimetres(walker: tuple[Body, BodyMotion]) -> None:
    """Thigh to 3 cm, shank from a few mm to 1.5 cm (Leardini et al. 2005; PMC8631460: 18 mm and 10 deg of a
    thigh's markers together); little at the forehead."""
    head = Mount("head", "head", 1.0, 0.0)
    mounts = (THIGH, KNEE, SHIN, head)
    still, wobbly = (worn_through(*walker, *mounts, wobble=w) for w in (None, SoftTissueArtefact()))
    moved_m = np.linalg.norm(own_axes(still, wobbly), axis=2).max(axis=0)
    thigh, knee, shin, forehead = moved_m
    assert 0.010 < thigh < 0.030
    assert 0.005 < knee < 0.015
    assert 0.003 < shin < 0.015
    assert forehead < 0.005
    turned_deg = np.rad2deg(rotations.angle_between_rad(still.turn, wobbly.turn))
    assert 5.0 < turned_deg[:, 0].max() < 20.0


def test_the_same_motion_wobbles_alike_whoever_else_is_worn(boxer: tuple[Body, BodyMotion]) -> None:
    alone, together = (
        worn_through(*boxer, *mounts, wobble=SoftTissueArtefact()) for mounts in ((SHIN,), (THIGH, SHIN))
    )
    np.testing.assert_array_equal(alone.position_m[:, 0], together.position_m[:, 1])
    np.testing.assert_array_equal(alone.turn[:, 0], together.turn[:, 1])


def test_numbers_that_cannot_be_are_refused() -> None:
    with pytest.raises(BadInput, match="frequency_hz"):
        SoftTissueArtefact(frequency_hz=0.0)
    with pytest.raises(BadInput, match="share"):
        StrapSlip(share=1.5)


@pytest.mark.parametrize("bone", BONES)
def test_every_bone_has_flesh_on_both_sides_alike(bone: str) -> None:
    assert 0.002 <= tissue_thickness_m(bone, 0.0) <= 0.06
    if bone[0] in "lr" and bone[1:] in THICKNESS_M:
        other = {"l": "r", "r": "l"}[bone[0]] + bone[1:]
        assert tissue_thickness_m(bone, 0.3) == tissue_thickness_m(other, 0.3)


def test_flesh_of_no_bone() -> None:
    with pytest.raises(UnknownName, match="'femur'"):
        tissue_thickness_m("femur", 0.5)


def test_strap_slips_have_the_given_rate_and_size(still: Still) -> None:
    slipped, along, around = [], [], []
    for seed in range(60):
        true, seen = still(0.5, 8, seed=seed), still(0.5, 8, seed=seed)
        StrapSlip(share=0.3, along_m=0.01, around_rad=0.1, over_s=0.0).apply(seen)
        shift, turned = own_axes(true, seen), rotations.multiply(rotations.inverse(true.turn), seen.turn)
        for row in range(8):
            last = shift[-1, row, 0]
            slipped.append(last != 0.0)
            if slipped[-1]:
                steps = np.flatnonzero(np.diff(shift[:, row, 0]))
                assert len(steps) <= 1, "once"
                along.append(last)
                around.append(rotations.log(turned[-1, row])[0])
    low, high = stats.binom.interval(1.0 - ODDS, len(slipped), 0.3)
    assert low <= np.sum(slipped) <= high
    assert_sd(np.array(along), 0.01)
    assert_sd(np.array(around), 0.1)


def test_a_strap_slips_alike_whatever_else_is_worn(still: Still) -> None:
    few, many = still(2.0, 2), still(2.0, 5)
    many.position_m[:, :2], many.turn[:, :2] = few.position_m, few.turn
    for readings in (few, many):
        StrapSlip(share=0.7).apply(readings)
    np.testing.assert_array_equal(few.position_m, many.position_m[:, :2])
    np.testing.assert_array_equal(few.turn, many.turn[:, :2])


def test_straps_slip_at_any_moment_of_the_take() -> None:
    slips = [StrapSlip(share=1.0).draw(np.random.default_rng(n), "torso", 2.0, 9.0) for n in range(2000)]
    assert all(slip is not None for slip in slips)
    assert_uniform(np.array([slip.from_s for slip in slips if slip is not None]), 2.0, 9.0)
