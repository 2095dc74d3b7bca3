"""The contract suite passes every shipped method, and catches methods broken on purpose."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.body.humanoid import Body, tpose
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Status
from harness.core.motion import Take
from harness.reconstruct import registry
from harness.reconstruct.coverage import Coverage
from harness.stream.frame import TrackerFrame
from harness.testing.method_checks import MethodBroken, check_method


@pytest.mark.parametrize("name", [*sorted(registry.methods()), "mean_pose+ik"])
def test_every_shipped_method_keeps_the_contract(name: str) -> None:
    check_method(registry.resolve(name))


class Standing:
    """A sound method that always answers with the T-pose; the broken ones each spoil one thing."""

    name, summary, needs_examples = "standing", "the T-pose, always", False

    def fit(self, body: Body, examples: Sequence[Take], rng: np.random.Generator) -> "Standing":
        self.body = body
        self.memory: list[Any] = []
        return self

    def begin(self, calibration: Calibration) -> "StandingSession":
        return self.session(self)

    @property
    def session(self) -> type["StandingSession"]:
        return StandingSession


@dataclass
class StandingSession:
    fitted: Standing

    def __post_init__(self) -> None:
        self.qpos, self.coverage = tpose(self.fitted.body.skeleton), Coverage()
        self.start()

    def start(self) -> None: ...

    def step(self, frame: TrackerFrame) -> Any:
        status, _ = self.coverage.seen(frame)
        return Estimate(self.answer(frame), status)

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        return self.qpos


class Dicing(StandingSession):
    """Draws from no generator of its own."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        out = self.qpos.copy()
        out[7] = np.random.default_rng().random()
        return out


class Remembering(StandingSession):
    """Starts where the session before it ended."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        self.fitted.memory.append(frame)
        out = self.qpos.copy()
        out[7] = 1e-3 * len(self.fitted.memory)
        return out


class Entangled(StandingSession):
    """Sessions write into one array."""

    def start(self) -> None:
        self.fitted.memory = [0.0]

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        self.fitted.memory[0] += 1e-3
        out = self.qpos.copy()
        out[7] = self.fitted.memory[0]
        return out


class Swallowing(StandingSession):
    """Takes NaN for a number."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        out = self.qpos.copy()
        out[:3] = frame.position_m.mean(axis=0)
        return out


class ZeroFed(StandingSession):
    """Takes lost stations for stations at the origin of a far-away tracker frame."""

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        out = self.qpos.copy()
        out[:2] = 0.0 if frame.position_valid.all() else 50.0
        return out


class Unnormalised(StandingSession):
    def answer(self, frame: TrackerFrame) -> np.ndarray:
        out = self.qpos.copy()
        out[3:7] *= 1.01
        return out


class Rewriting(StandingSession):
    """Smooths what it has already said."""

    def start(self) -> None:
        self.live = self.qpos.copy()

    def step(self, frame: TrackerFrame) -> Any:
        self.live[7] += 1e-3
        return SimpleNamespace(qpos=self.live, status=self.coverage.seen(frame)[0])


class Foreseeing(StandingSession):
    """Answers late, when the next frame is known."""

    def start(self) -> None:
        self.seen: list[TrackerFrame] = []

    def step(self, frame: TrackerFrame) -> Any:
        self.seen.append(frame)
        return Late(self, len(self.seen), self.coverage.seen(frame)[0])


@dataclass
class Late:
    session: Foreseeing
    frame: int
    status: Status

    @property
    def qpos(self) -> np.ndarray:
        out = self.session.qpos.copy()
        ahead = self.session.seen[min(self.frame, len(self.session.seen) - 1)]
        out[7] = 1e-3 * np.nan_to_num(ahead.position_m[0, 0])
        return out


class Boasting(StandingSession):
    """Never admits anything."""

    def step(self, frame: TrackerFrame) -> Any:
        return Estimate(self.qpos, Status.SOLVED)


class Despairing(StandingSession):
    """Once lost, always lost."""

    def start(self) -> None:
        self.worst = Status.SOLVED

    def step(self, frame: TrackerFrame) -> Any:
        self.worst = max(self.worst, self.coverage.seen(frame)[0])
        return Estimate(self.qpos, self.worst)


class Ticking(StandingSession):
    """Divides by the time since the last frame, and takes the period for granted."""

    def start(self) -> None:
        self.last_s = -1.0

    def answer(self, frame: TrackerFrame) -> np.ndarray:
        out, gap_s = self.qpos.copy(), frame.received_s - self.last_s
        self.last_s = frame.received_s
        out[7] = 0.0 if abs(gap_s - 0.025) < 1e-9 or frame.received_s == 0.0 else np.nan
        return out


def test_the_sound_one_passes() -> None:
    check_method(Standing())


@pytest.mark.parametrize(
    ("session", "rule"),
    [
        (Dicing, "equal input gives equal answers"),
        (Remembering, "starts from nothing"),
        (Entangled, "do not meet"),
        (Swallowing, "every answer is a pose"),
        (ZeroFed, "every answer is a pose"),
        (Unnormalised, "every answer is a pose"),
        (Rewriting, "not changed afterwards"),
        (Foreseeing, "no later frame"),
        (Boasting, "the status tells"),
        (Despairing, "the status tells"),
        (Ticking, "every answer is a pose"),
    ],
)
def test_each_broken_one_is_caught(session: type[StandingSession], rule: str) -> None:
    class Broken(Standing):
        name = "broken"

        @property
        def session(self) -> type[StandingSession]:
            return session

    with pytest.raises(MethodBroken, match=rule) as caught:
        check_method(Broken())
    assert str(caught.value).startswith("broken breaks the rule that ")
