"""What methods with a history learn from examples, and how a method learns from a database."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from harness.body import Body
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.reconstruct.contract import Reconstructor
from harness.reconstruct.database.frames import Windows
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.posture_statistics import mean_posture
from harness.reconstruct.features.station_increments import StationIncrements
from harness.reconstruct.methods.ik import Ik
from harness.reconstruct.solver.ik_session import POSTURE_PRIOR_SIGMA_RAD, PosturePrior

R = TypeVar("R", bound=Reconstructor)


@dataclass(frozen=True, eq=False)
class WindowExamples:
    """Windows of the examples that have a frame after them, and priors for what no example determines."""

    body: Body
    windows: Windows
    mean_prior: PosturePrior
    """Prior about the mean posture, for frames without a history."""
    ik_prior: PosturePrior
    """Prior of `ik`."""
    increments: StationIncrements
    """How far stations move in a time."""

    @classmethod
    def learn(cls, body: Body, database: MotionDatabase, poses: int) -> "WindowExamples":
        """Windows of so many poses."""
        mean_prior = PosturePrior(mean_posture(body, database), np.full(48, POSTURE_PRIOR_SIGMA_RAD))
        windows = database.windows(poses, with_successor=True)
        increments = StationIncrements(body, database)
        return cls(body, windows, mean_prior, Ik().posture_prior(body, database), increments)


class DatabaseLearner(ABC, Generic[R]):
    """Base of a `DatabaseMethod`: it builds the database of its examples."""

    name: str
    needs_examples = True
    training_data = "examples"

    @property
    def fewest_frames(self) -> int:
        """Frames of the shortest take that gives an example."""
        return 1

    @abstractmethod
    def fit_database(self, body: Body, database: MotionDatabase, rng: np.random.Generator) -> R:
        """Learn from a database, which may lie on disk."""

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> R:
        """Build the database; BadInput without an example that is long enough."""
        if not any(len(take) >= self.fewest_frames for take in examples):
            raise BadInput(
                f"{self.name} learns from examples of {self.fewest_frames} frames or more, and there are none.",
                "Name some in the scenario.",
            )
        return self.fit_database(body, MotionDatabase.build(body, examples), rng)
