"""Coverage by place: how many emitters are heard there, and how well ranges to them fix a position."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.simulate.physics.constellation import Constellation

ENOUGH = 3
"""Number of ranges that a position needs."""
LARGEST_DILUTION = 10.0
"""Largest dilution of precision that counts as a fix [choice]: 4 mm of a range then make 4 cm."""
PLAN_POINTS = 121
"""Places along each axis of a plan view [choice]."""
_MARGIN_M = 2.0
"""Width of the strip around the emitters in a plan view [m] [choice]."""
_NO_FIX = 1e-9
"""Determinant of the normal matrix below which ranges fix no position: the emitters lie in a plane with the station."""


def dilution_of_precision(unit: Floats, heard: Bools) -> Floats:
    """Dilution of precision of a position from ranges: (...,) from unit vectors (..., J, 3) to emitters heard (..., J).

    With the heard unit vectors as the rows of G it is sqrt(trace((G'G)^-1)): the standard deviation of the position
    over that of a range (Langley 1999, "Dilution of Precision", GPS World 10). NaN where fewer than three emitters are
    heard, and where these fix no position.
    """
    g = np.where(heard[..., None], unit, 0.0)
    (xx, xy, xz), (yy, yz), (zz,) = ([np.sum(g[..., a] * g[..., b], axis=-1) for b in range(a, 3)] for a in range(3))
    minors = xx * yy - xy**2 + xx * zz - xz**2 + yy * zz - yz**2
    determinant = xx * (yy * zz - yz**2) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    fixed = (np.sum(heard, axis=-1) >= ENOUGH) & (determinant > _NO_FIX)
    out: Floats = np.sqrt(np.where(fixed, minors, np.nan) / np.where(fixed, determinant, 1.0))
    return out


@dataclass(frozen=True, eq=False)
class PlaceCoverage:
    """Coverage at N places without a body; a station there faces each emitter."""

    heard: Ints
    """(N,) number of emitters heard."""
    dilution: Floats
    """(N,) dilution of precision; NaN without a fix."""

    @property
    def share(self) -> float:
        """Share of the places where three emitters or more are heard."""
        return float(np.mean(self.heard >= ENOUGH))

    @property
    def fixed_share(self) -> float:
        """Share of the places where these ranges fix a position, with a dilution of at most `LARGEST_DILUTION`."""
        return float(np.mean(self.dilution <= LARGEST_DILUTION))

    @property
    def median_heard(self) -> float:
        """Median number of emitters heard."""
        return float(np.median(self.heard))

    @property
    def median_dilution(self) -> float:
        """Median dilution of precision over the places with a fix; NaN without any."""
        return median_of_finite(self.dilution)


def place_coverage(constellation: Constellation, position_m: Floats) -> PlaceCoverage:
    """Coverage at places (N, 3) in the tracker's frame [m]: emitters in whose range and cone a place lies."""
    ray_m = position_m[:, None] - constellation.position_m
    distance_m = np.sqrt(np.sum(ray_m**2, axis=-1))
    in_cone = np.sum(ray_m * constellation.normal, axis=-1) >= np.cos(constellation.cone_rad) * distance_m
    heard = (distance_m <= constellation.range_m) & in_cone & (distance_m > 0.0)
    unit = ray_m / np.where(distance_m > 0.0, distance_m, 1.0)[..., None]
    return PlaceCoverage(heard.sum(axis=-1), dilution_of_precision(unit, heard))


def plan_axes_m(constellation: Constellation) -> tuple[Floats, Floats]:
    """x and y of the places of a plan view, (PLAN_POINTS,) each: the emitters and a strip around them [m]."""
    low_m, high_m = np.min(constellation.position_m, axis=0), np.max(constellation.position_m, axis=0)
    x_m, y_m = (np.linspace(low_m[axis] - _MARGIN_M, high_m[axis] + _MARGIN_M, PLAN_POINTS) for axis in (0, 1))
    return x_m, y_m


def grid_m(x_m: Floats, y_m: Floats, z_m: Floats) -> Floats:
    """(X * Y * Z, 3) the places of a grid, z changing fastest [m]."""
    out: Floats = np.stack(np.meshgrid(x_m, y_m, z_m, indexing="ij"), axis=-1).reshape(-1, 3)
    return out


def median_of_finite(values: Floats) -> float:
    """Median of the finite values; NaN without any."""
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else float("nan")
