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
from harness.reconstruct.solver.matrix_algebra import (
    angle_about,
    axis_rotation,
    cross,
    dot3,
    multiply,
    multiply_transposed,
    multiply_vector,
    shortest_rotation,
    transposed_multiply,
)
from harness.reconstruct.solver.quaternion_algebra import matrix_from_quaternion

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
    parent, bone = matrix_from_quaternion(hung.parent), matrix_from_quaternion(aim.turned)
    if aim.level == UPPER:
        if aim.facing:
            _set_ball(limb, angles, transposed_multiply(parent, bone))
        return
    if aim.here:
        _reach_point(limb, angles, parent, aim.point_m - hung.joint_m, aim, bone)
    if aim.facing:
        lower = multiply(multiply(parent, _ball_rotation(limb, angles)), axis_rotation(limb.hinge, angles[3]))
        _turn_end(limb, angles, aim.level, transposed_multiply(lower, bone))


@compiled
def _reach_point(limb: Limb, angles: Floats, parent: Floats, goal: Floats, aim: LimbTarget, turned: Floats) -> None:
    """To a goal (3,) seen from the joint, with orientations (3, 3) of the bones that carry limb and station."""
    twist = axis_rotation(limb.twist, angles[4])
    if aim.level == LOWER:
        beyond = aim.mount_m
    elif aim.level == TWIST and aim.facing:  # where the forearm starts turning, which its turning does not move
        goal = goal - multiply_vector(turned, aim.mount_m)
        beyond = limb.lower_m
    elif aim.level == TWIST:
        beyond = limb.lower_m + multiply_vector(twist, aim.mount_m)
    elif aim.facing:  # the end is where its own orientation puts it
        goal = goal - multiply_vector(turned, aim.mount_m)
        beyond = limb.lower_m + multiply_vector(twist, limb.twist_m)
    else:
        end = multiply(axis_rotation(limb.end[1], angles[6]), axis_rotation(limb.end[0], angles[5]))
        beyond = limb.lower_m + multiply_vector(twist, limb.twist_m + multiply_vector(end, aim.mount_m))
    far = np.sqrt(dot3(goal, goal))
    if far < 1e-9:
        return
    angles[3] = hinge_angle_rad(limb, beyond, far, angles[3])
    bend = axis_rotation(limb.hinge, angles[3])
    world = multiply(parent, _ball_rotation(limb, angles))
    way = goal / far
    world = multiply(
        shortest_rotation(multiply_vector(world, limb.upper_m + multiply_vector(bend, beyond)), way), world
    )
    if aim.facing:
        world = multiply(axis_rotation(way, _swivel(limb, aim.level, way, multiply(world, bend), turned)), world)
    _set_ball(limb, angles, transposed_multiply(parent, world))


@compiled
def hinge_angle_rad(limb: Limb, beyond_m: Floats, far_m: float, before_rad: float) -> float:
    """The angle of elbow or knee at which a point beyond it is `far_m` from the joint: the law of cosines.

    Of its two solutions the lawful one nearest to the angle before; as near as the limits and the lengths allow.
    """
    along = dot3(limb.hinge, beyond_m)
    flat = beyond_m - along * limb.hinge
    cosine, sine = dot3(limb.upper_m, flat), dot3(limb.upper_m, cross(limb.hinge, flat))
    wanted = 0.5 * (far_m**2 - dot3(limb.upper_m, limb.upper_m) - dot3(beyond_m, beyond_m))
    wanted -= along * dot3(limb.hinge, limb.upper_m)
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
        product = multiply_transposed(lower, turned)
        return -angle_about(way, product)
    if level == TWIST:
        have, want = multiply_vector(lower, limb.twist), multiply_vector(turned, limb.twist)
        across = dot3(have, want) - dot3(way, have) * dot3(way, want)
        return float(np.arctan2(dot3(way, cross(have, want)), across))
    if dot3(limb.twist, limb.twist) > 0.0:  # a hand's three hinges reach any orientation
        return 0.0
    # a foot's inner axis must stay square to its outer one
    inner, outer = multiply_vector(turned, limb.end[0]), multiply_vector(lower, limb.end[1])
    still = dot3(inner, way) * dot3(way, outer)
    cosine, sine = dot3(inner, outer) - still, dot3(inner, cross(way, outer))
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
        angles[4] = _clipped(limb, 4, _nearest_equivalent_angle(angle_about(limb.twist, lower_from_bone), angles[4]))
    elif level == END:
        inner, outer = limb.end[0], limb.end[1]
        third = cross(inner, outer)
        found = _euler(np.stack((inner, outer, third)), lower_from_bone)
        if dot3(limb.twist, limb.twist) > 0.0:
            sign = 1.0 if dot3(third, limb.twist) > 0.0 else -1.0
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
    inner = multiply(axis_rotation(limb.ball[1], angles[1]), axis_rotation(limb.ball[0], angles[0]))
    return multiply(axis_rotation(limb.ball[2], angles[2]), inner)


@compiled
def _euler(axes: Floats, turn: Floats) -> Floats:
    """Angles (3,) about right-handed axes (3, 3), innermost first (`core.hinges`)."""
    m = np.empty((3, 3))
    for j in range(3):
        column = multiply_vector(turn, axes[j])
        for i in range(3):
            m[i, j] = dot3(axes[i], column)
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
    return one if dot3(one - before, one - before) <= dot3(other - before, other - before) else other


@compiled
def _nearest_equivalent_angle(angle: float, other: float) -> float:
    return float(angle - 2.0 * np.pi * np.round((angle - other) / (2.0 * np.pi)))


@compiled
def _clipped(limb: Limb, k: int, angle: float) -> float:
    return float(min(max(angle, limb.low_rad[k]), limb.high_rad[k]))
