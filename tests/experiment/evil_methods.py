"""Methods that disturb others, by accident or on purpose. All answer with the T-pose, as far as they answer at all."""

import ctypes
import gc
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.body import tpose
from harness.core.estimate import Estimate, Status

MODULE = "tests.experiment.evil_methods"
MARK = "TRACKER_HARNESS_TEST_SLEEPER"
"""Argument by which a process that was left behind is recognised."""


@dataclass(frozen=True)
class Honest:
    """A method, its trained form and its session in one."""

    name: str = "honest"
    summary: str = "the T-pose"
    needs_examples: bool = True

    def fit(self, body: Any, examples: Any, rng: Any) -> Any:
        return Trained(tpose(body.skeleton), self, body, examples)

    def step(self, trained: "Trained", frame: Any) -> Any:
        return Estimate(trained.pose, Status.SOLVED)


class Trained:
    """Passes each frame to its method, and knows what it was trained with."""

    def __init__(self, pose: Any, method: Honest, body: Any, examples: Any) -> None:
        self.pose, self.method, self.body, self.examples = pose, method, body, examples
        self.calibration: Any = None
        self.given: list[Any] = []

    def begin(self, calibration: Any) -> "Trained":
        self.calibration = calibration
        return self

    def step(self, frame: Any) -> Any:
        self.given.append(self.method.step(self, frame))
        return self.given[-1]


class DeletesExamples(Honest):
    def fit(self, body: Any, examples: Any, rng: Any) -> Any:
        examples.clear()
        return super().fit(body, examples, rng)


def overwrite(array: Any) -> None:
    """Every way to write into an array that needs no foreign code."""
    if array is None:
        return
    whole = array
    while isinstance(whole, np.ndarray):
        with suppress(ValueError):
            whole.setflags(write=True)
        with suppress(ValueError):
            whole.flags.writeable = True
        with suppress(ValueError):
            whole[...] = 0.0
        whole = whole.base
    with suppress(TypeError):
        memoryview(whole)[0] = 0
    with suppress(ValueError, TypeError):
        np.frombuffer(whole, array.dtype).setflags(write=True)


class UnlocksArrays(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        for record in (frame, trained.calibration, trained.body.skeleton, *trained.examples):
            for name in ("position_m", "measured_s", "mount_m", "bone_m", "qpos"):
                overwrite(getattr(record, name, None))
        return super().step(trained, frame)


class ReplacesFields(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        for record in (frame, trained.calibration, *trained.examples):
            for name in ("position_m", "mount_m", "qpos"):
                if hasattr(record, name):
                    object.__setattr__(record, name, np.zeros_like(getattr(record, name)))
        return super().step(trained, frame)


class SpoilsTheModel(Honest):
    def fit(self, body: Any, examples: Any, rng: Any) -> Any:
        body.model.jnt_range[:] = 0.0
        body.model.body_pos[:] = 0.0
        return super().fit(body, examples, rng)


class RewritesAnswers(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        for estimate in trained.given:
            overwrite(estimate.qpos)
            object.__setattr__(estimate, "qpos", np.full(55, 7.0))
        return super().step(trained, frame)


class AnswersWithAView(Honest):
    """The array of each answer is the same one, which is changed later."""

    def step(self, trained: Trained, frame: Any) -> Any:
        pose = np.array(trained.pose)
        for estimate in trained.given:
            estimate.qpos[:] = 7.0
        estimate = Estimate(pose, Status.SOLVED)
        object.__setattr__(estimate, "qpos", pose)
        return estimate


class PatchesNumpy(Honest):
    def fit(self, body: Any, examples: Any, rng: Any) -> Any:
        fitted = super().fit(body, examples, rng)
        for name in ("mean", "median", "percentile", "nanmean", "degrees"):
            setattr(np, name, lambda *_, **__: 0.0)
        return fitted


class PatchesTheScorer(Honest):
    def fit(self, body: Any, examples: Any, rng: Any) -> Any:
        import harness.experiment.cells
        import harness.score.angles
        import harness.score.score

        for module in (harness.experiment.cells, harness.score.angles, harness.score.score):
            for name, value in list(vars(module).items()):
                if callable(value) and not isinstance(value, type):
                    setattr(module, name, lambda *_, **__: np.zeros(1))
        return super().fit(body, examples, rng)


class FindsTheTruth(Honest):
    """Answers with the true poses if they are anywhere in its process."""

    def step(self, trained: Trained, frame: Any) -> Any:
        for found in gc.get_objects():
            with suppress(Exception):
                truth = getattr(found, "truth_qpos", None)
                if isinstance(truth, np.ndarray) and truth.shape[1:] == (55,):
                    return Estimate(truth[min(len(trained.given), len(truth) - 1)], Status.SOLVED)
        return super().step(trained, frame)


class ChangesItsSurroundings(Honest):
    def fit(self, body: Any, examples: Any, rng: Any) -> Any:
        os.chdir("/")
        os.umask(0o777)
        os.environ.clear()
        sys.path.clear()
        np.random.seed(0)  # noqa: NPY002
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        sys.setrecursionlimit(10_000)
        return super().fit(body, examples, rng)


class ClosesItsOutput(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        with suppress(OSError, ValueError):
            sys.stdout.close()
            os.close(1)
            os.close(0)
        return super().step(trained, frame)


class PrintsRubbish(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        os.write(1, b"\x00\xff" * 10 + b"\n")
        print("rubbish")
        return super().step(trained, frame)


class LeavesThreads(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        if not trained.given:
            threading.Thread(target=time.sleep, args=(1e6,)).start()
        return super().step(trained, frame)


class LeavesAProcess(Honest):
    def fit(self, body: Any, examples: Any, rng: Any) -> Any:
        subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)", MARK])
        return super().fit(body, examples, rng)


class ReadsADeclaredFile(Honest):
    files = ("data/declared.txt",)

    def fit(self, body: Any, examples: Any, rng: Any) -> Any:
        Path(__file__).with_name("data").joinpath("declared.txt").read_text(encoding="utf-8")
        return super().fit(body, examples, rng)


HARMLESS: list[type[Honest]] = [
    *(DeletesExamples, UnlocksArrays, ReplacesFields, SpoilsTheModel, RewritesAnswers, AnswersWithAView, PatchesNumpy),
    *(PatchesTheScorer, FindsTheTruth, ChangesItsSurroundings, ClosesItsOutput, PrintsRubbish, LeavesThreads),
    *(LeavesAProcess, ReadsADeclaredFile),
]
"""Their cells are finished, and have the errors of `Honest`."""


class Exits(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        os._exit(0)


class ExitsWhenItIsMade(Honest):
    def __init__(self) -> None:
        os._exit(0)


class RaisesSystemExit(Honest):
    def fit(self, body: Any, examples: Any, rng: Any) -> Any:
        raise SystemExit("on purpose")


class RaisesKeyboardInterrupt(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        raise KeyboardInterrupt("on purpose")


class EatsTheMemory(Honest):
    def fit(self, body: Any, examples: Any, rng: Any) -> Any:
        held = []
        while True:
            held.append(np.ones(10_000_000))


class Crashes(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        return ctypes.string_at(0)


class KillsItself(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        os.kill(os.getpid(), signal.SIGKILL)


class Recurses(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        return self.step(trained, frame)


class ClosesEverything(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        os.closerange(0, 4096)
        return super().step(trained, frame)


class ForgesAnswers(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        for number in range(3, 64):
            with suppress(OSError):
                os.write(number, b"\x10" + 7 * b"\x00" + b'{"header": {}}   ')
        return super().step(trained, frame)


class AnswersWithTooFewNumbers(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        return Estimate(trained.pose[:54], Status.SOLVED)


class AnswersWithNothing(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        return None


class ReadsAnUndeclaredFile(Honest):
    """It catches the refusal and answers all the same."""

    def fit(self, body: Any, examples: Any, rng: Any) -> Any:
        with suppress(Exception):
            Path(__file__).with_name("data").joinpath("undeclared.txt").read_text(encoding="utf-8")
        return super().fit(body, examples, rng)


FAILING: dict[type[Honest], str] = {
    Exits: "ended with exit code 0",
    ExitsWhenItIsMade: "ended with exit code 0",
    RaisesSystemExit: "on purpose",
    RaisesKeyboardInterrupt: "on purpose",
    EatsTheMemory: r"Raise --memory-limit|SIGKILL",
    Crashes: "SIGSEGV",
    KillsItself: "SIGKILL",
    Recurses: "RecursionError",
    ClosesEverything: "cannot be read|exit code",
    ForgesAnswers: "cannot be read",
    AnswersWithTooFewNumbers: r"shape \(54,\)",
    AnswersWithNothing: "AttributeError",
    ReadsAnUndeclaredFile: r"data/undeclared\.txt, which is not declared",
}
"""Their cells fail, with a message that matches."""


class Hangs(Honest):
    def step(self, trained: Trained, frame: Any) -> Any:
        while True:
            time.sleep(1.0)


class HangsWithoutListening(Honest):
    """No other thread of its process can run, and it ignores signals that can be ignored."""

    def step(self, trained: Trained, frame: Any) -> Any:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        return re.match(r"(a+)+$", "a" * 64 + "b")


HANGING: list[type[Honest]] = [Hangs, HangsWithoutListening]


def method_name(kind: Callable[..., Any]) -> str:
    return f"{MODULE}:{kind.__name__}"
