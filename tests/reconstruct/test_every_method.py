"""Properties of every method in the registry; a new method is tested as well.

Frames are exact, so the error is the method's own. A method that learns recovers a take that is among its examples.
Baselines and methods that learn nothing have wider bounds.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from harness.body import retarget_to_common_body
from harness.core.estimate import Status
from harness.core.motion import BodyMotion
from harness.core.workers import run_in_workers
from harness.errors import BadInput
from harness.mocap import synthetic
from harness.reconstruct import registry
from harness.reconstruct.contract import Method
from harness.score import wrap_difference
from harness.testing import method_checks
from harness.testing.contract_case import make_case, require_identical
from harness.testing.frames import exact_frames
from harness.testing.method_checks import check_method
from harness.testing.rules import RULES
from harness.testing.rules.reproducibility import estimate_qpos, works_in_another_process
from tests.joint_centres import joint_centres_m
from tests.reconstruct.conftest import Scene, moved, scene

NAMES = sorted(registry.list_methods())
ALSO = ("mean_pose+ik", "best_match+ik")
COSTLY = ("dynamic_map:literal", "kernel_cca:literal", "weighted_blend:literal", "best_match+ik")
"""Methods whose contract takes half a minute each; they share their session with one that is cheaper."""
_OTHERS = (("walking", 1), ("boxing", 2))
LEARNERS = [name for name in NAMES if registry.make_method(name).needs_examples]


@dataclass(frozen=True)
class Bound:
    """Largest errors for a take that is among the examples, without the warm-up."""

    hinge_deg: float
    """Mean error of the hinges [deg]."""
    joint_mm: float
    """Mean distance of the joint centres [mm]."""


SEEN_IT = Bound(1.0, 10.0)
"""Bound of methods that learn from examples, unless `BOUNDS` has another."""
BOUNDS = {
    "mean_pose": Bound(9.0, 150.0),  # one posture for all
    "ridge": Bound(4.0, 60.0),  # linear maps
    "ik": Bound(4.0, 8.0),  # what no station shows is only held to a prior
    "ik:mean": Bound(4.0, 8.0),
    "ik:previous": Bound(4.0, 8.0),
    "ik:gaussian": Bound(4.0, 8.0),
}


@cache
def walk() -> Scene:
    return scene("walking", seconds=4.0)


@cache
def others() -> tuple[BodyMotion, ...]:
    """Two takes of other performers, on the walker's body."""
    clips = [
        synthetic.generate(b, synthetic.performer_names()[p], 1, seed=1, duration_s=4.0, rate_hz=40.0)
        for b, p in _OTHERS
    ]
    return tuple(retarget_to_common_body(clip, walk().body.skeleton)[0] for clip in clips)


def errors(method: Method, examples: list[BodyMotion], shown: Scene) -> tuple[float, float]:
    """Mean hinge error [deg] and joint distance [mm] after the first half second."""
    session = method.fit(shown.body, examples if method.needs_examples else [], np.random.default_rng(1)).begin(
        shown.calibration
    )
    estimates = [session.step(frame) for frame in shown.frames]
    assert estimates[-1].status is Status.SOLVED
    said, true = np.array([e.qpos for e in estimates])[20:], shown.take.qpos[20:]
    skeleton = shown.body.skeleton
    off_m = np.linalg.norm(joint_centres_m(skeleton, said) - joint_centres_m(skeleton, true), axis=2)
    return float(np.rad2deg(np.abs(wrap_difference(said[:, 7:] - true[:, 7:]))).mean()), 1e3 * float(off_m.mean())


@cache
def at_home(name: str) -> tuple[float, float]:
    return errors(registry.make_method(name), [walk().take, *others()], walk())


@cache
def unseen(name: str) -> tuple[float, float]:
    """Errors with other takes as examples."""
    return errors(registry.make_method(name), walk().examples, walk())


@pytest.mark.parametrize("name", [name for name in LEARNERS if not name.startswith("ik")])
def test_examples_are_needed(name: str) -> None:
    """A method that learns from windows of n frames needs n + 1."""
    method, rng = registry.make_method(name), np.random.default_rng(0)
    fewest = {"expert_map": 4, "dynamic_map": 4}.get(name, 3 if name.startswith(("dynamic_map:", "local_pca")) else 1)
    short = replace(walk().take, qpos=walk().take.qpos[: fewest - 1])
    for examples in ([], [short, short]) if fewest > 1 else ([],):
        with pytest.raises(BadInput, match=f"examples of {fewest} frames" if fewest > 1 else "examples"):
            method.fit(walk().body, examples, rng)


@pytest.mark.parametrize("name", NAMES)
def test_a_noiseless_take_that_is_among_the_examples_is_recovered(name: str) -> None:
    hinge_deg, joint_mm = at_home(name)
    bound = BOUNDS.get(name, SEEN_IT)
    assert hinge_deg <= bound.hinge_deg
    assert joint_mm <= bound.joint_mm


@pytest.mark.parametrize("name", LEARNERS)
def test_scores_do_not_change_when_the_room_of_the_examples_is_turned_and_shifted(name: str) -> None:
    examples = [replace(take, qpos=moved(take.qpos, 2.5, (-4.0, 7.0, 0.0))) for take in walk().examples]
    assert errors(registry.make_method(name), examples, walk()) == pytest.approx(unseen(name), rel=0.03, abs=0.02)


@pytest.mark.parametrize("name", NAMES)
def test_scores_do_not_change_when_the_performer_walks_elsewhere(name: str) -> None:
    home = walk()
    take = replace(home.take, qpos=moved(home.take.qpos, -1.2, (3.0, -8.0, 0.0)))
    away = Scene(home.body, home.calibration, take, exact_frames(home.body, home.calibration, take.qpos), [])
    found = errors(registry.make_method(name), home.examples, away)
    assert found == pytest.approx(unseen(name), rel=0.02, abs=0.02)


@pytest.mark.long
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in COSTLY else ()) for name in (*NAMES, *ALSO)]
)
def test_the_contract_is_kept(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every rule but the one of the next test."""
    rules = {rule: check for rule, check in RULES.items() if check is not works_in_another_process}
    assert len(rules) == len(RULES) - 1
    monkeypatch.setattr(method_checks, "RULES", rules)
    check_method(registry.make_method(name))


@pytest.mark.long
def test_what_was_fitted_may_go_to_another_process() -> None:
    """One process for all methods, since starting one takes seconds."""
    trials = [make_case(registry.make_method(name)) for name in (*NAMES, *ALSO)]
    tasks = [(trial.fit(), trial.calibration, trial.frames) for trial in trials]
    there = {which: future.result() for which, future in run_in_workers(estimate_qpos, tasks, 1)}
    for which, task in enumerate(tasks):
        require_identical(estimate_qpos(*task), there[which])
