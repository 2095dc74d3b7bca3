"""Motion of worn trackers: that of the trajectory in the tracker's frame, alike in blocks of any size."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.simulate.components.mount import MountOffset, MountSlip, StrapSlip
from harness.simulate.components.soft_tissue import SoftTissueArtefact, skin_below
from harness.simulate.noise import Noise
from harness.simulate.physics.inertial import Inertial, InertialUnit, true_increments
from harness.simulate.physics.motion import TrackerMotion, TrackerMotionSource
from harness.simulate.physics.worn import BodyMotionSource, Worn
from harness.simulate.simulation import TrackerConfig, exact_calibration
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
    components = Worn(
        noise, calibration.stations, skin, tick_hz=TICK_HZ, ends_s=trajectory.duration_s, seed=1, take=take.name
    )
    return BodyMotionSource(trajectory, calibration, components)


def in_blocks(source: TrackerMotionSource, time_s: Floats, ticks: int) -> list[Floats]:
    """Motion and measured increments in blocks of this many ticks, with the tick that ends each block left out."""
    unit = InertialUnit(Inertial(), source.stations, seed=1, take="t")
    parts = []
    for first in range(0, len(time_s) - 1, ticks):
        motion = source.advance(time_s[first : first + ticks + 1])
        true = true_increments(motion, np.array([0.0, 0.015, 0.0]))
        measured = unit.measure(*true)
        arrays = motion.position_m, motion.tracker_from_station, motion.velocity_m_s, motion.turn_rad_s
        parts.append([*(array[:-1] for array in arrays), *true, *measured])
    return [np.concatenate(column) for column in zip(*parts, strict=True)]


def test_it_is_the_trajectory_in_the_frame_of_the_tracker(boxer: tuple[Body, BodyMotion]) -> None:
    body, take = boxer
    time_s = ticks_s(0.0, 2.0)
    found = source_of(boxer, Noise()).advance(time_s)
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


def test_one_station_more_leaves_the_others_alone(boxer: tuple[Body, BodyMotion]) -> None:
    time_s = ticks_s(-1.0, 4.0)
    six = in_blocks(source_of(boxer, EVERYTHING), time_s, 500)
    seven = in_blocks(source_of(boxer, EVERYTHING, ("pelvis", *SIX)), time_s, 500)
    for one, other in zip(six, seven, strict=True):
        assert one.tobytes() == np.ascontiguousarray(other[:, 1:]).tobytes()


def test_orientations_have_no_flips_between_blocks(boxer: tuple[Body, BodyMotion]) -> None:
    source, time_s = source_of(boxer, Noise()), ticks_s(-1.0, 12.0)
    turns = [source.advance(time_s[first : first + 6]).tracker_from_station for first in range(0, len(time_s) - 1, 5)]
    turn = np.concatenate([*(block[:-1] for block in turns)])
    assert (np.sum(turn[1:] * turn[:-1], axis=-1) > 0.9).all()
    for block, following in pairwise(turns):
        assert np.array_equal(block[-1], following[0])


def test_times_outside_the_trajectory_are_refused(boxer: tuple[Body, BodyMotion]) -> None:
    with pytest.raises(BadInput, match="outside the take"):
        source_of(boxer, Noise()).advance(ticks_s(-2.0, 0.0))


def central_differences(motion: TrackerMotion) -> tuple[Floats, Floats]:
    """Velocity [m/s] and angular velocity [rad/s] from positions and orientations at the inner ticks."""
    apart_s = (motion.time_s[2:] - motion.time_s[:-2])[:, None, None]
    turn = motion.tracker_from_station
    spin = rotations.log(rotations.multiply(turn[2:], rotations.inverse(turn[:-2])))
    return (motion.position_m[2:] - motion.position_m[:-2]) / apart_s, spin / apart_s
