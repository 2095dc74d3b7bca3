"""Liu et al. 2011 as printed: the prediction against the paper's formulas, and the answers on unseen motion."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from harness.body.retargeting import retarget_to_common_body
from harness.core.arrays import Floats
from harness.core.estimate import Estimate, Origin
from harness.core.motion import BodyMotion
from harness.mocap import synthetic
from harness.reconstruct import registry
from harness.reconstruct.methods.dynamic_map import LITERAL, FittedDynamicMap
from harness.score.angles import wrap_difference
from tests.reconstruct.conftest import Scene, scene

BEHAVIOURS = ("walking", "boxing")
STARTED = 20
"""Frames of the start, which are not compared: 0.5 s."""


@cache
def unseen(behaviour: str) -> tuple[Scene, list[BodyMotion]]:
    """A take, and other takes of its performer and of another one as examples."""
    shown, names = scene(behaviour, take=1, seconds=6.0), synthetic.performer_names()
    clips = [
        synthetic.generate(behaviour, names[performer], take, seed=1, duration_s=12.0, rate_hz=40.0)
        for performer, take in ((0, 2), (0, 3), (1, 1))
    ]
    return shown, [retarget_to_common_body(clip, shown.body.skeleton)[0] for clip in clips]


@cache
def answers(name: str, behaviour: str) -> list[Estimate]:
    shown, examples = unseen(behaviour)
    fitted = registry.resolve(name).fit(shown.body, examples, np.random.default_rng(1))
    session = fitted.begin(shown.calibration)
    return [session.step(frame) for frame in shown.frames][STARTED:]


def hinges(name: str, behaviour: str) -> Floats:
    return np.array([estimate.qpos[7:] for estimate in answers(name, behaviour)])


def mean_deg(first: Floats, second: Floats) -> float:
    return float(np.rad2deg(np.abs(wrap_difference(first - second))).mean())


def test_the_preset_has_no_addition_to_the_paper() -> None:
    """No ridge, factor, floor, widening, gate or weight by quality, and one start."""
    assert (LITERAL.width, LITERAL.ridge, LITERAL.spread) == (0.0, 0.0, 1.0)
    assert (LITERAL.widening, LITERAL.ik_prior_weight) == (0.0, 0.0)
    assert (LITERAL.search, LITERAL.start, LITERAL.jump_m) == ("history", "closest", np.inf)
    assert (LITERAL.loss.robust, LITERAL.loss.quality, LITERAL.loss.suspect_weight) == (True, False, 1.0)
    assert np.rad2deg(max(LITERAL.least_sigma_rad, LITERAL.tilt_sigma_rad)) <= 0.011


@pytest.mark.parametrize("behaviour", BEHAVIOURS)
def test_the_model_answers_and_beats_inverse_kinematics(behaviour: str) -> None:
    """It answers 95 % of the frames, errs less than `ik`, and differs from `ik:mean` by 0.3 deg or more."""
    truth = unseen(behaviour)[0].take.qpos[STARTED:, 7:]
    own = [estimate.origin is Origin.MODEL for estimate in answers("dynamic_map:literal", behaviour)]
    assert np.mean(own) >= 0.95
    literal = hinges("dynamic_map:literal", behaviour)
    assert mean_deg(literal, truth) < mean_deg(hinges("ik", behaviour), truth)
    assert mean_deg(literal, hinges("ik:mean", behaviour)) >= 0.3


@pytest.mark.parametrize(("width", "spread", "neighbours"), [(0.0, 1.0, 200), (0.5, 1.0, 40), (0.0, 3.0, 200)])
def test_the_prediction_is_that_of_equations_5_to_8(width: float, spread: float, neighbours: int) -> None:
    """All windows are compared, weighted and regressed by the printed formulas, in double precision.

    The other two cases have the factors that the paper lacks: on the weights' variance, and on sigma_d.
    """
    shown, examples = unseen("walking")
    method = replace(LITERAL, width=width, spread=spread, neighbours=neighbours)
    fitted = method.fit(shown.body, examples, np.random.default_rng(1))
    session = fitted.begin(shown.calibration)
    for frame in shown.frames[:40]:
        session.step(frame)
    prior = session.independent_prior(session.predict())
    mean, variance = printed_prediction(fitted, session.past)
    np.testing.assert_allclose(prior.qpos[7:], mean, atol=1e-3)
    assert prior.precision is not None
    np.testing.assert_allclose(prior.precision[6:] ** -0.5, spread * np.sqrt(variance), rtol=0.02, atol=2e-4)


def printed_prediction(fitted: FittedDynamicMap, past: Floats) -> tuple[Floats, Floats]:
    """Mean and variance (48,) of the hinges by eq. 2 to 8, for the last estimates (m, 55), newest first."""
    windows, options = fitted.examples.windows, fitted.options
    query = windows.query(past).astype(float)
    x, y = windows.gather(slice(None)).astype(float), windows.successors(np.arange(len(windows)))[:, 4:52].astype(float)
    squared = np.sum((x - query) ** 2, axis=1)
    nearest = np.argsort(squared)[: options.neighbours]
    scale = options.width * np.sort(squared)[options.neighbours // 2] if options.width else 1.0  # D_w = 1 as printed
    x, y, weight = x[nearest], y[nearest], np.exp(-0.5 * squared[nearest] / scale)  # eq. 6
    weight /= weight.sum()
    x_mean, y_mean = weight @ x, weight @ y
    x, y = x - x_mean, y - y_mean
    eigenvalue, vector = np.linalg.eigh(x.T @ (weight[:, None] * x))
    eigenvalue, vector = eigenvalue[::-1], vector[:, ::-1]
    count = 1 + int(np.searchsorted(np.cumsum(eigenvalue), options.variance_kept * eigenvalue.sum()))
    u, inverse = vector[:, :count], 1.0 / eigenvalue[:count]
    beta = u @ (inverse[:, None] * (u.T @ (x.T @ (weight[:, None] * y))))  # eq. 7
    residual = y - x @ beta
    return y_mean + (query - x_mean) @ beta, weight @ residual**2  # eq. 8
