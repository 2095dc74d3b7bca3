"""A take without an end: what the trackers say during it, on the way back to its beginning, and so on.

The take itself is sensed as `simulate` does, reading by reading. The way back blends the configuration from the last
pose to the first (Flash & Hogan 1985: a minimum-jerk course, at rest at both ends) with noise of its own.
"""

from collections.abc import Sequence

import numpy as np

from harness.body.humanoid import Body
from harness.body.mounts import Mount
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.simulate.held_poses import minimum_jerk
from harness.simulate.noise import Noise
from harness.simulate.simulation import TrackerConfig, sampling_times_s, simulate_readings
from harness.simulate.trajectory import Trajectory
from harness.stream.codec.samples import DeviceSamples

SHORTEST_RETURN_S, WALK_M_S, TURN_RAD_S = 1.0, 1.2, 2.0
"""The way back takes a second, or as long as walking there and turning round does at an easy pace."""
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
    """The readings of a take and of the way back; BadInput when the take is shorter than one period.

    `session` is as in `simulate`.
    """
    there = Trajectory(body, take)
    time_s = sampling_times_s(there.duration_s, tracker, len(mounts))
    first = len(time_s)
    ends = there.qpos(np.array([time_s[-1, 0], 0.0]))
    periods = int(np.ceil(_return_duration_s(ends[0], ends[1]) * tracker.rate_hz)) + 1
    turns_s = time_s[0]
    back = _return_motion(take, ends[0], ends[1], periods / tracker.rate_hz + float(turns_s[-1]))
    back_s = np.arange(1, periods)[:, None] / tracker.rate_hz + turns_s
    seen = [
        simulate_readings(there, mounts, tracker, noise, time_s, seed=seed, take=take.name, session=session),
        simulate_readings(
            Trajectory(body, back),
            mounts,
            tracker,
            noise,
            back_s,
            seed=seed,
            take=back.name,
            begins_s=time_s[-1, 0],
            session=session,
        ),
    ]
    return DeviceSamples(
        stations=seen[0].stations,
        rate_hz=tracker.rate_hz,
        take_frames=first,
        taken_s=np.concatenate([sensed.time_s for sensed in seen]),
        ready_s=tracker.latency_s,
        device_s=np.concatenate([sensed.device_s for sensed in seen]),
        position_m=np.concatenate([sensed.position_m for sensed in seen]),
        tracker_from_station=np.concatenate([sensed.turn for sensed in seen]),
        quality=np.concatenate([sensed.quality for sensed in seen]),
    )


def _return_duration_s(last: Floats, first: Floats) -> float:
    """How long it takes from one configuration (55,) to the other [s]."""
    walk_s = float(np.linalg.norm(first[:2] - last[:2])) / WALK_M_S
    turn_s = float(rotations.angle_between_rad(first[3:7], last[3:7])) / TURN_RAD_S
    return max(SHORTEST_RETURN_S, walk_s, turn_s)


def _return_motion(take: BodyMotion, last: Floats, first: Floats, duration_s: float) -> BodyMotion:
    """From the last configuration to the first, where it stays for what is left of the time."""
    rate_hz = max(_BLEND_HZ, take.rate_hz)
    time_s = np.arange(int(np.ceil(duration_s * rate_hz)) + 1) / rate_hz
    qpos = minimum_jerk(last, first, np.clip(time_s / duration_s, 0.0, 1.0))
    return BodyMotion(f"{take.name} and back", take.subject, take.source, take.behaviour, rate_hz, qpos)
