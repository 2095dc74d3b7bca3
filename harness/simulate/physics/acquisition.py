"""Acquisition: position, velocity and attitude of a lost station, out of the ranges of the last turns of emitters.

A lost station keeps its attitude by the gyroscopes, and gravity levels it slowly. Its specific force is integrated
twice in that attitude, so the path between two ranges is known but for a velocity, a heading and a small tilt. A fix
solves for them by Gauss-Newton, from four headings and from a place below the emitters. It leaves out a few ranges that
do not fit. It is refused if the residuals stay large, if too few ranges remain, or if two different places fit as well.
"""

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.compiled import compiled
from harness.core.compiled_rotations import quaternion_from_vector, quaternion_product, rotate, rotation_vector
from harness.simulate.physics.filter_state import AcquisitionState, RangingModel, range_variance
from harness.simulate.physics.strapdown import MOTION_ERRORS, STATE, attitude, set_attitude
from harness.simulate.readings import GRAVITY_M_S2

RANGE_FIELDS = 12
"""Numbers of a stored range: time [s] 0, range [m] 1, path of the inertial unit at its arrival [m] 2:5, microphone from
that unit [m] 5:8, the station's z axis 8:11, and the emitter's index 11."""
LEAST_WINDOW_SLOTS, LONGEST_WINDOW_SLOTS = 40, 80
"""Limits of the window whose ranges make a fix: 0.5 s and 1 s at the default rate [choice]."""
_LEAST_RANGES, _LEAST_EMITTERS = 10, 4
"""Ranges and emitters of a fix, more than the nine unknowns and the three places need [choice]."""
_LARGEST_RMS = 1.5
"""Root mean square of the residuals, in their standard deviations [choice]."""
_LARGEST_RESIDUAL = 3.0
"""Largest residual of a range that is kept, in its standard deviations [choice]."""
_OUTLIER_SHARE = 0.7
"""Ranges whose residuals exceed this share of the largest are left out together [choice]."""
_INLIER_SHARE = 0.75
"""Share of the ranges that a fix must keep [choice]."""
_HEADINGS = 4
_ITERATIONS = 15
"""Headings from which Gauss-Newton starts, and its most steps [choice]."""
_SMALL_STEP = 1e-5
"""Length of a step that ends the search [m], [rad]."""
_START_DISTANCE_M = 1.5
"""Distance from the emitters at which it starts, on the side of their normals [choice]."""
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
def range_residual(model: RangingModel, row: Floats, motion: Floats, slope: Floats) -> tuple[float, float]:
    """Residual [m] and variance [m^2] of a range (12,) at `motion` (10,); sets its `slope` (9,)."""
    turn, since, emitter = attitude(motion), row[0], int(row[11])
    ax, ay, az = rotate(turn, row[2] + row[5], row[3] + row[6], row[4] + row[7])
    x = motion[0] + motion[3] * since + ax - model.emitter_m[emitter, 0]
    y = motion[1] + motion[4] * since + ay - model.emitter_m[emitter, 1]
    z = motion[2] + motion[5] * since + az + 0.5 * GRAVITY_M_S2 * since * since - model.emitter_m[emitter, 2]
    distance = np.sqrt(x * x + y * y + z * z) + 1e-9
    x, y, z = x / distance, y / distance, z / distance
    zx, zy, zz = rotate(turn, row[8], row[9], row[10])
    variance = range_variance(model, emitter, distance, x, y, z, -(zx * x + zy * y + zz * z))
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
def reject_outliers(model: RangingModel, ranges: Floats, used: Bools, motion: Floats, most: int) -> int:
    """Leave out the ranges that fit worst, at most some: those beyond the limit and near the largest; their number."""
    slope, size = np.empty(MOTION_ERRORS), np.zeros(len(used))
    for i in range(len(used)):
        if used[i]:
            residual, variance = range_residual(model, ranges[i], motion, slope)
            size[i] = abs(residual) / np.sqrt(variance)
    limit = max(_LARGEST_RESIDUAL, _OUTLIER_SHARE * np.max(size))
    dropped = 0
    for i in range(len(used)):
        if size[i] > limit and dropped < most:
            used[i] = False
            dropped += 1
    return dropped


@compiled
def refit_inliers(
    model: RangingModel,
    ranges: Floats,
    motion: Floats,
    total: float,
    converged: bool,
    tilt_variance: float,
    inverse: Floats,
) -> float:
    """Leave out the few ranges that do not fit `motion` (10,), the minimum of all N, and fit again.

    `total` and `converged` are those of `gauss_newton`. Returns the sum of squared residuals, or infinity where the
    fit is refused. Each range left out counts as much as one at the limit, so that sums compare. `inverse` (9, 9)
    becomes the covariance.
    """
    used = np.ones(len(ranges), dtype=np.bool_)
    left, least = len(ranges), max(_LEAST_RANGES, int(np.ceil(_INLIER_SHARE * len(ranges))))
    while True:
        dropped = reject_outliers(model, ranges, used, motion, left - least + 1)
        left -= dropped
        if left < least:
            return np.inf
        if dropped == 0:
            break
        total, converged = gauss_newton(model, ranges, used, motion, tilt_variance, inverse)
        if not np.isfinite(total):
            return np.inf
    if (
        not converged
        or total > _LARGEST_RMS**2 * (left - 7)
        or count_emitters(ranges, used, len(model.emitter_m)) < _LEAST_EMITTERS
    ):
        return np.inf
    for i in range(len(ranges)):
        j = int(ranges[i, 11])
        side = 0.0
        for k in range(3):
            side += model.normal[j, k] * (motion[k] - model.emitter_m[j, k])
        if used[i] and side <= 0.0:
            return np.inf
    return total + _LARGEST_RESIDUAL**2 * (len(ranges) - left)


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
    everything = np.ones(len(ranges), dtype=np.bool_)
    if len(ranges) < _LEAST_RANGES or count_emitters(ranges, everything, len(model.emitter_m)) < _LEAST_EMITTERS:
        return False
    best, best_inverse = np.zeros(STATE), np.empty((MOTION_ERRORS, MOTION_ERRORS))
    least, next_least = np.inf, np.inf
    minima, refined, totals = np.zeros((_HEADINGS, STATE)), np.zeros((_HEADINGS, STATE)), np.full(_HEADINGS, np.inf)
    inverse = np.empty((MOTION_ERRORS, MOTION_ERRORS))
    tilt_variance = max(acquisition.tilt_variance[s], _LEAST_TILT_VARIANCE)
    for heading in range(_HEADINGS):
        trial = minima[heading]
        for i in range(len(ranges)):
            j = int(ranges[i, 11])
            for k in range(3):
                trial[k] += (model.emitter_m[j, k] + _START_DISTANCE_M * model.normal[j, k]) / len(ranges)
        set_attitude(trial, quaternion_from_vector(0.0, 0.0, 2.0 * np.pi * heading / _HEADINGS))
        total, converged = gauss_newton(model, ranges, everything, trial, tilt_variance, inverse)
        fresh = np.isfinite(total)
        for other in range(heading):
            fresh = fresh and are_distinct(trial, minima[other])
        if not fresh:
            continue
        refined[heading] = trial
        totals[heading] = refit_inliers(model, ranges, refined[heading], total, converged, tilt_variance, inverse)
        if totals[heading] < least:
            least = totals[heading]
            best[:] = refined[heading]
            best_inverse[:] = inverse
    if not np.isfinite(least):
        return False
    for heading in range(_HEADINGS):
        if np.isfinite(totals[heading]) and are_distinct(best, refined[heading]):
            next_least = min(next_least, totals[heading])
    speed = np.sqrt(best[3] ** 2 + best[4] ** 2 + best[5] ** 2)
    if next_least < least + _AMBIGUITY_MARGIN or speed > _LARGEST_SPEED_M_S:
        return False
    turn = attitude(best)
    for k in range(6):
        motion[k] = best[k]
    set_attitude(motion, quaternion_product(turn, attitude(motion)))
    covariance[:MOTION_ERRORS, :] = 0.0
    covariance[:, :MOTION_ERRORS] = 0.0
    for a in range(MOTION_ERRORS):
        for b in range(MOTION_ERRORS):
            covariance[a, b] = _INFLATION * best_inverse[max(a, b), min(a, b)]
    return True
