"""Moments of increments: planted motion, takes and databases, rooms that are turned, and too few examples."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.station_increments import StationIncrements
from harness.reconstruct.features.virtual_trackers import station_poses
from harness.reconstruct.solver.reading_prediction import (
    AGES,
    NEWEST_AGE,
    OLDEST_AGE,
    IncrementMoments,
    unlearnt_moments,
)
from tests.reconstruct.conftest import Scene, moved

AGE = np.arange(-NEWEST_AGE, OLDEST_AGE + 1)


def planted(walk: Scene, frames: int, rate_hz: float = 40.0, yaw_rad_s: float = 0.0) -> BodyMotion:
    """A posture that glides at 0.4, -0.3, 0.1 m/s, or turns about the vertical."""
    at_s = np.arange(frames) / rate_hz
    qpos = np.tile(walk.take.qpos[30], (frames, 1))
    qpos[:, :3] += at_s[:, None] * (np.array([0.4, -0.3, 0.1]) if yaw_rad_s == 0.0 else 0.0)
    qpos[:, 3:7] = rotations.multiply(rotations.about_z(yaw_rad_s * at_s), qpos[:, 3:7])
    return BodyMotion("glide", "p1", "builtin", "gliding", rate_hz, qpos)


def learn(walk: Scene, takes: list[BodyMotion]) -> IncrementMoments:
    return StationIncrements(walk.body, takes).moments(walk.calibration)


@pytest.mark.parametrize(("rate_hz", "step"), [(40.0, 1), (30.0, 1), (60.0, 2), (120.0, 3)])
def test_stations_of_a_body_that_glides_share_its_increments(walk: Scene, rate_hz: float, step: int) -> None:
    """At any rate the ages reach 0.6 s back."""
    found = learn(walk, [planted(walk, 150, rate_hz)])
    assert found.period_s == pytest.approx(step / rate_hz)
    assert OLDEST_AGE * found.period_s >= 0.6 - 1e-9
    outer = np.outer(AGE, AGE) * found.period_s**2
    for one in range(6):
        for other in range(6):
            np.testing.assert_allclose(found.table[0, one, :, other], 0.5 * (0.4**2 + 0.3**2) * outer, atol=1e-12)
            np.testing.assert_allclose(found.table[1, one, :, other], 0.1**2 * outer, atol=1e-12)
    np.testing.assert_allclose(found.table[2:], 0.0, atol=1e-12)


def test_turns_are_rotation_vectors_about_the_axes_of_the_world(walk: Scene) -> None:
    found = learn(walk, [planted(walk, 100, yaw_rad_s=1.5)])
    outer = np.outer(AGE, AGE) * found.period_s**2
    for one in range(6):
        for other in range(6):
            np.testing.assert_allclose(found.table[3, one, :, other], 1.5**2 * outer, atol=1e-9)
    np.testing.assert_allclose(found.table[2], 0.0, atol=1e-9)


def written_out(walk: Scene, takes: list[BodyMotion]) -> Floats:
    """The moments of positions (2, S, A, S, A), with each frame of each take that has all ages."""
    rows: list[list[Floats]] = []
    for take in takes:
        at_m, _ = station_poses(walk.body, take, walk.calibration)
        now = range(OLDEST_AGE, len(take) - NEWEST_AGE)
        rows.extend([at_m[n - age] - at_m[n] for age in AGE] for n in now)
    increments = np.array(rows)  # (N, A, S, 3)
    each = np.einsum("nasi,nbti->isatb", increments, increments) / len(increments)
    return np.array([0.5 * (each[0] + each[1]), each[2]])


def test_moments_are_means_over_all_takes_each_by_itself(walk: Scene) -> None:
    takes = [walk.examples[0], planted(walk, 20), walk.take]
    np.testing.assert_allclose(learn(walk, takes).table[:2], written_out(walk, takes), atol=1e-9)


def test_of_long_examples_some_frames_are_averaged(walk: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are evenly spaced, so that the moments are nearly those of all frames."""
    whole = learn(walk, walk.examples).table
    monkeypatch.setattr("harness.reconstruct.features.station_increments._SAMPLE", 350)
    part = learn(walk, walk.examples).table
    assert (part != whole).any()
    np.testing.assert_allclose(part, whole, atol=0.02 * np.abs(whole).max())


def test_a_database_has_the_moments_of_its_takes(walk: Scene) -> None:
    database = MotionDatabase.build(walk.body, walk.examples)
    takes = StationIncrements(walk.body, walk.examples).moments(walk.calibration)
    found = StationIncrements(walk.body, database).moments(walk.calibration)
    assert found.period_s == takes.period_s
    for channel in range(4):
        scale = np.abs(takes.table[channel]).max()
        np.testing.assert_allclose(found.table[channel], takes.table[channel], atol=1e-5 * scale)


def test_a_room_that_is_turned_changes_nothing(walk: Scene) -> None:
    turned = [replace(take, qpos=moved(take.qpos, 1.1, (3.0, -2.0, 0.0))) for take in walk.examples]
    np.testing.assert_allclose(learn(walk, turned).table, learn(walk, walk.examples).table, atol=1e-10)


@pytest.mark.parametrize(("frames", "learnt"), [(AGES - 1 + 40, True), (AGES - 1 + 39, False), (10, False)])
def test_fewer_than_40_frames_teach_nothing(walk: Scene, frames: int, learnt: bool) -> None:
    found = learn(walk, [planted(walk, frames)])
    same = found.table.shape == (4, 6, AGES, 6, AGES) and (found.table == unlearnt_moments(6).table).all()
    assert same != learnt


def test_without_examples_moments_are_those_of_no_examples(walk: Scene) -> None:
    found = learn(walk, [])
    np.testing.assert_array_equal(found.table, unlearnt_moments(6).table)
    assert found.period_s == unlearnt_moments(6).period_s


def test_moments_of_a_calibration_are_learnt_once(walk: Scene) -> None:
    increments = StationIncrements(walk.body, walk.examples)
    assert increments.moments(walk.calibration) is increments.moments(walk.calibration)


def test_examples_of_a_slow_tracker_tell_ages_within_a_period(walk: Scene) -> None:
    """A body that swings once a second is told at 4 Hz nearly as at 40 Hz; straight lines would not do."""
    at_s = np.arange(401) / 40.0
    qpos = np.tile(walk.take.qpos[30], (len(at_s), 1))
    qpos[:, 0] += 0.2 * np.sin(2.0 * np.pi * at_s)
    fine = learn(walk, [BodyMotion("swing", "p1", "builtin", "swinging", 40.0, qpos)])
    slow = learn(walk, [BodyMotion("swing", "p1", "builtin", "swinging", 4.0, qpos[::10])])
    assert slow.period_s == pytest.approx(fine.period_s)
    now = NEWEST_AGE
    for ages in (5, 10, 20):
        told = slow.table[0, 0, now + ages, 0, now + ages]
        assert told == pytest.approx(fine.table[0, 0, now + ages, 0, now + ages], rel=0.05)
