"""Smooth motion of bodies, and stations on them that report it with known errors."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.measure.pose_series import MeasuredPoses, TruthPoses, TruthSpline


@dataclass(frozen=True)
class Tracker:
    """Errors and placement of a tracker."""

    room: Floats = field(default_factory=lambda: rotations.exp(np.array([2.9, 0.3, -0.4])))
    """(4,) `tracker_from_world`."""
    origin_m: Floats = field(default_factory=lambda: np.array([0.4, -0.6, 2.5]))
    scale: float = 0.0
    heading_rad: float = 0.0
    ahead_s: float = 0.0
    offset_s: float = 0.0
    ratio: float = 0.0
    rate_hz: float = 40.0
    white: tuple[float, float] = (0.0, 0.0)
    """Standard deviations of position [m] and rotation [rad]."""
    drift: tuple[float, float] = (0.0, 0.0)
    correlation_s: float = 1.0


def move_bodies(
    rng: np.random.Generator, names: tuple[str, ...], seconds: float = 60.0, turns: tuple[float, ...] = (0.6, 0.5, 0.4)
) -> dict[str, TruthPoses]:
    """Bodies that move by sums of sines and turn with these amplitudes about their axes [rad], sampled at 120 Hz."""
    time_s = np.arange(round(120.0 * seconds) + 1) / 120.0
    out = {}
    for name in names:
        hz, phase = rng.uniform(0.2, 1.5, (6, 4)), rng.uniform(0.0, 6.28, (6, 4))
        waves = np.sin(6.283 * hz[:, :, None] * time_s + phase[:, :, None]).sum(axis=1).T / 2.0
        place = 0.3 * waves[:, :3] + np.array([0.0, 0.0, 1.0])
        out[name] = TruthPoses(time_s, place, rotations.exp(waves[:, 3:] * np.array(turns)))
    return out


def draw_mounts(rng: np.random.Generator, names: tuple[str, ...]) -> dict[str, tuple[Floats, Floats]]:
    """Position [m] and `body_from_station` of each station."""
    return {name: (0.15 * rng.normal(size=3), rotations.exp(rng.normal(size=3))) for name in names}


def gauss_markov(rng: np.random.Generator, count: int, correlation: float) -> Floats:
    """Six processes (count, 6) of unit variance."""
    out, draws = np.empty((count, 6)), rng.normal(size=(count, 6))
    out[0] = draws[0]
    for i in range(1, count):
        out[i] = correlation * out[i - 1] + np.sqrt(1.0 - correlation**2) * draws[i]
    return out


def report_poses(
    rng: np.random.Generator,
    truths: Mapping[str, TruthPoses],
    mounts: Mapping[str, tuple[Floats, Floats]],
    tracker: Tracker,
) -> dict[str, MeasuredPoses]:
    """What stations on bodies of the same name report."""
    out = {}
    for name, (mount_m, mount) in mounts.items():
        spline = TruthSpline(truths[name])
        time_s = np.arange(spline.time_s[0] + 0.003, spline.time_s[-1] - 0.003, 1.0 / tracker.rate_hz)
        body_m, body, velocity, omega = spline.motion(time_s)
        velocity = velocity + rotations.rotate(body, np.cross(omega, mount_m))
        at_m = body_m + rotations.rotate(body, mount_m) - tracker.origin_m + tracker.ahead_s * velocity
        position_m = (1.0 + tracker.scale) * rotations.rotate(tracker.room, at_m)
        turn = rotations.multiply(rotations.about_z(tracker.heading_rad), tracker.room)
        turn = rotations.multiply(rotations.multiply(turn, body), mount)
        wander = gauss_markov(rng, len(time_s), float(np.exp(-1.0 / (tracker.rate_hz * tracker.correlation_s))))
        noise = rng.normal(size=(len(time_s), 6))
        errors = np.repeat(tracker.white, 3) * noise + np.repeat(tracker.drift, 3) * wander
        middle_s = 0.5 * (spline.time_s[0] + spline.time_s[-1])
        device_s = time_s + tracker.offset_s + tracker.ratio * (time_s - middle_s)
        turn = rotations.multiply(rotations.exp(errors[:, 3:]), turn)
        out[name] = MeasuredPoses(device_s, position_m + errors[:, :3], turn, np.ones(len(time_s), bool))
    return out
