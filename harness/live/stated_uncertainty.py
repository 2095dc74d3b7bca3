"""The uncertainty that a method states, as people see it: a line of text, and how far it moves each bone.

Bones have the same order in a configuration and in the skeleton. Only the order of the hinges within a bone differs.
"""

import numpy as np

from harness.core.arrays import Floats
from harness.core.estimate import HALF_WIDTH_95, mean_region_deg
from harness.core.number_format import format_fixed
from harness.core.skeleton import Skeleton

_SIDES = {"l": "left", "r": "right"}


def describe_uncertainty(skeleton: Skeleton, angle_sigma_rad: Floats | None) -> str:
    """The mean and the largest half width of the stated 95 % region [deg], of standard deviations (48,) [rad].

    They are in the order of `qpos`; None where the method states none, which the text then says.
    """
    if angle_sigma_rad is None:
        return "the method states no uncertainty"
    half_rad = HALF_WIDTH_95 * angle_sigma_rad
    mean, largest = (format_fixed(float(d), 1) for d in (mean_region_deg(angle_sigma_rad), np.rad2deg(half_rad.max())))
    bone = skeleton.dof_names[int(half_rad.argmax())].partition(".")[0]
    if f"{'r' if bone[0] == 'l' else 'l'}{bone[1:]}" in skeleton.names:  # a bone of either side
        bone = f"{_SIDES[bone[0]]} {bone[1:]}"
    return f"stated 95 % region of hinge angles: ±{mean}° on average; largest: {bone} ±{largest}°"


def bone_reach_m(skeleton: Skeleton, angle_sigma_rad: Floats) -> Floats:
    """(B,) distance to which the stated 95 % region of its least certain hinge moves the far end of each bone [m].

    Standard deviations (48,) [rad] are in the order of `qpos`. It is 0 for a bone without hinges.
    """
    half_rad = HALF_WIDTH_95 * angle_sigma_rad
    widest_rad = [half_rad[dofs].max(initial=0.0) for dofs in skeleton.dof_of_bone]
    out: Floats = skeleton.length_m * np.sin(np.minimum(widest_rad, 0.5 * np.pi))
    return out
