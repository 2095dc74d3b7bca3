"""A method that uses one station and no other: what is needed and what is useless is known beforehand."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.body import Body, tpose
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Status
from harness.core.motion import BodyMotion
from harness.stream import TrackerFrame

NEEDED = "pelvis"


@dataclass(frozen=True)
class OneStation:
    """The T-pose, turned as the pelvis is; without a tracker there, always turned alike."""

    name: str = "one_station"
    summary: str = "reads the pelvis alone"
    needs_examples: bool = False

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "Fitted":
        return Fitted(tpose(body.skeleton))


@dataclass(frozen=True)
class NoStation(OneStation):
    """The T-pose, whatever is worn."""

    name: str = "no_station"
    summary: str = "reads nothing"

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "Fitted":
        return Fitted(tpose(body.skeleton), "")


@dataclass(frozen=True)
class Bent(OneStation):
    """The T-pose as `OneStation` turns it; without a tracker on the pelvis every hinge is bent by half a radian."""

    name: str = "bent"
    summary: str = "bends without the pelvis"

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "Fitted":
        return Fitted(tpose(body.skeleton), bend_rad=0.5)


@dataclass(frozen=True, eq=False)
class Fitted:
    qpos: Floats
    needed: str = NEEDED
    bend_rad: float = 0.0
    """Rotation of every hinge where the needed station is not worn [rad]."""

    def begin(self, calibration: Calibration) -> "Session":
        bent = np.array(self.qpos)
        bent[7:] += 0.0 if self.needed in calibration.stations else self.bend_rad
        return Session(bent, calibration, self.needed)


class Session:
    def __init__(self, qpos: Floats, calibration: Calibration, needed: str) -> None:
        self.qpos, self.calibration, self.needed = np.array(qpos), calibration, needed

    def step(self, frame: TrackerFrame) -> Estimate:
        known = self.calibration
        if self.needed in known.stations:
            row = known.stations.index(self.needed)
            turn = rotations.multiply(known.world_from_tracker, frame.tracker_from_station[row])
            self.qpos[3:7] = rotations.multiply(turn, rotations.inverse(known.bone_from_station[row]))
        return Estimate(self.qpos, Status.SOLVED)
