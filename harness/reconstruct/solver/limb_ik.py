"""Closed-form inverse kinematics of arms and legs: the analytic final step of Kim et al. 2012 (docs/papers.md B5).

A limb is a ball joint (three hinges), one hinge, and an end of two or three hinges. The distance from shoulder or hip
to a point beyond the elbow or knee depends on that one hinge alone, and the law of cosines gives its angle. The upper
bone is then rotated by the smallest turn that brings the point to its measured position. What remains free is the
swivel, a rotation about the line from joint to point. It stays as predicted unless a measured orientation determines
it: that of the shin or forearm, or of a foot, whose two hinges cannot reach every orientation. Hinges keep their
limits, at the cost of the point's position.
"""

from typing import NamedTuple

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.core.compiled_rotations import matrix_from_quaternion
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

UPPER, LOWER, TWIST, END = 0, 1, 2, 3
"""Levels, the bones of a limb: upper arm or thigh; forearm or shin; the twisting part of the forearm; hand or foot."""


class Limb(NamedTuple):
    """Hinge axes and bone vectors of a limb, in the frames of their bones."""

    ball: Floats
    """(3, 3) rows: the upper bone's hinges, innermost first, orthogonal and right-handed."""
    upper_m: Floats
    """(3,) from joint to elbow or knee."""
    hinge: Floats
    """(3,) axis of elbow or knee."""
    lower_m: Floats
    """(3,) from there to the end of the shin, or to where the forearm starts to twist."""
    twist: Floats
    """(3,) axis about which the forearm twists; 0 for a leg."""
    twist_m: Floats
    """(3,) from there to the wrist; 0 for a leg."""
    end: Floats
    """(2, 3) rows: the hinges of hand or foot, innermost first, orthogonal."""
    low_rad: Floats
    """(7,) lower limits of ball (3), hinge, twist, end (2)."""
    high_rad: Floats
    """(7,) upper limits."""


class LimbTarget(NamedTuple):
    """A station on a limb, and its measured pose."""

    level: int
    """The bone that carries it: UPPER, LOWER, TWIST or END."""
    mount_m: Floats
    """(3,) its position in that bone's frame [m]."""
    point_m: Floats
    """(3,) measured position [m], if `has_position`."""
    world_from_bone: Floats
    """(4,) measured orientation of that bone, if `has_orientation`."""
    has_position: bool
    has_orientation: bool


@compiled
def solve_limb(limb: Limb, angles: Floats, world_from_parent: Floats, joint_m: Floats, target: LimbTarget) -> None:
    """Change the angles (7,) of a limb, in place, so that its station gets the measured pose.

    It starts from a joint (3,) [m] on a bone of orientation `world_from_parent` (4,): shoulder or hip.
    """
    parent = matrix_from_quaternion(world_from_parent)
    bone = matrix_from_quaternion(target.world_from_bone)
    if target.level == UPPER:
        if target.has_orientation:
            _set_ball(limb, angles, transposed_multiply(parent, bone))
        return
    if target.has_position:
        _reach_point(limb, angles, parent, target.point_m - joint_m, target, bone)
    if target.has_orientation:
        lower = multiply(multiply(parent, _ball_rotation(limb, angles)), axis_rotation(limb.hinge, angles[3]))
        _turn_end(limb, angles, target.level, transposed_multiply(lower, bone))


@compiled
def _reach_point(
    limb: Limb, angles: Floats, parent: Floats, goal: Floats, target: LimbTarget, measured: Floats
) -> None:
    """Bring the station to a goal (3,) relative to the joint.

    `parent` and `measured` are orientations (3, 3): of the bone that carries the limb, and of the station's bone.
    """
    twist = axis_rotation(limb.twist, angles[4])
    if target.level == LOWER:
        beyond = target.mount_m
    elif target.level == TWIST and target.has_orientation:  # aim at where the twist starts: twisting does not move it
        goal = goal - multiply_vector(measured, target.mount_m)
        beyond = limb.lower_m
    elif target.level == TWIST:
        beyond = limb.lower_m + multiply_vector(twist, target.mount_m)
    elif target.has_orientation:  # aim at wrist or ankle: the measured orientation says where
        goal = goal - multiply_vector(measured, target.mount_m)
        beyond = limb.lower_m + multiply_vector(twist, limb.twist_m)
    else:
        end = multiply(axis_rotation(limb.end[1], angles[6]), axis_rotation(limb.end[0], angles[5]))
        beyond = limb.lower_m + multiply_vector(twist, limb.twist_m + multiply_vector(end, target.mount_m))
    distance = np.sqrt(dot3(goal, goal))
    if distance < 1e-9:
        return
    angles[3] = hinge_angle_rad(limb, beyond, distance, angles[3])
    bend = axis_rotation(limb.hinge, angles[3])
    world = multiply(parent, _ball_rotation(limb, angles))
    direction = goal / distance
    world = multiply(
        shortest_rotation(multiply_vector(world, limb.upper_m + multiply_vector(bend, beyond)), direction), world
    )
    if target.has_orientation:
        swivel = _swivel(limb, target.level, direction, multiply(world, bend), measured)
        world = multiply(axis_rotation(direction, swivel), world)
    _set_ball(limb, angles, transposed_multiply(parent, world))


@compiled
def hinge_angle_rad(limb: Limb, beyond_m: Floats, distance_m: float, before_rad: float) -> float:
    """The angle of elbow or knee at which a point beyond it is `distance_m` from the joint, by the law of cosines.

    Of the two solutions it is the one within the limits and nearest to `before_rad`, or as near to it as limits and
    lengths allow.
    """
    along = dot3(limb.hinge, beyond_m)
    flat = beyond_m - along * limb.hinge
    cosine, sine = dot3(limb.upper_m, flat), dot3(limb.upper_m, cross(limb.hinge, flat))
    projection = 0.5 * (distance_m**2 - dot3(limb.upper_m, limb.upper_m) - dot3(beyond_m, beyond_m))
    projection -= along * dot3(limb.hinge, limb.upper_m)
    swing = np.hypot(cosine, sine)
    if swing < 1e-12:
        return before_rad
    middle = np.arctan2(sine, cosine)
    half = np.arccos(min(max(projection / swing, -1.0), 1.0))
    low, high = limb.low_rad[3], limb.high_rad[3]
    best, least_cost = before_rad, np.inf
    for angle in (middle + half, middle - half):
        near = _nearest_equivalent_angle(angle, before_rad)
        clipped = min(max(near, low), high)
        cost = 100.0 * abs(near - clipped) + abs(clipped - before_rad)
        if cost < least_cost:
            best, least_cost = clipped, cost
    return best


@compiled
def _swivel(limb: Limb, level: int, direction: Floats, lower: Floats, measured: Floats) -> float:
    """The angle about `direction` (3,) by which forearm or shin (3, 3) comes nearest to the measured orientation."""
    if level == LOWER:  # maximises the trace of measured^T R(direction, angle) lower
        product = multiply_transposed(lower, measured)
        return -angle_about(direction, product)
    if level == TWIST:
        current, wanted = multiply_vector(lower, limb.twist), multiply_vector(measured, limb.twist)
        across = dot3(current, wanted) - dot3(direction, current) * dot3(direction, wanted)
        return float(np.arctan2(dot3(direction, cross(current, wanted)), across))
    if dot3(limb.twist, limb.twist) > 0.0:  # a hand's three hinges reach any orientation
        return 0.0
    # A foot has two hinges: its inner axis, as measured, must become perpendicular to the outer one on the shin.
    inner, outer = multiply_vector(measured, limb.end[0]), multiply_vector(lower, limb.end[1])
    still = dot3(inner, direction) * dot3(direction, outer)
    cosine, sine = dot3(inner, outer) - still, dot3(inner, cross(direction, outer))
    swing = np.hypot(cosine, sine)
    if swing < 1e-12:
        return 0.0
    middle, half = np.arctan2(sine, cosine), np.arccos(min(max(-still / swing, -1.0), 1.0))
    first, second = _nearest_equivalent_angle(middle + half, 0.0), _nearest_equivalent_angle(middle - half, 0.0)
    return first if abs(first) < abs(second) else second


@compiled
def _turn_end(limb: Limb, angles: Floats, level: int, lower_from_bone: Floats) -> None:
    """Set twist and end hinges for an orientation (3, 3) relative to the lower bone."""
    if level == TWIST:
        angles[4] = _clip(limb, 4, _nearest_equivalent_angle(angle_about(limb.twist, lower_from_bone), angles[4]))
    elif level == END:
        inner, outer = limb.end[0], limb.end[1]
        third = cross(inner, outer)
        euler = _euler(np.stack((inner, outer, third)), lower_from_bone)
        if dot3(limb.twist, limb.twist) > 0.0:
            sign = 1.0 if dot3(third, limb.twist) > 0.0 else -1.0
            before = np.array([angles[5], angles[6], sign * angles[4]])
            euler = _nearest_euler(euler, before)
            angles[4] = _clip(limb, 4, sign * euler[2])
        else:  # a foot has no third hinge: its angle is zero for orientations in reach, and ignored for others
            before = np.array([angles[5], angles[6], 0.0])
            euler = _nearest_euler(euler, before)
        angles[5], angles[6] = _clip(limb, 5, euler[0]), _clip(limb, 6, euler[1])


@compiled
def _set_ball(limb: Limb, angles: Floats, parent_from_upper: Floats) -> None:
    """Set the ball joint's hinges for an orientation (3, 3) of the upper bone relative to the limb's parent."""
    euler = _nearest_euler(_euler(limb.ball, parent_from_upper), angles[:3])
    for k in range(3):
        angles[k] = _clip(limb, k, euler[k])


@compiled
def _ball_rotation(limb: Limb, angles: Floats) -> Floats:
    """(3, 3) rotation of the upper bone relative to the limb's parent."""
    inner = multiply(axis_rotation(limb.ball[1], angles[1]), axis_rotation(limb.ball[0], angles[0]))
    return multiply(axis_rotation(limb.ball[2], angles[2]), inner)


@compiled
def _euler(axes: Floats, rotation: Floats) -> Floats:
    """Angles (3,) about right-handed orthogonal axes (3, 3) that give a rotation (3, 3); see `core.skeleton`."""
    m = np.empty((3, 3))
    for j in range(3):
        column = multiply_vector(rotation, axes[j])
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
def _nearest_euler(angles: Floats, before: Floats) -> Floats:
    """Representation of three hinges' rotation that is nearest to `before` (3,)."""
    first, second = np.empty(3), np.empty(3)
    for k in range(3):
        first[k] = _nearest_equivalent_angle(angles[k], before[k])
        second[k] = _nearest_equivalent_angle(np.pi - angles[k] if k == 1 else np.pi + angles[k], before[k])
    return first if dot3(first - before, first - before) <= dot3(second - before, second - before) else second


@compiled
def _nearest_equivalent_angle(angle: float, before: float) -> float:
    """The angle plus the full turns that bring it nearest to `before` [rad]."""
    return float(angle - 2.0 * np.pi * np.round((angle - before) / (2.0 * np.pi)))


@compiled
def _clip(limb: Limb, k: int, angle: float) -> float:
    """An angle within the limits of hinge k [rad]."""
    return float(min(max(angle, limb.low_rad[k]), limb.high_rad[k]))
