"""What a reconstructor is: a configured method, trained once, then one causal session per take."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np

from harness.body.humanoid import Body
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import BodyMotion
from harness.stream.frame import TrackerFrame

if TYPE_CHECKING:
    from harness.reconstruct.database import MotionDatabase


class Session(Protocol):
    """One performer, one take. Causal: an estimate may rest on this frame and those before it."""

    def step(self, frame: TrackerFrame) -> Estimate: ...


class Reconstructor(Protocol):
    """Trained and immutable; shared between sessions and processes."""

    def begin(self, calibration: Calibration) -> Session: ...


class Method(Protocol):
    """A configured algorithm; its `repr` tells its options, as that of a dataclass does.

    It may also have `source`, where it comes from, which `harness list` prints.
    """

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
        """Whether `fit` learns from other takes; without it the result's split is "none"."""
        ...

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> Reconstructor:
        """Learn from takes at the tracker's rate, retargeted to `body`; never from the take under test."""
        ...


@runtime_checkable
class DatabaseMethod(Method, Protocol):
    """A method that can also learn from a database on disk, for which takes would not fit into memory.

    `fit(body, examples, rng)` of such a method is `fit_database(body, MotionDatabase.build(body, examples), rng)`.
    """

    def fit_database(self, body: Body, database: "MotionDatabase", rng: np.random.Generator) -> Reconstructor:
        """Learn from poses on `body` at the tracker's rate; they may be memory-mapped: copy none that need not be."""
        ...
