"""Mean pose (`mean_pose`): the examples' mean posture, placed where the trackers are.

A baseline: what any method that learns from examples has to beat. Hinge angles are the circular mean over all examples
and never change; in each frame only the root is fitted to the trackers (`root_placement`).

Source: ours. It has no options.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from harness.body.humanoid import Body, tpose
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.reconstruct.database import MotionDatabase
from harness.reconstruct.solver.ground_frame import HINGES
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.root_placement import place_root
from harness.reconstruct.solver.status_monitor import StatusMonitor
from harness.stream.frame import TrackerFrame


def mean_posture(body: Body, examples: Sequence[BodyMotion] | MotionDatabase) -> Floats:
    """(55,) circular mean of the examples' hinge angles [rad], with the root of the T-pose; BadInput without examples.

    Angles are averaged as directions, in principal form and within the limits.
    """
    limits, total, count = HingeLimits(body), np.zeros((2, 48)), 0
    for angles in _principal_angles(limits, examples):
        total += [np.sum(np.sin(angles), axis=0), np.sum(np.cos(angles), axis=0)]
        count += len(angles)
    if not count:
        raise BadInput("The mean posture is learnt from examples, and there are none.", "Name some in the scenario.")
    out = np.array(tpose(body.skeleton))
    out[7:] = limits.clip(limits.principal(np.arctan2(*total)))
    return out


def spread_rad(body: Body, examples: Sequence[BodyMotion] | MotionDatabase, centre: Floats) -> Floats:
    """(48,) RMS deviation of the examples' hinge angles from those of a configuration (55,) [rad]."""
    limits, total, count = HingeLimits(body), np.zeros(48), 0
    for angles in _principal_angles(limits, examples):
        away = np.remainder(angles - centre[7:] + np.pi, 2.0 * np.pi) - np.pi
        total += np.sum(away**2, axis=0)
        count += len(angles)
    return np.sqrt(total / count)


def _principal_angles(limits: HingeLimits, examples: Sequence[BodyMotion] | MotionDatabase) -> Iterator[Floats]:
    """Principal hinge angles (T, 48) [rad], take by take, since a database may be larger than memory."""
    if isinstance(examples, MotionDatabase):
        for run in examples.segments:
            yield limits.principal(examples.posture[run.start : run.stop, HINGES].astype(float))
        examples.release_memory()
    else:
        for take in examples:
            yield limits.principal(take.qpos[:, 7:])


@dataclass(frozen=True)
class MeanPose:
    """The mean pose, a `Method`; it has no options."""

    name: str = "mean_pose"
    summary: str = "the examples' mean posture, stood where the trackers are: the null that learns"
    needs_examples: bool = True

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
        return Estimate(self._qpos, status)
