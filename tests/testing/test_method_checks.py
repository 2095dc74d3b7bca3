"""The contract suite passes correct methods, and each rule alone detects a method with one fault."""

import os
import random
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.body import Body, tpose
from harness.core import rotations
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Origin, Status
from harness.core.motion import BodyMotion
from harness.reconstruct.solver import StatusMonitor
from harness.stream import TrackerFrame
from harness.testing import method_checks
from harness.testing.contract_case import make_case
from harness.testing.method_checks import MethodContractError, RuleResult, check_method, check_rules
from harness.testing.rules import RULES
from tests.command import Command


@dataclass(frozen=True)
class Standing:
    """A correct method that always returns the T-pose; each faulty session below has one fault."""

    session: type["StandingSession"]
    name: str = "standing"
    summary: str = "always the T-pose"
    needs_examples: bool = False

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedTPose":
        return FittedTPose(self.session, body)


class FittedTPose:
    """The fitted method; `memory` is for sessions that share what they should not."""

    def __init__(self, session: type["StandingSession"], body: Body) -> None:
        self.session, self.body = session, body
        self.standing = tpose(body.skeleton)
        self.memory: dict[str, Any] = {}
        session.fitted_once(self)

    def begin(self, calibration: Calibration) -> "StandingSession":
        return self.session(self, calibration)


class StandingSession:
    def __init__(self, fitted: FittedTPose, calibration: Calibration) -> None:
        self.fitted, self.known = fitted, calibration
        self.qpos, self.coverage = fitted.standing.copy(), StatusMonitor()
        self.start()

    @classmethod
    def fitted_once(cls, fitted: FittedTPose) -> None: ...

    def start(self) -> None: ...

    def step(self, frame: TrackerFrame) -> Any:
        status, _ = self.coverage.update(frame)
        return Estimate(self.answer(frame), status)

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        return self.qpos

    def bent(self, by_rad: float) -> np.ndarray:
        out = self.qpos.copy()
        out[7:] += by_rad
        return out


class DriftingQuaternion(StandingSession):
    """Never normalises its quaternion, which is wrong after 1.4 s of good frames."""

    def start(self) -> None:
        self.length = 1.0

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        good = frame.position_valid.all() and frame.orientation_valid.all() and frame.quality.min() == 1.0
        self.length = self.length + 1.8e-8 if good and len(frame.quality) == 6 else 1.0
        out = self.qpos.copy()
        out[3:7] *= self.length
        return out


class NeedsPositions(StandingSession):
    """Averages the positions, even where there are only orientations."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        out = self.qpos.copy()
        if frame.orientation_valid.any() and not frame.position_valid.any():
            out[:3] = np.nan
        return out


class DividesByStations(StandingSession):
    """Divides by the number of stations that report."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        reporting = np.count_nonzero(frame.position_valid | frame.orientation_valid)
        return self.bent(0.0 if reporting else np.nan)


class LostAtOrigin(StandingSession):
    """Takes a lost station for one at the origin of a distant tracker frame."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        out, lost = self.qpos.copy(), np.count_nonzero(frame.quality == 0.0)
        out[:2] = 50.0 if lost == 1 else 0.0
        return out


class NeedsPeriod(StandingSession):
    """Works only at the nominal period."""

    def start(self) -> None:
        self.last_s = -0.025

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        gap_s, self.last_s = frame.received_s - self.last_s, frame.received_s
        return self.bent(0.0 if abs(gap_s - 0.025) < 1e-9 or gap_s > 0.1 or gap_s < 0.0 else np.nan)


class NeedsQuality(StandingSession):
    """Takes the logarithm of the quality above 0.2."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        poor = (frame.quality > 0.0) & (frame.quality < 0.2)
        return self.bent(np.nan if poor.any() else 0.0)


class NeedsSixStations(StandingSession):
    """Works with six stations only."""

    def start(self) -> None:
        self.head = self.known.stations[5]


class Unseeded(StandingSession):
    """Fits with an unseeded random generator."""

    @classmethod
    def fitted_once(cls, fitted: FittedTPose) -> None:
        fitted.memory["bend"] = 1e-3 * np.random.default_rng().random()

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        return self.bent(self.fitted.memory["bend"])


class Continuing(StandingSession):
    """Begins where the previous session ended."""

    def start(self) -> None:
        self.bend = self.fitted.memory.get("bend", 0.0)

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        self.bend += 1e-4
        self.fitted.memory["bend"] = self.bend
        return self.bent(self.bend)


class SharesTime(StandingSession):
    """Keeps the time of the last frame where other sessions overwrite it."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        last_s = self.fitted.memory.get("last_s", 0.0) if frame.received_s > 0.0 else 0.0
        self.fitted.memory["last_s"] = frame.received_s
        return self.bent(1e-3 if frame.received_s < last_s else 0.0)


class SharesBuffer(StandingSession):
    """Works in an array that all sessions share, for long enough that another session interferes."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        self.fitted.memory["mine"] = id(self)
        time.sleep(1e-3)
        return self.bent(0.0 if self.fitted.memory["mine"] == id(self) else 1e-3)


class Unpicklable(StandingSession):
    """Holds a lock, which cannot be sent to another process."""

    @classmethod
    def fitted_once(cls, fitted: FittedTPose) -> None:
        fitted.memory["lock"] = threading.Lock()


class ModifiesEstimates(StandingSession):
    """Modifies estimates that it has already returned."""

    def start(self) -> None:
        self.live = self.qpos.copy()

    def step(self, frame: TrackerFrame) -> Any:
        self.live[7] += 1e-6
        return SimpleNamespace(qpos=self.live, status=self.coverage.update(frame)[0], origin=Origin.MODEL)


class LooksAhead(StandingSession):
    """Computes its estimate after it has received the next frame."""

    def start(self) -> None:
        self.seen: list[TrackerFrame] = []

    def step(self, frame: TrackerFrame) -> Any:
        self.seen.append(frame)
        return DelayedEstimate(self, len(self.seen), self.coverage.update(frame)[0])


@dataclass
class DelayedEstimate:
    session: LooksAhead
    frame: int
    status: Status
    origin: Origin = Origin.MODEL

    @property
    def qpos(self) -> np.ndarray:
        ahead = self.session.seen[min(self.frame, len(self.session.seen) - 1)]
        return self.session.bent(1e-3 * float(np.nan_to_num(ahead.tracker_from_station[0, 0])))


@dataclass(frozen=True)
class ModifiesExamples(Standing):
    """Modifies its examples."""

    needs_examples: bool = True

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> FittedTPose:
        for take in examples:
            object.__setattr__(take, "qpos", np.zeros_like(take.qpos))
        return FittedTPose(self.session, body)


class SeedsNumpy(StandingSession):
    """Seeds numpy's global generator."""

    def start(self) -> None:
        np.random.seed(1)  # noqa: NPY002  # the fault that its rule is there for


class SeedsPython(StandingSession):
    """Seeds Python's global generator."""

    def start(self) -> None:
        random.seed(1)


class AlwaysFallsBack(StandingSession):
    """Answers every frame by a fallback."""

    def step(self, frame: TrackerFrame) -> Any:
        estimate = super().step(frame)
        return Estimate(estimate.qpos, estimate.status, Origin.FALLBACK)


class AlwaysSolved(StandingSession):
    """Always reports SOLVED."""

    def step(self, frame: TrackerFrame) -> Any:
        return Estimate(self.qpos, Status.SOLVED)


class LostAtOnce(StandingSession):
    """Reports LOST where HELD is right."""

    def step(self, frame: TrackerFrame) -> Any:
        status, _ = self.coverage.update(frame)
        return Estimate(self.qpos, Status.LOST if status is Status.HELD else status)


class LostForever(StandingSession):
    """Stays LOST when the stations report again."""

    def start(self) -> None:
        self.worst = Status.SOLVED

    def step(self, frame: TrackerFrame) -> Any:
        self.worst = max(self.worst, self.coverage.update(frame)[0])
        return Estimate(self.qpos, self.worst)


class SolvedWithOne(StandingSession):
    """Reports SOLVED with a single station."""

    def step(self, frame: TrackerFrame) -> Any:
        some = frame.position_valid.any() or frame.orientation_valid.any()
        return Estimate(self.qpos, Status.SOLVED if some else self.coverage.update(frame)[0])


class NeverRecovers(StandingSession):
    """Keeps an error for ever after a jump of its first station."""

    def start(self) -> None:
        self.last_m, self.away_m = np.zeros(3), 0.0

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        here_m = np.nan_to_num(frame.position_m[0])
        if frame.received_s > 0.0 and np.linalg.norm(here_m - self.last_m) > 0.2:
            self.away_m = 1.0
        self.last_m = here_m
        out = self.qpos.copy()
        out[2] += self.away_m
        return out


class DependsOnPosition(StandingSession):
    """Bends its hinges with the distance from the origin."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        where_m = rotations.rotate(self.known.world_from_tracker, np.nan_to_num(frame.position_m[0]))
        return self.bent(0.05 * float(np.tanh(where_m[0] + self.known.tracker_origin_m[0])))


class StatesAtTimes(StandingSession):
    """States standard deviations only where every station reports."""

    def step(self, frame: TrackerFrame) -> Any:
        status, _ = self.coverage.update(frame)
        sigma_rad = np.full(48, 0.1) if frame.position_valid.all() else None
        return Estimate(self.answer(frame), status, angle_sigma_rad=sigma_rad)


class CertainWhenLost(StandingSession):
    """Answers with standard deviations of 0 when no station reports, in an object that nothing checks."""

    def step(self, frame: TrackerFrame) -> Any:
        status, _ = self.coverage.update(frame)
        sigma_rad = np.full(48, 0.1 if frame.quality.any() else 0.0)
        origin, qpos = Origin.MODEL, self.answer(frame)
        return SimpleNamespace(qpos=qpos, status=status, origin=origin, angle_sigma_rad=sigma_rad, lag=0)


class AnswersTooEarly(StandingSession):
    """States at its first step that it answers an earlier frame."""

    def start(self) -> None:
        self.lag = 1

    def step(self, frame: TrackerFrame) -> Any:
        status, _ = self.coverage.update(frame)
        lag, self.lag = self.lag, 0
        return Estimate(self.answer(frame), status, lag=lag)


class LateSession(StandingSession):
    """Correct: it answers three frames late, with the status of the frame, and states standard deviations."""

    def start(self) -> None:
        self.answers: list[Estimate] = []

    def step(self, frame: TrackerFrame) -> Any:
        status, _ = self.coverage.update(frame)
        self.answers.append(Estimate(self.answer(frame), status))
        lag = min(len(self.answers) - 1, 3)
        found = self.answers[-1 - lag]
        return Estimate(found.qpos, found.status, found.origin, np.full(48, 0.1), lag)


FORM_RULE = "lag and standard deviations keep their form"
PROCESS_RULE = "a fitted method works in another process"
FAULTY: tuple[tuple[type[StandingSession], str], ...] = (
    (DriftingQuaternion, "every estimate is a valid pose"),
    (NeedsPositions, "partial readings are tolerated"),
    (DividesByStations, "lost stations are tolerated"),
    (LostAtOrigin, "lost stations are tolerated"),
    (NeedsPeriod, "irregular frame times are tolerated"),
    (NeedsQuality, "any reading quality is tolerated"),
    (NeedsSixStations, "any set of stations is supported"),
    (StatesAtTimes, FORM_RULE),
    (CertainWhenLost, FORM_RULE),
    (AnswersTooEarly, FORM_RULE),
    (Unseeded, "equal input gives equal estimates"),
    (Continuing, "a session does not depend on earlier sessions"),
    (SharesTime, "simultaneous sessions do not affect each other"),
    (SharesBuffer, "sessions are thread-safe"),
    (Unpicklable, PROCESS_RULE),
    (ModifiesEstimates, "estimates are causal"),
    (LooksAhead, "estimates are causal"),
    (SeedsNumpy, "global random generators are not used"),
    (SeedsPython, "global random generators are not used"),
    (AlwaysSolved, "the status reports lost stations"),
    (LostAtOnce, "the status reports lost stations"),
    (LostForever, "the status reports lost stations"),
    (SolvedWithOne, "the status reports lost stations"),
    (AlwaysFallsBack, "the method's own model answers undisturbed frames"),
    (NeverRecovers, "the error recovers after a disturbance"),
    (DependsOnPosition, "the posture does not depend on position and heading"),
)


TRAINING_RULE = "the declared training data is consistent"


def violations(method: Standing) -> dict[str, str]:
    return {result.rule: result.seen for result in check_rules(method) if not result.ok}


@pytest.fixture
def _without_process_rule(monkeypatch: pytest.MonkeyPatch) -> None:
    """Skip the rule that starts a process, which takes seconds; it has tests of its own."""
    monkeypatch.setattr(method_checks, "RULES", {name: RULES[name] for name in RULES if name != PROCESS_RULE})


def test_a_correct_method_passes() -> None:
    check_method(Standing(StandingSession))


@pytest.mark.usefixtures("_without_process_rule")
@pytest.mark.parametrize("session", [StandingSession, LateSession])
def test_a_correct_method_has_no_violations(session: type[StandingSession]) -> None:
    assert violations(Standing(session)) == {}


def test_the_lag_and_the_standard_deviations_are_named() -> None:
    (found,) = [result for result in check_rules(Standing(LateSession)) if result.rule == FORM_RULE]
    assert found.seen == "a lag of 3 frames, standard deviations"


@pytest.mark.long
@pytest.mark.usefixtures("_without_process_rule")
@pytest.mark.parametrize(
    ("session", "rule"), [b for b in FAULTY if b[1] != PROCESS_RULE], ids=lambda value: getattr(value, "__name__", None)
)
def test_each_fault_violates_one_rule(session: type[StandingSession], rule: str) -> None:
    assert list(violations(Standing(session))) == [rule]


def test_a_method_that_cannot_be_sent_to_a_process_violates_one_rule() -> None:
    assert list(violations(Standing(Unpicklable))) == [PROCESS_RULE]


class DependsOnProcess(StandingSession):
    """Gives another estimate in another process."""

    @classmethod
    def fitted_once(cls, fitted: FittedTPose) -> None:
        fitted.memory["process"] = os.getpid()

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        return self.bent(0.0 if self.fitted.memory["process"] == os.getpid() else 1e-3)


def test_other_estimates_in_another_process_are_detected() -> None:
    assert violations(Standing(DependsOnProcess)) == {
        PROCESS_RULE: "60 estimates differ, the first in frame 0, by up to 0.001"
    }


@pytest.mark.usefixtures("_without_process_rule")
def test_modified_examples_violate_one_rule() -> None:
    assert list(violations(ModifiesExamples(StandingSession))) == ["examples are not modified"]


def test_every_rule_has_a_faulty_method() -> None:
    assert {rule for _, rule in FAULTY} | {"examples are not modified", TRAINING_RULE} == set(RULES)


@pytest.mark.parametrize(
    ("declared", "ok", "seen"),
    [
        ("none", True, "training data: none"),
        (" AMASS ", True, "trained on AMASS"),
        ("examples", False, "training_data is 'examples', but needs_examples is False"),
        (7, False, "training_data is 7. It must be a text such as 'examples', 'none' or 'AMASS'."),
    ],
)
def test_declared_training_data_agrees_with_the_method(declared: object, ok: bool, seen: str) -> None:
    method = Standing(StandingSession)
    object.__setattr__(method, "training_data", declared)
    assert method_checks.check_rule(make_case(method), TRAINING_RULE) == RuleResult(TRAINING_RULE, ok, seen)


def test_a_method_without_a_declaration_is_told_and_passes() -> None:
    found = method_checks.check_rule(make_case(Standing(StandingSession)), TRAINING_RULE)
    assert found.ok
    assert found.seen.startswith("training data unknown, ")


def test_the_first_violation_is_raised_with_its_rule() -> None:
    with pytest.raises(
        MethodContractError, match="standing violates the rule 'lost stations are tolerated': "
    ) as caught:
        check_method(Standing(LostAtOrigin))
    assert "far from every station" in caught.value.seen


@pytest.mark.long
def test_the_verb_prints_a_line_for_each_rule(command: Command) -> None:
    lines = command("check", "mean_pose").lines
    assert (lines[0], lines[-1]) == ("mean_pose", "pass")
    assert [line.split(": ")[0] for line in lines[1:-1]] == [f"  ok    {rule}" for rule in RULES]
    assert all(line.split(": ", 1)[1] for line in lines[1:-1])


@pytest.mark.usefixtures("_without_process_rule")
def test_the_verb_reports_violations_of_a_users_method(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    """`module:Class` is imported from the working folder; a violation is `regressed`, an unknown class is refused."""
    (tmp_path / "always_solved.py").write_text(
        "from tests.testing.test_method_checks import AlwaysSolved, Standing\n\n\n"
        "def Mine():\n    print('hello')\n    return Standing(AlwaysSolved)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    content = command("check", "always_solved:Mine", "--json", code=1).content
    assert content["outcome"] == "regressed"
    (violation,) = [result for result in content["methods"]["always_solved:Mine"] if not result["ok"]]
    assert violation["rule"] == "the status reports lost stations"
    assert "the status was SOLVED while 4 of 6 stations reported nothing" in violation["seen"]
    command("check", "always_solved:Yours", code=2)
