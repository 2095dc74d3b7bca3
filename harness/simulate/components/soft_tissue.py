"""Soft tissue artefact: a tracker sits on skin, which lags behind the bone and oscillates.

It is the largest error of skin-mounted trackers, largest at the thigh, and as slow as the motion itself (Leardini et
al. 2005). docs/is900.md 13.6 has its numbers and the limits of this model. `Skin` is what lies below the stations.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from harness.body import Mount, tissue_thickness_m
from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.core.calibration import Calibration
from harness.core.ranges import CheckedFields, Range
from harness.core.skeleton import Skeleton
from harness.simulate.readings import GRAVITY_M_S2, SimulatedReadings

_NORMAL_FREQUENCY_RATIO = 2.0
"""Ratio of the natural frequency normal to the skin to that along it: above 1 by Wakeling & Nigg 2001 [choice]."""


@dataclass(frozen=True)
class SoftTissueArtefact(CheckedFields):
    """A damped oscillator on each axis of a station, driven by the acceleration of its place on the bone.

    Soft tissue of thickness h is a layer in shear whose stiffness is proportional to 1/h. So the displacement is
    proportional to h, and the natural frequency is `frequency_hz` times the root of `reference_tissue_m`/h. The
    displacement is limited to h. A shift around the bone also rotates the station about it. The rest pose is the
    equilibrium; in other poses gravity displaces the station. The model is deterministic and draws nothing.
    """

    frequency_hz: Annotated[float, Range(0.1, 100.0)] = 5.0
    """Natural frequency along the skin for a tissue thickness of `reference_tissue_m` [Hz]."""
    damping: Annotated[float, Range(0.01, 10.0)] = 0.3
    """Damping ratio; 1 is critical damping."""
    reference_tissue_m: Annotated[float, Range(1e-3, 0.5)] = 0.04
    """Tissue thickness to which `frequency_hz` refers [m]."""

    def apply(self, readings: SimulatedReadings) -> None:
        pace = natural_frequency_rad_s(self, readings.tissue_m)
        linear_m = simulate_oscillators(-readings.force_m_s2, pace, self.damping, 1.0 / readings.rate_hz)
        shift_m = soft_limit(linear_m, readings.tissue_m[:, None])
        readings.position_m = readings.position_m + rotations.rotate(readings.turn, shift_m)
        # The bone runs along x, `radius_m` below: a shift of y around it rotates the station about x by -y/radius.
        roll_rad = -shift_m[..., 1] / readings.radius_m
        readings.turn = rotations.multiply(
            readings.turn, rotations.exp(roll_rad[..., None] * np.array([1.0, 0.0, 0.0]))
        )


def natural_frequency_rad_s(component: SoftTissueArtefact, tissue_m: Floats) -> Floats:
    """(S, 3) natural frequency along each axis of stations on tissue of these thicknesses (S,) [rad/s]."""
    frequency_hz = component.frequency_hz * np.sqrt(component.reference_tissue_m / tissue_m)
    out: Floats = 2.0 * math.pi * frequency_hz[:, None] * np.array([1.0, 1.0, _NORMAL_FREQUENCY_RATIO])
    return out


def simulate_oscillators(push: Floats, pace: Floats, damping: float, step_s: float) -> Floats:
    """Solution (N, ...) of x'' + 2 d w x' + w^2 x = push [m] for sampled pushes (N, ...) [m/s^2].

    `pace` w (...) [rad/s] is the natural frequency, `damping` d the damping ratio. Pushes are linear between samples,
    for which each step is exact, however stiff the oscillator. It starts at rest at the first push's equilibrium.
    """
    # A push u + r t has the solution c + s t + e(t); c, s and the free response e are matched at each sample.
    step = free_response(pace, damping, step_s)
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
    """Vectors (..., 3) with their length limited smoothly (tanh) to `most_m` (..., 1) [m]."""
    length_m = np.maximum(np.sqrt(np.sum(shift_m**2, axis=-1, keepdims=True)), 1e-12)
    out: Floats = shift_m * (most_m * np.tanh(length_m / most_m) / length_m)
    return out


def free_response(pace: Floats, damping: float, step_s: float) -> Floats:
    """(2, 2, ...) state transition of position and velocity over a step without a push."""
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


@dataclass(frozen=True, eq=False)
class Skin:
    """What lies between S stations and their bones."""

    radius_m: Floats
    """(S,) distance of the station from the axis of its bone [m]; the station's z points away from it, x along it."""
    tissue_m: Floats
    """(S,) thickness of the soft tissue between bone and skin at the station [m]."""

    def __post_init__(self) -> None:
        freeze(self, radius_m=("S",), tissue_m=("S",))


def skin_below(skeleton: Skeleton, mounts: Sequence[Mount], calibration: Calibration) -> Skin:
    """The skin below stations on these mounts, whose exact calibration is given."""
    along_m = [mount.along * skeleton.bone_m[skeleton.index(mount.bone)] for mount in mounts]
    return Skin(
        radius_m=np.linalg.norm(calibration.mount_m - along_m, axis=1),
        tissue_m=np.array([tissue_thickness_m(mount.bone, mount.along) for mount in mounts]),
    )


def tissue_force_m_s2(
    turn: Floats, acceleration_m_s2: Floats, calibration: Calibration, frame_from_world: Floats = rotations.IDENTITY
) -> Floats:
    """(N, S, 3) specific force at each station minus that in the rest pose, in the station's axes [m/s^2].

    Orientations (N, S, 4) and accelerations (N, S, 3) are those of the stations in a frame; the world's by default.
    """
    up = np.array([0.0, 0.0, GRAVITY_M_S2])
    specific_force = rotations.rotate(
        rotations.inverse(turn), acceleration_m_s2 + rotations.rotate(frame_from_world, up)
    )
    out: Floats = specific_force - rotations.rotate(rotations.inverse(calibration.bone_from_station), up)
    return out
