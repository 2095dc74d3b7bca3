"""True motion of trackers in the tracker's frame, block after block of ticks, and its kinematics for worn stations.

`station_states` takes the spline of a trajectory to poses, velocities and accelerations. It computes what
`Trajectory.station_motion` does, in the tracker's frame and with one pass over the bones for all stations. Each tick is
computed for itself, so the results do not depend on how ticks are cut into blocks, nor on the other stations.
"""

import math
from typing import NamedTuple, Protocol

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.core.compiled_rotations import as_tuple, quaternion_product, rotate
from harness.core.humanoid24 import QPOS_OF_DOF
from harness.core.skeleton import Skeleton

Point = tuple[Floats, Floats, Floats]
"""Position, velocity and acceleration of a point, (3,) each."""


class TrackerMotion(NamedTuple):
    """True motion of the origins of S stations at the T + 1 ticks of a block; the last tick begins the next block.

    Everything is in the tracker's frame: x forward, y right, z down.
    """

    time_s: Floats
    """(T+1,) times [s]."""
    position_m: Floats
    """(T+1, S, 3) positions [m]."""
    tracker_from_station: Floats
    """(T+1, S, 4) unit quaternions, signs continuous in time, also from block to block."""
    velocity_m_s: Floats
    """(T+1, S, 3) velocities: the derivatives of the positions [m/s]."""
    turn_rad_s: Floats
    """(T+1, S, 3) angular velocities in the tracker's axes [rad/s]."""

    def points(self, offset_m: Floats) -> tuple[Floats, Floats]:
        """Positions [m] and velocities [m/s], (T+1, S, 3), of a point (3,) fixed to each station, in its axes [m]."""
        arm_m = rotations.rotate(self.tracker_from_station, offset_m)
        return self.position_m + arm_m, self.velocity_m_s + rotations.cross(self.turn_rad_s, arm_m)


class TrackerMotionSource(Protocol):
    """True motion of stations, in a body's motion or free."""

    @property
    def stations(self) -> tuple[str, ...]: ...

    def sample_motion(self, time_s: Floats) -> TrackerMotion:
        """Motion at the ticks (T+1,) of the next block [s]. Blocks follow one another; the result may depend on all."""
        ...

    def performer_m(self, time_s: Floats) -> Floats:
        """(F, 3) place of the performer at F times [s]; it does not depend on which stations are worn."""
        ...

    def qpos(self, time_s: Floats) -> Floats | None:
        """(F, 55) configurations of the body at F times [s]; None when no body is in the room."""
        ...


class StationChain(NamedTuple):
    """N bones from the root to S stations, parents before children; K hinges, outermost first within each bone."""

    parent: Ints
    """(N,) row of each bone's parent; -1 is the root."""
    hinge: Ints
    """(N + 1,) first hinge of each bone, and K."""
    column: Ints
    """(K,) column of each hinge in a configuration."""
    axis: Floats
    """(K, 3) axis of each hinge."""
    bone_m: Floats
    """(N, 3) from a bone's joint to its far end [m]."""
    station_bone: Ints
    """(S,) row of each station's bone."""
    mount_m: Floats
    """(S, 3) origin of each station in its bone's axes [m]."""
    bone_from_station: Floats
    """(S, 4) orientation of each station."""
    tracker_from_world: Floats
    """(4,) rotation to the tracker's axes."""
    origin_m: Floats
    """(3,) the tracker's origin in the world [m]."""


def station_chain(skeleton: Skeleton, calibration: Calibration) -> StationChain:
    """The bones and mounts of a calibration's stations."""
    needed = set[int]()
    for bone in map(skeleton.index, calibration.bones):
        while bone >= 0 and bone not in needed:
            needed.add(bone)
            bone = skeleton.parents[bone]
    bones = sorted(needed)
    row = {-1: -1} | {bone: n for n, bone in enumerate(bones)}
    hinges = [list(range(*skeleton.dof_of_bone[bone].indices(len(skeleton.axes))))[::-1] for bone in bones]
    flat = [d for own in hinges for d in own]
    return StationChain(
        parent=np.array([row[skeleton.parents[bone]] for bone in bones]),
        hinge=np.cumsum([0, *map(len, hinges)]),
        column=7 + QPOS_OF_DOF[flat],
        axis=skeleton.axes[flat],
        bone_m=skeleton.bone_m[bones],
        station_bone=np.array([row[skeleton.index(bone)] for bone in calibration.bones]),
        mount_m=np.array(calibration.mount_m),
        bone_from_station=np.array(calibration.bone_from_station),
        tracker_from_world=rotations.inverse(calibration.world_from_tracker),
        origin_m=np.array(calibration.tracker_origin_m),
    )


def station_states(
    chain: StationChain, pieces: Floats, knots_s: Floats, time_s: Floats
) -> tuple[TrackerMotion, Floats]:
    """Motion and accelerations (T, S, 3) [m/s^2] at increasing times (T,) [s], in the tracker's frame.

    The configurations are a cubic spline: `pieces` (4, P, 55), `knots_s` (P + 1,).

    Signs of quaternions are continuous in time, as they are in the spline.
    """
    shape = len(time_s), len(chain.station_bone)
    position_m, velocity_m_s, turn_rad_s, acceleration_m_s2 = (np.empty((*shape, 3)) for _ in range(4))
    out = TrackerMotion(time_s, position_m, np.empty((*shape, 4)), velocity_m_s, turn_rad_s)
    _chain_states(chain, pieces, knots_s, out, acceleration_m_s2)
    return out, acceleration_m_s2


@compiled
def _chain_states(
    chain: StationChain, pieces: Floats, knots_s: Floats, out: TrackerMotion, acceleration_m_s2: Floats
) -> None:
    time_s = out.time_s
    bones, stations, final = len(chain.parent), len(chain.station_bone), pieces.shape[1] - 1
    # Rows are bones, and the root last, where -1 finds it.
    turn, omega, alpha = np.empty((bones + 1, 4)), np.empty((bones + 1, 3)), np.empty((bones + 1, 3))
    start, speed, force = np.empty((bones + 1, 3)), np.empty((bones + 1, 3)), np.empty((bones + 1, 3))
    reach, root = np.empty(3), np.empty((3, 7))
    no_reach = np.zeros(3)
    piece = 0
    for k in range(len(time_s)):
        while piece < final and time_s[k] >= knots_s[piece + 1]:
            piece += 1
        h = time_s[k] - knots_s[piece]
        for c in range(7):
            root[0, c], root[1, c], root[2, c] = _evaluate(pieces, piece, c, h)
        _root_state(root, chain.tracker_from_world, chain.origin_m, turn[-1], omega[-1], alpha[-1])
        start[-1], speed[-1], force[-1] = root[0, :3], root[1, :3], root[2, :3]
        for b in range(bones):
            p = chain.parent[b]
            reach[:] = chain.bone_m[p] if p >= 0 else no_reach
            before, at = (start[p], speed[p], force[p]), (start[b], speed[b], force[b])
            _at_offset(turn[p], omega[p], alpha[p], before, reach, at)
            turn[b], omega[b], alpha[b] = turn[p], omega[p], alpha[p]
            for d in range(chain.hinge[b], chain.hinge[b + 1]):
                angle, rate, change = _evaluate(pieces, piece, chain.column[d], h)
                _turn_hinge(chain.axis[d], angle, rate, change, turn[b], omega[b], alpha[b])
        for s in range(stations):
            b = chain.station_bone[s]
            at = out.position_m[k, s], out.velocity_m_s[k, s], acceleration_m_s2[k, s]
            _at_offset(turn[b], omega[b], alpha[b], (start[b], speed[b], force[b]), chain.mount_m[s], at)
            out.turn_rad_s[k, s] = omega[b]
            q = quaternion_product(as_tuple(turn[b]), as_tuple(chain.bone_from_station[s]))
            for i in range(4):
                out.tracker_from_station[k, s, i] = q[i]


@compiled
def _evaluate(pieces: Floats, piece: int, column: int, h: float) -> tuple[float, float, float]:
    """Value and two derivatives of a cubic piece, `h` after its beginning."""
    a, b, c = pieces[0, piece, column], pieces[1, piece, column], pieces[2, piece, column]
    value = ((a * h + b) * h + c) * h + pieces[3, piece, column]
    return value, (3.0 * a * h + 2.0 * b) * h + c, 6.0 * a * h + 2.0 * b


@compiled
def _root_state(
    root: Floats, tracker_from_world: Floats, origin_m: Floats, turn: Floats, omega: Floats, alpha: Floats
) -> None:
    """Root state in the tracker's frame from the spline's values and derivatives (3, 7); it changes the first three."""
    # As in `Trajectory`: with p the splined quaternion and q = p / n, components of q' and q'' along q do not change
    # the angular velocity and its derivative. Here both are in the world's axes: 2 q' conj(q) and 2 q'' conj(q).
    place, rate, change = root[0, 3:], root[1, 3:], root[2, 3:]
    n = math.sqrt(place[0] * place[0] + place[1] * place[1] + place[2] * place[2] + place[3] * place[3])
    along = 0.0
    for i in range(4):
        place[i], rate[i], change[i] = place[i] / n, rate[i] / n, change[i] / n
        along += place[i] * rate[i]
    for i in range(4):
        change[i] -= 2.0 * along * rate[i]
    to_tracker, root_from_world = as_tuple(tracker_from_world), (place[0], -place[1], -place[2], -place[3])
    turn[0], turn[1], turn[2], turn[3] = quaternion_product(to_tracker, as_tuple(place))
    _, x, y, z = quaternion_product(as_tuple(rate), root_from_world)
    omega[0], omega[1], omega[2] = rotate(to_tracker, 2.0 * x, 2.0 * y, 2.0 * z)
    _, x, y, z = quaternion_product(as_tuple(change), root_from_world)
    alpha[0], alpha[1], alpha[2] = rotate(to_tracker, 2.0 * x, 2.0 * y, 2.0 * z)
    for i in range(3):
        root[0, i] -= origin_m[i]
    for i in range(3):
        root[i, 0], root[i, 1], root[i, 2] = rotate(to_tracker, root[i, 0], root[i, 1], root[i, 2])


@compiled
def _turn_hinge(
    axis: Floats, angle: float, rate: float, change: float, turn: Floats, omega: Floats, alpha: Floats
) -> None:
    """Add a hinge to the rotation, angular velocity and angular acceleration of what it carries."""
    x, y, z = rotate(as_tuple(turn), axis[0], axis[1], axis[2])
    alpha[0] += change * x + rate * (omega[1] * z - omega[2] * y)
    alpha[1] += change * y + rate * (omega[2] * x - omega[0] * z)
    alpha[2] += change * z + rate * (omega[0] * y - omega[1] * x)
    omega[0] += rate * x
    omega[1] += rate * y
    omega[2] += rate * z
    sine, cosine = math.sin(0.5 * angle), math.cos(0.5 * angle)
    # turn times (cosine, sine axis), with the axis already rotated: (cosine, sine (x, y, z)) times turn
    w, i, j, m = turn
    x, y, z = sine * x, sine * y, sine * z
    turn[0] = cosine * w - x * i - y * j - z * m
    turn[1] = cosine * i + x * w + y * m - z * j
    turn[2] = cosine * j - x * m + y * w + z * i
    turn[3] = cosine * m + x * j - y * i + z * w


@compiled
def _at_offset(turn: Floats, omega: Floats, alpha: Floats, before: Point, reach_m: Floats, out: Point) -> None:
    """Position, velocity and acceleration of a point of a rigid body, `reach_m` (3,) from another in its axes."""
    x, y, z = rotate(as_tuple(turn), reach_m[0], reach_m[1], reach_m[2])
    u, v, w = omega[1] * z - omega[2] * y, omega[2] * x - omega[0] * z, omega[0] * y - omega[1] * x
    place, speed, force = before
    out_place, out_speed, out_force = out
    out_place[0], out_place[1], out_place[2] = place[0] + x, place[1] + y, place[2] + z
    out_speed[0], out_speed[1], out_speed[2] = speed[0] + u, speed[1] + v, speed[2] + w
    out_force[0] = force[0] + (alpha[1] * z - alpha[2] * y) + (omega[1] * w - omega[2] * v)
    out_force[1] = force[1] + (alpha[2] * x - alpha[0] * z) + (omega[2] * u - omega[0] * w)
    out_force[2] = force[2] + (alpha[0] * y - alpha[1] * x) + (omega[0] * v - omega[1] * u)
