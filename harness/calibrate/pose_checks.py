"""Checks of an eight-pose calibration: unusual station orientations, poses not held, exchanged stations.

A strap put on another way rotates a station on its bone by the same rotation in every pose; calibration estimates it.
A boresight or an alignment left on in the device (docs/is900.md 4.1, `B` and `A`) rotates every reported orientation
in the room. No mount explains that, and it shows because the poses rotate the bone. It is refused.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from harness.body import Mount, locate_mount
from harness.calibrate.bundle_adjustment import BundleAdjustment, ResidualScales
from harness.calibrate.bundle_fit import BundleFit, levenberg_marquardt_step
from harness.calibrate.hold import UnusableHold
from harness.calibrate.poses import POSES
from harness.calibrate.tpose_calibration import (
    LEVEL_FROM_TRACKER,
    exchange_error,
    possible_exchanges,
    require_heading,
)
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


MOST_POSE_ERROR_RAD = float(np.deg2rad(10.0))
"""Largest error of a pose's hinges, RMS [rad]: twice that of people who try, half that of a missing arm or leg
[choice]."""
OUTLIER_RATIO, OUTLIER_RAD = 2.0, float(np.deg2rad(5.0))
"""A pose is also refused if its error exceeds the median pose's by this ratio and exceeds this angle [choice]."""
_COST_RATIO, _COST_PER_READING = 0.5, 2.0
"""Stations are reported as exchanged when exchanging them leaves less than this share of the cost, and at most this
much cost per reading [choice]."""
_SCREENING_STEPS, _CANDIDATES, _FINAL_STEPS = 1, 4, 5
"""Every exchange is screened with one step; the best candidates get more."""


def require_no_boresight(bundle: BundleAdjustment) -> None:
    """UnusableHold when a station's orientations look rotated by a boresight or an alignment."""
    at = bundle.start()
    turn_rad = estimate_boresight_rad(
        bundle.forward_kinematics(at).world_from_bone[:, bundle.shared.carriers], bundle.turn
    )
    turn_rad = rotations.rotate(rotations.inverse(LEVEL_FROM_TRACKER), turn_rad)
    rotated_stations = np.flatnonzero(np.any(turn_rad != 0.0, axis=1))
    if len(rotated_stations) == 0:
        return
    mounts = bundle.shared.mounts
    rotated = "; ".join(f"station {j + 1} ({mounts[j].station}) {rotation_text(turn_rad[j])}" for j in rotated_stations)
    undo = ", ".join(f"b{j + 1}" for j in rotated_stations)
    raise UnusableHold(
        f"These stations report orientations with the same rotation in every pose (axes x forward, z down): {rotated}.",
        f"Undo the boresight (send {undo}) or the alignment (R) of these stations, or remove any rotation that is "
        "applied after reading; then hold the poses again.",
    )


def require_poses_held(bundle: BundleAdjustment, fit: BundleFit, numbers: Sequence[int]) -> None:
    """UnusableHold when a pose was not held as shown, or when stations are exchanged.

    `numbers` (P,) are the poses' indices in `poses.POSES`.
    """
    require_heading(fit.heading_sd_rad, bundle.shared.mounts)
    worst = int(np.argmax(fit.pose_error_rad))
    usual = OUTLIER_RATIO * float(np.median(fit.pose_error_rad))
    if fit.pose_error_rad[worst] <= min(MOST_POSE_ERROR_RAD, max(usual, OUTLIER_RAD)):
        return
    _require_no_exchange(bundle, fit)
    mounts = bundle.shared.mounts
    off_m = pose_distances_m(bundle, fit)[worst]
    station = int(np.argmax(off_m))
    off_deg, off_mm = np.rad2deg(fit.pose_error_rad[worst]), 1e3 * off_m[station]
    number = numbers[worst]
    raise UnusableHold(
        f"Pose {number + 1} ({POSES[number].name}) was not held as shown: hinges are {off_deg:.0f} deg off (RMS); "
        f"station {mounts[station].station!r} is the farthest from its place in it, {off_mm:.0f} mm.",
        f"Hold it again: {POSES[number].instruction}",
    )


def pose_distances_m(bundle: BundleAdjustment, fit: BundleFit) -> Floats:
    """(P, S) distance of stations from where they would be had the poses been held as shown, upright [m]."""
    as_shown = replace(fit.solution, world_from_root=bundle.start().world_from_root, angles_rad=bundle.nominal_rad)
    place_m = bundle.forward_kinematics(as_shown).place_m
    shift_m = np.median(bundle.place_m - place_m, axis=1, keepdims=True)
    return np.asarray(np.linalg.norm(bundle.place_m - place_m - shift_m, axis=2))


def _require_no_exchange(bundle: BundleAdjustment, fit: BundleFit) -> None:
    """UnusableHold when exchanging two stations, or all left and right ones, fits far better."""
    mounts = bundle.shared.mounts
    scales = ResidualScales(MOST_POSE_ERROR_RAD / 2.0, 1.0, fit.scales.skin_offset_m, 0.005, np.deg2rad(1.0))
    plain = _ExchangedFit(bundle, list(range(len(mounts))), scales)
    candidates = [(_ExchangedFit(bundle, rows, scales), pairs) for rows, pairs in possible_exchanges(mounts)]
    candidates = sorted(candidates, key=lambda each: each[0].cost(_SCREENING_STEPS))[:_CANDIDATES]
    best, pairs = min((each.cost(_FINAL_STEPS), pairs) for each, pairs in candidates)
    if best <= min(_COST_RATIO * plain.cost(_FINAL_STEPS), _COST_PER_READING * 6.0 * bundle.place_m[..., 0].size):
        raise exchange_error(mounts, pairs, "poses")


class _ExchangedFit:
    """A fit with the stations' readings in another order."""

    def __init__(self, bundle: BundleAdjustment, rows: list[int], scales: ResidualScales) -> None:
        self._bundle = BundleAdjustment(
            bundle.shared, bundle.nominal_rad, bundle.place_m[:, rows], bundle.turn[:, rows]
        )
        self._at, self._damping, self._given = self._bundle.start(), 1e-3, scales
        self._weight = np.ones((*bundle.place_m.shape[:2], 2))

    def cost(self, steps: int) -> float:
        """The cost after a number of further steps."""
        for _ in range(steps):
            normal = self._bundle.normal_equations(self._at, self._given, self._weight)
            self._at, self._damping, _ = levenberg_marquardt_step(
                self._bundle, self._at, normal, self._given, self._weight, self._damping
            )
        return self._bundle.cost(self._at, self._given, self._weight)
