"""Derivatives of the registration model."""

import numpy as np
import pytest

from harness.core import rotations
from harness.measure.pose_series import TruthSpline
from harness.measure.registration_model import OWN, SHARED, RegistrationState, linearise
from tests.measure.moving_bodies import Tracker, draw_mounts, move_bodies, report_poses

NAMES = ("hand", "head")


def make_state(rng: np.random.Generator) -> RegistrationState:
    mounts = draw_mounts(rng, NAMES)
    tracker = Tracker()
    return RegistrationState(
        10.0, tracker.room, tracker.origin_m, 0.01, 0.1, 4.0, 0.02, 1e-3,
        np.array([mounts[n][1] for n in NAMES]), np.array([mounts[n][0] for n in NAMES]),
    )  # fmt: skip


@pytest.mark.parametrize("column", range(SHARED + OWN))
def test_slopes_are_differences_of_the_model(column: int, rng: np.random.Generator) -> None:
    truth = TruthSpline(move_bodies(rng, ("head",), 20.0)["head"])
    state, measured_s = make_state(rng), np.linspace(6.0, 20.0, 30)
    zero, turn = np.zeros((30, 3)), truth.poses(np.linspace(2.0, 16.0, 30))[1]
    # Orientations near the modelled ones: a small residual rotates as a vector.
    at_start, _ = linearise(state, 1, measured_s, zero, turn, truth)
    turn = rotations.multiply(rotations.exp(-at_start[:, 3:]), turn)
    step = np.zeros(SHARED + 2 * OWN)
    step[column if column < SHARED else column + OWN] = 1e-6
    ahead, behind = (linearise(state.moved(sign * step), 1, measured_s, zero, turn, truth)[0] for sign in (1.0, -1.0))
    residual, slope = linearise(state, 1, measured_s, zero, turn, truth)
    np.testing.assert_allclose(residual[:, 3:], 0.0, atol=1e-9)
    difference = -(ahead - behind) / 2e-6
    np.testing.assert_allclose(slope[:, :, column], difference, atol=2e-4 * np.abs(difference).max() + 1e-6)


def test_reports_have_no_residual(rng: np.random.Generator) -> None:
    """The model agrees with reports that were made independently of it."""
    truths, mounts = move_bodies(rng, NAMES, 20.0), draw_mounts(rng, NAMES)
    tracker = Tracker(scale=0.01, heading_rad=0.1, ahead_s=0.02, offset_s=4.0, ratio=1e-3)
    poses = report_poses(rng, truths, mounts, tracker)["head"]
    state = RegistrationState(
        10.0, tracker.room, tracker.origin_m, 0.01, 0.1, 4.0, 0.02, 1e-3,
        np.array([mounts[n][1] for n in NAMES]), np.array([mounts[n][0] for n in NAMES]),
    )  # fmt: skip
    spline = TruthSpline(truths["head"])
    residual, _ = linearise(state, 1, poses.measured_s, poses.position_m, poses.tracker_from_station, spline)
    np.testing.assert_allclose(residual, 0.0, atol=1e-9)
