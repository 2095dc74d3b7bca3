"""Where readings are looked at from: above one station and along its bone's heading, so that the room does not matter.

Kim et al. 2012 compare readings with examples in the room of the T-pose calibration (B2), where the database knows
only the places at which it was captured. Here everything is seen from an anchor on the trunk (docs/methods.md E,
"world invariance"). A bone's heading is its twist about the vertical, as in `database.ground`.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from harness.core.arrays import Floats

_TRUNK = ("lhipjoint", "rhipjoint", "lowerback", "upperback", "thorax", "lowerneck", "upperneck", "head")
"""Bones that may be anchors, best first."""


class View(NamedTuple):
    """A place on the floor [m] and a heading [rad]."""

    x_m: float
    y_m: float
    yaw_rad: float


def anchor_of(bones: Sequence[str]) -> int:
    """The station whose bone (S,) is nearest to the pelvis; the first when none is on the trunk."""
    return min(range(len(bones)), key=lambda k: _TRUNK.index(bones[k]) if bones[k] in _TRUNK else len(_TRUNK))


def on_trunk(bone: str) -> bool:
    """Whether a bone tells the performer's heading."""
    return bone in _TRUNK


def twist_rad(turned: Floats) -> Floats:
    """(...,) heading of orientations (..., 4)."""
    out: Floats = 2.0 * np.arctan2(turned[..., 3], turned[..., 0])
    return out
