"""Simulated readings of a take that repeats without end: the take, then a motion back to its beginning.

The take's readings are those of `simulate_readings`. The return motion is a minimum-jerk motion from the last
configuration to the first (Flash & Hogan 1985), with noise of its own.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from harness.body import Body, Mount
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.simulate.calibration_motion import minimum_jerk
from harness.simulate.noise import Noise
from harness.simulate.physical_readings import filter_samples
from harness.simulate.physics.filter_settings import Fusion
from harness.simulate.readings import SimulatedReadings
from harness.simulate.rest_pieces import START_S, STOP_S
from harness.simulate.simulation import TrackerConfig, sampling_times_s, simulate_readings
from harness.simulate.trajectory import Trajectory
from harness.stream.polhemus.codec import DeviceSamples, FilterSamples

SHORTEST_RETURN_S, WALK_M_S, TURN_RAD_S = 1.0, 1.2, 2.0
"""Shortest duration of the return [s], and the walking speed and turning rate that may lengthen it."""
_BLEND_HZ = 120.0


def simulate_loop(
    body: Body,
    take: BodyMotion,
    mounts: Sequence[Mount],
    tracker: TrackerConfig,
    noise: Noise,
    *,
    seed: int,
    session: str = "",
) -> DeviceSamples:
    """Readings of a take and of the return to its beginning; BadInput when the take is shorter than one period.

    `session` has the meaning that it has in `simulate_tracker`.
    """
    if noise.physics is not None:
        return _simulate_physical_loop(body, take, mounts, tracker, noise, noise.physics.fusion, seed, session)
    trajectory = Trajectory(body, take)
    time_s = sampling_times_s(trajectory.duration_s, tracker, len(mounts))
    first = len(time_s)
    ends = trajectory.qpos(np.array([time_s[-1, 0], 0.0]))
    periods = int(np.ceil(_return_duration_s(ends[0], ends[1]) * tracker.rate_hz)) + 1
    slots_s = time_s[0]
    back = _return_motion(take, ends[0], ends[1], periods / tracker.rate_hz + float(slots_s[-1]))
    back_s = np.arange(1, periods)[:, None] / tracker.rate_hz + slots_s
    simulate = partial(simulate_readings, mounts=mounts, tracker=tracker, noise=noise, seed=seed, session=session)
    parts = (
        simulate(trajectory, time_s=time_s, take=take.name),
        simulate(Trajectory(body, back), time_s=back_s, take=back.name, begins_s=time_s[-1, 0]),
    )
    return _device_samples(parts, tracker, first)


def _simulate_physical_loop(
    body: Body,
    take: BodyMotion,
    mounts: Sequence[Mount],
    tracker: TrackerConfig,
    noise: Noise,
    fusion: Fusion,
    seed: int,
    session: str,
) -> DeviceSamples:
    """Readings of one loop by a physical tracker, which does not stop between take and way back."""
    trajectory, frames = loop_trajectory(body, take, tracker.rate_hz)
    taken_s = sampling_times_s(trajectory.duration_s, tracker, len(mounts))
    time_s = np.arange(frames)[:, None] / tracker.rate_hz + taken_s[0]
    readings = simulate_readings(
        *(trajectory, mounts, tracker, noise, time_s),
        seed=seed,
        take=take.name,
        ends_s=float(taken_s.max()),
        session=session,
    )
    return _device_samples([readings], tracker, len(taken_s), filter_samples(readings, fusion))


def _device_samples(
    parts: Sequence[SimulatedReadings], tracker: TrackerConfig, take_frames: int, samples: FilterSamples | None = None
) -> DeviceSamples:
    """The readings of a loop, part after part."""
    time_s, device_s, position_m, turn, quality = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("time_s", "device_s", "position_m", "turn", "quality")
    )
    return DeviceSamples(
        stations=parts[0].stations,
        rate_hz=tracker.rate_hz,
        take_frames=take_frames,
        taken_s=time_s,
        ready_s=tracker.latency_s,
        device_s=device_s,
        position_m=position_m,
        tracker_from_station=turn,
        quality=quality,
        filter=samples,
    )


def loop_trajectory(body: Body, take: BodyMotion, rate_hz: float) -> tuple[Trajectory, int]:
    """Trajectory of a take and of the way back in one piece, and the number of frames of a round.

    A round takes this number of periods of `rate_hz`; then the take begins again with its first position and velocity.
    Inertial sensors need that: they would measure a jump of the velocity as an infinite acceleration.
    """
    trajectory = Trajectory(body, take)
    ends = trajectory.qpos(np.array([trajectory.duration_s, 0.0]))
    least_s = trajectory.duration_s + STOP_S + _return_duration_s(ends[0], ends[1]) + START_S
    frames = int(np.ceil(least_s * rate_hz))
    return trajectory.with_return(frames / rate_hz), frames


def loop_motion(body: Body, take: BodyMotion, mounts: Sequence[Mount], tracker: TrackerConfig) -> BodyMotion:
    """The true motion of one loop of `simulate_loop` without physics, at 120 Hz or more: the take, then the way back.

    A reference for recordings of several loops. The way back ends within one frame of the loop's end.
    """
    trajectory = Trajectory(body, take)
    time_s = sampling_times_s(trajectory.duration_s, tracker, len(mounts))
    turn_s, slot_s = float(time_s[-1, 0]), float(time_s[0, -1])
    ends = trajectory.qpos(np.array([turn_s, 0.0]))
    periods = int(np.ceil(_return_duration_s(ends[0], ends[1]) * tracker.rate_hz)) + 1
    back = _return_motion(take, ends[0], ends[1], periods / tracker.rate_hz + slot_s)
    rate_hz = max(_BLEND_HZ, take.rate_hz)
    grid_s = np.arange(round((turn_s + periods / tracker.rate_hz) * rate_hz)) / rate_hz
    there = grid_s <= turn_s
    qpos = np.concatenate([trajectory.qpos(grid_s[there]), Trajectory(body, back).qpos(grid_s[~there] - turn_s)])
    return replace(take, name=back.name, rate_hz=rate_hz, qpos=qpos)


def _return_duration_s(last: Floats, first: Floats) -> float:
    """Duration of the return from one configuration (55,) to another [s]."""
    walk_s = float(np.linalg.norm(first[:2] - last[:2])) / WALK_M_S
    turn_s = float(rotations.angle_between_rad(first[3:7], last[3:7])) / TURN_RAD_S
    return max(SHORTEST_RETURN_S, walk_s, turn_s)


def _return_motion(take: BodyMotion, last: Floats, first: Floats, duration_s: float) -> BodyMotion:
    """Motion from the last configuration to the first, where it stays for the rest of the time."""
    rate_hz = max(_BLEND_HZ, take.rate_hz)
    time_s = np.arange(int(np.ceil(duration_s * rate_hz)) + 1) / rate_hz
    qpos = minimum_jerk(last, first, np.clip(time_s / duration_s, 0.0, 1.0))
    return BodyMotion(f"{take.name} and back", take.subject, take.source, take.behaviour, rate_hz, qpos)
