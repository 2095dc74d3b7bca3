"""Neighbours of a query whose velocities are unknown, against a search through all examples."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core.arrays import Floats, Ints
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.example_features import ExampleFeatures, FeatureWeights, Query
from harness.reconstruct.features.query_features import QueryFeatures
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.stream import TrackerFrame
from harness.testing.frames import drop_stations
from tests.reconstruct.methods.test_dynamic_map import unseen

COUNT = 8


def queries(frames: list[TrackerFrame]) -> tuple[ExampleFeatures, list[Query]]:
    """Queries of frames of a walk, with the true poses as estimates, and examples that lack this walk."""
    shown, takes = unseen("walking")
    database = MotionDatabase.build(shown.body, takes)
    examples = ExampleFeatures(shown.body, database, shown.calibration, FeatureWeights(), "kd_tree", COUNT)
    residuals = Residuals(shown.body, shown.calibration, Loss())
    features, out = QueryFeatures(residuals, shown.calibration, examples), []
    for frame in frames:
        residuals.read(frame)
        out.append(features.compute(frame, shown.take.qpos[round(40.0 * frame.received_s)]))
    return examples, out


def nearest_of_all(examples: ExampleFeatures, query: Query) -> Ints:
    """Rows of the nearest examples in the known columns, by comparison with each."""
    offsets: Floats = examples.gather(slice(None)).astype(float) - query.features
    return np.argsort(offsets**2 @ query.confidence)[:COUNT]


def test_at_the_start_and_after_a_gap_the_nearest_are_those_of_all_examples() -> None:
    frames = unseen("walking")[0].frames
    shown = [*frames[:3], *frames[60:63]]
    examples, made = queries(shown)
    known = [query.confidence.min() == 1.0 for query in made]
    assert known == [False, True, True, False, True, True]
    for query in made:
        rows = examples.nearest(query, COUNT, examples.index)
        assert set(rows.tolist()) == set(nearest_of_all(examples, query).tolist())


def test_a_velocity_of_zero_proposes_the_wrong_examples() -> None:
    """Why a start must not be filled in: the walk's neighbours are then those who stand."""
    examples, (first, *_) = queries(unseen("walking")[0].frames[:1])
    wrong = examples.nearest(replace_filled(first), COUNT, examples.index)
    assert set(wrong.tolist()) != set(nearest_of_all(examples, first).tolist())


def replace_filled(query: Query) -> Query:
    return query._replace(filled=True)


@pytest.mark.parametrize("station", [0, 2])
def test_a_silent_station_has_the_velocity_of_the_last_estimates(station: int) -> None:
    """Its filled-in velocity is near the true one, and it proposes most of the nearest."""
    frames = unseen("walking")[0].frames[:60]
    silent = [drop_stations(f, [station]) if i >= 20 else f for i, f in enumerate(frames)]
    examples, made = queries(silent)
    _, full = queries(frames)
    columns = slice(7 * examples.count + 3 * station, 7 * examples.count + 3 * station + 3)
    error = [np.abs(a.features[columns] - b.features[columns]).max() for a, b in zip(made[22:], full[22:], strict=True)]
    size = [np.abs(b.features[columns]).max() for b in full[22:]]
    assert np.mean(error) < 0.3 * np.mean(size)
    assert all(query.filled and not query.confidence[columns].any() for query in made[22:])
    found = [
        len(set(examples.nearest(q, COUNT, examples.index).tolist()) & set(nearest_of_all(examples, q).tolist()))
        for q in made[22:]
    ]
    assert np.mean(found) >= 0.9 * COUNT


def test_a_host_that_receives_frames_late_changes_no_query() -> None:
    """Velocities of filled-in positions are by the device's clock."""
    frames = unseen("walking")[0].frames[:40]
    silent = [drop_stations(f, [2]) if i >= 20 else f for i, f in enumerate(frames)]
    late = [replace(f, received_s=f.received_s + 0.004 * (i % 3)) for i, f in enumerate(silent)]
    for punctual, delayed in zip(queries(silent)[1], queries(late)[1], strict=True):
        np.testing.assert_array_equal(punctual.features, delayed.features)


def test_a_station_that_reports_again_has_no_velocity_in_the_first_frame() -> None:
    frames = unseen("walking")[0].frames[:30]
    back = [drop_stations(f, [0]) if 10 <= i < 20 else f for i, f in enumerate(frames)]
    _, made = queries(back)
    assert [query.filled for query in made] == [False] + [True] * 19 + [False] + [True] * 9
