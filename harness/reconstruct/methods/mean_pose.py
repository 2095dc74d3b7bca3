"""Mean pose (`mean_pose`): the examples' mean posture, placed where the trackers are.

A baseline: what any method that learns from examples has to beat. Hinge angles are the circular mean over all examples
and never change; in each frame only the root is fitted to the trackers (`root_placement`).

Source: ours. It has no options.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.body import Body
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Origin
from harness.core.motion import BodyMotion
from harness.reconstruct.features.posture_statistics import mean_posture
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.root_placement import place_root
from harness.reconstruct.solver.status_monitor import StatusMonitor
from harness.stream import TrackerFrame


@dataclass(frozen=True)
class MeanPose:
    """The mean pose, a `Method`; it has no options."""

    name: str = "mean_pose"
    summary: str = "the examples' mean posture, placed at the trackers: a baseline"
    needs_examples: bool = True
    training_data = "examples"

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedMeanPose":
        """BadInput without examples."""
        return FittedMeanPose(body, mean_posture(body, examples))


@dataclass(frozen=True, eq=False)
class FittedMeanPose:
    """The body and the mean posture of the examples."""

    body: Body
    qpos: Floats
    """(55,) T-pose root and mean hinge angles."""

    def begin(self, calibration: Calibration) -> "MeanPoseSession":
        return MeanPoseSession(self, calibration)


class MeanPoseSession:
    """Fits the root of the mean posture to each frame."""

    def __init__(self, fitted: FittedMeanPose, calibration: Calibration) -> None:
        self._residuals = Residuals(fitted.body, calibration, Loss())
        self._monitor = StatusMonitor()
        self._qpos = fitted.qpos

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_seen = self._monitor.update(frame)
        if any_seen:
            self._residuals.read(frame)
            self._qpos = place_root(self._residuals, self._qpos)
        return Estimate(self._qpos, status, Origin.MODEL if any_seen else Origin.BRIDGED)
