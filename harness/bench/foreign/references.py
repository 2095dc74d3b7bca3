"""What others compute of the same poses: a grid search of the time offset, OpenCV's hand-eye solvers, evo, allantools.

None of these functions uses the package's own estimators.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.measure import MeasuredPoses, TruthPoses

GRID_STEP_S, GRID_HALF_S = 0.002, 0.06
_LONGEST_STEP_S = 0.15
"""Longest step of a reference that is interpolated [s]."""
KEYFRAMES = 100
"""Pairs of poses that hand-eye solvers are given, evenly spaced."""


def search_offset(capture: MeasuredPoses, truth: TruthPoses, around_s: float) -> float:
    """Offset [s] near `around_s` at which orientations agree best in the mean square, on a grid, then by a parabola.

    At each offset the rotations of the hand-eye problem are those of Shah 2013.
    """
    from scipy.spatial.transform import Rotation, Slerp

    capture_turn = Rotation.from_quat(np.roll(capture.tracker_from_station[capture.valid], -1, axis=1))
    time_s = capture.measured_s[capture.valid]
    between = Slerp(truth.time_s, Rotation.from_quat(np.roll(truth.world_from_body, -1, axis=1)))

    def misfit(offset_s: float) -> float:
        at_s = time_s - offset_s
        after = np.clip(np.searchsorted(truth.time_s, at_s, side="right"), 1, len(truth.time_s) - 1)
        rows = (at_s >= truth.time_s[0]) & (at_s <= truth.time_s[-1])
        rows &= truth.time_s[after] - truth.time_s[after - 1] < _LONGEST_STEP_S
        first, second = capture_turn[rows], between(at_s[rows])
        products = np.einsum("nij,nkl->iklj", first.as_matrix(), second.as_matrix()).reshape(9, 9)
        room = _rotation(np.linalg.svd(products)[0][:, 0].reshape(3, 3))
        mount = _rotation((products.T @ room.ravel()).reshape(3, 3))
        rest = Rotation.from_matrix(room) * second * Rotation.from_matrix(mount) * first.inv()
        return float(np.mean(rest.magnitude() ** 2))

    grid_s = around_s + np.arange(-GRID_HALF_S, GRID_HALF_S + 0.5 * GRID_STEP_S, GRID_STEP_S)
    values = np.array([misfit(float(offset_s)) for offset_s in grid_s])
    best = int(np.clip(np.argmin(values), 1, len(values) - 2))
    left, middle, right = values[best - 1 : best + 2]
    return float(grid_s[best] + 0.5 * GRID_STEP_S * (left - right) / (left - 2.0 * middle + right))


def _rotation(matrix: Floats) -> Floats:
    left, _, right = np.linalg.svd(matrix * np.sign(np.linalg.det(matrix)))
    out: Floats = left @ right
    return out


@dataclass(frozen=True, eq=False)
class HandEye:
    """A solution of A X = Y B of one station, as homogeneous matrices."""

    mount: Floats
    """(4, 4) `body_from_station`."""
    room: Floats
    """(4, 4) `tracker_from_world`."""


def pose_matrices(position_m: Floats, quaternions: Floats) -> Floats:
    """(N, 4, 4) homogeneous matrices."""
    out = np.tile(np.eye(4), (len(position_m), 1, 1))
    out[:, :3, :3], out[:, :3, 3] = rotations.to_matrix(quaternions), position_m
    return out


def opencv_solutions(station: Floats, body: Floats) -> dict[str, HandEye]:
    """Solutions of OpenCV's solvers for poses (N, 4, 4) of a station and of its body; those without a number missing.

    `calibrateHandEye` gives the mount alone: its room is the best one for that mount.
    """
    import cv2

    cv: Any = cv2
    seen, carried = np.linalg.inv(station), np.linalg.inv(body)
    found = {}
    for name in ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS"):
        turn, place = cv.calibrateHandEye(
            list(body[:, :3, :3]), list(body[:, :3, 3]), list(seen[:, :3, :3]), list(seen[:, :3, 3]),
            method=getattr(cv, f"CALIB_HAND_EYE_{name}"),
        )  # fmt: skip
        mount = _join(turn, place)
        if np.isfinite(mount).all():
            found[name.lower()] = HandEye(mount, best_room(station, body, mount))
    for name in ("SHAH", "LI"):
        turn, place, own_turn, own_place = cv.calibrateRobotWorldHandEye(
            list(seen[:, :3, :3]), list(seen[:, :3, 3]), list(carried[:, :3, :3]), list(carried[:, :3, 3]),
            method=getattr(cv, f"CALIB_ROBOT_WORLD_HAND_EYE_{name}"),
        )  # fmt: skip
        mount = _join(own_turn, own_place)
        if np.isfinite(mount).all():
            found[name.lower()] = HandEye(_inverse(mount), _join(turn, place))
    return found


def _inverse(matrix: Floats) -> Floats:
    out: Floats = np.linalg.inv(matrix).astype(np.float64)
    return out


def _join(turn: Floats, place: Floats) -> Floats:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = turn, np.ravel(place)
    return out


def best_room(station: Floats, body: Floats, mount: Floats) -> Floats:
    """(4, 4) room that fits best to poses (N, 4, 4) with this mount, rotations first."""
    carried = body @ mount
    turn = _rotation((station[:, :3, :3] @ np.swapaxes(carried[:, :3, :3], 1, 2)).mean(axis=0))
    return _join(turn, (station[:, :3, 3] - carried[:, :3, 3] @ turn.T).mean(axis=0))


def hand_eye_residuals(station: Floats, body: Floats, found: HandEye) -> tuple[float, float]:
    """RMS of positions [m] and of orientations [rad] that a solution leaves."""
    from scipy.spatial.transform import Rotation

    modelled = found.room @ body @ found.mount
    place = np.linalg.norm(modelled[:, :3, 3] - station[:, :3, 3], axis=1)
    turn = Rotation.from_matrix(np.swapaxes(modelled[:, :3, :3], 1, 2) @ station[:, :3, :3]).magnitude()
    return float(np.sqrt(np.mean(place**2))), float(np.sqrt(np.mean(turn**2)))


def evo_alignment(reported_m: Floats, expected_m: Floats) -> tuple[float, float]:
    """Relative scale error, and RMS distance [m] of evo's alignment with scale, of matched positions (N, 3)."""
    from evo.core import metrics, trajectory

    time_s = np.arange(len(reported_m), dtype=np.float64)
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (len(reported_m), 1))
    truth = trajectory.PoseTrajectory3D(reported_m, turn, time_s)
    moved = trajectory.PoseTrajectory3D(expected_m, turn, time_s)
    _, _, factor = moved.align(truth, correct_scale=True)
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((truth, moved))
    return float(factor) - 1.0, float(error.get_statistic(metrics.StatisticsType.rmse))


def allantools_deviation(values: Floats, rate_hz: float, tau_s: Floats) -> Floats:
    """(K,) overlapping Allan deviations of columns (N, A) together, by allantools, at these averaging times."""
    import allantools

    squares = []
    for column in values.T:
        used_s, deviation, *_ = allantools.oadev(column, rate=rate_hz, data_type="freq", taus=tau_s)
        if len(used_s) != len(tau_s):
            raise ValueError("allantools left out an averaging time")
        squares.append(deviation**2)
    out: Floats = np.sqrt(np.mean(squares, axis=0))
    return out
