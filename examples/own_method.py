"""A method of one's own, with a regression gate: python examples/own_method.py [FOLDER]

The method keeps the T-pose and places it under the first station that reports a position. A method may use any library:
the harness calls `fit`, `begin` and `step`.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.body import Body, tpose
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Status
from harness.core.motion import BodyMotion
from harness.core.rotations import rotate
from harness.stream import TrackerFrame
from harness.testing.regression_gate import RegressionGate


@dataclass(frozen=True)
class TPose:
    """A `Method`: a configured algorithm. Its fields are its options: `own_method:TPose[height_m=1.0]`."""

    name: str = "t_pose"
    summary: str = "the T-pose, under the first station that reports a position"
    needs_examples: bool = False
    height_m: float = 0.9

    def fit(self, body: Body, examples: list[BodyMotion], rng: np.random.Generator) -> "TrainedTPose":
        """Learn from the examples; this method needs none."""
        return TrainedTPose(body, self.height_m)


@dataclass(frozen=True, eq=False)
class TrainedTPose:
    """A `Reconstructor`: trained, and shared between sessions."""

    body: Body
    height_m: float

    def begin(self, calibration: Calibration) -> "TPoseSession":
        """Start a take with a calibrated performer."""
        return TPoseSession(tpose(self.body.skeleton), self.height_m, calibration)


class TPoseSession:
    """A `Session`: one performer, one take, frame by frame."""

    def __init__(self, qpos: Floats, height_m: float, calibration: Calibration) -> None:
        self.qpos, self.calibration = qpos.copy(), calibration
        self.qpos[2] = height_m

    def step(self, frame: TrackerFrame) -> Estimate:
        """One frame in, one pose out."""
        if not frame.position_valid.any():
            return Estimate(self.qpos, Status.HELD)
        position_m = frame.position_m[frame.position_valid][0]
        in_world_m = rotate(self.calibration.world_from_tracker, position_m) + self.calibration.tracker_origin_m
        self.qpos[:2] = in_world_m[:2]
        return Estimate(self.qpos, Status.SOLVED)


def main(out: Path) -> bool:
    gate = RegressionGate(out / "runs", baselines=out / "baselines")
    if not (out / "baselines" / "t_pose").is_dir():
        scenario = str(Path(__file__).with_name("six_walks.toml"))
        print("baseline:", gate.save_baseline("own_method:TPose", "t_pose", scenario=scenario))
    result = gate.check("own_method:TPose", "t_pose")  # in a test: the fixture `harness_gate` does the same
    print(result)
    return result.passed


if __name__ == "__main__":
    sys.exit(not main(Path(sys.argv[1] if len(sys.argv) > 1 else "results/own_method")))
