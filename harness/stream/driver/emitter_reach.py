"""How far from the tracker's origin a constellation reaches, for output lists of short range."""

from collections.abc import Iterable

import numpy as np

from harness.stream.codec.replies import Emitter

EMITTER_RANGE_M = 4.0
"""Largest distance at which an emitter is heard [m] (docs/is900.md 13.1)."""


def emitter_reach_m(emitters: Iterable[Emitter]) -> float:
    """Return the largest coordinate that stations before some emitter have at least [m]; 0 without emitters.

    A station can be anywhere on the emitter's axis up to its range. The point that is nearest to the origin counts: an
    emitter at the ceiling is no trouble for an origin at the floor.
    """
    reach_m = 0.0
    for emitter in emitters:
        position_m, normal = np.array(emitter.position_m), np.array(emitter.normal)
        ahead_m = np.clip(-np.dot(position_m, normal), 0.0, EMITTER_RANGE_M)
        reach_m = max(reach_m, float(np.abs(position_m + ahead_m * normal).max()))
    return reach_m
