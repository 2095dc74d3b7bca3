"""Detects unusual station orientations: on their straps (accepted) and in the room (refused).

A strap put on another way rotates a station on its bone by the same rotation in every pose; calibration estimates it.
A boresight or an alignment left on in the device (docs/is900.md 4.1, `B` and `A`) rotates every reported orientation
in the room. No mount explains that, and it shows because the poses rotate the bone.
"""

from collections.abc import Sequence

import numpy as np

from harness.body.mounts import Mount, locate_mount
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton

LEAST_ROTATION_RAD = float(np.deg2rad(30.0))
"""Smaller rotations than this are normal for straps [rad] [choice]."""
MOST_RESIDUAL_SHARE = 0.3
"""A rotation in the room is reported if it leaves at most this share of the squared angles [choice]. For 240 stations
without one, of performers with 5 deg of pose error, the smallest share was 0.33."""
_POSE_ERROR_RAD = float(np.deg2rad(8.0))
"""Angle off a mount, on each axis, that the pose errors of a good performer explain [rad] [choice]."""
_NEAR_AXIS = float(np.cos(np.deg2rad(20.0)))
_ROUNDS = 20


def strap_hints(skeleton: Skeleton, mounts: Sequence[Mount], bone_from_station: Floats) -> tuple[str, ...]:
    """Sentences about stations (S, 4) whose orientation is far from that of their nominal mounts."""
    hints = []
    for number, (mount, turn) in enumerate(zip(mounts, bone_from_station, strict=True), 1):
        off = rotations.log(rotations.multiply(rotations.inverse(locate_mount(skeleton, mount)[1]), turn))
        if np.linalg.norm(off) > LEAST_ROTATION_RAD:
            rotation = f"{rotation_text(off)} on its strap, in its own axes"
            hints.append(
                f"station {number} ({mount.station}) is rotated by {rotation}; the calibration accounts for it"
            )
    return tuple(hints)


def estimate_boresight_rad(world_from_bone: Floats, world_from_station: Floats) -> Floats:
    """(S, 3) rotation vector in the room that a boresight adds to each station's orientations [rad].

    Arguments are approximate bone orientations and reported station orientations, both (P, S, 3, 3). The result is 0
    where a mount explains the readings as well.
    """
    plain = _squared_residual(np.eye(3)[None, None], world_from_bone, world_from_station)
    if np.all(plain < 3.0 * len(world_from_bone) * _POSE_ERROR_RAD**2):
        return np.zeros((len(plain), 3))
    best, turn = plain, np.zeros((world_from_bone.shape[1], 3))
    for start in _INITIAL_ROTATIONS_RAD:
        room = np.tile(rotations.to_matrix(rotations.exp(start)), (len(turn), 1, 1))
        for _ in range(_ROUNDS):
            back = np.swapaxes(room, -1, -2)
            mounted = _mean(np.swapaxes(world_from_bone, -1, -2) @ back @ world_from_station)
            room = _mean(world_from_station @ np.swapaxes(world_from_bone @ mounted, -1, -2))
        left = _squared_residual(room, world_from_bone, world_from_station)
        rotation_rad = rotations.log(rotations.from_matrix(room))
        turn = np.where((left < best)[:, None], rotation_rad, turn)
        best = np.minimum(best, left)
    sure = (best < MOST_RESIDUAL_SHARE * plain) & (np.linalg.norm(turn, axis=1) > LEAST_ROTATION_RAD)
    return np.where(sure[:, None], turn, 0.0)


def rotation_text(turn_rad: Floats) -> str:
    """Text of a rotation vector (3,), such as "90 deg about z"."""
    angle = float(np.linalg.norm(turn_rad))
    axis = turn_rad / angle
    most = int(np.argmax(np.abs(axis)))
    if abs(axis[most]) >= _NEAR_AXIS:
        return f"{np.rad2deg(angle) * np.sign(axis[most]):.0f} deg about {'xyz'[most]}"
    return f"{np.rad2deg(angle):.0f} deg about ({', '.join(f'{x:.1f}' for x in axis)})"


_INITIAL_ROTATIONS_RAD = 0.5 * np.pi * np.concatenate([np.eye(3), -np.eye(3), 2.0 * np.eye(3)])


def _squared_residual(room: Floats, world_from_bone: Floats, world_from_station: Floats) -> Floats:
    """(S,) squared residual angles for a rotation in the room, with the mounts that fit best [rad^2]."""
    turned = room @ world_from_bone
    mounted = _mean(np.swapaxes(turned, -1, -2) @ world_from_station)
    off = rotations.log(rotations.from_matrix(np.swapaxes(turned @ mounted, -1, -2) @ world_from_station))
    return np.asarray(np.sum(off**2, axis=(0, 2)))


def _mean(turns: Floats) -> Floats:
    """(S, 3, 3) mean of rotations (P, S, 3, 3) over poses."""
    return rotations.nearest_rotation(turns.mean(axis=0))
