"""How stations are turned: on their straps, which calibration takes as they are, and in the room, which it cannot.

A strap put on another way round turns a station on its bone, the same in every pose. A station with a boresight or an
alignment of its own left on (docs/is900.md 4.1, `B` and `A`) reports every orientation turned in the room: no mount
explains that, and it shows because poses turn the bone.
"""

from collections.abc import Sequence

import numpy as np

from harness.body.mounts import Mount, locate_mount
from harness.calibrate.bundle_adjustment import mean_rotations
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton

LEAST_ROTATION_RAD = float(np.deg2rad(30.0))
"""Less than this is how straps sit [choice]."""
MOST_RESIDUAL_SHARE = 0.3
"""A turn in the room is believed when it leaves no more of the squared angles than this [choice]: of 240 stations of
performers who missed the poses by 5 deg and had none, the least that was left is 0.33."""
_POSE_ERROR_RAD = float(np.deg2rad(8.0))
"""Angles off a mount, on each axis, that a good performer's misses make of themselves [choice]."""
_NEAR_AXIS = float(np.cos(np.deg2rad(20.0)))
_ROUNDS = 20


def strap_hints(skeleton: Skeleton, mounts: Sequence[Mount], bone_from_station: Floats) -> tuple[str, ...]:
    """Words for each station (S, 4) that sits far turned from its nominal mount."""
    told = []
    for number, (mount, turn) in enumerate(zip(mounts, bone_from_station, strict=True), 1):
        off = rotations.log(rotations.multiply(rotations.inverse(locate_mount(skeleton, mount)[1]), turn))
        if np.linalg.norm(off) > LEAST_ROTATION_RAD:
            how = f"station {number} ({mount.station}) looks turned {rotation_text(off)} on its strap, in its own axes"
            told.append(f"{how}: taken as it is")
    return tuple(told)


def estimate_boresight_rad(world_from_bone: Floats, world_from_station: Floats) -> Floats:
    """(S, 3) rotation vector by which each station's orientations (P, S, 3, 3) look turned in the room, given how its
    bone (P, S, 3, 3) was about turned in each pose; 0 where a mount explains them as well [rad]."""
    plain = _squared_residual(np.eye(3)[None, None], world_from_bone, world_from_station)
    if np.all(plain < 3.0 * len(world_from_bone) * _POSE_ERROR_RAD**2):
        return np.zeros((len(plain), 3))
    best, turn = plain, np.zeros((world_from_bone.shape[1], 3))
    for start in _INITIAL_ROTATIONS_RAD:
        room = np.tile(rotations.to_matrix(rotations.exp(start)), (len(turn), 1, 1))
        for _ in range(_ROUNDS):
            back = np.swapaxes(room, -1, -2)
            mounted = mean_rotations(np.swapaxes(world_from_bone, -1, -2) @ back @ world_from_station)
            room = mean_rotations(world_from_station @ np.swapaxes(world_from_bone @ mounted, -1, -2))
        left = _squared_residual(room, world_from_bone, world_from_station)
        found = rotations.log(rotations.from_matrix(room))
        turn = np.where((left < best)[:, None], found, turn)
        best = np.minimum(best, left)
    sure = (best < MOST_RESIDUAL_SHARE * plain) & (np.linalg.norm(turn, axis=1) > LEAST_ROTATION_RAD)
    return np.where(sure[:, None], turn, 0.0)


def rotation_text(turn_rad: Floats) -> str:
    """Words for a rotation vector (3,): "90 deg about z"."""
    angle = float(np.linalg.norm(turn_rad))
    axis = turn_rad / angle
    most = int(np.argmax(np.abs(axis)))
    if abs(axis[most]) >= _NEAR_AXIS:
        return f"{np.rad2deg(angle) * np.sign(axis[most]):.0f} deg about {'xyz'[most]}"
    return f"{np.rad2deg(angle):.0f} deg about ({', '.join(f'{x:.1f}' for x in axis)})"


_INITIAL_ROTATIONS_RAD = 0.5 * np.pi * np.concatenate([np.eye(3), -np.eye(3), 2.0 * np.eye(3)])


def _squared_residual(room: Floats, world_from_bone: Floats, world_from_station: Floats) -> Floats:
    """(S,) squared angles that are left when stations are turned so in the room and mounted as fits best."""
    turned = room @ world_from_bone
    mounted = mean_rotations(np.swapaxes(turned, -1, -2) @ world_from_station)
    off = rotations.log(rotations.from_matrix(np.swapaxes(turned @ mounted, -1, -2) @ world_from_station))
    return np.asarray(np.sum(off**2, axis=(0, 2)))
