"""Silent stations: predictions as written out, what predicts and what does not, and moments without examples."""

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.reconstruct.solver.reading_prediction import (
    AGES,
    MAX_OFFSET_S,
    NEWEST_AGE,
    OLDEST_AGE,
    OLDEST_S,
    READINGS,
    IncrementMoments,
    ReadingHistory,
    predict_readings,
    unlearnt_moments,
)

STATIONS, PERIOD_S, INSTANT_S = 3, 0.025, 50.0
NOISE = 0.002, float(np.deg2rad(0.4))
"""Of a position [m] and of an orientation [rad]."""


def random_moments(rng: np.random.Generator) -> IncrementMoments:
    """Moments of increments that are 0 at age 0."""
    factor = rng.normal(0.0, 0.1, (4, STATIONS, AGES, 40))
    factor *= np.abs(np.arange(-NEWEST_AGE, OLDEST_AGE + 1))[:, None] ** 0.5
    return IncrementMoments(np.einsum("csak,ctbk->csatb", factor, factor), PERIOD_S)


def random_history(rng: np.random.Generator, age_s: Floats) -> ReadingHistory:
    """Readings of ages (S, K), positions about the origin and orientations that are less than a turn apart."""
    turn = rotations.multiply(
        rotations.exp(rng.normal(0.0, 0.3, (STATIONS, READINGS, 3))), rotations.exp(rng.normal(size=(STATIONS, 1, 3)))
    )
    position_m = rng.normal(size=(STATIONS, READINGS, 3))
    return ReadingHistory(INSTANT_S - age_s, position_m, INSTANT_S - age_s - 0.004, turn)


def predict(moments: IncrementMoments, history: ReadingHistory, known: Bools) -> tuple[Floats, Floats, Floats, Bools]:
    """Positions (S, 3), orientations (S, 4), variances (2S,) and which rows are known then (2S,)."""
    position_m, turn = np.full((STATIONS, 3), 7.0), np.tile(rotations.IDENTITY, (STATIONS, 1))
    found, variance = known.copy(), np.zeros(2 * STATIONS)
    predict_readings(INSTANT_S, moments, found, variance, position_m, turn, history)
    return position_m, turn, variance, found


def written_out(table: Floats, at_s: Floats, values: Floats, noise: float) -> tuple[Floats, Floats]:
    """(A' V^-1 A)^-1 A' V^-1 y and its variances (S,) for one axis, from readings (S, K); those of -inf s are none."""
    rows = [(s, k) for s in range(STATIONS) for k in range(READINGS) if at_s[s, k] > -np.inf]
    blend = np.zeros((len(rows), STATIONS * AGES))
    of = np.zeros((len(rows), STATIONS))
    for row, (s, k) in enumerate(rows):
        of[row, s] = 1.0
        age = (INSTANT_S - at_s[s, k]) / PERIOD_S
        for column, whole in enumerate(range(-NEWEST_AGE, OLDEST_AGE + 1)):
            blend[row, s * AGES + column] = max(0.0, 1.0 - abs(age - whole))
    sigma = table.reshape(STATIONS * AGES, STATIONS * AGES)
    v = blend @ sigma @ blend.T + noise**2 * np.eye(len(rows))
    covariance = np.linalg.inv(of.T @ np.linalg.solve(v, of))
    y = np.array([values[s, k] for s, k in rows])
    return covariance @ of.T @ np.linalg.solve(v, y), np.diag(covariance) - noise**2


@pytest.mark.parametrize("silent", [(0,), (1, 2), (0, 1, 2)])
def test_predictions_are_those_of_the_formula(rng: np.random.Generator, silent: tuple[int, ...]) -> None:
    """All kept readings take part, also those of stations that report, and those that are read after the instant."""
    age_s = np.sort(rng.uniform(-0.15, 0.55, (STATIONS, READINGS)), axis=1)
    age_s[1, 2] = np.inf  # it has two readings only
    moments, history = random_moments(rng), random_history(rng, age_s)
    known = np.ones(2 * STATIONS, bool)
    known[list(silent)] = known[[STATIONS + s for s in silent]] = False
    position_m, turn, variance, found = predict(moments, history, known)
    assert found.all()
    wanted_m = np.empty((STATIONS, 3))
    wanted_variance = np.zeros(2 * STATIONS)
    wanted_turn = np.empty((STATIONS, 3))
    newest = history.turn[:, :1]
    turned = rotations.log(rotations.multiply(history.turn, rotations.inverse(newest)))
    for axis in range(3):
        channel = 1 if axis == 2 else 0
        wanted_m[:, axis], spread = written_out(
            moments.table[channel], history.position_s, history.position_m[..., axis], NOISE[0]
        )
        wanted_variance[:STATIONS] += 2.0 * spread / 3.0
        wanted_turn[:, axis], spread = written_out(
            moments.table[2 + channel], history.turn_s, turned[..., axis], NOISE[1]
        )
        wanted_variance[STATIONS:] += 2.0 * spread / 3.0
    for s in range(STATIONS):
        if s in silent:
            np.testing.assert_allclose(position_m[s], wanted_m[s], atol=1e-8)
            wanted = rotations.multiply(rotations.exp(wanted_turn[s]), history.turn[s, 0])
            assert rotations.angle_between_rad(turn[s], wanted) < 1e-8
            np.testing.assert_allclose(variance[[s, STATIONS + s]], wanted_variance[[s, STATIONS + s]], rtol=1e-6)
        else:
            np.testing.assert_array_equal(position_m[s], 7.0)
            np.testing.assert_array_equal(turn[s], rotations.IDENTITY)
            np.testing.assert_array_equal(variance[[s, STATIONS + s]], 0.0)


def test_a_shift_of_the_room_shifts_predictions(rng: np.random.Generator) -> None:
    age_s = np.sort(rng.uniform(0.0, 0.55, (STATIONS, READINGS)), axis=1)
    moments, history = random_moments(rng), random_history(rng, age_s)
    away = history._replace(position_m=history.position_m + np.array([30.0, -20.0, 1.0]))
    none = np.zeros(2 * STATIONS, bool)
    one, other = predict(moments, history, none), predict(moments, away, none)
    np.testing.assert_allclose(other[0] - one[0], np.tile([30.0, -20.0, 1.0], (STATIONS, 1)), atol=1e-8)
    np.testing.assert_array_equal(other[2], one[2])


@pytest.mark.parametrize(("age_s", "predicts"), [(0.59, True), (0.61, False), (-0.59, True), (-0.61, False)])
def test_a_station_without_a_reading_of_the_last_0_6_s_stays_unknown(
    rng: np.random.Generator, age_s: float, predicts: bool
) -> None:
    """Nor does a reading of a later time predict: a device that restarts leaves such readings."""
    ages_s = np.full((STATIONS, READINGS), np.inf)
    ages_s[:, 0] = 0.1, age_s, 0.2
    history = random_history(rng, ages_s)._replace(turn_s=INSTANT_S - ages_s)
    position_m, turn, variance, found = predict(random_moments(rng), history, np.zeros(2 * STATIONS, bool))
    assert found.tolist() == [True, predicts, True] * 2
    if not predicts:
        np.testing.assert_array_equal(position_m[1], 7.0)
        np.testing.assert_array_equal(turn[1], rotations.IDENTITY)
        assert variance[1] == variance[4] == 0.0


def test_constants_are_those_of_the_documentation() -> None:
    """docs/methods.md, reading prediction."""
    assert (READINGS, OLDEST_S, MAX_OFFSET_S) == (3, 0.6, 0.04)


@pytest.mark.parametrize(("a", "b"), [(4, 4), (4, 20), (24, 24), (-8, -3), (-8, 24), (-2, 6)])
def test_without_examples_velocity_forgets_itself_exponentially(a: int, b: int) -> None:
    """Cov(D(a), D(b)) is the double integral of the covariance of velocities, v^2 exp(-|t - u| / 0.2 s)."""
    moments = unlearnt_moments(2)
    assert moments.period_s == PERIOD_S
    middle = (np.arange(400) + 0.5) / 400
    t, u = a * PERIOD_S * middle, b * PERIOD_S * middle
    integral = np.exp(-np.abs(t[:, None] - u) / 0.2).mean() * a * b * PERIOD_S**2
    found = moments.table[:, 0, NEWEST_AGE + a, 0, NEWEST_AGE + b]
    np.testing.assert_allclose(found, integral * np.array([1.0, 1.0, 9.0, 9.0]), rtol=1e-4)


def test_without_examples_stations_move_independently() -> None:
    table = unlearnt_moments(3).table
    for one in range(3):
        np.testing.assert_array_equal(table[:, one, :, one], table[:, 0, :, 0])
        for other in set(range(3)) - {one}:
            assert not table[:, one, :, other].any()
