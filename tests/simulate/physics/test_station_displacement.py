"""Motion of worn trackers: that of the trajectory in the tracker's frame, alike in blocks of any size."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest

from harness.body import Body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.errors import BadInput, UnknownName
from harness.simulate.components.mount import MountOffset, MountSlip, StrapSlip
from harness.simulate.components.soft_tissue import (
    Skin,
    SoftTissueArtefact,
    simulate_oscillators,
    skin_below,
    soft_limit,
)
from harness.simulate.noise import Noise
from harness.simulate.physics.inertial import Inertial, InertialUnit, true_increments
from harness.simulate.physics.motion import TrackerMotion, TrackerMotionSource
from harness.simulate.physics.station_displacement import BodyMotionSource, StationDisplacement, minimum_jerk_share
from harness.simulate.simulation import TrackerConfig, exact_calibration, sampling_times_s, simulate_readings
from harness.simulate.trajectory import Trajectory
from tests.simulate.conftest import SIX, worn

TICK_HZ = 400.0
TISSUE = Noise(soft_tissue=SoftTissueArtefact())
EVERYTHING = Noise(
    soft_tissue=SoftTissueArtefact(),
    mount=MountOffset(0.01, 0.05),
    strap_slip=StrapSlip(share=1.0),
    mount_slip=(MountSlip("head", 2.0, 1.0, 0.5, 0.02),),
)


def ticks_s(from_s: float, to_s: float) -> Floats:
    """Times of the ticks from one time to another."""
    return np.arange(round(from_s * TICK_HZ), round(to_s * TICK_HZ) + 1) / TICK_HZ


def source_of(
    boxer: tuple[Body, BodyMotion], noise: Noise, stations: Sequence[str] = SIX, warm_up_s: float = 1.0
) -> BodyMotionSource:
    """The motion of these stations of the boxer, with worn components."""
    body, take = boxer
    trajectory, mounts = Trajectory(body, take).with_lead_in(warm_up_s), worn(*stations)
    calibration = exact_calibration(body, mounts, TrackerConfig(origin_m=(0.1, 0.2, 2.5)))
    skin = skin_below(body.skeleton, mounts, calibration)
    components = StationDisplacement(
        noise, calibration.stations, skin, tick_hz=TICK_HZ, ends_s=trajectory.duration_s, seed=1, take=take.name
    )
    return BodyMotionSource(trajectory, calibration, components)


def in_blocks(source: TrackerMotionSource, time_s: Floats, ticks: int) -> list[Floats]:
    """Motion and measured increments in blocks of this many ticks, with the tick that ends each block left out."""
    unit = InertialUnit(Inertial(), source.stations, seed=1, take="t")
    parts = []
    for first in range(0, len(time_s) - 1, ticks):
        motion = source.sample_motion(time_s[first : first + ticks + 1])
        true = true_increments(motion, np.array([0.0, 0.015, 0.0]))
        measured = unit.measure_increments(*true)
        arrays = motion.position_m, motion.tracker_from_station, motion.velocity_m_s, motion.turn_rad_s
        parts.append([*(array[:-1] for array in arrays), *true, *measured])
    return [np.concatenate(column) for column in zip(*parts, strict=True)]


def test_it_is_the_trajectory_in_the_frame_of_the_tracker(boxer: tuple[Body, BodyMotion]) -> None:
    body, take = boxer
    time_s = ticks_s(0.0, 2.0)
    found = source_of(boxer, Noise()).sample_motion(time_s)
    calibration = exact_calibration(body, worn(), TrackerConfig())
    true = Trajectory(body, take).station_motion(calibration, np.repeat(time_s[:, None], 6, axis=1))
    flip = np.array([1.0, -1.0, -1.0])
    np.testing.assert_allclose(found.position_m, flip * (true.position_m - [0.1, 0.2, 2.5]), atol=1e-12)
    np.testing.assert_allclose(found.velocity_m_s, flip * true.velocity_m_s, atol=1e-12)
    np.testing.assert_allclose(found.turn_rad_s, flip * true.turn_rad_s, atol=1e-12)
    ahead = np.array([1.0, 0.5, 0.2])
    seen = rotations.rotate(found.tracker_from_station, ahead)
    np.testing.assert_allclose(seen, flip * rotations.rotate(true.world_from_station, ahead), atol=1e-12)


def test_configurations_are_those_of_the_trajectory(boxer: tuple[Body, BodyMotion]) -> None:
    time_s = np.array([-0.7, 0.3, 2.0])
    found = source_of(boxer, Noise()).qpos(time_s)
    assert np.array_equal(found, Trajectory(*boxer).with_lead_in(1.0).qpos(time_s))


@pytest.mark.parametrize("noise", [Noise(), EVERYTHING], ids=["bare", "worn"])
@pytest.mark.parametrize("ticks", [5, 35, 500])
def test_blocks_of_any_size_give_the_same_bytes(boxer: tuple[Body, BodyMotion], noise: Noise, ticks: int) -> None:
    time_s = ticks_s(-1.0, 4.0)
    whole = in_blocks(source_of(boxer, noise), time_s, len(time_s))
    parts = in_blocks(source_of(boxer, noise), time_s, ticks)
    for one, other in zip(whole, parts, strict=True):
        assert one.tobytes() == other.tobytes()


def test_orientations_have_no_flips_between_blocks(boxer: tuple[Body, BodyMotion]) -> None:
    source, time_s = source_of(boxer, Noise()), ticks_s(-1.0, 12.0)
    turns = [
        source.sample_motion(time_s[first : first + 6]).tracker_from_station for first in range(0, len(time_s) - 1, 5)
    ]
    turn = np.concatenate([*(block[:-1] for block in turns)])
    assert (np.sum(turn[1:] * turn[:-1], axis=-1) > 0.9).all()
    for block, following in pairwise(turns):
        assert np.array_equal(block[-1], following[0])


def test_times_outside_the_trajectory_are_refused(boxer: tuple[Body, BodyMotion]) -> None:
    with pytest.raises(BadInput, match="outside the take"):
        source_of(boxer, Noise()).sample_motion(ticks_s(-2.0, 0.0))


def central_differences(motion: TrackerMotion) -> tuple[Floats, Floats]:
    """Velocity [m/s] and angular velocity [rad/s] from positions and orientations at the inner ticks."""
    apart_s = (motion.time_s[2:] - motion.time_s[:-2])[:, None, None]
    turn = motion.tracker_from_station
    spin = rotations.log(rotations.multiply(turn[2:], rotations.inverse(turn[:-2])))
    return (motion.position_m[2:] - motion.position_m[:-2]) / apart_s, spin / apart_s


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
    components = StationDisplacement(
        COMPONENTS[name], stations, skin, tick_hz=1.0 / STEP_S, ends_s=1.0, seed=3, take="t"
    )
    motion = turning(3, time_s)
    phase = time_s[:, None, None] * np.array([11.0, 17.0, 23.0])
    components.apply(motion, 30.0 * np.sin(phase) * np.array([[1.0], [0.5], [2.0]]))
    slope, spin = central_differences(motion)
    assert np.abs(slope - motion.velocity_m_s[1:-1]).max() < 1e-5
    assert np.abs(spin - motion.turn_rad_s[1:-1]).max() < 1e-4


def test_the_derivative_holds_while_a_body_boxes(boxer: tuple[Body, BodyMotion]) -> None:
    """At 400 Hz central differences are coarse: the bound is a tenth of what a tissue adds."""
    time_s = ticks_s(0.0, 12.0)
    bare, moved = source_of(boxer, Noise()).sample_motion(time_s), source_of(boxer, TISSUE).sample_motion(time_s)
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
    StationDisplacement(
        Noise(soft_tissue=component), stations, skin, tick_hz=400.0, ends_s=2.0, seed=1, take="t"
    ).apply(motion, force)
    pace = 2 * np.pi * 5.0 * np.sqrt(0.04 / skin.tissue_m)[:, None] * [1.0, 1.0, 2.0]
    expected_m = soft_limit(simulate_oscillators(-force, pace, 0.3, 1.0 / 400.0), skin.tissue_m[:, None])
    found_m = rotations.rotate(rotations.inverse(turn), motion.position_m - before_m)
    np.testing.assert_allclose(found_m, expected_m, atol=1e-12)
    roll = rotations.log(rotations.multiply(rotations.inverse(turn), motion.tracker_from_station))
    np.testing.assert_allclose(roll[..., 0], -expected_m[..., 1] / skin.radius_m, atol=1e-9)
    np.testing.assert_allclose(roll[..., 1:], 0.0, atol=1e-9)


def test_tissue_is_still_while_the_performer_stands(boxer: tuple[Body, BodyMotion]) -> None:
    motion = source_of(boxer, TISSUE).sample_motion(ticks_s(-1.0, -0.41))
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
    StationDisplacement(noise, SIX, skin, tick_hz=40.0, ends_s=float(time_s.max()), seed=5, take=take.name).apply(
        motion, None
    )
    clear = np.all(np.abs(motion.position_m - read.position_m) < 1e-9, axis=-1)
    # while a strap slips, minimum jerk and uniform motion differ: half a second of twelve
    assert clear[-1].all()
    assert clear.mean() > (0.999 if component == "mount" else 0.94)
    assert rotations.angle_between_rad(motion.tracker_from_station, read.turn)[clear].max() < 1e-7


def test_a_mount_belongs_to_the_session() -> None:
    def mounted(take: str, session: str) -> Floats:
        motion, skin = turning(2, np.zeros(1)), Skin(np.ones(2), np.ones(2))
        noise = COMPONENTS["mount"]
        StationDisplacement(noise, "ab", skin, tick_hz=400.0, ends_s=1.0, seed=1, take=take, session=session).apply(
            motion, None
        )
        return motion.position_m

    assert np.array_equal(mounted("one", "day"), mounted("two", "day"))
    assert np.array_equal(mounted("day", ""), mounted("two", "day"))
    assert not np.isclose(mounted("one", "day"), mounted("one", "night")).any(axis=-1).all()


def test_a_slip_is_a_minimum_jerk_motion() -> None:
    share, pace = minimum_jerk_share(np.array([-1.0, 0.0, 1.0, 2.0, 3.0]), 2.0)
    np.testing.assert_allclose(share, [0.0, 0.0, 0.5, 1.0, 1.0])
    np.testing.assert_allclose(pace, [0.0, 0.0, 1.875 / 2.0, 0.0, 0.0])


def test_a_slip_of_a_station_that_is_not_worn_is_refused() -> None:
    with pytest.raises(UnknownName, match="torso"):
        StationDisplacement(
            Noise(mount_slip=(SLIP,)),
            ("head",),
            Skin(np.ones(1), np.ones(1)),
            tick_hz=400.0,
            ends_s=1.0,
            seed=1,
            take="t",
        )
