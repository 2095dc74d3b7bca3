"""Errors of joint angles and rotations (docs/metrics.md, part D). Each metric maps a `Pair` to one number per frame.

Definitions differ by up to a factor of two on the same motion; never compare numbers of different definitions.
"""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.score.pair import Pair, bones_named, hinged_bones

SIP_BONES = ("lhumerus", "rhumerus", "lfemur", "rfemur")
"""Upper arms and thighs: von Marcard et al. 2017, Sparse Inertial Poser."""


def wrap_difference(angle_rad: Floats) -> Floats:
    """Differences of angles wrapped to +-pi [rad]. Unlike `rotations.wrap_angle` it keeps every small value exact."""
    out: Floats = angle_rad - 2.0 * np.pi * np.round(angle_rad / (2.0 * np.pi))
    return out


def geodesic_deg(p: Floats, q: Floats) -> Floats:
    """Angle (...,) between rotation matrices (..., 3, 3), by the chord |p - q| = 2 sqrt(2) sin(angle / 2) [deg].

    The chord is exact at zero, where the arc cosine of the trace is least accurate.
    """
    chord = np.sqrt(np.sum((p - q) ** 2, axis=(-2, -1)))
    out: Floats = np.rad2deg(2.0 * np.arcsin(np.minimum(chord / np.sqrt(8.0), 1.0)))
    return out


def hinge_errors_deg(pair: Pair) -> Floats:
    """(F, D) absolute wrapped difference of every hinge angle [deg]."""
    out: Floats = np.rad2deg(np.abs(wrap_difference(pair.estimate.angles_rad - pair.truth.angles_rad)))
    return out


def local_errors_deg(pair: Pair) -> Floats:
    """(F, 22) geodesic error of each hinged bone relative to its parent."""
    bones = hinged_bones(pair.skeleton)
    return geodesic_deg(pair.truth.parent_from_bone[:, bones], pair.estimate.parent_from_bone[:, bones])


def joint_angle_mean_deg(pair: Pair) -> Floats:
    """(F,) D1, as in Liu et al. 2011: mean absolute difference of the hinge angles, without the root orientation."""
    out: Floats = hinge_errors_deg(pair).mean(axis=1)
    return out


def joint_angle_rms_deg(pair: Pair) -> Floats:
    """(F,) root mean square difference of the hinge angles."""
    out: Floats = np.sqrt(np.mean(hinge_errors_deg(pair) ** 2, axis=1))
    return out


def mpjre_deg(pair: Pair) -> Floats:
    """(F,) D2: mean geodesic error of the hinged bones relative to their parents."""
    out: Floats = local_errors_deg(pair).mean(axis=1)
    return out


def mpjre_axis_angle_deg(pair: Pair) -> Floats:
    """(F,) mean absolute wrapped difference of axis-angle components: the MPJRE of papers on head-mounted displays."""
    bones = hinged_bones(pair.skeleton)
    truth, estimate = (
        rotations.log(rotations.from_matrix(p.parent_from_bone[:, bones])) for p in (pair.truth, pair.estimate)
    )
    out: Floats = np.rad2deg(np.abs(wrap_difference(estimate - truth))).mean(axis=(1, 2))
    return out


def joint_geodesic_global_deg(pair: Pair) -> Floats:
    """(F,) mean geodesic error of the global rotations of the hinged bones, after aligning the roots."""
    return _root_aligned_deg(pair, hinged_bones(pair.skeleton))


def sip_error_deg(pair: Pair) -> Floats:
    """(F,) mean geodesic error of the global rotations of upper arms and thighs, after aligning the roots."""
    return _root_aligned_deg(pair, bones_named(pair.skeleton, SIP_BONES))


def root_angle_deg(pair: Pair) -> Floats:
    """(F,) geodesic error of the root's orientation."""
    out: Floats = np.rad2deg(rotations.angle_between_rad(pair.truth.world_from_root, pair.estimate.world_from_root))
    return out


def root_heading_deg(pair: Pair) -> Floats:
    """(F,) absolute wrapped difference of the root's yaw."""
    truth, estimate = (rotations.yaw_rad(p.world_from_root) for p in (pair.truth, pair.estimate))
    out: Floats = np.rad2deg(np.abs(wrap_difference(estimate - truth)))
    return out


def _root_aligned_deg(pair: Pair, bones: Ints) -> Floats:
    out: Floats = geodesic_deg(pair.truth.root_from_bone[:, bones], pair.estimate.root_from_bone[:, bones]).mean(axis=1)
    return out
