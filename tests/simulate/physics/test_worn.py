"""Worn components at the inertial rate: velocities are derivatives, draws are those of the statistical noise."""

from dataclasses import replace

import numpy as np
import pytest

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.errors import BadInput, UnknownName
from harness.simulate.components.mount import MountOffset, MountSlip, StrapSlip
from harness.simulate.components.soft_tissue import Skin, SoftTissueArtefact, simulate_oscillators, soft_limit
from harness.simulate.noise import Noise
from harness.simulate.physics.motion import TrackerMotion
from harness.simulate.physics.worn import Worn, minimum_jerk_share
from harness.simulate.simulation import TrackerConfig, exact_calibration, sampling_times_s, simulate_readings
from harness.simulate.trajectory import Trajectory
from tests.simulate.conftest import SIX, worn
from tests.simulate.physics.test_body_motion import EVERYTHING, TISSUE, central_differences, source_of, ticks_s

STEP_S = 1e-4
SLIP = MountSlip("torso", from_s=0.2, over_s=0.5, around_rad=0.8, along_m=0.03)
COMPONENTS = {
    "none": Noise(),
    "tissue": TISSUE,
    "mount": Noise(mount=MountOffset(0.01, 0.3)),
    "strap": Noise(strap_slip=StrapSlip(share=1.0, along_m=0.05, around_rad=0.5)),
    "slip": Noise(mount_slip=(SLIP,)),
    "all": EVERYTHING,
}


def turning(stations: int, time_s: Floats) -> TrackerMotion:
    """A plain motion whose derivatives are known: circles at several rates."""
    rate = 2.0 + np.arange(stations)
    angle = rate * time_s[:, None]
    axis = np.array([0.6, 0.0, 0.8])
    zero = np.zeros_like(angle)
    return TrackerMotion(
        time_s=time_s,
        position_m=np.stack([np.cos(angle), np.sin(angle), zero], axis=-1),
        tracker_from_station=rotations.exp(angle[..., None] * axis),
        velocity_m_s=rate[:, None] * np.stack([-np.sin(angle), np.cos(angle), zero], axis=-1),
        turn_rad_s=np.broadcast_to(rate[:, None] * axis, (*angle.shape, 3)).copy(),
    )


@pytest.mark.parametrize("name", COMPONENTS)
def test_velocity_is_the_derivative_of_position(name: str) -> None:
    stations, time_s = ("torso", "head", "left_wrist"), STEP_S * np.arange(20001.0)
    skin = Skin(np.array([0.12, 0.1, 0.04]), np.array([0.01, 0.005, 0.02]))
    components = Worn(COMPONENTS[name], stations, skin, tick_hz=1.0 / STEP_S, ends_s=1.0, seed=3, take="t")
    motion = turning(3, time_s)
    phase = time_s[:, None, None] * np.array([11.0, 17.0, 23.0])
    components.apply(motion, 30.0 * np.sin(phase) * np.array([[1.0], [0.5], [2.0]]))
    slope, spin = central_differences(motion)
    assert np.abs(slope - motion.velocity_m_s[1:-1]).max() < 1e-5
    assert np.abs(spin - motion.turn_rad_s[1:-1]).max() < 1e-4


def test_the_derivative_holds_while_a_body_boxes(boxer: tuple[Body, BodyMotion]) -> None:
    """At 400 Hz central differences are coarse: the bound is a tenth of what a tissue adds."""
    time_s = ticks_s(0.0, 12.0)
    bare, moved = source_of(boxer, Noise()).advance(time_s), source_of(boxer, TISSUE).advance(time_s)
    added = np.abs(moved.velocity_m_s - bare.velocity_m_s).max()
    assert added > 0.3
    coarse = np.abs(central_differences(bare)[0] - bare.velocity_m_s[1:-1]).max()
    assert np.abs(central_differences(moved)[0] - moved.velocity_m_s[1:-1]).max() < coarse + 0.1 * added


def test_tissue_is_the_oscillator_of_the_component() -> None:
    """Displacements are those of the statistical component, for the same pushes."""
    rng = np.random.default_rng(1)
    stations, time_s = ("a", "b"), np.arange(801) / 400.0
    skin, component = Skin(np.array([0.12, 0.05]), np.array([0.02, 0.01])), SoftTissueArtefact()
    force = np.cumsum(rng.normal(size=(801, 2, 3)), axis=0)
    motion = turning(2, time_s)
    before_m = motion.position_m.copy()
    turn = motion.tracker_from_station.copy()
    Worn(Noise(soft_tissue=component), stations, skin, tick_hz=400.0, ends_s=2.0, seed=1, take="t").apply(motion, force)
    pace = 2 * np.pi * 5.0 * np.sqrt(0.04 / skin.tissue_m)[:, None] * [1.0, 1.0, 2.0]
    expected_m = soft_limit(simulate_oscillators(-force, pace, 0.3, 1.0 / 400.0), skin.tissue_m[:, None])
    found_m = rotations.rotate(rotations.inverse(turn), motion.position_m - before_m)
    np.testing.assert_allclose(found_m, expected_m, atol=1e-12)
    roll = rotations.log(rotations.multiply(rotations.inverse(turn), motion.tracker_from_station))
    np.testing.assert_allclose(roll[..., 0], -expected_m[..., 1] / skin.radius_m, atol=1e-9)
    np.testing.assert_allclose(roll[..., 1:], 0.0, atol=1e-9)


def test_tissue_is_still_while_the_performer_stands(boxer: tuple[Body, BodyMotion]) -> None:
    motion = source_of(boxer, TISSUE).advance(ticks_s(-1.0, -0.41))
    assert np.abs(motion.velocity_m_s).max() < 1e-9
    assert np.abs(motion.position_m - motion.position_m[0]).max() < 1e-9


@pytest.mark.parametrize("component", ["mount", "strap", "slip"])
def test_it_ends_where_the_statistical_component_does(boxer: tuple[Body, BodyMotion], component: str) -> None:
    """Mounts and finished slips are the same with physics and without, from the same draws."""
    body, take = boxer
    noise, tracker = COMPONENTS[component], TrackerConfig(rate_hz=40.0, slot_s=0.0)
    mounts, trajectory = worn(), Trajectory(body, take)
    time_s = sampling_times_s(trajectory.duration_s, tracker, len(mounts))
    read = simulate_readings(trajectory, mounts, tracker, noise, time_s, seed=5, take=take.name)
    calibration = exact_calibration(body, mounts, tracker)
    skin = Skin(read.radius_m, read.tissue_m)
    true = trajectory.station_motion(calibration, time_s)
    turn = rotations.multiply(rotations.inverse(calibration.world_from_tracker), true.world_from_station)
    flip = np.array([1.0, -1.0, -1.0])
    position_m = flip * (true.position_m - calibration.tracker_origin_m)
    motion = TrackerMotion(time_s[:, 0], position_m, turn, flip * true.velocity_m_s, flip * true.turn_rad_s)
    Worn(noise, SIX, skin, tick_hz=40.0, ends_s=float(time_s.max()), seed=5, take=take.name).apply(motion, None)
    clear = np.all(np.abs(motion.position_m - read.position_m) < 1e-9, axis=-1)
    # while a strap slips, minimum jerk and uniform motion differ: half a second of twelve
    assert clear[-1].all()
    assert clear.mean() > (0.999 if component == "mount" else 0.94)
    assert rotations.angle_between_rad(motion.tracker_from_station, read.turn)[clear].max() < 1e-7


def test_a_mount_belongs_to_the_session() -> None:
    def mounted(take: str, session: str) -> Floats:
        motion, skin = turning(2, np.zeros(1)), Skin(np.ones(2), np.ones(2))
        noise = COMPONENTS["mount"]
        Worn(noise, "ab", skin, tick_hz=400.0, ends_s=1.0, seed=1, take=take, session=session).apply(motion, None)
        return motion.position_m

    assert np.array_equal(mounted("one", "day"), mounted("two", "day"))
    assert np.array_equal(mounted("day", ""), mounted("two", "day"))
    assert not np.isclose(mounted("one", "day"), mounted("one", "night")).any(axis=-1).all()


def test_a_slip_is_a_minimum_jerk_motion() -> None:
    share, pace = minimum_jerk_share(np.array([-1.0, 0.0, 1.0, 2.0, 3.0]), 2.0)
    np.testing.assert_allclose(share, [0.0, 0.0, 0.5, 1.0, 1.0])
    np.testing.assert_allclose(pace, [0.0, 0.0, 1.875 / 2.0, 0.0, 0.0])


@pytest.mark.parametrize(
    "noise", [Noise(mount_slip=(replace(SLIP, over_s=0.0),)), Noise(strap_slip=StrapSlip(over_s=0.0))]
)
def test_a_slip_in_no_time_is_refused(noise: Noise) -> None:
    with pytest.raises(BadInput, match="infinite acceleration"):
        Worn(noise, ("torso",), Skin(np.ones(1), np.ones(1)), tick_hz=400.0, ends_s=1.0, seed=1, take="t")


def test_a_slip_of_a_station_that_is_not_worn_is_refused() -> None:
    with pytest.raises(UnknownName, match="torso"):
        Worn(
            Noise(mount_slip=(SLIP,)),
            ("head",),
            Skin(np.ones(1), np.ones(1)),
            tick_hz=400.0,
            ends_s=1.0,
            seed=1,
            take="t",
        )
