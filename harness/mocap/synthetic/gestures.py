"""Gestures such as punches, strokes and swings: short curves on named channels, which add up where they overlap."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.mocap.synthetic.curves import interpolate_keys

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
        """The gesture with its values scaled by `size` and its times by `slowness`, varied at random.

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
