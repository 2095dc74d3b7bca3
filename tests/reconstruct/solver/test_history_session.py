"""The history of the last answers: what fills it, one row for each period of the examples."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Origin
from harness.reconstruct.contract import Method
from harness.reconstruct.methods.dynamic_map import WINDOW
from harness.reconstruct.methods.local_pca import LocalPca
from harness.reconstruct.solver.history_session import HistorySession
from harness.reconstruct.solver.ik_session import PosturePrior, SolverOptions
from harness.reconstruct.solver.ik_solver import IKSolution
from harness.reconstruct.solver.reading_prediction import IncrementMoments, unlearnt_moments
from harness.stream import TrackerFrame
from harness.testing.frames import drop_stations
from tests.reconstruct.conftest import Scene

RISE = 0.001
"""Every bridged period adds this to the last hinge [rad]."""


def no_examples(calibration: Calibration) -> IncrementMoments:
    return unlearnt_moments(len(calibration.stations))


class Counting(HistorySession):
    """Answers with the last pose, and keeps the history that it was given."""

    def __init__(self, scene: Scene, poses: int) -> None:
        prior = PosturePrior(scene.take.qpos[0], np.ones(48))
        super().__init__(scene.body, scene.calibration, SolverOptions(), prior, no_examples, poses, 40.0)
        self.shown: list[Floats] = []

    def solve_next(self) -> IKSolution:
        self.shown.append(np.array(self.past))
        return self.solver.solve(self.past[0], self._posture_prior.prior(self.limits, self.past[0]))

    def predict_gap(self) -> Floats:
        out = np.array(self.past[0])
        out[-1] += RISE
        return out


def steps(session: Counting, frames: list[TrackerFrame]) -> list[Floats]:
    """The answers (55,)."""
    return [np.array(session.step(frame).qpos) for frame in frames]


def test_the_history_is_the_last_answers_newest_first(walk: Scene) -> None:
    session = Counting(walk, 3)
    answers = steps(session, walk.frames[:6])
    assert len(session.shown) == 3  # frames 3, 4 and 5
    for shown, newest in zip(session.shown, (2, 3, 4), strict=True):
        np.testing.assert_allclose(shown, np.array([answers[newest], answers[newest - 1], answers[newest - 2]]))


@pytest.mark.parametrize("missing", [1, 2, 7])
def test_a_short_gap_is_bridged_period_by_period(walk: Scene, missing: int) -> None:
    """After n missing frames the history holds n predictions, each of them from the one before."""
    session = Counting(walk, 9)
    answers = steps(session, walk.frames[:20])
    session.step(walk.frames[20 + missing])
    assert session.origin is Origin.MODEL
    shown = session.shown[-1]
    np.testing.assert_allclose(shown[missing:], answers[19 : 10 + missing : -1])
    np.testing.assert_allclose(shown[:missing, -1], answers[19][-1] + RISE * np.arange(missing, 0, -1))
    np.testing.assert_allclose(shown[:missing, :-1], np.tile(answers[19][:-1], (missing, 1)))


@pytest.mark.parametrize(("missing", "bridged"), [(7, True), (8, False)])
def test_the_longest_gap_is_eight_periods(walk: Scene, missing: int, bridged: bool) -> None:
    """0.2 s at 40 Hz. After a longer gap inverse kinematics answers until the history is full again."""
    session = Counting(walk, 3)
    steps(session, walk.frames[:10])
    origins = [session.step(frame).origin for frame in walk.frames[10 + missing : 14 + missing]]
    assert origins == ([Origin.MODEL] * 4 if bridged else [Origin.FALLBACK] * 3 + [Origin.MODEL])


def test_a_frame_within_half_a_period_replaces_the_last(walk: Scene) -> None:
    session = Counting(walk, 2)
    answers = steps(session, walk.frames[:5])
    early = walk.frames[4]
    early = replace(early, received_s=early.received_s + 0.01, measured_s=early.measured_s + 0.01)
    session.step(early)
    np.testing.assert_allclose(session.shown[-1], np.array([answers[3], answers[2]]))
    again = np.array(session.qpos)
    session.step(walk.frames[5])
    np.testing.assert_allclose(session.shown[-1], np.array([again, answers[3]]))


@pytest.mark.parametrize(
    ("method", "moves"), [(replace(WINDOW, neighbours=20, ridge=1e-3), True), (LocalPca(neighbours=60), False)]
)
def test_the_model_predicts_through_a_gap_and_local_pca_holds(walk: Scene, method: Method, moves: bool) -> None:
    """The local dynamic model continues a walk that it has learnt; local PCA, without dynamics, repeats its answer.

    A walk that is not among the examples is predicted worse by history alone than by the last answer (traps.md).
    """
    session = method.fit(walk.body, [walk.take], np.random.default_rng(0)).begin(walk.calibration)
    assert isinstance(session, HistorySession)
    off, still = np.zeros(60), np.zeros(60)
    for i, truth in enumerate(walk.take.qpos[1:61, 7:]):
        session.step(walk.frames[i])
        if i >= 20:  # the history is full
            off[i] = np.abs(session.predict_gap()[7:] - truth).mean()
            still[i] = np.abs(session.past[0, 7:] - truth).mean()
    if moves:
        assert np.mean(off) < 0.5 * np.mean(still)
    else:
        np.testing.assert_array_equal(off, still)


def test_the_history_has_hinges_within_half_a_turn(walk: Scene) -> None:
    session = Counting(walk, 2)
    free = 7 + int(np.flatnonzero(np.isinf(session.limits.high_rad))[0])
    for turns in (-1.0, 1.0):
        qpos = np.array(walk.take.qpos[0])
        qpos[free] += 2.0 * np.pi * turns
        session._push(qpos)
        np.testing.assert_allclose(session.past[0], np.append(qpos[:7], session.limits.principal(qpos[7:])))
        assert abs(session.past[0, free]) <= np.pi


def test_readings_that_were_not_measured_contradict_nothing(walk: Scene) -> None:
    session = Counting(walk, 2)
    session.residuals.read(drop_stations(walk.frames[0], [0]))
    session.residuals.evaluate(walk.take.qpos[0])
    assert session.outlier_share() == 0.0
    session.residuals.evaluate(np.append(walk.take.qpos[0][:3] + 1.0, walk.take.qpos[0][3:]))
    assert session.outlier_share() == pytest.approx(0.5), "positions, not orientations"
