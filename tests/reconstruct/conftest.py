"""Scenes: synthetic motions and the frames of exact trackers."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from harness.body import Body, retarget_to_common_body, retarget_to_own_body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import BodyMotion
from harness.mocap import synthetic
from harness.reconstruct.contract import Method, Reconstructor
from harness.reconstruct.solver.normal_equations import normal_rows
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.stream import TrackerFrame, make_inputs
from harness.testing.frames import exact_calibration, exact_frames
from tests.joint_centres import joint_centres_m


@dataclass(frozen=True, eq=False)
class Scene:
    """A take on its performer's body, the calibration of six stations, their frames, and other takes as examples."""

    body: Body
    calibration: Calibration
    take: BodyMotion
    frames: list[TrackerFrame]
    examples: list[BodyMotion]
    """Other takes of the performer and one of another performer; the take itself is not among them."""
    fits: dict[tuple[str, int], Reconstructor] = field(default_factory=dict, repr=False)
    """What methods learnt from the scene's examples: sessions share it, and so do tests."""

    def fit(self, method: Method, examples: list[BodyMotion] | None = None) -> Reconstructor:
        """The method after learning from the scene's examples, or from others."""
        if examples is not None or not method.needs_examples:
            return method.fit(self.body, examples or [], np.random.default_rng(1))
        key = repr(method), id(self.examples)
        if key not in self.fits:
            self.fits[key] = method.fit(self.body, self.examples, np.random.default_rng(1))
        return self.fits[key]

    def run(
        self, method: Method, frames: list[TrackerFrame] | None = None, examples: list[BodyMotion] | None = None
    ) -> list[Estimate]:
        """Estimates of the scene's frames, or of others, after learning from the scene's examples, or from others."""
        session = self.fit(method, examples).begin(self.calibration)
        return [session.step(frame) for frame in (self.frames if frames is None else frames)]

    def only(self, inputs: str) -> list[TrackerFrame]:
        """The frames with these inputs only."""
        kept = make_inputs(inputs, self.calibration.stations)
        return [kept.mask(frame) for frame in self.frames]

    def off_m(self, estimates: list[Estimate], truth: Floats) -> Floats:
        """(T,) mean distance over the joint centres [m]."""
        found = joint_centres_m(self.body.skeleton, np.array([e.qpos for e in estimates]))
        off: Floats = np.linalg.norm(found - joint_centres_m(self.body.skeleton, truth), axis=2).mean(axis=1)
        return off

    def residuals(self, estimates: list[Estimate], frames: list[TrackerFrame]) -> tuple[Floats, Floats]:
        """(T, S) position [m] and orientation [rad] residuals, 0 where not measured."""
        judge, rows = Residuals(self.body, self.calibration, Loss()), []
        for frame, estimate in zip(frames, estimates, strict=True):
            judge.read(frame)
            judge.evaluate(estimate.qpos)
            rows.append(np.where(judge.measured, judge.distance, 0.0))
        position, orientation = np.split(np.array(rows), 2, axis=1)
        return position, orientation


def scene(behaviour: str, take: int = 1, seconds: float = 3.0) -> Scene:
    clip = synthetic.generate(behaviour, synthetic.performer_names()[0], take, seed=1, duration_s=seconds, rate_hz=40.0)
    body, on_body = retarget_to_own_body(clip)
    calibration = exact_calibration(body)
    names = synthetic.performer_names()
    others = [
        synthetic.generate(behaviour, names[performer], other, seed=1, duration_s=12.0, rate_hz=40.0)
        for performer, other in ((0, take + 1), (0, take + 2), (1, 1))
    ]
    examples = [retarget_to_common_body(clip, body.skeleton)[0] for clip in others]
    return Scene(body, calibration, on_body, exact_frames(body, calibration, on_body.qpos), examples)


def normal_equations_of(residuals: Residuals) -> tuple[Floats, Floats]:
    """The Gauss-Newton matrix (54, 54) and the descent (54,) at the configuration that was evaluated last."""
    tree, hessian = residuals.tree, np.zeros((54, 54))
    rows, descent = normal_rows_of(residuals)
    for i, row in enumerate(rows):
        ancestors = tree.ancestors[i, : tree.depth[i] + 1]
        hessian[i, ancestors] = row[: len(ancestors)]
    return hessian + np.tril(hessian, -1).T, descent


def normal_rows_of(residuals: Residuals) -> tuple[Floats, Floats]:
    """The same matrix as rows (54, D)."""
    rows, descent = np.empty(residuals.tree.ancestors.shape), np.empty(54)
    normal_rows(residuals.tree, residuals.state, rows, descent)
    return rows, descent


def moved(qpos: Floats, yaw_rad: float, by_m: tuple[float, float, float]) -> Floats:
    """A motion rotated about the vertical through the origin, then shifted."""
    turn, out = rotations.about_z(yaw_rad), np.array(qpos)
    out[:, :3] = rotations.rotate(turn, qpos[:, :3]) + np.array(by_m)
    out[:, 3:7] = rotations.multiply(turn, qpos[:, 3:7])
    return out


@pytest.fixture(scope="session")
def walk() -> Scene:
    return scene("walking")


@pytest.fixture(scope="session")
def boxing() -> Scene:
    return scene("boxing")
