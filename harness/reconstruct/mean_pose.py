"""The mean posture of the examples, stood where the trackers are: what any method that learns has to beat."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.body.humanoid import Body, tpose
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import Take
from harness.errors import BadInput
from harness.reconstruct.coverage import Coverage
from harness.reconstruct.hinges import HingeLimits
from harness.reconstruct.placing import nearest_placed
from harness.reconstruct.residuals import Loss, Residuals
from harness.stream.frame import TrackerFrame


def mean_posture(body: Body, examples: Sequence[Take]) -> Floats:
    """(55,) the mean of the examples' hinge angles, rooted like the T-pose; BadInput without examples."""
    if not examples:
        raise BadInput("The mean posture is learnt from examples, and there are none.", "Name some in the scenario.")
    out = np.array(tpose(body.skeleton))
    out[7:] = HingeLimits(body).mean(np.concatenate([take.qpos[:, 7:] for take in examples]))
    return out


@dataclass(frozen=True)
class MeanPose:
    """A `Method`."""

    name: str = "mean_pose"
    summary: str = "the examples' mean posture, stood where the trackers are: the null that learns"
    needs_examples: bool = True

    def fit(self, body: Body, examples: Sequence[Take], rng: np.random.Generator) -> "FittedMeanPose":
        """BadInput without examples."""
        return FittedMeanPose(body, mean_posture(body, examples))


@dataclass(frozen=True, eq=False)
class FittedMeanPose:
    """The body and its mean posture."""

    body: Body
    qpos: Floats
    """(55,)"""

    def begin(self, calibration: Calibration) -> "MeanPoseSession":
        return MeanPoseSession(self, calibration)


class MeanPoseSession:
    """Moves the posture as a whole."""

    def __init__(self, fitted: FittedMeanPose, calibration: Calibration) -> None:
        self._residuals = Residuals(fitted.body, calibration, Loss())
        self._coverage = Coverage()
        self._qpos = fitted.qpos

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_seen = self._coverage.seen(frame)
        if any_seen:
            self._residuals.read(frame)
            self._qpos = nearest_placed(self._residuals, self._qpos)
        return Estimate(self._qpos, status)
