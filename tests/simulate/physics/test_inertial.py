"""Inertial sensors: true increments against MuJoCo and dead reckoning, errors against their Allan deviations."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from harness.body import Body, joint_offsets_m
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.core.package_data import data_folder
from harness.simulate.noise import Noise
from harness.simulate.physics.inertial import Accelerometer, Gyroscope, Inertial, InertialUnit, true_increments
from harness.simulate.physics.motion import TrackerMotion
from harness.simulate.physics.settings import Physics
from harness.simulate.simulation import TrackerConfig, exact_calibration
from harness.simulate.trajectory import Trajectory
from tests.simulate.conftest import worn
from tests.simulate.physics.test_station_displacement import TICK_HZ, TISSUE, source_of, ticks_s

LEVER_M = np.array([0.01, 0.015, -0.005])
GRAVITY_M_S2 = np.array([0.0, 0.0, 9.81])
CLEAN = Physics().with_preset("clean").inertial
GAUSS = np.polynomial.legendre.leggauss(3)


class Sensors:
    """MuJoCo's accelerometer and gyroscope on a body, at the inertial unit of one station."""

    def __init__(self, body: Body, take: BodyMotion, station: str) -> None:
        calibration = exact_calibration(body, worn(station), TrackerConfig())
        spec = mujoco.MjSpec.from_file(str(data_folder("models") / "humanoid24" / "humanoid24.xml"))
        for name, start_m in zip(body.skeleton.names, joint_offsets_m(body.skeleton), strict=True):
            spec.body(name).pos = start_m
        for name, axis in zip(body.skeleton.dof_names, body.skeleton.axes, strict=True):
            spec.joint(name).axis = axis
        turn = calibration.bone_from_station[0]
        place_m = calibration.mount_m[0] + rotations.rotate(turn, LEVER_M)
        spec.body(calibration.bones[0]).add_site(name="unit", pos=place_m, quat=turn)
        for kind in (mujoco.mjtSensor.mjSENS_ACCELEROMETER, mujoco.mjtSensor.mjSENS_GYRO):
            spec.add_sensor(name=str(kind), type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="unit")
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._trajectory = Trajectory(body, take)

    def read(self, time_s: float) -> tuple[Floats, Floats, Floats]:
        """Specific force (3,) [m/s^2] and rate (3,) [rad/s] in the station's axes, and the station's axes (3, 3)."""
        at = np.array([time_s])
        self._data.qpos[:] = self._trajectory.qpos(at)[0]
        self._data.qvel[:] = self._trajectory.qvel(at)[0]
        self._data.qacc[:] = self._trajectory.qacc(at)[0]
        mujoco.mj_inverse(self._model, self._data)
        force, rate = self._data.sensordata.reshape(2, 3).copy()
        return force, rate, self._data.site_xmat[0].reshape(3, 3).copy()


@pytest.mark.parametrize("station", ["left_wrist", "right_ankle", "head"])
def test_increments_are_integrals_of_the_sensors_of_mujoco(boxer: tuple[Body, BodyMotion], station: str) -> None:
    """Per second of the interval: 1e-6 m/s^2 and 1e-6 rad/s."""
    body, take = boxer
    sensors = Sensors(body, take, station)
    # a fourth of a frame, so that no interval contains a knot of the spline
    step_s = 1.0 / (4 * take.rate_hz)
    compared = 0
    for first in range(40, 4 * len(take) - 8, 371):
        time_s = step_s * np.arange(first, first + 2.0)
        motion = source_of(boxer, Noise(), (station,)).sample_motion(time_s)
        angle_rad, gain_m_s = true_increments(motion, LEVER_M)
        axes_before = sensors.read(time_s[0])[2]
        moments_s = time_s[0] + 0.5 * step_s * (1.0 + GAUSS[0])
        force, rate, axes = (np.array(column) for column in zip(*map(sensors.read, moments_s), strict=True))
        turned = axes_before.T @ axes
        expected = np.einsum("n,nij,nj->i", 0.5 * GAUSS[1], turned, force)
        np.testing.assert_allclose(gain_m_s[0, 0] / step_s, expected, atol=1e-6)
        # in the axes at the beginning, the angle's derivative is the rate there, but for terms of the third order
        mean = 0.5 * GAUSS[1] @ rate
        slope = (rate[2] - rate[0]) / (GAUSS[0][2] - GAUSS[0][0]) * 2.0
        coning = step_s / 12.0 * np.cross(mean, slope)
        np.testing.assert_allclose(angle_rad[0, 0] / step_s, mean + coning, atol=1e-6)
        compared += 1
    assert compared > 10


@pytest.mark.parametrize("station", ["left_wrist", "right_ankle", "torso"])
def test_force_and_rate_are_those_of_the_sensors_of_mujoco(boxer: tuple[Body, BodyMotion], station: str) -> None:
    """At an instant: the unit's velocity has MuJoCo's acceleration, and the station MuJoCo's turn rate."""
    body, take = boxer
    sensors = Sensors(body, take, station)
    calibration = exact_calibration(body, worn(station), TrackerConfig())
    arm_m = rotations.rotate(calibration.bone_from_station, LEVER_M)
    at_unit = replace(calibration, mount_m=calibration.mount_m + arm_m)
    time_s = np.linspace(0.1, 11.9, 60)
    true = Trajectory(body, take).station_motion(at_unit, time_s[:, None])
    station_from_world = rotations.inverse(true.world_from_station[:, 0])
    force = rotations.rotate(station_from_world, true.acceleration_m_s2[:, 0] + GRAVITY_M_S2)
    rate = rotations.rotate(station_from_world, true.turn_rad_s[:, 0])
    motion = source_of(boxer, Noise(), (station,)).sample_motion(time_s)
    velocity_m_s = motion.points(LEVER_M)[1][:, 0] * [1.0, -1.0, -1.0]
    np.testing.assert_allclose(velocity_m_s, true.velocity_m_s[:, 0], atol=1e-9)
    for row, moment_s in enumerate(time_s):
        expected_force, expected_rate, _ = sensors.read(float(moment_s))
        np.testing.assert_allclose(force[row], expected_force, atol=1e-6)
        np.testing.assert_allclose(rate[row], expected_rate, atol=1e-6)


@pytest.mark.parametrize("noise", [Noise(), TISSUE], ids=["bare", "tissue"])
def test_dead_reckoning_without_noise(boxer: tuple[Body, BodyMotion], noise: Noise) -> None:
    """From the true first state, ten seconds of boxing stay within 2 mm and 0.01 deg."""
    motion = source_of(boxer, noise).sample_motion(ticks_s(-0.5, 11.0))
    unit = InertialUnit(CLEAN, ("",) * 6, seed=1, take="t")
    angle_rad, gain_m_s = unit.measure_increments(*true_increments(motion, LEVER_M))
    place_m, speed_m_s = (column[0] for column in motion.points(LEVER_M))
    turn = motion.tracker_from_station[0]
    for angle, gain in zip(angle_rad, gain_m_s, strict=True):
        faster_m_s = speed_m_s + rotations.rotate(turn, gain) + GRAVITY_M_S2 / TICK_HZ
        place_m = place_m + 0.5 * (speed_m_s + faster_m_s) / TICK_HZ
        speed_m_s, turn = faster_m_s, rotations.multiply(turn, rotations.exp(angle))
    origin_m = place_m - rotations.rotate(turn, LEVER_M)
    assert np.linalg.norm(origin_m - motion.position_m[-1], axis=-1).max() < 2e-3
    assert np.rad2deg(rotations.angle_between_rad(turn, motion.tracker_from_station[-1])).max() < 0.01


def test_a_station_at_rest_measures_gravity_alone() -> None:
    """The force that holds it up, in its own axes: a station that faces up measures it along z."""
    still = np.zeros((9, 1, 3))
    turn = np.tile([0.0, 1.0, 0.0, 0.0], (9, 1, 1))
    angle_rad, gain_m_s = true_increments(TrackerMotion(np.arange(9) / 400, still, turn, still, still), LEVER_M)
    np.testing.assert_allclose(angle_rad, 0.0, atol=1e-15)
    np.testing.assert_allclose(400 * gain_m_s, np.broadcast_to(GRAVITY_M_S2, (8, 1, 3)), atol=1e-9)


def test_without_errors_a_unit_measures_the_truth() -> None:
    rng = np.random.default_rng(2)
    true = rng.normal(size=(2, 50, 3, 3))
    for one, other in zip(true, InertialUnit(CLEAN, "abc", seed=1, take="t").measure_increments(*true), strict=True):
        assert np.array_equal(one, other)


QUIET = dict.fromkeys(("white", "bias_instability", "random_walk", "turn_on", "scale", "misalignment_rad"), 0.0)


def with_errors(**errors: float) -> Inertial:
    """Settings with these errors alone, of both triads."""
    values = QUIET | {"correlation_s": 1.0, "limit": 1e6} | errors
    return Inertial(gyroscope=Gyroscope(**values), accelerometer=Accelerometer(**values))


def measured(settings: Inertial, true: Floats, stations: int) -> Floats:
    """Measured increments (2, T, S, 3) for the same true ones of both triads."""
    names = tuple(f"s{s}" for s in range(stations))
    return np.array(InertialUnit(settings, names, seed=4, take="t", session="day").measure_increments(true, true))


def test_values_beyond_the_limit_are_cut() -> None:
    true = np.array([[[5.0, -5.0, 0.5]]]) / 400
    np.testing.assert_allclose(400 * measured(with_errors(limit=2.0), true, 1)[0, 0, 0], [2.0, -2.0, 0.5])


def test_constant_errors_have_their_standard_deviations() -> None:
    """Scale, misalignment and turn-on bias, from 400 stations; within 10 %."""
    unit_vectors = np.broadcast_to(np.eye(3)[:, None], (3, 400, 3)) / 400
    still = np.zeros((1, 400, 3))
    settings = with_errors(scale=2e-3, misalignment_rad=5e-3, turn_on=0.3)
    bias = 400 * measured(settings, still, 400)[:, 0]
    matrix = 400 * measured(settings, unit_vectors, 400) - bias[:, None]
    assert np.std(bias, axis=(1, 2)) == pytest.approx([0.3, 0.3], rel=0.1)
    on_axis = matrix[:, [0, 1, 2], :, [0, 1, 2]]
    assert np.std(on_axis) == pytest.approx(2e-3, rel=0.1)
    assert np.mean(on_axis) == pytest.approx(1.0, abs=3e-4)
    assert np.std(matrix[:, [0, 1, 2, 0, 1, 2], :, [1, 2, 0, 2, 0, 1]]) == pytest.approx(5e-3, rel=0.1)
    assert abs(np.mean(bias)) < 0.03


def test_misaligned_axes_keep_their_scale() -> None:
    """The axes of a triad are unit vectors, however oblique: they differ from the scale error."""
    unit_vectors = np.broadcast_to(np.eye(3)[:, None], (3, 5, 3)) / 400
    matrix = 400 * measured(with_errors(misalignment_rad=0.2), unit_vectors, 5)
    np.testing.assert_allclose(np.sum(matrix**2, axis=1), 1.0, atol=1e-12)
    assert np.abs(matrix[:, 0, :, 1]).min() > 1e-3


def test_constant_errors_belong_to_the_session() -> None:
    settings = with_errors(scale=2e-3, misalignment_rad=5e-3, turn_on=0.3)
    true = np.full((1, 2, 3), 0.01)

    def seen(take: str, session: str) -> Floats:
        return np.array(
            InertialUnit(settings, ("a", "b"), seed=4, take=take, session=session).measure_increments(true, true)
        )

    assert np.array_equal(seen("one", "day"), seen("two", "day"))
    assert not np.isclose(seen("one", "day"), seen("one", "night")).any()
    assert np.array_equal(seen("one", ""), seen("two", "one"))
    assert not np.isclose(seen("one", "day")[:, :, 0], seen("one", "day")[:, :, 1]).any()


STATIONS, LENGTH_S, RATE_HZ = 4, 4000.0, 100.0


def allan_variance(rate: Floats, spans: list[int]) -> Floats:
    """Overlapping Allan variance (len(spans),) of rates (T, N), mean of N, for averages over these numbers of steps."""
    angle = np.concatenate([np.zeros((1, rate.shape[1])), np.cumsum(rate, axis=0)]) / RATE_HZ
    out = []
    for span in spans:
        second = angle[2 * span :] - 2.0 * angle[span:-span] + angle[: -2 * span]
        out.append(np.mean(second**2) / (2.0 * (span / RATE_HZ) ** 2))
    return np.array(out)


def laws(span_s: Floats, correlation_s: float) -> Floats:
    """(3, N) Allan variance of unit white noise, unit Gauss-Markov bias and unit random walk (IEEE 952-1997 C)."""
    u = span_s / correlation_s
    markov = 2.0 / u * (1.0 - (3.0 - 4.0 * np.exp(-u) + np.exp(-2.0 * u)) / (2.0 * u))
    return np.stack([1.0 / span_s, markov, span_s / 3.0])


@pytest.fixture(scope="module")
def static_rates() -> Floats:
    """(2, T, N) rates of both triads of stations at rest for over an hour."""
    errors = {"white": 0.02, "bias_instability": 0.05, "correlation_s": 0.5, "random_walk": 0.004}
    settings = replace(with_errors(**errors), rate_hz=RATE_HZ)
    still = np.zeros((round(LENGTH_S * RATE_HZ), STATIONS, 3))
    return RATE_HZ * measured(settings, still, STATIONS).reshape(2, -1, 3 * STATIONS)


@pytest.mark.long
@pytest.mark.parametrize("triad", [0, 1])
def test_allan_deviation_recovers_each_parameter(static_rates: Floats, triad: int) -> None:
    """White noise, bias instability and random walk, fitted to one curve: each within 10 %."""
    spans = np.unique(np.round(np.geomspace(1, 60 * RATE_HZ, 40)).astype(int))
    found = allan_variance(static_rates[triad], spans.tolist())
    model = laws(spans / RATE_HZ, 0.5)
    squares = np.linalg.lstsq((model / found).T, np.ones(len(spans)), rcond=None)[0]
    np.testing.assert_allclose(np.sqrt(squares), [0.02, 0.05, 0.004], rtol=0.1)


@pytest.mark.long
def test_allantools_computes_the_same_deviation(static_rates: Floats) -> None:
    allantools = pytest.importorskip("allantools", reason="allantools is not installed (extra `dev`)")
    spans = [1, 7, 50, 400, 3000]
    ours = np.sqrt(allan_variance(static_rates[0][:, :1], spans))
    theirs = allantools.oadev(static_rates[0][:, 0], rate=RATE_HZ, data_type="freq", taus=np.array(spans) / RATE_HZ)[1]
    np.testing.assert_allclose(ours, theirs, rtol=1e-9)
