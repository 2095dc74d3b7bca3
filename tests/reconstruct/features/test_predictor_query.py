"""Predictors of a session's frames, which readings it counts on, and when readings alone suffice."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core.arrays import Bools, Floats
from harness.reconstruct.features.predictor_query import PredictorQuery
from harness.reconstruct.features.reduced_rank_regression import ReducedRankRegression
from harness.reconstruct.methods.dynamic_map import DynamicMap
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.stream import TrackerFrame
from harness.testing.frames import drop_stations, exact_frames
from tests.reconstruct.conftest import Scene, moved

TORSO = 4
AT = 30
"""Frame of the scene that is looked at."""


@pytest.fixture(scope="module")
def regression(walk: Scene) -> ReducedRankRegression:
    return DynamicMap().fit(walk.body, walk.examples, np.random.default_rng(0)).regression(walk.calibration)


def query_of(walk: Scene, regression: ReducedRankRegression, frame: TrackerFrame) -> tuple[PredictorQuery, Residuals]:
    """A new session's query whose residuals have read a frame."""
    residuals = Residuals(walk.body, walk.calibration, Loss())
    residuals.read(frame)
    return PredictorQuery(regression, residuals), residuals


def past_of(walk: Scene, yaw_rad: float = 0.0) -> Floats:
    """(3, 55) true configurations before the frame, newest first."""
    return moved(walk.take.qpos[[AT - 1, AT - 2, AT - 3]], yaw_rad, (0.0, 0.0, 0.0))


def mask(*lost: int) -> Bools:
    out = np.ones(12, bool)
    out[list(lost)] = False
    return out


@pytest.mark.parametrize("inputs", ["pos+ori", "pos"])
def test_predictors_of_a_frame_are_those_of_an_example(
    walk: Scene, regression: ReducedRankRegression, inputs: str
) -> None:
    """As the regression makes them from the database, when the take is in it."""
    fitted = DynamicMap().fit(walk.body, [walk.take], np.random.default_rng(0))
    trained, row = fitted.regression(walk.calibration), AT - len(past_of(walk))
    query, _ = query_of(walk, trained, walk.only(inputs)[AT])
    query.prepare(True)
    windows = query.regression.windows
    (wanted, _), *_ = query.regression.training_data(windows, np.array([row]))
    assert windows.frames[row] == AT - 1
    known = query.regression.columns(query.usual)
    np.testing.assert_allclose(query.predictors(past_of(walk))[known], wanted[0][known], atol=2e-5)
    assert (query.regression is trained) == (inputs == "pos+ori")


@pytest.mark.parametrize("inputs", ["pos+ori", "pos"])
def test_the_room_does_not_matter(walk: Scene, regression: ReducedRankRegression, inputs: str) -> None:
    there = moved(walk.take.qpos, 2.0, (4.0, -3.0, 0.0))
    found = []
    for qpos in (walk.take.qpos, there):
        shown = replace(walk, frames=exact_frames(walk.body, walk.calibration, qpos))
        query, _ = query_of(walk, regression, shown.only(inputs)[AT])
        query.prepare(True)
        known = query.regression.columns(query.usual)
        found.append(query.predictors(qpos[[AT - 1, AT - 2, AT - 3]])[known])
    np.testing.assert_allclose(found[1], found[0], atol=1e-5)


def test_without_the_anchor_the_last_estimate_lends_place_and_heading(
    walk: Scene, regression: ReducedRankRegression
) -> None:
    """With the anchor they come from the readings, whatever the last estimate was."""
    length = regression.windows.size
    for lost, depends in ((), False), ((TORSO,), True), ((0,), False):
        query, _ = query_of(walk, regression, walk.frames[AT])
        query.prepare(True)
        query.record()
        residuals = query._residuals
        residuals.read(drop_stations(walk.frames[AT], lost))
        near, far = (query.predictors(past_of(walk, yaw)) for yaw in (0.0, 0.7))
        kept = np.setdiff1d(np.arange(6), lost)
        readings = [x[length:].reshape(6, 9)[kept] for x in (near, far)]
        assert (np.abs(readings[0] - readings[1]).max() > 0.1) == depends


@pytest.mark.parametrize("kind", ["position", "orientation"])
def test_of_the_anchor_only_what_is_missing_comes_from_the_last_estimate(
    walk: Scene, regression: ReducedRankRegression, kind: str
) -> None:
    query, residuals = query_of(walk, regression, walk.frames[AT])
    query.prepare(True)
    whole = query.predictors(past_of(walk))[regression.windows.size :].reshape(6, 9)
    residuals.leave_out(np.arange(12) == (TORSO if kind == "position" else 6 + TORSO))
    if kind == "position":
        residuals.target_m[TORSO] = 0.0
    past = past_of(walk)
    past[:, :2] += 0.2
    part = query.predictors(past)[regression.windows.size :].reshape(6, 9)
    others = np.setdiff1d(np.arange(6), [TORSO])
    away = np.abs(part - whole)[others]
    if kind == "position":  # heading from the reading, place from the shifted estimate
        np.testing.assert_allclose(away[:, 3:], 0.0, atol=1e-6)
        assert np.abs(np.linalg.norm(part[others, :2] - whole[others, :2], axis=1) - 0.2 * np.sqrt(2.0)).max() < 0.05
    else:  # heading from the last estimate, which is a frame old; place from the reading
        assert 0.0 < away.max() < 0.05


def test_a_view_by_positions_keeps_its_stations(walk: Scene, regression: ReducedRankRegression) -> None:
    """Without one of them, its place is that of the last estimate."""
    query, residuals = query_of(walk, regression, walk.only("pos")[AT])
    query.prepare(True)
    whole = query.predictors(past_of(walk))[regression.windows.size :].reshape(6, 9)[:, :3]
    residuals.read(drop_stations(walk.only("pos")[AT], [0]))
    part = query.predictors(past_of(walk))[regression.windows.size :].reshape(6, 9)[:, :3]
    assert 0.0 < np.abs(part - whole)[1:].max() < 0.05


def test_the_choice_is_open_until_there_is_a_history(walk: Scene, regression: ReducedRankRegression) -> None:
    query, residuals = query_of(walk, regression, drop_stations(walk.frames[AT], [0]))
    assert query.prepare(False)
    np.testing.assert_array_equal(query.usual, mask(0, 6))
    assert not query.prepare(False), "nothing new"
    query.record()
    residuals.read(drop_stations(walk.frames[AT], [1]))
    assert query.prepare(False)
    np.testing.assert_array_equal(query.usual, mask())
    residuals.read(drop_stations(walk.frames[AT], [0]))
    assert query.prepare(True)
    np.testing.assert_array_equal(query.usual, mask(0, 6))  # the frame with station 0 was not recorded
    query.record()
    residuals.read(walk.frames[AT])
    assert not query.prepare(True)
    assert not query.prepare(False)
    np.testing.assert_array_equal(query.usual, mask(0, 6))


def test_the_heading_follows_the_usual_readings(walk: Scene, regression: ReducedRankRegression) -> None:
    query, residuals = query_of(walk, regression, walk.only("pos")[AT])
    query.prepare(False)
    by_positions = query.regression
    assert by_positions.heading is not None
    residuals.read(walk.frames[AT])
    query.prepare(False)
    assert query.regression is regression
    residuals.read(walk.only("pos")[AT])
    query.prepare(True)
    assert query.regression is by_positions
    residuals.read(walk.frames[AT])
    query.prepare(True)
    assert query.regression is by_positions, "the choice is final"


@pytest.mark.parametrize(
    ("inputs", "lost", "suffice"),
    [
        ("pos+ori", (), True),
        ("pos+ori", (0, 1, 2, 3, 5), True),
        ("pos+ori", (TORSO,), False),
        ("pos", (), True),
        ("ori", (), False),
    ],
)
def test_readings_alone_suffice_with_the_anchor_or_all_positions_of_the_heading(
    walk: Scene, regression: ReducedRankRegression, inputs: str, lost: tuple[int, ...], suffice: bool
) -> None:
    query, _ = query_of(walk, regression, drop_stations(walk.only(inputs)[AT], lost))
    assert query.readings_suffice() is suffice


def test_after_the_choice_all_its_stations_are_needed(walk: Scene, regression: ReducedRankRegression) -> None:
    query, residuals = query_of(walk, regression, walk.only("pos")[AT])
    query.prepare(True)
    query.record()
    assert query.readings_suffice()
    residuals.read(drop_stations(walk.only("pos")[AT], [0]))
    assert not query.readings_suffice()


def test_before_the_choice_stations_of_earlier_frames_are_needed(
    walk: Scene, regression: ReducedRankRegression
) -> None:
    query, residuals = query_of(walk, regression, walk.only("pos")[AT])
    query.record()
    residuals.read(drop_stations(walk.only("pos")[AT], [0]))
    assert not query.readings_suffice()
