"""Anchor frame: a view of the readings that does not depend on the room.

Kim et al. 2012 compare readings with examples in the room of the T-pose calibration (B2), so their database knows only
the places where it was captured. Here everything is relative to a point above one station on the trunk, the anchor, and
to its bone's heading (docs/papers.md E, "world invariance"). The heading is the bone's twist about the vertical, as in
`solver.ground_frame`. Without orientations the heading is estimated from the positions, by the same linear map for
examples and readings (F5).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Bools, Floats

Complexes = NDArray[np.complex128]

_TRUNK = ("lhipjoint", "rhipjoint", "lowerback", "upperback", "thorax", "lowerneck", "upperneck", "head")
"""Bones that show the performer's position and heading, best first."""
_LIMBS = ("femur", "tibia", "foot", "clavicle", "humerus", "radius", "wrist", "hand")
"""Bones for stations elsewhere, best first: a shin follows the body's heading better than a hand.

On validation blocks of boxing, two hands and two ankles have errors of 3.0, 3.0 and 1.9 deg with this order, in place
of 3.6, 3.3 and 2.5; walking does not change."""

MIN_HEADING_EXPLAINED = 0.8
"""Least explained share of the heading for its estimate from positions: six stations reach 0.94, two below 0.78."""


class AnchorFrame(NamedTuple):
    """A point on the floor and a heading."""

    x_m: float
    """World x [m]."""
    y_m: float
    """World y [m]."""
    yaw_rad: float
    """Heading about the vertical [rad]."""


def anchor_of(bones: Sequence[str]) -> int:
    """Index of the anchor among stations on these bones (S,): the bone nearest to the pelvis, the first of equals."""

    def distance(bone: str) -> int:
        return _TRUNK.index(bone) if bone in _TRUNK else len(_TRUNK) + _LIMBS.index(bone[1:])

    return min(range(len(bones)), key=lambda k: distance(bones[k]))


def on_trunk(bone: str) -> bool:
    """Whether a bone belongs to the trunk and so shows the performer's heading."""
    return bone in _TRUNK


def twist_rad(orientation: Floats) -> Floats:
    """(...,) heading of orientations (..., 4): their twist about the vertical [rad]."""
    out: Floats = 2.0 * np.arctan2(orientation[..., 3], orientation[..., 0])
    return out


class HeadingEstimator(NamedTuple):
    """Linear estimator of the performer's heading from station positions relative to the anchor.

    It is equivariant: rotating the stations about the vertical rotates the estimate.
    """

    anchor: int
    stations: Bools
    """(S,) stations that it uses, the anchor among them."""
    weight: Complexes
    """(S,) complex weight of each horizontal position x + i y relative to the anchor; 0 for unused stations."""
    explained: float
    """Share of the heading's variance that it explains in its training examples, 0 to 1."""

    @classmethod
    def fit(cls, at_m: Floats, anchor: int, used: Bools) -> "HeadingEstimator":
        """Fit by least squares to positions (N, S, 3) of performers who face along x, over `used` stations (S,)."""
        offsets = _horizontal_offsets(at_m, anchor)[:, used]
        product, towards = offsets.conj().T @ offsets, offsets.conj().sum(axis=0)
        weight = np.zeros(len(used), complex)
        least = 1e-6 * np.trace(product).real + 1e-12  # the anchor is at 0 from itself
        weight[used] = np.linalg.solve(product + least * np.eye(len(product)), towards)
        return cls(anchor, used, weight, float((towards.conj() @ weight[used]).real) / len(at_m))

    def heading_rad(self, at_m: Floats) -> Floats:
        """(...,) heading estimated from station positions (..., S, 3) [rad]."""
        out: Floats = np.angle(_horizontal_offsets(at_m, self.anchor) @ self.weight)
        return out


def _horizontal_offsets(at_m: Floats, anchor: int) -> Complexes:
    """(..., S) horizontal positions x + i y of stations (..., S, 3) relative to the anchor [m]."""
    offset_m = at_m[..., :2] - at_m[..., anchor, None, :2]
    out: Complexes = offset_m[..., 0] + 1j * offset_m[..., 1]
    return out
