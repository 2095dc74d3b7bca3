"""Room and mounts in closed form: the hand-eye problem A X = Y B of several stations that share one room.

A station's orientation is `tracker_from_world * world_from_body * body_from_station`. Rotations come first, from the
Kronecker products of matrices (Shah 2013, J. Mechanisms Robotics 5); all stations share the first factor. Positions
follow by linear least squares, together with the scale of the tracker.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints, freeze
from harness.errors import NotComparable
from harness.measure.registration_model import RegistrationState

LEAST_TURN_RAD = 0.05
"""Least spread of the body's orientations about a second axis [rad]; a smaller one is motion about one axis."""

MOST_MEDIANS = 3.0
"""Pairs whose residual is larger than this many medians are left out of the trimmed solution [choice]."""
_MOST_STEPS = 10
_MOST_REFINED = 2000
"""About the most pairs of a station by which a solution is refined."""


@dataclass(frozen=True, eq=False)
class PosePairs:
    """N pairs of poses of one station at the same instants: reported, and those of its body."""

    position_m: Floats
    """(N, 3) reported position, tracker's frame [m]."""
    tracker_from_station: Floats
    """(N, 4) unit quaternions."""
    body_m: Floats
    """(N, 3) position of the body, world [m]."""
    world_from_body: Floats
    """(N, 4) unit quaternions."""

    def rows(self, chosen: Bools | Ints) -> "PosePairs":
        """Some of the pairs, by a mask (N,) or by their numbers."""
        return PosePairs(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))

    def __post_init__(self) -> None:
        freeze(self, position_m=("N", 3))
        count = len(self.position_m)
        freeze(self, tracker_from_station=(count, 4), body_m=(count, 3), world_from_body=(count, 4))


def solve_hand_eye(stations: Sequence[PosePairs], *, with_scale: bool = True) -> RegistrationState:
    """Solve for the room, the scale and the mount of each station by least squares; all other values are zero.

    NotComparable if no station turns about two axes: the room's and the mounts' turn about the only axis is then
    not observable.
    """
    require_two_axes(stations)
    room, mounts = _solve_rotations(stations)
    origin_m, scale, mount_m = _solve_positions(stations, room, with_scale)
    return RegistrationState(0.0, room, origin_m, scale, 0.0, 0.0, 0.0, 0.0, mounts, mount_m)


def most_likely_hand_eye(stations: Sequence[PosePairs], *, with_scale: bool = True) -> RegistrationState:
    """`solve_hand_eye`, refined by all pairs."""
    return refine_hand_eye(stations, solve_hand_eye(stations, with_scale=with_scale), with_scale=with_scale)


def solve_trimmed(stations: Sequence[PosePairs], *, with_scale: bool = True) -> RegistrationState:
    """As `solve_hand_eye`, of the pairs that agree: those far from the others are left out, again and again.

    So a stream that lost its place for a part of its time is registered by the rest (least trimmed squares). The result
    is refined.
    """
    state, kept = solve_hand_eye(stations, with_scale=with_scale), list(stations)
    for _ in range(_MOST_STEPS):
        far = [far_pairs(pairs, state, s) for s, pairs in enumerate(stations)]
        chosen = [pairs.rows(~mask) for pairs, mask in zip(stations, far, strict=True)]
        if all(len(a.position_m) == len(b.position_m) for a, b in zip(chosen, kept, strict=True)):
            break
        state, kept = solve_hand_eye(chosen, with_scale=with_scale), chosen
    thinned = [
        pairs.rows(np.arange(0, len(pairs.position_m), len(pairs.position_m) // _MOST_REFINED + 1)) for pairs in kept
    ]
    return refine_hand_eye(thinned, state, with_scale=with_scale)


def refine_hand_eye(
    stations: Sequence[PosePairs], state: RegistrationState, *, with_scale: bool = True
) -> RegistrationState:
    """The most likely room, scale and mounts near a state, by all pairs, for independent errors of unknown size.

    Gauss-Newton steps, where positions and orientations weigh by their own residuals. The rotations of the closed form
    do not see the positions.
    """
    size = 7 + 6 * len(stations)
    for _ in range(_MOST_STEPS):
        parts = [_linearise_pairs(pairs, state, s, size) for s, pairs in enumerate(stations)]
        normal, right = np.zeros((size, size)), np.zeros(size)
        for part in (0, 1):
            rest, slope = (np.concatenate([one[part][i] for one in parts]) for i in (0, 1))
            weight = 1.0 / max(float(np.mean(rest**2)), 1e-24)
            normal += weight * slope.T @ slope
            right += weight * slope.T @ rest
        free = [i for i in range(size) if with_scale or i != 6]
        step, inside = np.zeros(size), np.ix_(free, free)
        scale = np.sqrt(np.maximum(np.diag(normal)[free], 1e-300))
        step[free] = (
            np.linalg.lstsq(normal[inside] / scale[:, None] / scale, right[free] / scale, rcond=1e-12)[0] / scale
        )
        own = step[7:].reshape(-1, 6)
        state = replace(
            state,
            tracker_from_world=rotations.multiply(rotations.exp(step[:3]), state.tracker_from_world),
            tracker_origin_m=state.tracker_origin_m + step[3:6],
            scale=state.scale + float(step[6]),
            body_from_station=rotations.multiply(rotations.exp(own[:, :3]), state.body_from_station),
            mount_m=state.mount_m + own[:, 3:],
        )
        if np.abs(step).max() < 1e-10:
            break
    return state


def _linearise_pairs(
    pairs: PosePairs, state: RegistrationState, station: int, size: int
) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Residuals (3 N,) and slopes (3 N, size) of positions, then of orientations: room, origin, scale, mounts."""
    place, turn = pair_residuals(pairs, state, station)
    room, factor = rotations.to_matrix(state.tracker_from_world), 1.0 + state.scale
    in_room = (pairs.position_m - place) / factor
    of_place, of_turn = np.zeros((len(place), 3, size)), np.zeros((len(place), 3, size))
    own = 7 + 6 * station
    turned = room @ rotations.to_matrix(pairs.world_from_body)
    of_place[:, :, :3] = -factor * rotations.cross_matrix(in_room)
    of_place[:, :, 3:6] = -factor * room
    of_place[:, :, 6] = in_room
    of_place[:, :, own + 3 : own + 6] = factor * turned
    of_turn[:, :, :3] = np.eye(3)
    of_turn[:, :, own : own + 3] = turned
    return (place.ravel(), of_place.reshape(-1, size)), (turn.ravel(), of_turn.reshape(-1, size))


def pair_residuals(pairs: PosePairs, state: RegistrationState, station: int) -> tuple[Floats, Floats]:
    """What a state leaves of pairs of one station: positions (N, 3) [m], rotation vectors (N, 3) [rad]."""
    room = state.tracker_from_world
    at_m = pairs.body_m + rotations.rotate(pairs.world_from_body, state.mount_m[station]) - state.tracker_origin_m
    place = pairs.position_m - (1.0 + state.scale) * rotations.rotate(room, at_m)
    modelled = rotations.multiply(rotations.multiply(room, pairs.world_from_body), state.body_from_station[station])
    return place, rotations.log(rotations.multiply(pairs.tracker_from_station, rotations.inverse(modelled)))


def far_pairs(pairs: PosePairs, state: RegistrationState, station: int) -> Bools:
    """(N,) whether the position or the orientation of a pair is far from the model, against the median."""
    far = np.zeros(len(pairs.position_m), bool)
    for values in pair_residuals(pairs, state, station):
        length = np.linalg.norm(values, axis=1)
        far |= length > MOST_MEDIANS * max(float(np.median(length)), 1e-9)
    return far


def require_two_axes(stations: Sequence[PosePairs]) -> None:
    """Raise NotComparable unless a body turns about two axes."""
    spread = max((second_spread_rad(pairs.world_from_body) for pairs in stations), default=0.0)
    if not spread >= LEAST_TURN_RAD:
        raise NotComparable(
            f"The bodies turn about one axis only: {np.rad2deg(spread):.1f} deg (RMS) about a second one.",
            "Not observable: each mount's rotation about this axis, and its position along it. Turn about two axes.",
        )


def second_spread_rad(quaternions: Floats) -> float:
    """RMS rotation about the second axis of orientations (N, 4) relative to their mean [rad]; 0 without any."""
    if not len(quaternions):
        return 0.0
    mean = rotations.mean_rotation(quaternions)
    turns = rotations.log(rotations.multiply(rotations.inverse(mean), quaternions))
    return float(np.sqrt(max(np.linalg.eigvalsh(turns.T @ turns / len(turns))[1], 0.0)))


def _solve_rotations(stations: Sequence[PosePairs]) -> tuple[Floats, Floats]:
    """`tracker_from_world` (4,) and `body_from_station` (S, 4).

    R_m = X B Y gives vec(R_m Y^T B^T): the sum of R_m (x) B maps vec(Y) to a multiple of vec(X).
    """
    sums = []
    for pairs in stations:
        reported = rotations.to_matrix(pairs.tracker_from_station)
        body = rotations.to_matrix(pairs.world_from_body)
        # X[i,k] = sum over j, l of R_m[i,j] B[k,l] Y[l,j]
        sums.append(np.einsum("nij,nkl->iklj", reported, body).reshape(9, 9))
    left, _, _ = np.linalg.svd(np.concatenate(sums, axis=1))
    room = _nearest_rotation(left[:, 0].reshape(3, 3))
    mounts = _nearest_rotation(np.array([(total.T @ room.reshape(9)).reshape(3, 3) for total in sums]))
    return rotations.from_matrix(room), rotations.from_matrix(mounts)


def _nearest_rotation(matrix: Floats) -> Floats:
    """The rotations nearest to multiples, of either sign, of matrices (..., 3, 3)."""
    return rotations.nearest_rotation(matrix * np.sign(np.linalg.det(matrix))[..., None, None])


def _solve_positions(stations: Sequence[PosePairs], room: Floats, with_scale: bool) -> tuple[Floats, float, Floats]:
    """Origin (3,), scale and mounts (S, 3), from k p = R (b + B m - o), which is linear in k, o and m."""
    size = 4 + 3 * len(stations)
    normal, right = np.zeros((size, size)), np.zeros(size)
    for s, pairs in enumerate(stations):
        in_world = rotations.rotate(rotations.inverse(room), pairs.position_m)
        rows = np.zeros((len(in_world), 3, size))
        rows[:, :, 0] = in_world
        rows[:, :, 1:4] = np.eye(3)
        rows[:, :, 4 + 3 * s : 7 + 3 * s] = -rotations.to_matrix(pairs.world_from_body)
        values = pairs.body_m
        if not with_scale:
            values, rows[:, :, 0] = values - in_world, 0.0
        flat = rows.reshape(-1, size)
        normal += flat.T @ flat
        right += flat.T @ values.reshape(-1)
    solution: Floats = np.asarray(np.linalg.lstsq(normal, right, rcond=1e-12)[0], dtype=np.float64)
    factor = float(solution[0]) if with_scale else 1.0
    if not factor > 0.1:
        raise NotComparable(
            f"Reported positions explain {factor:.2f} of the motion.",
            "Not observable: the scale. Move through the room, and give the reference in metres.",
        )
    return solution[1:4], 1.0 / factor - 1.0, solution[4:].reshape(-1, 3)
