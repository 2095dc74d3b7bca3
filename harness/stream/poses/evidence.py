"""Units and the order of a quaternion, concluded from the numbers of a file."""

from datetime import UTC, datetime

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.units import LENGTH_UNITS_M, TIME_UNITS_S
from harness.stream.poses.pose_log import FileFinding

UNIX_S = (6.3e8, 4.1e9)
"""Range of Unix times that are taken for such: 1990 to 2099 [s] [choice]."""
_TICK, _TICKS = "100ns", (6.3e17, 6.8e17)
"""Unit of the ticks of .NET since the year 1, and their range from 1997 to 2155: as Unix times in ns, 1989 to 1991."""
_STEP_S = (2e-4, 10.0)
"""Range of steps between Unix times of which the unit is believed [s]."""
_USUAL_RATE_HZ = 60.0
_ROOM, _VEHICLE = 20.0, 200.0
"""Largest coordinate in a room [m], and above which a file in metres is one of a vehicle [choices]."""
_FASTEST = 20.0
"""Speed that a body, and hardly a vehicle, stays below [m/s] [choice]."""
_USUAL_M = (0.3, 12.0)
"""Largest coordinates that are usual [m]: units with which a file has such are named as alternatives [choice]."""
_FAR = 1e6
"""Coordinates of a map, in metres, reach above it: in millimetres it is a kilometre [choice]."""
_FULL_TURN = 6.3
_COARSE_STEPS = 0.1
"""Resolution of times, in median steps, from which on it is told [choice]."""
_LAG_S = 0.3
_MOST_PAIRS = 5000
_LEAST_EXPLAINED, _LEAST_MARGIN = 0.2, 0.15
"""Least share of the movement that a lever arm explains, and by which it explains more than with the other order,
for the order to count as shown [choices]. On 26 real files no wrong order was ahead by more than 0.08."""


def counts_samples(times: Floats) -> bool:
    """Whether times (N,), in order, are numbers of samples: whole, and mostly one apart."""
    steps = np.diff(times)
    return len(steps) > 0 and bool(np.all(times % 1.0 == 0.0)) and float(np.median(steps[steps > 0.0])) == 1.0


def conclude_time_unit(times: Floats, stated: str, given: str | None) -> FileFinding:
    """The unit of raw times (N,), in the order of time; `stated` is that of the column's name."""
    if given or stated:
        reason = "given by --time-unit" if given else "the column's name"
        return FileFinding("time unit", given or stated, reason)
    steps = np.diff(times)
    steps = steps[steps > 0.0]
    step = float(np.median(steps)) if len(steps) else 0.0
    if _TICKS[0] <= times[0] <= _TICKS[1]:
        return FileFinding("time unit", _TICK, "the first time is one of .NET, counted from the year 1")
    for name, unit_s in TIME_UNITS_S.items():
        if UNIX_S[0] <= times[0] * unit_s <= UNIX_S[1] and (not step or _STEP_S[0] <= step * unit_s <= _STEP_S[1]):
            day = datetime.fromtimestamp(float(times[0] * unit_s), UTC).date()
            return FileFinding("time unit", name, f"the first time is a Unix time of {day}")
    if not step:
        return FileFinding("time unit", "s", "there is one time only", assumed=True)
    usual = [each for each in TIME_UNITS_S if each != _TICK]
    name = min(usual, key=lambda each: abs(np.log(step * TIME_UNITS_S[each] * _USUAL_RATE_HZ)))
    step_s = step * TIME_UNITS_S[name]
    doubtful = not 1e-3 <= step_s <= 0.4
    return FileFinding("time unit", name, f"the median step of {step:.6g} is then {1e3 * step_s:.4g} ms", doubtful)


def conclude_resolution(times: Floats, scale_s: float) -> FileFinding | None:
    """The decimal to which raw times (N,), in order, were rounded; 1 in them is `scale_s`.

    None where it is fine beside the steps, and where all steps are multiples of the median one, as at an even rate.
    """
    steps = np.diff(times)
    steps = steps[steps > 0.0]
    if not len(steps):
        return None
    median = float(np.median(steps))
    for digits in range(-9, 7):
        grid = times * 10.0**digits
        exact = np.abs(grid - np.round(grid)) <= 1e-3 + 2.0 * np.spacing(np.abs(grid))
        if 10.0**-digits > 1.5 * steps.min() or not exact.all():
            continue
        multiples = np.round(steps / median)
        even = np.abs(steps - multiples * median) < 0.5 * 10.0**-digits
        if 10.0**-digits < _COARSE_STEPS * median or even.all():
            return None
        value = f"{1e3 * scale_s * 10.0**-digits:g} ms, where the median step is {1e3 * scale_s * median:.4g} ms"
        return FileFinding("time resolution", value, "all times are multiples of it, and steps differ")
    return None


def conclude_length_unit(
    positions: Floats,
    times_s: Floats | None,
    stated: str,
    given_m: float | None,
    *,
    reason: str = "the file's header",
) -> tuple[FileFinding, float]:
    """The unit of raw positions (N, 3) of one body, and its length [m]; times are None where a file has none.

    `reason` is why a `stated` unit counts.
    """
    if given_m is not None:
        return FileFinding("length unit", f"{given_m:g} m", "given by --unit"), given_m
    if stated:
        return FileFinding("length unit", stated, reason), LENGTH_UNITS_M[stated]
    size = float(np.percentile(np.abs(positions).max(axis=1), 95))
    speed = _speed(positions, times_s)
    shown = f"coordinates reach {size:.4g}" + (f" and speeds {speed:.4g} a second" if speed else "")
    spread = float(np.max(np.percentile(positions, 95, axis=0) - np.percentile(positions, 5, axis=0)))
    if size <= _ROOM:
        name, doubtful = "m", size > 0.2 * _ROOM
    elif size <= _VEHICLE:
        name, doubtful = ("m" if speed <= _FASTEST else "cm"), True
    else:
        name = "m" if speed <= 2.0 * _FASTEST and spread > _VEHICLE else "mm"
        doubtful = speed <= 2.0 * _FASTEST
        name = "m" if size > _FAR else name if times_s is not None else "mm"
    others = [
        unit
        for unit, unit_m in LENGTH_UNITS_M.items()
        if unit not in (name, "ft")
        and ((times_s is None and unit == "m") or _USUAL_M[0] <= size * unit_m <= _USUAL_M[1])
        and speed * unit_m <= _FASTEST
    ]
    if others:
        shown += f"; {' or '.join(others)} would fit as well: --unit decides"
    return FileFinding("length unit", name, shown, doubtful or bool(others)), LENGTH_UNITS_M[name]


def conclude_angle_unit(angles: Floats, stated: str, given: str) -> FileFinding:
    """The unit of angles, an array of any shape; `stated` is that of the columns' names, `given` that of an option."""
    if given or stated:
        return FileFinding("unit of angles", given or stated, "given by --euler" if given else "the columns' names")
    largest = float(np.nanmax(np.abs(angles), initial=0.0))
    if largest > _FULL_TURN:
        return FileFinding("unit of angles", "deg", f"they reach {largest:.4g}")
    doubt = f"they reach {largest:.4g}, less than a turn in radians; with degrees write :deg behind the axes"
    return FileFinding("unit of angles", "rad", doubt, assumed=True)


def _speed(positions: Floats, times_s: Floats | None) -> float:
    """Speed that is exceeded in a tenth of the time, over steps of 0.2 s; 0 without times."""
    if times_s is None or len(times_s) < 2:
        return 0.0
    later = np.searchsorted(times_s, times_s + 0.2)
    rows = np.flatnonzero(later < len(times_s))
    if not len(rows):
        return 0.0
    later = later[rows]
    moved = np.linalg.norm(positions[later] - positions[rows], axis=1)
    return float(np.percentile(moved / (times_s[later] - times_s[rows]), 90))


def conclude_quaternion_order(
    positions: Floats, quaternions: Floats, times_s: Floats, *, stated: str, reason: str, given: str | None, usual: str
) -> FileFinding:
    """The order of the components of raw quaternions (N, 4), as columns stand in the file.

    Norm and continuity are the same in each order. The order shows in the movement: a body that turns about a point
    away from its origin moves its origin by a lever arm, which is constant in the body's frame in the right order
    alone. `stated` is the order of the columns' names, whose evidence is `reason`; "" without names. `usual` is the
    order of such files.
    """
    if given:
        return FileFinding("quaternion order", given, "given by --quaternion")
    shares = {
        "xyzw": explained_by_lever_arm(positions, quaternions[:, [3, 0, 1, 2]], times_s),
        "wxyz": explained_by_lever_arm(positions, quaternions, times_s),
    }
    best, other = sorted(shares, key=shares.__getitem__, reverse=True)
    clear = shares[best] >= _LEAST_EXPLAINED and shares[best] - shares[other] >= _LEAST_MARGIN
    figures = f"a lever arm explains {shares[best]:.2f} of the movement, in the order {other} {shares[other]:.2f}"
    if stated:
        doubt = f"; but in the order {best} {figures}" if clear and best != stated else ""
        return FileFinding("quaternion order", stated, reason + doubt)
    if clear:
        return FileFinding("quaternion order", best, figures)
    return FileFinding("quaternion order", usual, "usual in such files, and the movement shows neither", assumed=True)


def explained_by_lever_arm(positions: Floats, quaternions: Floats, times_s: Floats) -> float:
    """Share of the squared displacements over 0.3 s that one lever arm in the body's frame explains, 0 to 1."""
    later = np.searchsorted(times_s, times_s + _LAG_S)
    rows = np.flatnonzero(later < len(times_s))
    rows = rows[:: len(rows) // _MOST_PAIRS + 1]
    if len(rows) < 10:
        return 0.0
    moved = positions[later[rows]] - positions[rows]
    total = float(np.sum(moved**2))
    turned = rotations.to_matrix(quaternions[later[rows]]) - rotations.to_matrix(quaternions[rows])
    if not 0.0 < total < np.inf:
        return 0.0
    arm = np.linalg.lstsq(turned.reshape(-1, 3), moved.ravel(), rcond=None)[0]
    return 1.0 - float(np.sum((moved - turned @ arm) ** 2)) / total
