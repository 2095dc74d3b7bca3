"""Flesh that gives way: a tracker sits on skin, and skin lags behind the bone and swings after it.

Soft tissue artefact is the largest error of skin-mounted trackers, largest at the thigh, and as slow as the motion
itself (Leardini et al. 2005); its numbers and what this model leaves out: docs/is900.md 13.6.
"""

import math
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.simulate.parameter_ranges import require_ranges
from harness.simulate.readings import SimulatedReadings

_FASTER_INWARD = 2.0
"""How much higher the frequency is square to the skin than along it: higher, by Wakeling & Nigg 2001 [choice]."""


@dataclass(frozen=True)
class SoftTissueArtefact:
    """A damped oscillator for each axis of a station, driven by what its place on the bone is accelerated by.

    Flesh of thickness h is a layer in shear: its stiffness goes with 1/h, so that a tracker gives way in proportion to
    h, and swings at `frequency_hz` times the root of `reference_tissue_m`/h; yet it never gives way by more than h. What slides
    around the bone turns about it as well. In the rest pose it hangs where it was strapped on; other poses pull it
    elsewhere. No draws: the same motion gives the same wobble.
    """

    frequency_hz: float = 5.0
    """Natural frequency along the skin over `reference_tissue_m` of flesh [Hz]."""
    damping: float = 0.3
    """Share of the critical damping."""
    reference_tissue_m: float = 0.04
    """The thickness that `frequency_hz` is of [m]."""

    def __post_init__(self) -> None:
        require_ranges(self, frequency_hz=(0.1, 100.0), damping=(0.01, 10.0), reference_tissue_m=(1e-3, 0.5))

    def apply(self, sensed: SimulatedReadings) -> None:
        frequency_hz = self.frequency_hz * np.sqrt(self.reference_tissue_m / sensed.flesh_m)
        pace = 2.0 * math.pi * frequency_hz[:, None] * np.array([1.0, 1.0, _FASTER_INWARD])
        linear_m = simulate_oscillators(-sensed.force_m_s2, pace, self.damping, 1.0 / sensed.rate_hz)
        shift_m = soft_limit(linear_m, sensed.flesh_m[:, None])
        sensed.position_m = sensed.position_m + rotations.rotate(sensed.turn, shift_m)
        # The bone runs along x, `radius_m` below: what goes by y to the left of it turns about x by -y/radius.
        roll_rad = -shift_m[..., 1] / sensed.radius_m
        sensed.turn = rotations.multiply(sensed.turn, rotations.exp(roll_rad[..., None] * np.array([1.0, 0.0, 0.0])))


def simulate_oscillators(push: Floats, pace: Floats, damping: float, step_s: float) -> Floats:
    """Where oscillators x'' + 2 d w x' + w^2 x = push are, (N, ...) [m], under pushes (N, ...) [m/s^2].

    `pace` w (...) [rad/s]. Pushes are straight lines between samples, for which each step is exact however stiff the
    oscillator; it begins where the first push holds it.
    """
    # With a push of u + r t the motion is c + s t + e(t): c, s and the free part e are matched at each sample.
    step = _free_response(pace, damping, step_s)
    place, speed = push[0] / pace**2, np.zeros_like(push[0])
    out = np.empty_like(push)
    out[0] = place
    for k in range(1, len(push)):
        slope = (push[k] - push[k - 1]) / (step_s * pace**2)
        begin = push[k - 1] / pace**2 - 2.0 * damping / pace * slope
        off, gain = place - begin, speed - slope
        place = begin + slope * step_s + step[0, 0] * off + step[0, 1] * gain
        speed = slope + step[1, 0] * off + step[1, 1] * gain
        out[k] = place
    return out


def soft_limit(shift_m: Floats, most_m: Floats) -> Floats:
    """Vectors (..., 3) that come ever nearer to a length of `most_m` (..., 1), the short ones as they are."""
    length_m = np.maximum(np.sqrt(np.sum(shift_m**2, axis=-1, keepdims=True)), 1e-12)
    out: Floats = shift_m * (most_m * np.tanh(length_m / most_m) / length_m)
    return out


def _free_response(pace: Floats, damping: float, step_s: float) -> Floats:
    """(2, 2, ...) what a step makes of place and speed without a push."""
    root = np.sqrt(complex(damping**2 - 1.0))
    root = root if abs(root) > 1e-6 else 1e-6  # critical damping is the limit of both sides
    one, two = pace * (-damping + root), pace * (-damping - root)
    first, second = np.exp(one * step_s), np.exp(two * step_s)
    gap = one - two
    out: Floats = np.array(
        [
            [(one * second - two * first) / gap, (first - second) / gap],
            [one * two * (second - first) / gap, (one * first - two * second) / gap],
        ]
    ).real
    return out
