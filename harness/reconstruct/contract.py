"""Interfaces of a reconstructor: a configured method is trained once, then makes one causal session per take.

`Fitted` and `CalibrationCache` are what trained methods keep: how a session starts, and what was computed for a
calibration.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar, runtime_checkable

import numpy as np

from harness.body import Body
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import BodyMotion
from harness.stream import TrackerFrame

if TYPE_CHECKING:
    from harness.reconstruct.database.motion_database import MotionDatabase


class Session(Protocol):
    """Reconstruction of one take of one performer."""

    def step(self, frame: TrackerFrame) -> Estimate:
        """Estimate of the body at a frame; causal, from this frame and earlier ones only.

        A session answers the frame of the step (`Estimate.lag` 0), or the frame that it received a fixed number L of
        steps before. The lag of its n-th estimate is min(n, L), n from 0. The first L + 1 estimates therefore all
        answer the first frame, and the last of them counts. The last L frames of a take are never answered: they count
        as expected and not as matched. Scores compare an estimate with the truth at the frame that it answers.
        """
        ...


class Reconstructor(Protocol):
    """A trained method; immutable, and shared between sessions and processes."""

    def begin(self, calibration: Calibration) -> Session:
        """Start a session for stations with the mounts of a calibration."""
        ...


class Method(Protocol):
    """A configured algorithm. Its attributes are its options, and part of a cell's key (`core.object_state`).

    It may also have an attribute `source`, the paper it comes from, which `harness list` prints, and an attribute
    `training_data` (`core.split`). Without the latter its rank has the note "training data unknown".
    """

    @property
    def name(self) -> str:
        """Name in tables, such as "ik"."""
        ...

    @property
    def summary(self) -> str:
        """Description in one line."""
        ...

    @property
    def needs_examples(self) -> bool:
        """Whether `fit` learns from other takes. If not, the split of its results is "none"."""
        ...

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> Reconstructor:
        """Learn from motions at the tracker's rate, retargeted to `body`; never from the take under test."""
        ...


@runtime_checkable
class DatabaseMethod(Method, Protocol):
    """A method that can also learn from a database on disk, which may be larger than memory.

    `fit(body, examples, rng)` of such a method is `fit_database(body, MotionDatabase.build(body, examples), rng)`.
    """

    def fit_database(self, body: Body, database: "MotionDatabase", rng: np.random.Generator) -> Reconstructor:
        """Learn from poses on `body` at the tracker's rate; they may be memory-mapped, so avoid copies."""
        ...


T = TypeVar("T")
S = TypeVar("S", bound=Session, covariant=True)


@dataclass(frozen=True, eq=False)
class Fitted(Generic[S]):
    """A `Reconstructor` that knows no more than what its sessions start with."""

    begin: Callable[[Calibration], S]


class CalibrationCache(Generic[T]):
    """Cache of what takes seconds, such as the features of the examples.

    It holds a value for the last calibration, so that sessions of one performer share it.
    """

    def __init__(self) -> None:
        self._entry: tuple[tuple[tuple[str, ...], bytes], T] | None = None

    def get(self, calibration: Calibration, make: Callable[[], T]) -> T:
        """The value for a calibration's bones and mounts; `make` is called when they changed.

        The old value is released first, since both may not fit into memory.
        """
        key = tuple(calibration.bones), calibration.mount_m.tobytes()
        entry = self._entry
        if entry is None or entry[0] != key:
            entry = self._entry = None
            entry = self._entry = (key, make())
        return entry[1]
