"""Room and mounts in closed form: the hand-eye problem A X = Y B of several stations that share one room.

A station's orientation is `tracker_from_world * world_from_body * body_from_station`. Rotations come first, from the
Kronecker products of matrices (Shah 2013, J. Mechanisms Robotics 5); all stations share the first factor. Positions
follow by linear least squares. Their scale is taken to be exact.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints, freeze
from harness.errors import NotComparable
from harness.measure.registration_fit import solve_normal
from harness.measure.registration_model import (
    AHEAD,
    CLOCK,
    HEADING,
    OFFSET,
    OWN,
    ROOM_ORIGIN,
    ROOM_TURN,
    SCALE,
    SHARED,
    RegistrationState,
)

LEAST_TURN_RAD = 0.05
"""Least spread of the body's orientations about a second axis [rad]; a smaller one is motion about one axis."""

MOST_MEDIANS = 3.0
"""Pairs whose residual is larger than this many medians are left out of the trimmed solution [choice]."""
_FIXED = (SCALE, HEADING, OFFSET, AHEAD, CLOCK)
"""Parameters of a registration that pairs at the same instants are taken not to need."""
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


def solve_hand_eye(stations: Sequence[PosePairs]) -> RegistrationState:
    """Solve for the room and the mount of each station by least squares; all other values are zero.

    NotComparable if no station turns about two axes: the room's and the mounts' turn about the only axis is then
    not observable.
    """
    require_two_axes(stations)
    room, mounts = _solve_rotations(stations)
    origin_m, mount_m = _solve_positions(stations, room)
    return RegistrationState(0.0, room, origin_m, 0.0, 0.0, 0.0, 0.0, 0.0, mounts, mount_m)


def most_likely_hand_eye(stations: Sequence[PosePairs]) -> RegistrationState:
    """`solve_hand_eye`, refined by all pairs."""
    return refine_hand_eye(stations, solve_hand_eye(stations))


def solve_trimmed(stations: Sequence[PosePairs]) -> RegistrationState:
    """As `solve_hand_eye`, of the pairs that agree: those far from the others are left out, again and again.

    So a stream that lost its place for a part of its time is registered by the rest (least trimmed squares). The result
    is refined.
    """
    state, kept = solve_hand_eye(stations), list(stations)
    for _ in range(_MOST_STEPS):
        far = [far_pairs(pairs, state, s) for s, pairs in enumerate(stations)]
        chosen = [pairs.rows(~mask) for pairs, mask in zip(stations, far, strict=True)]
        if all(len(a.position_m) == len(b.position_m) for a, b in zip(chosen, kept, strict=True)):
            break
        state, kept = solve_hand_eye(chosen), chosen
    thinned = [
        pairs.rows(np.arange(0, len(pairs.position_m), len(pairs.position_m) // _MOST_REFINED + 1)) for pairs in kept
    ]
    return refine_hand_eye(thinned, state)


def refine_hand_eye(stations: Sequence[PosePairs], state: RegistrationState) -> RegistrationState:
    """The most likely room and mounts near a state, by all pairs, for independent errors of unknown size.

    Gauss-Newton steps, where positions and orientations weigh by their own residuals. The rotations of the closed form
    do not see the positions.
    """
    size = SHARED + OWN * len(stations)
    for _ in range(_MOST_STEPS):
        parts = [_linearise_pairs(pairs, state, s, size) for s, pairs in enumerate(stations)]
        normal, right = np.zeros((size, size)), np.zeros(size)
        for part in (0, 1):
            rest, slope = (np.concatenate([one[part][i] for one in parts]) for i in (0, 1))
            weight = 1.0 / max(float(np.mean(rest**2)), 1e-24)
            normal += weight * slope.T @ slope
            right += weight * slope.T @ rest
        step = solve_normal(normal, right, _FIXED)
        state = state.moved(step)
        if np.abs(step).max() < 1e-10:
            break
    return state


def _linearise_pairs(
    pairs: PosePairs, state: RegistrationState, station: int, size: int
) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Residuals (3 N,) and slopes (3 N, size) of positions, then of orientations, by the parameters of a state."""
    place, turn = pair_residuals(pairs, state, station)
    room = rotations.to_matrix(state.tracker_from_world)
    of_place, of_turn = np.zeros((len(place), 3, size)), np.zeros((len(place), 3, size))
    own = SHARED + OWN * station
    turned = room @ rotations.to_matrix(pairs.world_from_body)
    of_place[:, :, ROOM_TURN] = -rotations.cross_matrix(pairs.position_m - place)
    of_place[:, :, ROOM_ORIGIN] = -room
    of_place[:, :, own + 3 : own + OWN] = turned
    of_turn[:, :, ROOM_TURN] = np.eye(3)
    of_turn[:, :, own : own + 3] = turned
    return (place.ravel(), of_place.reshape(-1, size)), (turn.ravel(), of_turn.reshape(-1, size))


def pair_residuals(pairs: PosePairs, state: RegistrationState, station: int) -> tuple[Floats, Floats]:
    """What a state leaves of pairs of one station: positions (N, 3) [m], rotation vectors (N, 3) [rad]."""
    room = state.tracker_from_world
    at_m = pairs.body_m + rotations.rotate(pairs.world_from_body, state.mount_m[station]) - state.tracker_origin_m
    place = pairs.position_m - rotations.rotate(room, at_m)
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


def _solve_positions(stations: Sequence[PosePairs], room: Floats) -> tuple[Floats, Floats]:
    """Origin (3,) and mounts (S, 3), from p = R (b + B m - o), which is linear in o and m."""
    size = 3 + 3 * len(stations)
    normal, right = np.zeros((size, size)), np.zeros(size)
    for s, pairs in enumerate(stations):
        rows = np.zeros((len(pairs.position_m), 3, size))
        rows[:, :, :3] = np.eye(3)
        rows[:, :, 3 + 3 * s : 6 + 3 * s] = -rotations.to_matrix(pairs.world_from_body)
        values = pairs.body_m - rotations.rotate(rotations.inverse(room), pairs.position_m)
        flat = rows.reshape(-1, size)
        normal += flat.T @ flat
        right += flat.T @ values.reshape(-1)
    solution: Floats = np.asarray(np.linalg.lstsq(normal, right, rcond=1e-12)[0], dtype=np.float64)
    return solution[:3], solution[3:].reshape(-1, 3)
