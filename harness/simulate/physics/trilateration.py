"""A first guess of the place of a lost station, and the emitters that it hears directly, from the ranges of a window.

A range is late if its sound came over a wall, and hardly ever early. So the direct ranges of an emitter are its
shortest ones, and a station cannot be where the range of any emitter would be early. Three emitters give a place by
trilateration. The guesses are those places that most emitters agree with.
"""

from typing import NamedTuple

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.compiled import compiled

_COMPANION_M = 0.3
"""Largest difference of two ranges of an emitter that support one another [m] [choice]."""
_SPREAD_M = 0.4
"""Largest difference of the direct ranges of an emitter in a window [m] [choice]."""
_LATEST_S = 0.02
"""Time in which the ranges of both microphones arrive, and what follows from the last of them [s] [choice]."""
_LEAST_HEIGHT_M = 0.2
"""Least distance of an emitter from the line through two others [m] [choice]."""
_AGREEMENT_M, _EARLY_M = 0.2, 0.3
"""Largest error of a range that agrees with a guess, and least one of a range that is early [m] [choice]."""
_SPEED_M_S = 4.0
"""Speed of a station: it adds to both errors for the age of a range [m/s] [choice]."""
_BEYOND_M, _BEYOND_COS = 0.1, 0.05
"""Tolerances at the limits of the reach [m] and of the cosine at the cone [choice]."""


class EmitterCones(NamedTuple):
    """Where J emitters are, and where they are heard."""

    position_m: Floats
    """(J, 3) positions."""
    normal: Floats
    """(J, 3) unit vectors along which they send."""
    reach_m: float
    """Largest distance to a microphone."""
    cone_cos: float
    """Least cosine of the angle between normal and sound."""


@compiled
def find_shortest(ranges: Floats, shortest: Bools) -> None:
    """Flag the ranges (N, 12) near the shortest one of their emitter that another range of it supports."""
    for i in range(len(ranges)):
        least = np.inf
        for a in range(len(ranges)):
            if ranges[a, 11] != ranges[i, 11] or ranges[a, 1] >= least:
                continue
            for b in range(len(ranges)):
                if a != b and ranges[b, 11] == ranges[a, 11] and abs(ranges[b, 1] - ranges[a, 1]) < _COMPANION_M:
                    least = ranges[a, 1]
                    break
        shortest[i] = least <= ranges[i, 1] < least + _SPREAD_M


@compiled
def latest_ranges(ranges: Floats, shortest: Bools, latest: Floats) -> None:
    """Set range [m] and age [s] of the latest flagged ranges of each emitter, (J, 2); NaN without any."""
    latest[:] = np.nan
    for i in range(len(ranges)):
        j = int(ranges[i, 11])
        if shortest[i] and not latest[j, 1] <= -ranges[i, 0]:
            latest[j, 1] = -ranges[i, 0]
    for j in range(len(latest)):
        total, count = 0.0, 0
        for i in range(len(ranges)):
            if shortest[i] and ranges[i, 11] == j and -ranges[i, 0] < latest[j, 1] + _LATEST_S:
                total += ranges[i, 1]
                count += 1
        if count > 0:
            latest[j, 0] = total / count


@compiled
def trilaterate(first: Floats, second: Floats, third: Floats, range_m: Floats, places: Floats) -> bool:
    """Set the two places (2, 3) at ranges (3,) from three points (3,) [m]; False if they lie nearly on a line.

    Where the ranges do not meet, both are the place between them in the plane of the points.
    """
    x, y, z = np.empty(3), np.empty(3), np.empty(3)
    base, along, height = 0.0, 0.0, 0.0
    for k in range(3):
        base += (second[k] - first[k]) ** 2
    base = np.sqrt(base)
    for k in range(3):
        x[k] = (second[k] - first[k]) / base
        along += x[k] * (third[k] - first[k])
    for k in range(3):
        y[k] = third[k] - first[k] - along * x[k]
        height += y[k] * y[k]
    height = np.sqrt(height)
    if height < _LEAST_HEIGHT_M:
        return False
    for k in range(3):
        y[k] /= height
    z[0], z[1], z[2] = x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]
    u = (range_m[0] ** 2 - range_m[1] ** 2 + base**2) / (2.0 * base)
    v = (range_m[0] ** 2 - range_m[2] ** 2 + along**2 + height**2 - 2.0 * along * u) / (2.0 * height)
    w = np.sqrt(max(range_m[0] ** 2 - u * u - v * v, 0.0))
    for k in range(3):
        middle = first[k] + u * x[k] + v * y[k]
        places[0, k], places[1, k] = middle - w * z[k], middle + w * z[k]
    return True


@compiled
def supporting_emitters(cones: EmitterCones, latest: Floats, place: Floats, support: Bools) -> int:
    """Flag the emitters (J,) that agree with a place (3,); their number, 0 if one is early or could not be heard."""
    count = 0
    for j in range(len(latest)):
        support[j] = False
        if np.isnan(latest[j, 0]):
            continue
        distance, depth = 0.0, 0.0
        for k in range(3):
            distance += (place[k] - cones.position_m[j, k]) ** 2
            depth += (place[k] - cones.position_m[j, k]) * cones.normal[j, k]
        distance = np.sqrt(distance)
        late, moved = latest[j, 0] - distance, _SPEED_M_S * latest[j, 1]
        if late < -_EARLY_M - moved:
            return 0
        if late < _AGREEMENT_M + moved:
            if distance > cones.reach_m + _BEYOND_M or depth < (cones.cone_cos - _BEYOND_COS) * distance:
                return 0
            support[j] = True
            count += 1
    return count


@compiled
def guess_places(cones: EmitterCones, latest: Floats, places: Floats, supports: Bools) -> int:
    """Set the places (K, 3) that most emitters agree with, and these emitters (K, J); the number of places.

    A place is left out if an earlier one agrees with the three emitters that it comes from.
    """
    heard = np.nonzero(~np.isnan(latest[:, 0]))[0]
    counts, found = np.zeros(len(places), dtype=np.int64), 0
    both, range_m, support = np.empty((2, 3)), np.empty(3), np.empty(len(latest), dtype=np.bool_)
    for a in range(len(heard)):
        for b in range(a):
            for c in range(b):
                first, second, third = heard[a], heard[b], heard[c]
                known = False
                for k in range(found):
                    known = known or (supports[k, first] and supports[k, second] and supports[k, third])
                if known:
                    continue
                range_m[0], range_m[1], range_m[2] = latest[first, 0], latest[second, 0], latest[third, 0]
                emitters = cones.position_m
                if not trilaterate(emitters[first], emitters[second], emitters[third], range_m, both):
                    continue
                for side in range(2):
                    count = supporting_emitters(cones, latest, both[side], support)
                    if count < 3 or not (support[first] and support[second] and support[third]):
                        continue
                    k = found if found < len(places) else int(np.argmin(counts))
                    if found == len(places) and counts[k] >= count:
                        continue
                    places[k], supports[k], counts[k] = both[side], support, count
                    found = max(found, k + 1)
    return found
