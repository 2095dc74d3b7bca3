"""The contract suite passes sound methods, and each of its rules alone catches one broken on purpose."""

import json
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

from harness.body.humanoid import Body, tpose
from harness.cli import main
from harness.core import rotations
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Status
from harness.core.motion import BodyMotion
from harness.reconstruct.solver.status_monitor import StatusMonitor
from harness.stream.frame import TrackerFrame
from harness.testing import method_checks
from harness.testing.method_checks import MethodContractError, check_method, check_rules
from harness.testing.rules import RULES


@dataclass(frozen=True)
class Standing:
    """A sound method that always answers with the T-pose; the broken ones each spoil one thing."""

    session: type["StandingSession"]
    name: str = "standing"
    summary: str = "the T-pose, always"
    needs_examples: bool = False

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "Stood":
        return Stood(self.session, body)


class Stood:
    """Something to share, for those that share what they should not."""

    def __init__(self, session: type["StandingSession"], body: Body) -> None:
        self.session, self.body = session, body
        self.standing = tpose(body.skeleton)
        self.memory: dict[str, Any] = {}
        session.fitted_once(self)

    def begin(self, calibration: Calibration) -> "StandingSession":
        return self.session(self, calibration)


class StandingSession:
    def __init__(self, fitted: Stood, calibration: Calibration) -> None:
        self.fitted, self.known = fitted, calibration
        self.qpos, self.coverage = fitted.standing.copy(), StatusMonitor()
        self.start()

    @classmethod
    def fitted_once(cls, fitted: Stood) -> None: ...

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


class Drifting(StandingSession):
    """A quaternion that is not normed again: after 1.4 s of good frames it is off."""

    def start(self) -> None:
        self.length = 1.0

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        good = frame.position_valid.all() and frame.orientation_valid.all() and frame.quality.min() == 1.0
        self.length = self.length + 1.8e-8 if good and len(frame.quality) == 6 else 1.0
        out = self.qpos.copy()
        out[3:7] *= self.length
        return out


class Lopsided(StandingSession):
    """Takes the middle of the positions, though there may be orientations alone."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        out = self.qpos.copy()
        if frame.orientation_valid.any() and not frame.position_valid.any():
            out[:3] = np.nan
        return out


class Swallowing(StandingSession):
    """Divides by the number of stations that report."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        reporting = np.count_nonzero(frame.position_valid | frame.orientation_valid)
        return self.bent(0.0 if reporting else np.nan)


class ZeroFed(StandingSession):
    """Takes lost stations for stations at the origin of a far-away tracker frame."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        out, lost = self.qpos.copy(), np.count_nonzero(frame.quality == 0.0)
        out[:2] = 50.0 if lost == 1 else 0.0
        return out


class Ticking(StandingSession):
    """Divides by how much longer a period was than usual."""

    def start(self) -> None:
        self.last_s = -0.025

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        gap_s, self.last_s = frame.received_s - self.last_s, frame.received_s
        return self.bent(0.0 if abs(gap_s - 0.025) < 1e-9 or gap_s > 0.1 or gap_s < 0.0 else np.nan)


class Fastidious(StandingSession):
    """Takes the logarithm of what quality is left above a fifth."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        poor = (frame.quality > 0.0) & (frame.quality < 0.2)
        return self.bent(np.nan if poor.any() else 0.0)


class Liuist(StandingSession):
    """Knows of six stations and no other number."""

    def start(self) -> None:
        self.head = self.known.stations[5]


class Dicing(StandingSession):
    """Fits with chance of its own."""

    @classmethod
    def fitted_once(cls, fitted: Stood) -> None:
        fitted.memory["bend"] = 1e-3 * np.random.default_rng().random()

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        return self.bent(self.fitted.memory["bend"])


class Remembering(StandingSession):
    """Begins where the session before it ended."""

    def start(self) -> None:
        self.bend = self.fitted.memory.get("bend", 0.0)

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        self.bend += 1e-4
        self.fitted.memory["bend"] = self.bend
        return self.bent(self.bend)


class Entangled(StandingSession):
    """Keeps the time of the last frame where another session finds it."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        last_s = self.fitted.memory.get("last_s", 0.0) if frame.received_s > 0.0 else 0.0
        self.fitted.memory["last_s"] = frame.received_s
        return self.bent(1e-3 if frame.received_s < last_s else 0.0)


class Racing(StandingSession):
    """Works in an array that all sessions share; long enough for another to come in between."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        self.fitted.memory["mine"] = id(self)
        time.sleep(1e-3)
        return self.bent(0.0 if self.fitted.memory["mine"] == id(self) else 1e-3)


class Rooted(StandingSession):
    """Holds what cannot leave its process."""

    @classmethod
    def fitted_once(cls, fitted: Stood) -> None:
        fitted.memory["lock"] = threading.Lock()


class Rewriting(StandingSession):
    """Smooths what it has already said."""

    def start(self) -> None:
        self.live = self.qpos.copy()

    def step(self, frame: TrackerFrame) -> Any:
        self.live[7] += 1e-6
        return SimpleNamespace(qpos=self.live, status=self.coverage.update(frame)[0])


class Foreseeing(StandingSession):
    """Answers late, when the next frame is known."""

    def start(self) -> None:
        self.seen: list[TrackerFrame] = []

    def step(self, frame: TrackerFrame) -> Any:
        self.seen.append(frame)
        return Late(self, len(self.seen), self.coverage.update(frame)[0])


@dataclass
class Late:
    session: Foreseeing
    frame: int
    status: Status

    @property
    def qpos(self) -> np.ndarray:
        ahead = self.session.seen[min(self.frame, len(self.session.seen) - 1)]
        return self.session.bent(1e-3 * float(np.nan_to_num(ahead.tracker_from_station[0, 0])))


@dataclass(frozen=True)
class Tampering(Standing):
    """Thinks the examples are its own."""

    needs_examples: bool = True

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> Stood:
        for take in examples:
            take.qpos.flags.writeable = True
            take.qpos[:, :3] = 0.0
        return Stood(self.session, body)


class Seeding(StandingSession):
    """Makes everybody's chance its own."""

    def start(self) -> None:
        np.random.seed(1)  # noqa: NPY002  # the fault that its rule is there for


class Shuffling(StandingSession):
    """The same with Python's."""

    def start(self) -> None:
        random.seed(1)


class Boasting(StandingSession):
    """Never admits anything."""

    def step(self, frame: TrackerFrame) -> Any:
        return Estimate(self.qpos, Status.SOLVED)


class Hasty(StandingSession):
    """Gives up at once."""

    def step(self, frame: TrackerFrame) -> Any:
        status, _ = self.coverage.update(frame)
        return Estimate(self.qpos, Status.LOST if status is Status.HELD else status)


class Despairing(StandingSession):
    """Once lost, always lost."""

    def start(self) -> None:
        self.worst = Status.SOLVED

    def step(self, frame: TrackerFrame) -> Any:
        self.worst = max(self.worst, self.coverage.update(frame)[0])
        return Estimate(self.qpos, self.worst)


class Undemanding(StandingSession):
    """One station is enough for it."""

    def step(self, frame: TrackerFrame) -> Any:
        some = frame.position_valid.any() or frame.orientation_valid.any()
        return Estimate(self.qpos, Status.SOLVED if some else self.coverage.update(frame)[0])


class Offended(StandingSession):
    """Never gets over a jump of its first station."""

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


class Homesick(StandingSession):
    """Bends the more, the farther it is from where it was fitted."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        where_m = rotations.rotate(self.known.world_from_tracker, np.nan_to_num(frame.position_m[0]))
        return self.bent(0.05 * float(np.tanh(where_m[0] + self.known.tracker_origin_m[0])))


ELSEWHERE = "what was fitted may go to another process"
BROKEN: tuple[tuple[type[StandingSession], str], ...] = (
    (Drifting, "every answer is a pose"),
    (Lopsided, "poor input is borne"),
    (Swallowing, "losses are borne"),
    (ZeroFed, "losses are borne"),
    (Ticking, "irregular time is borne"),
    (Fastidious, "any quality is borne"),
    (Liuist, "any set of stations is borne"),
    (Dicing, "equal input gives equal answers"),
    (Remembering, "a session starts from nothing"),
    (Entangled, "sessions do not meet"),
    (Racing, "sessions may run in threads"),
    (Rooted, ELSEWHERE),
    (Rewriting, "an answer rests on no later frame"),
    (Foreseeing, "an answer rests on no later frame"),
    (Seeding, "chance is the generator given"),
    (Shuffling, "chance is the generator given"),
    (Boasting, "the status tells what the answer rests on"),
    (Hasty, "the status tells what the answer rests on"),
    (Despairing, "the status tells what the answer rests on"),
    (Undemanding, "the status tells what the answer rests on"),
    (Offended, "the error comes back to what it was"),
    (Homesick, "the posture does not depend on the place"),
)


def amiss(method: Standing) -> dict[str, str]:
    return {finding.rule: finding.seen for finding in check_rules(method) if not finding.ok}


@pytest.fixture
def _stays_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process takes seconds to start, so only those that may not or cannot go to another are sent there."""
    monkeypatch.setattr(method_checks, "RULES", {name: RULES[name] for name in RULES if name != ELSEWHERE})


def test_the_sound_one_passes() -> None:
    check_method(Standing(StandingSession))


@pytest.mark.usefixtures("_stays_here")
def test_nothing_is_amiss_with_the_sound_one() -> None:
    assert amiss(Standing(StandingSession)) == {}


@pytest.mark.usefixtures("_stays_here")
@pytest.mark.parametrize(
    ("session", "rule"), [b for b in BROKEN if b[1] != ELSEWHERE], ids=lambda value: getattr(value, "__name__", None)
)
def test_one_rule_alone_catches_each_broken_one(session: type[StandingSession], rule: str) -> None:
    assert list(amiss(Standing(session))) == [rule]


def test_what_cannot_leave_its_process_is_caught_by_its_rule_alone() -> None:
    assert list(amiss(Standing(Rooted))) == [ELSEWHERE]


class Settled(StandingSession):
    """Answers by the process that it was fitted in."""

    @classmethod
    def fitted_once(cls, fitted: Stood) -> None:
        fitted.memory["process"] = os.getpid()

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        return self.bent(0.0 if self.fitted.memory["process"] == os.getpid() else 1e-3)


def test_what_answers_otherwise_in_another_process_is_caught_there() -> None:
    assert amiss(Standing(Settled)) == {ELSEWHERE: "60 answers differ, the first in frame 0, by up to 0.001"}


@pytest.mark.usefixtures("_stays_here")
def test_tampering_with_the_examples_is_caught_by_its_rule_alone() -> None:
    assert list(amiss(Tampering(StandingSession))) == ["examples stay as they are"]


def test_every_rule_has_its_broken_one() -> None:
    assert {rule for _, rule in BROKEN} | {"examples stay as they are"} == set(RULES)


def test_the_first_rule_that_is_broken_is_raised_by_name() -> None:
    with pytest.raises(MethodContractError, match="standing breaks the rule that losses are borne: ") as caught:
        check_method(Standing(ZeroFed))
    assert "far from every station" in caught.value.seen


def test_the_verb_prints_a_line_for_each_rule(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "mean_pose"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert (lines[0], lines[-1]) == ("mean_pose", "pass")
    assert [line.split(": ")[0] for line in lines[1:-1]] == [f"  ok    {rule}" for rule in RULES]
    assert all(line.split(": ", 1)[1] for line in lines[1:-1])


@pytest.mark.usefixtures("_stays_here")
def test_the_verb_tells_what_anyones_own_method_breaks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`module:Class` from the folder where one works; a broken one regresses, one that does not exist is refused."""
    (tmp_path / "boaster.py").write_text(
        "from tests.testing.test_method_checks import Boasting, Standing\n\n\n"
        "def Mine():\n    print('hello')\n    return Standing(Boasting)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert main(["check", "boaster:Mine", "--json"]) == 1
    content = json.loads(capsys.readouterr().out)
    assert content["outcome"] == "regressed"
    (broken,) = [finding for finding in content["methods"]["boaster:Mine"] if not finding["ok"]]
    assert broken["rule"] == "the status tells what the answer rests on"
    assert "SOLVED while 4 of 6 stations were silent" in broken["seen"]
    assert main(["check", "boaster:Yours"]) == 2
