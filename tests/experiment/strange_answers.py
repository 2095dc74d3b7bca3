"""Methods whose answers are no poses, or poses in an unusual form; all begin with the T-pose."""

import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.core.estimate import Estimate, Status
from tests.experiment.evil_methods import Honest, Trained

MODULE = "tests.experiment.strange_answers"


class Strange(Honest):
    """Changes its pose at each step, and answers with an object of its own if asked for a form."""

    def step(self, trained: Trained, frame: Any) -> Any:
        return self.answer(np.array(trained.pose), len(trained.given))

    def answer(self, pose: Floats, number: int) -> Any:
        raise NotImplementedError


def plain(qpos: Any, **others: Any) -> Any:
    return SimpleNamespace(qpos=qpos, status=Status.SOLVED, **others)


class Diverges(Strange):
    def answer(self, pose: Floats, number: int) -> Any:
        pose[10] = 1e17 if number > 50 else 0.0
        return Estimate(pose, Status.SOLVED)


class DivergesByItself(Strange):
    """Its answers are no `Estimate`, which would refuse them at once."""

    def answer(self, pose: Floats, number: int) -> Any:
        pose[3:7] *= 1e-160
        return plain(pose)


class IsComplex(Strange):
    def answer(self, pose: Floats, number: int) -> Any:
        return plain(pose + 1j)


class StatesTooLittle(Strange):
    def answer(self, pose: Floats, number: int) -> Any:
        return plain(pose, angle_sigma_rad=np.full(48, 1e-50))


class IsOfAnotherSize(Strange):
    def answer(self, pose: Floats, number: int) -> Any:
        return plain(pose[None])


class RefusesToStep(Strange):
    def answer(self, pose: Floats, number: int) -> Any:
        from harness.errors import BadInput

        raise BadInput("There is no way.", "Go home.")


class NamesAFileThatIsNoUnicode(Strange):
    def answer(self, pose: Floats, number: int) -> Any:
        return Path(os.fsdecode(b"/nowhere/caf\xe9")).read_text()


class RaisesAnErrorWithoutText(Strange):
    def answer(self, pose: Floats, number: int) -> Any:
        class Untold(BaseException):
            def __str__(self) -> str:
                raise TypeError

        raise Untold


class IsSingle(Strange):
    def answer(self, pose: Floats, number: int) -> Any:
        return plain(pose.astype(np.float32))


class IsUndefinedAtTimes(Strange):
    def answer(self, pose: Floats, number: int) -> Any:
        pose[:] = np.nan if number % 7 == 0 else pose
        return plain(pose)


FAILING: dict[type[Strange], str] = {
    Diverges: r"1e\+17 at place 10 of a pose",
    DivergesByItself: "a root quaternion of",
    IsComplex: "complex128",
    StatesTooLittle: "hinge 0 is 1e-50 rad",
    IsOfAnotherSize: r"\(1, 55\)",
    NamesAFileThatIsNoUnicode: r"FileNotFoundError: .*/nowhere/caf",
    RaisesAnErrorWithoutText: "Untold: <exception str",
    RefusesToStep: "There is no way. Go home.",
}
SCORED: list[type[Strange]] = [IsSingle, IsUndefinedAtTimes]


def method_name(kind: Callable[..., Any]) -> str:
    return f"{MODULE}:{kind.__name__}"
