"""The trajectory: through every frame, twice differentiable, and consistent with MuJoCo."""

import mujoco
import numpy as np
import pytest

from harness.body import Body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.simulate.noise import noise_preset
from harness.simulate.simulation import TrackerConfig, simulate_tracker
from harness.simulate.trajectory import Trajectory
from tests.simulate.conftest import worn

STEP_S = 1e-5


@pytest.fixture(scope="module")
def trajectory(boxer: tuple[Body, BodyMotion]) -> Trajectory:
    return Trajectory(*boxer)


@pytest.fixture(scope="module")
def moments_s(trajectory: Trajectory) -> Floats:
    out: Floats = np.linspace(0.1, trajectory.duration_s - 0.1, 97) + 0.0013
    return out


def test_it_goes_through_every_frame(boxer: tuple[Body, BodyMotion], trajectory: Trajectory) -> None:
    _, take = boxer
    qpos = trajectory.qpos(np.arange(len(take)) / take.rate_hz)
    assert np.abs(qpos[:, :3] - take.qpos[:, :3]).max() < 1e-9
    assert rotations.angle_between_rad(qpos[:, 3:7], take.qpos[:, 3:7]).max() < 1e-9
    assert np.abs(qpos[:, 7:] - take.qpos[:, 7:]).max() < 1e-9
    assert trajectory.duration_s == pytest.approx((len(take) - 1) / take.rate_hz)


def test_velocity_is_the_slope_of_position(
    boxer: tuple[Body, BodyMotion], trajectory: Trajectory, moments_s: Floats
) -> None:
    body, _ = boxer
    before, after = trajectory.qpos(moments_s - STEP_S), trajectory.qpos(moments_s + STEP_S)
    slope = np.empty((len(moments_s), body.model.nv))
    for row, one, other in zip(slope, before, after, strict=True):
        mujoco.mj_differentiatePos(body.model, row, 2.0 * STEP_S, one, other)
    assert np.abs(slope - trajectory.qvel(moments_s)).max() < 1e-5


def test_acceleration_is_the_slope_of_velocity(trajectory: Trajectory, moments_s: Floats) -> None:
    slope = (trajectory.qvel(moments_s + STEP_S) - trajectory.qvel(moments_s - STEP_S)) / (2.0 * STEP_S)
    assert np.abs(slope - trajectory.qacc(moments_s)).max() < 1e-3 * np.abs(slope).max()


def test_acceleration_does_not_jump_at_frames(boxer: tuple[Body, BodyMotion], trajectory: Trajectory) -> None:
    """Twice continuously differentiable: the step over a frame is what the third derivative makes of 2 us."""
    _, take = boxer
    frames_s = np.arange(1, len(take) - 1) / take.rate_hz
    step = np.abs(trajectory.qacc(frames_s + 1e-6) - trajectory.qacc(frames_s - 1e-6)).max()
    wide = np.abs(trajectory.qacc(frames_s + 1e-3) - trajectory.qacc(frames_s - 1e-3)).max()
    assert step < 5e-3 * wide


@pytest.mark.parametrize("station", ["left_hand", "right_ankle", "left_foot", "torso", "head", "pelvis"])
def test_stations_move_as_mujoco_says(
    boxer: tuple[Body, BodyMotion], trajectory: Trajectory, moments_s: Floats, station: str
) -> None:
    """Place, velocity and acceleration of a station, against mj_forward on the same configuration: under 1e-6."""
    body, take = boxer
    calibration = simulate_tracker(
        body, take, worn(station), TrackerConfig(), noise_preset("clean"), seed=1
    ).calibration
    motion = trajectory.station_motion(calibration, moments_s[:, None])
    model, data = body.model, mujoco.MjData(body.model)
    bone = int(body.bone_body_ids[body.skeleton.index(calibration.bones[0])])
    qpos, qvel, qacc = (f(moments_s) for f in (trajectory.qpos, trajectory.qvel, trajectory.qacc))
    for i in range(0, len(moments_s), 8):
        data.qpos[:], data.qvel[:] = qpos[i], qvel[i]
        mujoco.mj_forward(model, data)
        data.qacc[:] = qacc[i]
        mujoco.mj_rnePostConstraint(model, data)
        bone_turn, reach_m = data.xmat[bone].reshape(3, 3), calibration.mount_m[0]
        reach_m = bone_turn @ reach_m
        both = np.empty(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, bone, both, 0)
        turning, speed = both[:3].copy(), both[3:].copy()
        mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_XBODY, bone, both, 0)
        swelling, thrust = both[:3].copy(), both[3:] + model.opt.gravity
        swing = np.cross(turning, reach_m)
        expected = (
            data.xpos[bone] + reach_m,
            speed + swing,
            thrust + np.cross(swelling, reach_m) + np.cross(turning, swing),
            turning,
        )
        found = (motion.position_m, motion.velocity_m_s, motion.acceleration_m_s2, motion.turn_rad_s)
        for ours, theirs in zip(found, expected, strict=True):
            assert np.abs(ours[i, 0] - theirs).max() < 1e-6
        turned = rotations.multiply(data.xquat[bone], calibration.bone_from_station[0])
        assert rotations.angle_between_rad(motion.world_from_station[i, 0], turned) < 1e-6


def test_orientation_has_no_flips(trajectory: Trajectory, boxer: tuple[Body, BodyMotion]) -> None:
    body, take = boxer
    seen = simulate_tracker(body, take, worn(), TrackerConfig(), noise_preset("clean"), seed=1)
    time_s = np.repeat(np.linspace(0.0, trajectory.duration_s, 2000)[:, None], 6, axis=1)
    turn = trajectory.station_motion(seen.calibration, time_s).world_from_station
    assert (np.sum(turn[1:] * turn[:-1], axis=-1) > 0.9).all()


@pytest.mark.parametrize("moment_s", [-0.01, 1e6, np.nan])
def test_moments_outside_the_take_are_refused(trajectory: Trajectory, moment_s: float) -> None:
    with pytest.raises(BadInput, match="outside the take"):
        trajectory.qpos(np.array([1.0, moment_s]))


def test_one_frame_is_no_motion(boxer: tuple[Body, BodyMotion]) -> None:
    body, take = boxer
    with pytest.raises(BadInput, match="at least two"):
        Trajectory(body, BodyMotion("short", "p1", "test", "", 120.0, take.qpos[:1]))


def jump(trajectory: Trajectory, moment_s: float) -> tuple[float, float]:
    """Steps of position and velocity over a moment, less what the motion itself makes of 2 ns."""
    around = moment_s + np.array([-1e-9, 1e-9])
    place, speed = trajectory.qpos(around), trajectory.qvel(around)
    return np.abs(place[1] - place[0]).max(), np.abs(speed[1] - speed[0]).max()


def motions(trajectory: Trajectory, time_s: Floats) -> list[Floats]:
    return [trajectory.qpos(time_s), trajectory.qvel(time_s), trajectory.qacc(time_s)]


def test_a_lead_in_rests_in_the_first_pose_and_joins_the_take(
    boxer: tuple[Body, BodyMotion], trajectory: Trajectory
) -> None:
    led = trajectory.with_lead_in(3.0)
    assert (led.begins_s, led.ends_s) == (-3.0, trajectory.duration_s)
    still = led.qpos(np.array([-3.0, -1.7, -0.4]))
    np.testing.assert_allclose(still, np.tile(trajectory.qpos(np.zeros(1)), (3, 1)), atol=1e-12)
    assert np.array_equal(led.qvel(np.array([-3.0, -1.7, -0.4])), np.zeros((3, 54)))
    assert np.abs(trajectory.qvel(np.zeros(1))).max() > 0.1
    for moment_s in (-0.4, 0.0):
        place, speed = jump(led, moment_s)
        assert place < 1e-7
        assert speed < 1e-6


@pytest.mark.parametrize("change", ["lead_in", "lead_out", "return", "all"])
def test_the_take_itself_stays_as_it_is(boxer: tuple[Body, BodyMotion], trajectory: Trajectory, change: str) -> None:
    """To the bit, with whatever is added around it."""
    changed = {
        "lead_in": lambda: trajectory.with_lead_in(2.0),
        "lead_out": lambda: trajectory.with_lead_out(1.0),
        "return": lambda: trajectory.with_return(trajectory.duration_s + 2.0),
        "all": lambda: trajectory.with_return(trajectory.duration_s + 2.0).with_lead_in(2.0),
    }[change]()
    time_s = np.linspace(0.0, trajectory.duration_s - 1e-9, 3001)
    for one, other in zip(motions(trajectory, time_s), motions(changed, time_s), strict=True):
        assert one.tobytes() == other.tobytes()
    calibration = simulate_tracker(*boxer, worn(), TrackerConfig(), noise_preset("clean"), seed=1).calibration
    each_s = np.repeat(time_s[:, None], 6, axis=1)
    true, led = (t.station_motion(calibration, each_s) for t in (trajectory, changed))
    for name in ("position_m", "world_from_station", "velocity_m_s", "acceleration_m_s2", "turn_rad_s"):
        assert getattr(true, name).tobytes() == getattr(led, name).tobytes()


def test_a_lead_out_comes_to_rest_in_the_last_pose(trajectory: Trajectory) -> None:
    out = trajectory.with_lead_out(1.0)
    end_s = trajectory.duration_s
    assert out.ends_s == pytest.approx(end_s + 1.0)
    for moment_s in (end_s, end_s + 0.3):
        place, speed = jump(out, moment_s)
        assert place < 1e-7
        assert speed < 1e-6
    np.testing.assert_allclose(out.qpos(end_s + np.array([0.3, 1.0])), out.qpos(np.array([end_s] * 2)), atol=1e-12)


def test_a_return_joins_end_and_beginning(trajectory: Trajectory) -> None:
    loop_s = trajectory.duration_s + 2.0
    back = trajectory.with_return(loop_s)
    for moment_s in (trajectory.duration_s, trajectory.duration_s + 0.3, loop_s - 0.4, loop_s):
        place, speed = jump(back, moment_s)
        assert place < 1e-7
        assert speed < 1e-6
    first_s = np.linspace(0.0, 0.04, 9)
    for one, other in zip(motions(back, first_s), motions(back, loop_s + first_s), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6 * np.abs(one).max())


def test_a_performer_who_has_turned_goes_back_without_a_jump(boxer: tuple[Body, BodyMotion]) -> None:
    """After a whole turn the root's quaternion has the other sign, which its spline must carry to the end."""
    body, take = boxer
    qpos = np.array(take.qpos)
    yaw = np.linspace(0.0, 2.0 * np.pi, len(take))
    qpos[:, 3:7] = rotations.multiply(rotations.about_z(yaw), qpos[:, 3:7])
    trajectory = Trajectory(body, BodyMotion("turn", "p1", "test", "", take.rate_hz, qpos))
    loop_s = trajectory.duration_s + 2.0
    time_s = np.arange(trajectory.duration_s, loop_s + 0.04, 1e-3)
    back = trajectory.with_return(loop_s)
    assert np.abs(back.qvel(time_s)[:, 3:6]).max() < 10.0
    turn = back.spline(time_s)[:, 3:7]
    products = np.sum(turn[1:] * turn[:-1], axis=1)
    assert 0.99 < products.min() <= products.max() < 1.01


def test_a_take_of_two_frames_has_a_return(boxer: tuple[Body, BodyMotion]) -> None:
    """Shorter than the time for which it goes on into its next round: it stops, and jumps nowhere."""
    body, take = boxer
    short = Trajectory(body, BodyMotion("short", "p1", "test", "", take.rate_hz, take.qpos[600:602]))
    back = short.with_return(2.0)
    assert back.ends_s > 2.4
    for moment_s in (0.3 + short.duration_s, 2.0, 2.0 + short.duration_s):
        place, speed = jump(back, moment_s)
        assert place < 1e-7
        assert speed < 1e-6


@pytest.mark.parametrize("make", ["lead_in", "lead_out", "return"])
def test_too_short_rests_are_refused(trajectory: Trajectory, make: str) -> None:
    with pytest.raises(BadInput, match="too short"):
        {
            "lead_in": lambda: trajectory.with_lead_in(0.4),
            "lead_out": lambda: trajectory.with_lead_out(0.3),
            "return": lambda: trajectory.with_return(trajectory.duration_s + 0.7),
        }[make]()
