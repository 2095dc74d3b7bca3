"""True motion of the stations that a performer wears, and what is worn: soft tissue, mount errors and slips.

The components are those of the statistical noise, with the same draws. Here they act at every tick of the inertial
sensors, and velocity and turn rate are the derivatives of position and orientation. So a slip needs a duration.
"""

import math
from collections.abc import Sequence

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.core.seeds import generator
from harness.errors import UnknownName
from harness.simulate.components.mount import MountSlip
from harness.simulate.components.soft_tissue import (
    Skin,
    SoftTissueArtefact,
    free_response,
    natural_frequency_rad_s,
    tissue_force_m_s2,
)
from harness.simulate.noise import Noise
from harness.simulate.physics.motion import TrackerMotion, station_chain, station_states
from harness.simulate.trajectory import Trajectory


class StationDisplacement:
    """The worn components of a noise on S stations. It carries state: `apply` takes block after block.

    `ends_s` is the last sampling time of the take, by which random slips are timed [s]. UnknownName for a slip of a
    station that is not worn. `Noise` refuses slips in no time, whose acceleration is infinite.
    """

    def __init__(
        self,
        noise: Noise,
        stations: Sequence[str],
        skin: Skin,
        *,
        tick_hz: float,
        ends_s: float,
        seed: int,
        take: str,
        session: str = "",
    ) -> None:
        self._radius_m = skin.radius_m
        self._tissue = None if noise.soft_tissue is None else _TissueOscillators(noise.soft_tissue, skin, tick_hz)
        self._mount: tuple[Floats, Floats] | None = None
        if noise.mount is not None:
            keys = (("noise", session or take, "mount", station) for station in stations)
            draws = np.array([generator(seed, *key).normal(size=6) for key in keys])
            turn = rotations.exp(noise.mount.orientation_rad * draws[:, 3:])
            self._mount = noise.mount.position_m * draws[:, :3], turn
        slips: list[MountSlip] = []
        if noise.strap_slip is not None:
            for station in stations:
                rng = generator(seed, "noise", take, "loose", station)
                slip = noise.strap_slip.draw(rng, station, 0.0, ends_s)
                slips += [] if slip is None else [slip]
        for slip in noise.mount_slip:
            if slip.station not in stations:
                raise UnknownName("station", slip.station, stations)
        self._slips = [(slip, list(stations).index(slip.station)) for slip in (*slips, *noise.mount_slip)]

    @property
    def has_tissue(self) -> bool:
        """Whether soft tissue moves, which needs the force on it."""
        return self._tissue is not None

    def apply(self, motion: TrackerMotion, force_m_s2: Floats | None) -> None:
        """Change the motion of a block in place, from the bone outwards.

        `force_m_s2` (T+1, S, 3) is `skin.tissue_force_m_s2` at the ticks; it is needed where tissue moves.
        """
        everyone = slice(None)
        if self._tissue is not None and force_m_s2 is not None:
            shift_m, speed_m_s = self._tissue.displacement(force_m_s2)
            _translate(motion, everyone, shift_m, speed_m_s)
            # The bone runs along x, `radius_m` below: a shift of y around it rotates the station about x by -y/radius.
            _rotate_about_bone(motion, everyone, -shift_m[..., 1] / self._radius_m, -speed_m_s[..., 1] / self._radius_m)
        if self._mount is not None:
            offset_m, turn = self._mount
            _translate(motion, everyone, offset_m, np.zeros(3))
            motion.tracker_from_station[:] = rotations.multiply(motion.tracker_from_station, turn)
        for slip, row in self._slips:
            share, pace = minimum_jerk_share(motion.time_s - slip.from_s, slip.over_s)
            angle, rate = slip.around_rad * share, slip.around_rad * pace
            radius_m = self._radius_m[row]
            # In the station's axes the bone runs along x, `radius_m` below the origin.
            offset_m = np.stack([slip.along_m * share, -radius_m * np.sin(angle), radius_m * (np.cos(angle) - 1.0)], 1)
            swing_m_s = -radius_m * rate
            speed_m_s = np.stack([slip.along_m * pace, swing_m_s * np.cos(angle), swing_m_s * np.sin(angle)], 1)
            _translate(motion, row, offset_m, speed_m_s)
            _rotate_about_bone(motion, row, angle, rate)


def minimum_jerk_share(since_s: Floats, over_s: float) -> tuple[Floats, Floats]:
    """Share (N,) of a minimum-jerk motion done at times since its beginning [s], and its derivative [1/s]."""
    t = np.clip(since_s / over_s, 0.0, 1.0)
    return t * t * t * (10.0 - 15.0 * t + 6.0 * t * t), 30.0 * (t * (1.0 - t)) * (t * (1.0 - t)) / over_s


class _TissueOscillators:
    """Oscillators of S stations, each with position and velocity; they start in the first push's equilibrium."""

    def __init__(self, component: SoftTissueArtefact, skin: Skin, tick_hz: float) -> None:
        self._pace = natural_frequency_rad_s(component, skin.tissue_m)
        self._damping, self._step_s = component.damping, 1.0 / tick_hz
        self._response = free_response(self._pace, component.damping, self._step_s)
        self._tissue_m = np.array(skin.tissue_m)
        self._state: Floats | None = None

    def displacement(self, force_m_s2: Floats) -> tuple[Floats, Floats]:
        """Displacement [m] and velocity [m/s] (T+1, S, 3) in the station's axes at the ticks of a block."""
        push = -force_m_s2
        if self._state is None:
            self._state = np.stack([push[0] / self._pace**2, np.zeros_like(push[0])])
        shift_m, speed_m_s = np.empty_like(push), np.empty_like(push)
        _oscillate(push, self._pace, self._damping, self._step_s, self._response, self._state, shift_m, speed_m_s)
        _limit(self._tissue_m, shift_m, speed_m_s)
        return shift_m, speed_m_s


@compiled
def _oscillate(
    push: Floats,
    pace: Floats,
    damping: float,
    step_s: float,
    response: Floats,
    state: Floats,
    shift_m: Floats,
    speed_m_s: Floats,
) -> None:
    """Position and velocity of each oscillator, as `components.soft_tissue.simulate_oscillators` solves it."""
    count, stations, _ = push.shape
    for s in range(stations):
        for a in range(3):
            w = pace[s, a]
            place, speed = state[0, s, a], state[1, s, a]
            shift_m[0, s, a], speed_m_s[0, s, a] = place, speed
            for k in range(1, count):
                slope = (push[k, s, a] - push[k - 1, s, a]) / (step_s * w * w)
                begin = push[k - 1, s, a] / (w * w) - 2.0 * damping / w * slope
                off, gain = place - begin, speed - slope
                place = begin + slope * step_s + response[0, 0, s, a] * off + response[0, 1, s, a] * gain
                speed = slope + response[1, 0, s, a] * off + response[1, 1, s, a] * gain
                shift_m[k, s, a], speed_m_s[k, s, a] = place, speed
            state[0, s, a], state[1, s, a] = place, speed


@compiled
def _limit(most_m: Floats, shift_m: Floats, speed_m_s: Floats) -> None:
    """`components.soft_tissue.soft_limit` of displacements in place, and its derivative for velocities."""
    count, stations, _ = shift_m.shape
    for k in range(count):
        for s in range(stations):
            x, y, z = shift_m[k, s]
            u, v, w = speed_m_s[k, s]
            length = max(math.sqrt(x * x + y * y + z * z), 1e-12)
            tanh = math.tanh(length / most_m[s])
            ratio = most_m[s] * tanh / length
            # d(ratio)/dt / length, with d(length)/dt = (x, y, z) (u, v, w) / length
            change = (1.0 - tanh * tanh - ratio) * (x * u + y * v + z * w) / (length * length)
            shift_m[k, s, 0], shift_m[k, s, 1], shift_m[k, s, 2] = ratio * x, ratio * y, ratio * z
            speed_m_s[k, s, 0] = ratio * u + change * x
            speed_m_s[k, s, 1] = ratio * v + change * y
            speed_m_s[k, s, 2] = ratio * w + change * z


def _translate(motion: TrackerMotion, row: int | slice, offset_m: Floats, speed_m_s: Floats) -> None:
    """Move stations by offsets in their axes [m], which change at a speed [m/s]."""
    turn = motion.tracker_from_station[:, row]
    arm_m = rotations.rotate(turn, offset_m)
    motion.position_m[:, row] += arm_m
    motion.velocity_m_s[:, row] += rotations.cross(motion.turn_rad_s[:, row], arm_m) + rotations.rotate(turn, speed_m_s)


def _rotate_about_bone(motion: TrackerMotion, row: int | slice, angle_rad: Floats, rate_rad_s: Floats) -> None:
    """Rotate stations about their x axis by angles [rad], which change at a rate [rad/s]."""
    axis, turn = np.array([1.0, 0.0, 0.0]), motion.tracker_from_station[:, row]
    motion.turn_rad_s[:, row] += rotations.rotate(turn, rate_rad_s[..., None] * axis)
    motion.tracker_from_station[:, row] = rotations.multiply(turn, rotations.exp(angle_rad[..., None] * axis))


class BodyMotionSource:
    """A `TrackerMotionSource`: the stations of a calibration on a trajectory, with what `worn` does to them."""

    def __init__(self, trajectory: Trajectory, calibration: Calibration, displacement: StationDisplacement) -> None:
        self.stations = calibration.stations
        self._trajectory, self._calibration, self._displacement = trajectory, calibration, displacement
        self._chain = station_chain(trajectory.body.skeleton, calibration)
        self._pieces: Floats = np.ascontiguousarray(trajectory.spline.c)
        self._knots_s: Floats = np.ascontiguousarray(trajectory.spline.x)

    def sample_motion(self, time_s: Floats) -> TrackerMotion:
        """Motion at the ticks (T+1,) of the next block [s]; BadInput outside the trajectory."""
        self._trajectory.require_inside(time_s)
        motion, acceleration_m_s2 = station_states(self._chain, self._pieces, self._knots_s, time_s)
        force_m_s2 = None
        if self._displacement.has_tissue:
            force_m_s2 = tissue_force_m_s2(
                motion.tracker_from_station, acceleration_m_s2, self._calibration, self._chain.tracker_from_world
            )
        self._displacement.apply(motion, force_m_s2)
        return motion

    def performer_m(self, time_s: Floats) -> Floats:
        """(F, 3) place of the body's root at F times [s]."""
        root_m = self._trajectory.qpos(time_s)[:, :3]
        return rotations.rotate(self._chain.tracker_from_world, root_m - self._chain.origin_m)

    def qpos(self, time_s: Floats) -> Floats:
        """(F, 55) configurations at F times [s]."""
        return self._trajectory.qpos(time_s)
