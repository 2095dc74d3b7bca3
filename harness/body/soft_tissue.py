"""Thickness of the soft tissue between a bone and the skin under a tracker.

Muscle and fat over the middle of the thigh are 28 + 10 mm thick, by ultrasound of 17 adults (Mechelli 2019,
J. Cachexia, Sarcopenia and Muscle - Clinical Reports 4). All other numbers are our choice relative to that one.
Only skin lies over forehead, breastbone, shin and the back of the hand. The thickness is linear along a bone.
"""

from collections.abc import Mapping
from types import MappingProxyType

from harness.core import humanoid24

THICKNESS_M: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "lowerback": (0.025, 0.025),
        "upperback": (0.020, 0.015),
        "thorax": (0.010, 0.010),
        "lowerneck": (0.020, 0.020),
        "upperneck": (0.020, 0.020),
        "head": (0.005, 0.005),
        "clavicle": (0.015, 0.020),
        "humerus": (0.035, 0.020),
        "radius": (0.025, 0.012),
        "wrist": (0.012, 0.005),
        "hand": (0.005, 0.005),
        "fingers": (0.005, 0.005),
        "thumb": (0.005, 0.005),
        "hipjoint": (0.015, 0.040),
        "femur": (0.050, 0.026),
        "tibia": (0.020, 0.005),
        "foot": (0.008, 0.008),
        "toes": (0.005, 0.005),
    }
)
"""Thickness at the joint and at the far end, by bone of either side [m]."""


def tissue_thickness_m(bone: str, along: float) -> float:
    """Thickness at a place along a bone, 0 at its joint to 1 at its far end [m]; UnknownName for the bone."""
    humanoid24.standard_skeleton().index(bone)
    at_joint, at_end = THICKNESS_M[bone if bone in THICKNESS_M else bone[1:]]
    return at_joint + along * (at_end - at_joint)
