"""Smooth curves of time, from which the motion generator composes every joint's motion, and gestures made of them.

Each curve is twice continuously differentiable, so that joint speeds and accelerations do not jump. Gestures such as
punches, strokes and swings are short curves on named channels, which add up where they overlap.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats

GRAVITY_M_S2 = 9.81


def minimum_jerk(share: Floats) -> Floats:
    """0 to 1 as `share` goes from 0 to 1, constant outside: the minimum-jerk step of Flash and Hogan (1985)."""
    x = np.clip(share, 0.0, 1.0)
    out: Floats = x**3 * (10.0 + x * (6.0 * x - 15.0))
    return out


def smooth_trapezoid(share: Floats, ramp: float = 0.35) -> Floats:
    """0 to 1 with eased ends and constant speed between: the peak speed is 1 / (1 - ramp) of the mean.

    This is the speed profile of a swinging foot.
    """
    x = np.clip(share, 0.0, 1.0)
    out: Floats = (
        (_minimum_jerk_integral(x / ramp) - _minimum_jerk_integral((x - 1.0 + ramp) / ramp)) * ramp / (1.0 - ramp)
    )
    return out


def _minimum_jerk_integral(x: Floats) -> Floats:
    """Integral of `minimum_jerk` from minus infinity."""
    inside = np.clip(x, 0.0, 1.0)
    out: Floats = inside**4 * (2.5 + inside * (inside - 3.0)) + np.maximum(x - 1.0, 0.0)
    return out


def pulse(share: Floats, peak: float = 0.5) -> Floats:
    """0 to 1 and back to 0 as `share` goes from 0 to 1; highest at `peak`, which is at most a half."""
    x = np.clip(share, 0.0, 1.0)
    fall = 3.0 * (1.0 - peak) / peak
    out: Floats = (x / peak) ** 3 * ((1.0 - x) / (1.0 - peak)) ** fall
    return out


def interpolate_keys(t: Floats, key_s: Sequence[float] | Floats, key: Sequence[float] | Floats) -> Floats:
    """A curve through keys at increasing times without overshoot; constant before the first and after the last.

    Quintic between keys, at rest at every extreme, with the slopes of Fritsch and Butland (1984) elsewhere.
    """
    at, value = np.asarray(key_s, dtype=float), np.asarray(key, dtype=float)
    gap, rise = np.diff(at), np.diff(value) / np.diff(at)
    slope = np.zeros(len(at))
    same = rise[1:] * rise[:-1] > 0.0
    left, right = rise[:-1][same], rise[1:][same]
    w1, w2 = (2.0 * gap[1:] + gap[:-1])[same], (gap[1:] + 2.0 * gap[:-1])[same]
    slope[1:-1][same] = (w1 + w2) / (w1 / left + w2 / right)
    zero = np.zeros(len(at))
    return quintic_spline(t, at, value, slope, zero)


def quintic_spline(t: Floats, at: Floats, value: Floats, slope: Floats, bend: Floats) -> Floats:
    """Quintic spline with these values, first and second derivatives at the times `at`; constant outside them."""
    inside = np.clip(t, at[0], at[-1])
    k = np.clip(np.searchsorted(at, inside, side="right") - 1, 0, len(at) - 2)
    h = at[k + 1] - at[k]
    x = (inside - at[k]) / h
    x3, x4, x5 = x**3, x**4, x**5
    up = 10.0 * x3 - 15.0 * x4 + 6.0 * x5
    out: Floats = (
        value[k] * (1.0 - up)
        + value[k + 1] * up
        + h * slope[k] * (x - 6.0 * x3 + 8.0 * x4 - 3.0 * x5)
        + h * slope[k + 1] * (-4.0 * x3 + 7.0 * x4 - 3.0 * x5)
        + h**2 * bend[k] * 0.5 * (x**2 - 3.0 * x3 + 3.0 * x4 - x5)
        + h**2 * bend[k + 1] * 0.5 * (x3 - 2.0 * x4 + x5)
    )
    return out


def smooth_noise(rng: np.random.Generator, t: Floats, period_s: float, rms: float) -> Floats:
    """Smooth random drift (T,) of the given root mean square: sines with periods of 0.5 to 3 times `period_s`."""
    waves = 6
    turns = 1.0 / (period_s * np.geomspace(0.5, 3.0, waves) * rng.uniform(0.9, 1.1, waves))
    weight = np.geomspace(0.5, 1.0, waves)
    phase = rng.uniform(0.0, 2.0 * np.pi, waves)
    sines = np.sin(2.0 * np.pi * turns[:, None] * t + phase[:, None])
    out: Floats = rms * np.sqrt(2.0 / np.sum(weight**2)) * (weight @ sines)
    return out


def smooth_minimum(a: Floats, b: Floats, softness: float) -> Floats:
    """A smooth minimum of two curves: below both everywhere, by at most half of `softness` where they are equal."""
    out: Floats = 0.5 * (a + b - np.sqrt((a - b) ** 2 + softness**2))
    return out


def smooth_maximum(a: Floats, b: Floats, softness: float) -> Floats:
    """A smooth maximum of two curves, the mirror image of `smooth_minimum`."""
    return -smooth_minimum(-a, -b, softness)


def gaussian_smooth(curve: Floats, frames: float) -> Floats:
    """The curve (T,) smoothed by a Gaussian of `frames` standard deviation; the ends are padded with the end values."""
    half = int(3.0 * frames)
    bell = np.exp(-0.5 * (np.arange(-half, half + 1) / frames) ** 2)
    out: Floats = np.convolve(np.pad(curve, half, mode="edge"), bell / bell.sum(), mode="valid")
    return out


Keyframes = Sequence[tuple[float, float]]
"""(time after the start [s], value) in order of time; constant before the first and after the last."""


@dataclass(frozen=True)
class Gesture:
    """One movement: when it starts, and the curve that it adds to each channel."""

    at_s: float
    channels: Mapping[str, Keyframes]

    @property
    def end_s(self) -> float:
        return self.at_s + max(keys[-1][0] for keys in self.channels.values())

    def vary(self, rng: np.random.Generator, size: float, slowness: float, spread: float = 0.06) -> "Gesture":
        """The gesture with its values scaled by `size` and its times by `slowness`, changed at random.

        `spread` is the relative standard deviation of each value. The order of the channels decides the random draws.
        """
        slow = slowness * rng.normal(1.0, 0.5 * spread)
        big = size * rng.normal(1.0, 0.5 * spread)
        return Gesture(
            self.at_s,
            {
                name: [(dt * slow, value * big * rng.normal(1.0, spread)) for dt, value in keys]
                for name, keys in self.channels.items()
            },
        )


def keyframes_at(moments: Mapping[str, float], lag_s: float = 0.0, **values: float) -> Keyframes:
    """Keyframes at named moments [s], 0 at the first and the last; `lag_s` delays those in between."""
    names = list(moments)
    keys = [(moments[name] + lag_s, value) for name, value in values.items()]
    return sorted([(moments[names[0]], 0.0), *keys, (moments[names[-1]], 0.0)])


def sum_gestures(t: Floats, gestures: Iterable[Gesture]) -> Mapping[str, Floats]:
    """The sum (T,) of the gestures on each channel; 0 for a channel without gestures."""
    out: defaultdict[str, Floats] = defaultdict(lambda: np.zeros(len(t)))
    for gesture in gestures:
        for name, keys in gesture.channels.items():
            first = int(np.searchsorted(t, gesture.at_s + keys[0][0]))
            last = len(t) if keys[-1][1] else int(np.searchsorted(t, gesture.at_s + keys[-1][0]))
            out[name][first:last] += interpolate_keys(
                t[first:last], [gesture.at_s + k[0] for k in keys], [k[1] for k in keys]
            )
    return out
