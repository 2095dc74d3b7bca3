"""Methods from outside the package that answer late, and state standard deviations or spoil them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.core.estimate import Estimate
from harness.reconstruct import Ik

SIGMA_RAD = np.deg2rad(np.linspace(1.0, 12.0, 48))


@dataclass(frozen=True)
class Late:
    """Inverse kinematics that keeps each answer for `wait` frames; its name does not say so."""

    wait: int = 2
    stated: bool = True
    name: str = "late"
    summary: str = "inverse kinematics, late"
    needs_examples: bool = False
    training_data: str = "none"

    def fit(self, body: Any, examples: Any, rng: Any) -> "Waiting":
        return Waiting(self, Ik(towards_mean=0.0, spread=False).fit(body, examples, rng))


@dataclass(frozen=True, eq=False)
class Waiting:
    options: Late
    inner: Any

    def begin(self, calibration: Any) -> "WaitingSession":
        return WaitingSession(self.options, self.inner.begin(calibration))


class WaitingSession:
    def __init__(self, options: Late, inner: Any) -> None:
        self.options, self.inner = options, inner
        self.answers: list[Estimate] = []

    def step(self, frame: Any) -> Estimate:
        self.answers.append(self.inner.step(frame))
        lag = min(self.options.wait, len(self.answers) - 1)
        found = self.answers[-1 - lag]
        return Estimate(found.qpos, found.status, found.origin, self.sigma_rad(), lag)

    def sigma_rad(self) -> Any:
        return SIGMA_RAD if self.options.stated else None


class Spoilt:
    """An answer that is no `Estimate`, so nothing has checked it."""

    def __init__(self, estimate: Estimate, changes: dict[str, Any]) -> None:
        self.qpos, self.status, self.origin = estimate.qpos, estimate.status, estimate.origin
        self.angle_sigma_rad, self.lag = estimate.angle_sigma_rad, estimate.lag
        self.__dict__.update(changes)


def spoilt(session: WaitingSession, at: int, **changes: Any) -> Any:
    """The session, whose answer at one step is changed."""
    step = session.step

    def changed(frame: Any) -> Any:
        estimate = step(frame)
        return Spoilt(estimate, changes) if len(session.answers) == at + 1 else estimate

    session.step = changed  # type: ignore[method-assign]
    return session


NAMES: Sequence[str] = (f"{__name__}:Late", f"{__name__}:Late[wait=0]")
"""The method with a lag of two frames, and the same without."""
