"""Acquisition: position, velocity and attitude of a lost station, out of the ranges of the last turns of emitters.

A lost station keeps its attitude by the gyroscopes, and gravity levels it slowly. Its specific force is integrated
twice in that attitude, so the path between two ranges is known but for a velocity, a heading and a small tilt. A fix
solves for them by Gauss-Newton, from the places of `trilateration` and four headings, first with the ranges that agree
with a place, then with all that fit. It is refused if the residuals stay large, if too few ranges fit or several are
early, if its emitters could not be heard, or if another place or heading fits as well.
"""

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.compiled import compiled
from harness.core.compiled_rotations import (
    Vector,
    quaternion_from_vector,
    quaternion_product,
    rotate,
    rotation_vector,
)
from harness.simulate.physics.filter_state import AcquisitionState, RangingModel, range_variance
from harness.simulate.physics.sound import level_db
from harness.simulate.physics.strapdown import MOTION_ERRORS, STATE, attitude, set_attitude
from harness.simulate.physics.trilateration import (
    EmitterCones,
    find_shortest,
    guess_places,
    latest_ranges,
)
from harness.simulate.readings import GRAVITY_M_S2

RANGE_FIELDS = 12
"""Numbers of a stored range: time [s] 0, range [m] 1, path of the inertial unit at its arrival [m] 2:5, microphone from
that unit [m] 5:8, the station's z axis 8:11, and the emitter's index 11."""
LEAST_WINDOW_SLOTS, LONGEST_WINDOW_SLOTS = 40, 80
"""Limits of the window whose ranges make a fix: 0.5 s and 1 s at the default rate [choice]."""
_LEAST_RANGES, _LEAST_EMITTERS = 10, 3
"""Ranges and emitters of a fix, more than the nine unknowns need [choice]. Both microphones give the heading."""
_LARGEST_RMS = 1.5
"""Root mean square of the residuals, in their standard deviations [choice]."""
_LARGEST_RESIDUAL = 3.0
"""Largest residual of a range that fits, in its standard deviations [choice]."""
_OUTLIER_SHARE = 0.7
"""Ranges whose residuals exceed this share of the largest are left out together [choice]."""
_MOST_EARLY = 1
"""Most early ranges of a fix [choice]."""
_REFITS = 5
"""Most fits of a guess, each to the ranges that fit the one before [choice]."""
_GUESSES = 3
"""Most places from which the search starts [choice]."""
_BEYOND_M, _BEYOND_COS, _BEYOND_DB = 0.05, 0.01, 0.5
"""Tolerances of a fix at the limits of the reach [m], of the cosine at the cone, and of the level [dB] [choice]."""
_HEADINGS = 4
_ITERATIONS = 15
"""Headings from which Gauss-Newton starts, and its most steps [choice]."""
_SMALL_STEP = 1e-5
"""Length of a step that ends the search [m], [rad]."""
_SPEED_SIGMA_M_S, _LARGEST_SPEED_M_S = 5.0, 15.0
"""Standard deviation of the speed of a lost station, and the largest speed of a fix [choice]."""
_DISTINCT_M, _DISTINCT_RAD = 0.05, 0.5
"""Differences at which two minima are different places or headings [choice]."""
_AMBIGUITY_MARGIN = 9.0
"""Least difference of the sums of squared residuals of two places: 3 standard deviations."""
_GRAVITY_S = 0.5
_LEVEL_SIGMA_RAD = 0.01
"""Time over which the specific force is averaged, and the least error of a level from it [choice]."""
_MOTION_M_S2 = 5.0
"""Acceleration that a motion may have whose variance is not yet known [choice]."""
_INFLATION = 2.0
"""Factor on the covariance of a fix, for what its model leaves out [choice]."""
FIRST_TILT_VARIANCE, _LEAST_TILT_VARIANCE = 1.0, 1e-6
"""Variance of the tilt at switch-on, and the least one [rad^2] [choice]."""


@compiled
def integrate_path(path: Floats, x: float, y: float, z: float, duration_s: float) -> None:
    """Integrate a velocity increment without gravity, in the tracker's axes [m/s], into the path (7,)."""
    half = 0.5 * duration_s
    path[0] += half * (2.0 * path[3] + x)
    path[1] += half * (2.0 * path[4] + y)
    path[2] += half * (2.0 * path[5] + z)
    path[3] += x
    path[4] += y
    path[5] += z
    path[6] += duration_s


@compiled
def level_attitude(
    acquisition: AcquisitionState, s: int, motion: Floats, x: float, y: float, z: float, slot_s: float
) -> None:
    """Turn the attitude in `motion` (10,) towards level by the specific force (x, y, z) of a slot [m/s^2].

    The direction of the mean force is a measurement of the tilt, whose variance grows with that of the force. What
    station s has collected turns along.
    """
    gravity = acquisition.gravity[s]
    gravity[4] += 1.0
    share = max(1.0 / gravity[4], slot_s / _GRAVITY_S)
    dx, dy, dz = x - gravity[0], y - gravity[1], z - gravity[2]
    if gravity[4] > 1.0:
        gravity[3] = (1.0 - share) * (gravity[3] + share * (dx * dx + dy * dy + dz * dz))
    gravity[0] += share * dx
    gravity[1] += share * dy
    gravity[2] += share * dz
    length = np.sqrt(gravity[0] ** 2 + gravity[1] ** 2 + gravity[2] ** 2)
    variance = gravity[3] + (length - GRAVITY_M_S2) ** 2 + (_MOTION_M_S2 / gravity[4]) ** 2
    noise = (variance / GRAVITY_M_S2**2 + _LEVEL_SIGMA_RAD**2) * 0.5 * _GRAVITY_S / slot_s
    gain = acquisition.tilt_variance[s] / (acquisition.tilt_variance[s] + noise)
    acquisition.tilt_variance[s] *= 1.0 - gain
    across = np.sqrt(gravity[0] ** 2 + gravity[1] ** 2)
    angle = gain * np.arctan2(across, -gravity[2])
    turn = quaternion_from_vector(angle, 0.0, 0.0)
    if across > 1e-9:
        turn = quaternion_from_vector(-angle * gravity[1] / across, angle * gravity[0] / across, 0.0)
    set_attitude(motion, quaternion_product(turn, attitude(motion)))
    gravity[0], gravity[1], gravity[2] = rotate(turn, gravity[0], gravity[1], gravity[2])
    path = acquisition.path[s]
    path[0], path[1], path[2] = rotate(turn, path[0], path[1], path[2])
    path[3], path[4], path[5] = rotate(turn, path[3], path[4], path[5])
    for i in range(min(acquisition.range_count[s], acquisition.ranges.shape[1])):
        row = acquisition.ranges[s, i]
        for k in range(2, 11, 3):
            row[k], row[k + 1], row[k + 2] = rotate(turn, row[k], row[k + 1], row[k + 2])


@compiled
def collect_ranges(acquisition: AcquisitionState, s: int, window_s: float, ranges: Floats) -> int:
    """Copy the ranges of the window into `heard` (N, 12), with times and paths from the present; their number."""
    path, kept = acquisition.path[s], 0
    for i in range(min(acquisition.range_count[s], acquisition.ranges.shape[1])):
        row = acquisition.ranges[s, i]
        since = row[0] - path[6]
        if since < -window_s:
            continue
        ranges[kept] = row
        ranges[kept, 0] = since
        for k in range(3):
            ranges[kept, 2 + k] = row[2 + k] - path[k] - path[3 + k] * since
        kept += 1
    return kept


@compiled
def count_emitters(ranges: Floats, used: Bools, emitters: int) -> int:
    """Number of different emitters among the ranges used (N,)."""
    present = np.zeros(emitters, dtype=np.bool_)
    total = 0
    for i in range(len(used)):
        j = int(ranges[i, 11])
        if used[i] and not present[j]:
            present[j] = True
            total += 1
    return total


@compiled
def normal_equations(
    model: RangingModel, ranges: Floats, used: Bools, motion: Floats, tilt_variance: float, matrix: Floats, side: Floats
) -> float:
    """Set the normal equations (9, 9), (9,) of a fix at `motion` (10,), whose attitude turns the kept one.

    Returns the sum of squared residuals in units of their variances, priors included.
    """
    matrix[:] = 0.0
    side[:] = 0.0
    total = 0.0
    slope = np.empty(MOTION_ERRORS)
    for i in range(len(used)):
        if not used[i]:
            continue
        residual, variance = range_residual(model, ranges[i], motion, slope)
        weight = 1.0 / variance
        total += residual * residual * weight
        for a in range(MOTION_ERRORS):
            side[a] += weight * slope[a] * residual
            for b in range(a + 1):
                matrix[a, b] += weight * slope[a] * slope[b]
    for k in range(3):
        weight = 1.0 / _SPEED_SIGMA_M_S**2
        matrix[3 + k, 3 + k] += weight
        side[3 + k] -= weight * motion[3 + k]
        total += weight * motion[3 + k] ** 2
    x, y, _ = rotate(attitude(motion), 0.0, 0.0, 1.0)
    matrix[6, 6] += 1.0 / tilt_variance
    matrix[7, 7] += 1.0 / tilt_variance
    side[6] += y / tilt_variance
    side[7] -= x / tilt_variance
    return total + (x * x + y * y) / tilt_variance


@compiled
def ray_to_microphone(model: RangingModel, row: Floats, motion: Floats) -> tuple[Vector, float, float, Vector]:
    """Where the emitter and microphone of a range (12,) are for a station at `motion` (10,).

    Returns direction and distance [m] from emitter to microphone, the cosine of the angle between the station's z axis
    and the direction to the emitter, and the microphone from the inertial unit's present place [m].
    """
    turn, since, emitter = attitude(motion), row[0], int(row[11])
    arm = rotate(turn, row[2] + row[5], row[3] + row[6], row[4] + row[7])
    x = motion[0] + motion[3] * since + arm[0] - model.emitter_m[emitter, 0]
    y = motion[1] + motion[4] * since + arm[1] - model.emitter_m[emitter, 1]
    z = motion[2] + motion[5] * since + arm[2] + 0.5 * GRAVITY_M_S2 * since * since - model.emitter_m[emitter, 2]
    distance = np.sqrt(x * x + y * y + z * z) + 1e-9
    x, y, z = x / distance, y / distance, z / distance
    zx, zy, zz = rotate(turn, row[8], row[9], row[10])
    return (x, y, z), distance, -(zx * x + zy * y + zz * z), arm


@compiled
def range_residual(model: RangingModel, row: Floats, motion: Floats, slope: Floats) -> tuple[float, float]:
    """Residual [m] and variance [m^2] of a range (12,) at `motion` (10,); sets its `slope` (9,)."""
    (x, y, z), distance, cos_station, (ax, ay, az) = ray_to_microphone(model, row, motion)
    since = row[0]
    variance = range_variance(model, int(row[11]), distance, x, y, z, cos_station)
    slope[0], slope[1], slope[2] = x, y, z
    slope[3], slope[4], slope[5] = since * x, since * y, since * z
    slope[6], slope[7], slope[8] = ay * z - az * y, az * x - ax * z, ax * y - ay * x
    return row[1] - distance, max(variance, 1e-12)


@compiled
def cholesky_inverse(matrix: Floats, inverse: Floats) -> bool:
    """Invert a symmetric positive definite matrix (N, N) given by its lower triangle; False if it is not definite.

    `np.linalg.inv` takes 1.3 times as long for 9 rows, and does not say whether the matrix is definite.
    """
    n = len(matrix)
    factor = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if i > j:
                factor[i, j] = total / factor[j, j]
            elif total > 1e-12 * matrix[i, i] and total > 0.0:
                factor[i, i] = np.sqrt(total)
            else:
                return False
    column = np.empty(n)
    for c in range(n):
        for i in range(n):
            total = 1.0 * (i == c)
            for k in range(i):
                total -= factor[i, k] * column[k]
            column[i] = total / factor[i, i]
        for i in range(n - 1, -1, -1):
            total = column[i]
            for k in range(i + 1, n):
                total -= factor[k, i] * column[k]
            column[i] = total / factor[i, i]
        inverse[:, c] = column
    return True


@compiled
def gauss_newton(
    model: RangingModel, ranges: Floats, used: Bools, motion: Floats, tilt_variance: float, inverse: Floats
) -> tuple[float, bool]:
    """Gauss-Newton from `motion` (10,), in place.

    Returns the sum of squared residuals, infinity where the unknowns are not determined, and whether the last step was
    small. It is not where wrong ranges pull far. `inverse` (9, 9) becomes the covariance.
    """
    matrix, side = np.empty((MOTION_ERRORS, MOTION_ERRORS)), np.empty(MOTION_ERRORS)
    step, converged = np.empty(MOTION_ERRORS), False
    for _ in range(_ITERATIONS):
        total = normal_equations(model, ranges, used, motion, tilt_variance, matrix, side)
        if not np.isfinite(total) or not cholesky_inverse(matrix, inverse):
            return np.inf, False
        for a in range(MOTION_ERRORS):
            step[a] = 0.0
            for b in range(MOTION_ERRORS):
                step[a] += inverse[a, b] * side[b]
        length = np.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
        turned = np.sqrt(step[6] ** 2 + step[7] ** 2 + step[8] ** 2)
        scale = 1.0 / max(1.0, length / 2.0, turned)  # at most 2 m and 1 rad at once
        for a in range(6):
            motion[a] += scale * step[a]
        turn = quaternion_from_vector(scale * step[6], scale * step[7], scale * step[8])
        set_attitude(motion, quaternion_product(turn, attitude(motion)))
        converged = length < _SMALL_STEP and turned < _SMALL_STEP
        if converged:
            break
    return normal_equations(model, ranges, used, motion, tilt_variance, matrix, side), converged


@compiled
def select_inliers(
    model: RangingModel, ranges: Floats, used: Bools, motion: Floats, inverse: Floats
) -> tuple[int, int]:
    """Use the ranges that fit `motion` (10,) and its covariance (9, 9); numbers of changes, and of early ranges.

    While a range that is used lies far off, the fit is a bad one: only what lies almost as far off is then left out.
    """
    slope, size, limit = np.empty(MOTION_ERRORS), np.empty(len(used)), _LARGEST_RESIDUAL
    for i in range(len(used)):
        residual, variance = range_residual(model, ranges[i], motion, slope)
        for a in range(MOTION_ERRORS):
            for b in range(MOTION_ERRORS):
                variance += slope[a] * inverse[a, b] * slope[b]
        size[i] = residual / np.sqrt(variance)
        if used[i]:
            limit = max(limit, _OUTLIER_SHARE * abs(size[i]))
    changes, early = 0, 0
    for i in range(len(used)):
        fits = abs(size[i]) < (limit if used[i] else _LARGEST_RESIDUAL)
        changes += fits != used[i]
        used[i] = fits
        early += not fits and size[i] < 0.0
    return changes, early


@compiled
def refit_inliers(
    model: RangingModel, ranges: Floats, used: Bools, motion: Floats, tilt_variance: float, inverse: Floats
) -> float:
    """Fit `motion` (10,) to the ranges used (N,), and again to all that fit it, until they stay the same.

    Late ranges that lie near a guess, as those over the floor of a station near it do, keep a fit from converging.
    Returns the sum of squared residuals, or infinity where the fit is refused. Each range left out counts as much as
    one at the limit, so that sums compare. `inverse` (9, 9) becomes the covariance.
    """
    for _ in range(_REFITS):
        total, converged = gauss_newton(model, ranges, used, motion, tilt_variance, inverse)
        if not np.isfinite(total):
            return np.inf
        changes, early = select_inliers(model, ranges, used, motion, inverse)
        if changes == 0:
            break
    left = np.sum(used)
    if (
        not converged
        or changes > 0
        or early > _MOST_EARLY
        or left < _LEAST_RANGES
        or total > _LARGEST_RMS**2 * (left - 7)
        or count_emitters(ranges, used, len(model.emitter_m)) < _LEAST_EMITTERS
    ):
        return np.inf
    return total + _LARGEST_RESIDUAL**2 * (len(ranges) - left)


@compiled
def is_audible(model: RangingModel, ranges: Floats, used: Bools, motion: Floats) -> bool:
    """Whether a station at `motion` (10,) could hear the emitters of all ranges used, by the law of `level_db`."""
    for i in range(len(used)):
        if not used[i]:
            continue
        j = int(ranges[i, 11])
        (x, y, z), distance, cos_station = ray_to_microphone(model, ranges[i], motion)[:3]
        cos_emitter = model.normal[j, 0] * x + model.normal[j, 1] * y + model.normal[j, 2] * z
        level = level_db(distance, cos_emitter, cos_station, model.absorption_db_per_m)
        if (
            distance > model.reach_m + _BEYOND_M
            or cos_emitter < model.cone_cos - _BEYOND_COS
            or level < model.threshold_db - _BEYOND_DB
        ):
            return False
    return True


@compiled
def are_distinct(motion: Floats, other: Floats) -> bool:
    """Whether two motions (10,) are different places or headings."""
    apart = (motion[0] - other[0]) ** 2 + (motion[1] - other[1]) ** 2 + (motion[2] - other[2]) ** 2
    q = attitude(other)
    x, y, z = rotation_vector(quaternion_product(attitude(motion), (q[0], -q[1], -q[2], -q[3])))
    return bool(apart > _DISTINCT_M**2 or x * x + y * y + z * z > _DISTINCT_RAD**2)


@compiled
def solve_position(
    model: RangingModel, acquisition: AcquisitionState, s: int, window_s: float, motion: Floats, covariance: Floats
) -> bool:
    """Try a fix of station s: True, with `motion` (10,) and the motion's part of P (15, 15) replaced, if it is clear.

    The attitude in `motion` is the kept one before the call.
    """
    ranges = np.empty((acquisition.ranges.shape[1], RANGE_FIELDS))
    ranges = ranges[: collect_ranges(acquisition, s, window_s, ranges)]
    emitters = len(model.emitter_m)
    shortest, latest = np.empty(len(ranges), dtype=np.bool_), np.empty((emitters, 2))
    find_shortest(ranges, shortest)
    latest_ranges(ranges, shortest, latest)
    places, supports = np.empty((_GUESSES, 3)), np.empty((_GUESSES, emitters), dtype=np.bool_)
    tilt_variance = max(acquisition.tilt_variance[s], _LEAST_TILT_VARIANCE)
    trials, totals = np.zeros((_GUESSES * _HEADINGS, STATE)), np.full(_GUESSES * _HEADINGS, np.inf)
    best_inverse, inverse = np.empty((MOTION_ERRORS, MOTION_ERRORS)), np.empty((MOTION_ERRORS, MOTION_ERRORS))
    used, best, audible = np.empty(len(ranges), dtype=np.bool_), 0, False
    cones = EmitterCones(model.emitter_m, model.normal, model.reach_m, model.cone_cos)
    for guess in range(guess_places(cones, latest, places, supports)):
        for heading in range(_HEADINGS):
            k = guess * _HEADINGS + heading
            for i in range(len(ranges)):
                used[i] = shortest[i] and supports[guess, int(ranges[i, 11])]
            trials[k, :3] = places[guess]
            set_attitude(trials[k], quaternion_from_vector(0.0, 0.0, 2.0 * np.pi * heading / _HEADINGS))
            totals[k] = refit_inliers(model, ranges, used, trials[k], tilt_variance, inverse)
            if totals[k] < totals[best] or k == 0:
                best = k
                best_inverse[:] = inverse
                audible = np.isfinite(totals[k]) and is_audible(model, ranges, used, trials[k])
    if not audible:
        return False
    for k in range(len(trials)):
        if totals[k] < totals[best] + _AMBIGUITY_MARGIN and are_distinct(trials[best], trials[k]):
            return False
    found = trials[best]
    if np.sqrt(found[3] ** 2 + found[4] ** 2 + found[5] ** 2) > _LARGEST_SPEED_M_S:
        return False
    turn = attitude(found)
    motion[:6] = found[:6]
    set_attitude(motion, quaternion_product(turn, attitude(motion)))
    covariance[:MOTION_ERRORS, :] = 0.0
    covariance[:, :MOTION_ERRORS] = 0.0
    for a in range(MOTION_ERRORS):
        for b in range(MOTION_ERRORS):
            covariance[a, b] = _INFLATION * best_inverse[max(a, b), min(a, b)]
    return True
