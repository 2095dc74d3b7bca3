"""What a reconstructor is: a configured method, trained once, then one causal session per take."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from harness.body.humanoid import Body
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import Take
from harness.stream.frame import TrackerFrame


class Session(Protocol):
    """One performer, one take. Causal: an estimate may rest on this frame and those before it."""

    def step(self, frame: TrackerFrame) -> Estimate: ...


class Reconstructor(Protocol):
    """Trained and immutable; shared between sessions and processes."""

    def begin(self, calibration: Calibration) -> Session: ...


class Method(Protocol):
    """A configured algorithm; its `repr` tells its options, as that of a dataclass does."""

    @property
    def name(self) -> str:
        """As it stands in tables, such as "ik"."""
        ...

    @property
    def summary(self) -> str:
        """What it does, in one line."""
        ...

    @property
    def needs_examples(self) -> bool:
        """Whether `fit` learns from other takes; without it the result's protocol is "none"."""
        ...

    def fit(self, body: Body, examples: Sequence[Take], rng: np.random.Generator) -> Reconstructor:
        """Learn from takes at the tracker's rate, retargeted to `body`; never from the take under test."""
        ...
