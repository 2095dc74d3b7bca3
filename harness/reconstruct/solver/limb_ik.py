"""Arms and legs put on their trackers in closed form: the analytic final step of Kim et al. 2012 (docs/methods.md B5).

A limb is a ball joint (three hinges), one hinge, and an end of two or three hinges. The distance from shoulder or hip
to a point beyond the elbow or knee depends on that one hinge alone, and the law of cosines gives its angle; the upper
bone is then turned the shortest way until the point lies where it was measured. What is left is a turn about the line
from joint to point. It stays as predicted, unless a measured orientation determines it: that of the shin or forearm, or
of a foot, whose two hinges cannot reach every orientation. Hinges keep their limits, at the point's cost.
The algebra of 3 x 3 matrices is at the end, for compiled functions call only those of their own file (`core.compiled`).
"""

from typing import NamedTuple

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled

UPPER, LOWER, TWIST, END = 0, 1, 2, 3
"""What carries a station: upper arm or thigh, forearm or shin on its hinge, the turning forearm, hand or foot."""


class Limb(NamedTuple):
    """Axes and vectors in the frames of their bones, as in the rest pose."""

    ball: Floats
    """(3, 3) rows: the upper bone's hinges, innermost first, orthogonal and right-handed."""
    upper_m: Floats
    """(3,) from joint to elbow or knee."""
    hinge: Floats
    """(3,) axis of elbow or knee."""
    lower_m: Floats
    """(3,) from there to the end of forearm or shin, or to where the forearm starts turning."""
    twist: Floats
    """(3,) axis about which the forearm turns; 0 for a leg."""
    twist_m: Floats
    """(3,) from there to the wrist; 0 for a leg."""
    end: Floats
    """(2, 3) rows: the hinges of hand or foot, innermost first, orthogonal."""
    low_rad: Floats
    """(7,) limits of ball (3), hinge, twist, end (2)."""
    high_rad: Floats


class LimbBase(NamedTuple):
    """Where a limb hangs."""

    parent: Floats
    """(4,) orientation of the bone that carries it."""
    joint_m: Floats
    """(3,) shoulder or hip."""


class LimbTarget(NamedTuple):
    """A station on a limb, and where it was measured."""

    level: int
    """What carries it."""
    mount_m: Floats
    """(3,) in that bone's frame."""
    point_m: Floats
    """(3,) position, if `here`."""
    turned: Floats
    """(4,) orientation of that bone, if `facing`."""
    here: bool
    facing: bool


@compiled
def solve_limb(limb: Limb, angles: Floats, hung: LimbBase, aim: LimbTarget) -> None:
    """Changes angles (7,) so that the station comes to where it was measured."""
    parent, bone = _matrix(hung.parent), _matrix(aim.turned)
    if aim.level == UPPER:
        if aim.facing:
            _set_ball(limb, angles, _transposed_multiply(parent, bone))
        return
    if aim.here:
        _reach_point(limb, angles, parent, aim.point_m - hung.joint_m, aim, bone)
    if aim.facing:
        lower = _multiply(_multiply(parent, _ball_rotation(limb, angles)), _axis_rotation(limb.hinge, angles[3]))
        _turn_end(limb, angles, aim.level, _transposed_multiply(lower, bone))


@compiled
def _reach_point(limb: Limb, angles: Floats, parent: Floats, goal: Floats, aim: LimbTarget, turned: Floats) -> None:
    """To a goal (3,) seen from the joint, with orientations (3, 3) of the bones that carry limb and station."""
    twist = _axis_rotation(limb.twist, angles[4])
    if aim.level == LOWER:
        beyond = aim.mount_m
    elif aim.level == TWIST and aim.facing:  # where the forearm starts turning, which its turning does not move
        goal = goal - _rotate(turned, aim.mount_m)
        beyond = limb.lower_m
    elif aim.level == TWIST:
        beyond = limb.lower_m + _rotate(twist, aim.mount_m)
    elif aim.facing:  # the end is where its own orientation puts it
        goal = goal - _rotate(turned, aim.mount_m)
        beyond = limb.lower_m + _rotate(twist, limb.twist_m)
    else:
        end = _multiply(_axis_rotation(limb.end[1], angles[6]), _axis_rotation(limb.end[0], angles[5]))
        beyond = limb.lower_m + _rotate(twist, limb.twist_m + _rotate(end, aim.mount_m))
    far = np.sqrt(_dot(goal, goal))
    if far < 1e-9:
        return
    angles[3] = hinge_angle_rad(limb, beyond, far, angles[3])
    bend = _axis_rotation(limb.hinge, angles[3])
    world = _multiply(parent, _ball_rotation(limb, angles))
    way = goal / far
    world = _multiply(_shortest_rotation(_rotate(world, limb.upper_m + _rotate(bend, beyond)), way), world)
    if aim.facing:
        world = _multiply(_axis_rotation(way, _swivel(limb, aim.level, way, _multiply(world, bend), turned)), world)
    _set_ball(limb, angles, _transposed_multiply(parent, world))


@compiled
def hinge_angle_rad(limb: Limb, beyond_m: Floats, far_m: float, before_rad: float) -> float:
    """The angle of elbow or knee at which a point beyond it is `far_m` from the joint: the law of cosines.

    Of its two solutions the lawful one nearest to the angle before; as near as the limits and the lengths allow.
    """
    along = _dot(limb.hinge, beyond_m)
    flat = beyond_m - along * limb.hinge
    cosine, sine = _dot(limb.upper_m, flat), _dot(limb.upper_m, _cross(limb.hinge, flat))
    wanted = 0.5 * (far_m**2 - _dot(limb.upper_m, limb.upper_m) - _dot(beyond_m, beyond_m))
    wanted -= along * _dot(limb.hinge, limb.upper_m)
    swing = np.hypot(cosine, sine)
    if swing < 1e-12:
        return before_rad
    middle = np.arctan2(sine, cosine)
    half = np.arccos(min(max(wanted / swing, -1.0), 1.0))
    low, high = limb.low_rad[3], limb.high_rad[3]
    best, least = before_rad, np.inf
    for angle in (middle + half, middle - half):
        near = _nearest_equivalent_angle(angle, before_rad)
        lawful = min(max(near, low), high)
        cost = 100.0 * abs(near - lawful) + abs(lawful - before_rad)
        if cost < least:
            best, least = lawful, cost
    return best


@compiled
def _swivel(limb: Limb, level: int, way: Floats, lower: Floats, turned: Floats) -> float:
    """The turn about `way` (3,) of forearm or shin (3, 3) that suits the measured orientation best."""
    if level == LOWER:  # the largest trace of turned^T R(way, angle) lower
        product = _multiply_transposed(lower, turned)
        skew = np.array([product[2, 1] - product[1, 2], product[0, 2] - product[2, 0], product[1, 0] - product[0, 1]])
        trace = product[0, 0] + product[1, 1] + product[2, 2]
        return -float(np.arctan2(_dot(way, skew), trace - _dot(way, _rotate(product, way))))
    if level == TWIST:
        have, want = _rotate(lower, limb.twist), _rotate(turned, limb.twist)
        across = _dot(have, want) - _dot(way, have) * _dot(way, want)
        return float(np.arctan2(_dot(way, _cross(have, want)), across))
    if _dot(limb.twist, limb.twist) > 0.0:  # a hand's three hinges reach any orientation
        return 0.0
    # a foot's inner axis must stay square to its outer one
    inner, outer = _rotate(turned, limb.end[0]), _rotate(lower, limb.end[1])
    still = _dot(inner, way) * _dot(way, outer)
    cosine, sine = _dot(inner, outer) - still, _dot(inner, _cross(way, outer))
    swing = np.hypot(cosine, sine)
    if swing < 1e-12:
        return 0.0
    middle, half = np.arctan2(sine, cosine), np.arccos(min(max(-still / swing, -1.0), 1.0))
    one, other = _nearest_equivalent_angle(middle + half, 0.0), _nearest_equivalent_angle(middle - half, 0.0)
    return one if abs(one) < abs(other) else other


@compiled
def _turn_end(limb: Limb, angles: Floats, level: int, lower_from_bone: Floats) -> None:
    """Twist and end hinges for an orientation (3, 3) relative to the lower bone."""
    if level == TWIST:
        angles[4] = _clipped(limb, 4, _nearest_equivalent_angle(_angle_about(limb.twist, lower_from_bone), angles[4]))
    elif level == END:
        inner, outer = limb.end[0], limb.end[1]
        third = _cross(inner, outer)
        found = _euler(np.stack((inner, outer, third)), lower_from_bone)
        if _dot(limb.twist, limb.twist) > 0.0:
            sign = 1.0 if _dot(third, limb.twist) > 0.0 else -1.0
            before = np.array([angles[5], angles[6], sign * angles[4]])
            found = _nearer_twin(found, before)
            angles[4] = _clipped(limb, 4, sign * found[2])
        else:  # without the third: zero wherever the hinges can reach
            before = np.array([angles[5], angles[6], 0.0])
            found = _nearer_twin(found, before)
        angles[5], angles[6] = _clipped(limb, 5, found[0]), _clipped(limb, 6, found[1])


@compiled
def _set_ball(limb: Limb, angles: Floats, parent_from_upper: Floats) -> None:
    found = _nearer_twin(_euler(limb.ball, parent_from_upper), angles[:3])
    for k in range(3):
        angles[k] = _clipped(limb, k, found[k])


@compiled
def _ball_rotation(limb: Limb, angles: Floats) -> Floats:
    inner = _multiply(_axis_rotation(limb.ball[1], angles[1]), _axis_rotation(limb.ball[0], angles[0]))
    return _multiply(_axis_rotation(limb.ball[2], angles[2]), inner)


@compiled
def _euler(axes: Floats, turn: Floats) -> Floats:
    """Angles (3,) about right-handed axes (3, 3), innermost first (`core.hinges`)."""
    m = np.empty((3, 3))
    for j in range(3):
        column = _rotate(turn, axes[j])
        for i in range(3):
            m[i, j] = _dot(axes[i], column)
    out = np.empty(3)
    level = np.hypot(m[2, 1], m[2, 2])
    out[1] = np.arctan2(-m[2, 0], level)
    if level < 1e-9:
        out[0], out[2] = 0.0, np.arctan2(-m[0, 1], m[1, 1])
    else:
        out[0], out[2] = np.arctan2(m[2, 1], m[2, 2]), np.arctan2(m[1, 0], m[0, 0])
    return out


@compiled
def _nearer_twin(angles: Floats, before: Floats) -> Floats:
    """The representation of three hinges' rotation that is nearest to angles (3,) before."""
    one, other = np.empty(3), np.empty(3)
    for k in range(3):
        one[k] = _nearest_equivalent_angle(angles[k], before[k])
        other[k] = _nearest_equivalent_angle(np.pi - angles[k] if k == 1 else np.pi + angles[k], before[k])
    return one if _dot(one - before, one - before) <= _dot(other - before, other - before) else other


@compiled
def _nearest_equivalent_angle(angle: float, other: float) -> float:
    return float(angle - 2.0 * np.pi * np.round((angle - other) / (2.0 * np.pi)))


@compiled
def _clipped(limb: Limb, k: int, angle: float) -> float:
    return float(min(max(angle, limb.low_rad[k]), limb.high_rad[k]))


@compiled
def _angle_about(axis: Floats, turn: Floats) -> float:
    """The turn about an axis that comes nearest to a rotation (3, 3)."""
    skew = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    trace = turn[0, 0] + turn[1, 1] + turn[2, 2]
    return float(np.arctan2(_dot(axis, skew), trace - _dot(axis, _rotate(turn, axis))))


@compiled
def _shortest_rotation(start: Floats, way: Floats) -> Floats:
    """(3, 3) the shortest turn of a vector (3,) into a direction (3,)."""
    length = np.sqrt(_dot(start, start))
    axis, cosine = _cross(start, way) / length, _dot(start, way) / length
    sine = np.sqrt(_dot(axis, axis))
    if sine < 1e-12:
        if cosine > 0.0:
            return np.eye(3)
        least = np.zeros(3)
        least[np.argmin(np.abs(way))] = 1.0
        axis = _cross(way, least)
        return _axis_rotation(axis / np.sqrt(_dot(axis, axis)), np.pi)
    return _axis_rotation(axis / sine, np.arctan2(sine, cosine))


@compiled
def _axis_rotation(axis: Floats, angle: float) -> Floats:
    """(3, 3) about a unit axis; nothing about a zero one."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = axis[0], axis[1], axis[2]
    if x * x + y * y + z * z == 0.0:
        return np.eye(3)
    u = 1.0 - c
    return np.array(
        [
            [c + u * x * x, u * x * y - s * z, u * x * z + s * y],
            [u * x * y + s * z, c + u * y * y, u * y * z - s * x],
            [u * x * z - s * y, u * y * z + s * x, c + u * z * z],
        ]
    )


@compiled
def _matrix(q: Floats) -> Floats:
    """(3, 3) of a unit quaternion."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


@compiled
def _dot(a: Floats, b: Floats) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@compiled
def _cross(a: Floats, b: Floats) -> Floats:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@compiled
def _rotate(turn: Floats, v: Floats) -> Floats:
    return np.array([_dot(turn[0], v), _dot(turn[1], v), _dot(turn[2], v)])


@compiled
def _multiply(a: Floats, b: Floats) -> Floats:
    out = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]
    return out


@compiled
def _multiply_transposed(a: Floats, b: Floats) -> Floats:
    """a b^T."""
    return _multiply(a, np.ascontiguousarray(b.T))


@compiled
def _transposed_multiply(a: Floats, b: Floats) -> Floats:
    """a^T b."""
    return _multiply(np.ascontiguousarray(a.T), b)
