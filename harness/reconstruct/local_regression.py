"""What the two methods of Kim et al. 2012 have in common: all but how neighbours become a pose (docs/methods.md B).

At every frame: the k examples in which the trackers read most like now (eq. 2), together with those of the frame
before; one weight for each of them, which is where the methods differ; the weighted pose; the blend of three frames
(eq. 6); and inverse kinematics onto the trackers.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import Take
from harness.errors import BadInput
from harness.reconstruct.coverage import Coverage
from harness.reconstruct.database import MotionDatabase
from harness.reconstruct.gate import Gate
from harness.reconstruct.hinges import HingeLimits
from harness.reconstruct.local_examples import LocalExamples, Weights
from harness.reconstruct.placing import nearest_placed
from harness.reconstruct.residuals import Loss, Residuals
from harness.reconstruct.smoothing import shares
from harness.reconstruct.solver import Prior, Solver, Stopping
from harness.reconstruct.viewpoint import View, on_trunk
from harness.stream.frame import TrackerFrame

_JUMP_M = 0.3
"""As for the best match: a learnt pose is never as near as a fitted one."""


@dataclass(frozen=True)
class LocalRegression:
    """Options that both methods share; each adds its own, and `weigh`."""

    name: str
    summary: str
    needs_examples: bool = True
    neighbours: int = 8
    """k of eq. 2, for this frame; those of the frame before are kept as well."""
    weights: Weights = field(default_factory=Weights)
    longest_gap_s: float = 0.2
    """A velocity is taken between readings no farther apart [s]."""
    alpha: float = 0.3
    beta: float = 0.4
    """Of eq. 6; beta = 0 blends nothing."""
    final_ik: bool = True
    root_sigma_m: float = 0.1
    root_sigma_rad: float = math.radians(10.0)
    hinge_sigma_rad: float = math.radians(15.0)
    """How far inverse kinematics lets the pose be from what was regressed [m, rad]."""
    most_steps: int = 4
    """Of inverse kinematics."""

    def fit(self, body: Body, examples: Sequence[Take], rng: np.random.Generator) -> "FittedLocal":
        """BadInput without examples."""
        if not any(len(take) for take in examples):
            raise BadInput("A local regression learns from examples, and there are none.", "Name some in the scenario.")
        return self.fit_database(body, MotionDatabase.build(body, examples), rng)

    def fit_database(self, body: Body, database: MotionDatabase, rng: np.random.Generator) -> "FittedLocal":
        """From a database that may lie on disk."""
        return FittedLocal(self, body, database)

    def weigh(self, inputs: Floats, query: Floats, outputs: Floats) -> Floats:
        """(m,) weights, of sum 1, of m >= 2 outputs (m, 55), for inputs (m, 7 S) and a query (7 S,)."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class FittedLocal:
    """The examples."""

    options: LocalRegression
    body: Body
    database: MotionDatabase

    def begin(self, calibration: Calibration) -> "LocalSession":
        return LocalSession(self, calibration)


class LocalSession:
    """Follows one performer."""

    def __init__(self, fitted: FittedLocal, calibration: Calibration) -> None:
        options = self._options = fitted.options
        self._residuals = Residuals(fitted.body, calibration, Loss())
        self._coverage, self._gate = Coverage(), Gate(len(calibration.stations), _JUMP_M)
        self._limits = HingeLimits(fitted.body)
        self._solver = Solver(self._residuals, self._limits, Stopping(most_steps=options.most_steps))
        self._precision = np.repeat(
            [options.root_sigma_m**-2, options.root_sigma_rad**-2, options.hinge_sigma_rad**-2], [3, 3, 48]
        )
        self._examples = LocalExamples(fitted.body, fitted.database, calibration, options.weights)
        self._on_trunk = on_trunk(calibration.bones[self._examples.anchor])
        self._answer = fitted.database.qpos(np.array([0]), np.zeros(3))[0]
        self._rows_before: list[int] = []
        self._poses_before: list[Floats] = []
        self._positions_before: tuple[Floats, Floats, Bools] | None = None

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_seen = self._coverage.seen(frame)
        if not any_seen:
            self._rows_before, self._poses_before = [], []
            return Estimate(self._answer, status)
        self._gate.read(frame, self._residuals)
        view, query, known = self._looked_at(frame)
        pose = self._regressed(query, known)
        pose = self._smoothed(pose)
        qpos = _stood(pose, view)
        if not self._residuals.measured[: self._examples.count].any():
            qpos[:2] = self._answer[:2]  # orientations alone do not say where: stay
        if self._options.final_ik:
            qpos[7:] = self._limits.clipped(qpos[7:])
            qpos = self._solver.solve(qpos, Prior(qpos, self._precision)).qpos
        else:
            qpos = nearest_placed(self._residuals, qpos)
        self._answer = qpos
        self._gate.answered(frame, self._residuals, qpos)
        return Estimate(qpos, status)

    def _looked_at(self, frame: TrackerFrame) -> tuple[View, Floats, Bools]:
        residuals, count, anchor = self._residuals, self._examples.count, self._examples.anchor
        velocity_m_s, moving = self._velocities(frame)
        position_m, turned = residuals.target_m, residuals.world_from_target
        if not residuals.measured.all():
            position_m, turned = self._filled()
        w, _, _, z = turned[anchor].tolist()
        x_m, y_m, _ = position_m[anchor].tolist()
        view = View(x_m, y_m, 2.0 * math.atan2(z, w))
        known = np.repeat(np.concatenate([residuals.measured, moving]), np.repeat([3, 4, 3], count))
        return view, self._examples.query(position_m, turned, velocity_m_s, view), known

    def _velocities(self, frame: TrackerFrame) -> tuple[Floats, Bools]:
        """(S, 3) since the last frame [m/s], and where it is known."""
        here = self._residuals.measured[: self._examples.count]
        now = self._residuals.target_m.copy(), frame.measured_s, here
        before, self._positions_before = self._positions_before, now
        if before is None:
            return np.zeros_like(now[0]), np.zeros_like(now[2])
        gap_s = now[1] - before[1]
        known = now[2] & before[2] & (gap_s > 0.0) & (gap_s <= self._options.longest_gap_s)
        gone_m = np.where(known[:, None], now[0] - before[0], 0.0)
        velocity_m_s: Floats = gone_m / np.where(known, gap_s, 1.0)[:, None]
        return velocity_m_s, known

    def _filled(self) -> tuple[Floats, Floats]:
        residuals, count = self._residuals, self._examples.count
        here, facing = residuals.measured[:count, None], residuals.measured[count:, None]
        residuals.kinematics.set(nearest_placed(residuals, self._answer))
        identity = np.tile(rotations.IDENTITY, (count, 1))
        at_m, turned = residuals.kinematics.station_poses(residuals.bones, residuals.mount_m, identity)
        return np.where(here, residuals.target_m, at_m), np.where(facing, residuals.world_from_target, turned)

    def _regressed(self, query: Floats, known: Bools) -> Floats:
        rows = self._examples.nearest(query, known, self._options.neighbours).tolist()
        training = list(dict.fromkeys([*rows, *self._rows_before]))
        self._rows_before = rows
        outputs = self._examples.poses(np.array(training))
        if len(training) == 1:
            return outputs.reshape(-1)
        used = known.copy()
        used[7 * self._examples.count :] = False
        inputs = self._examples.features[training][:, used].astype(float)
        weights = self._options.weigh(inputs, query[used], outputs)
        pose: Floats = np.matmul(weights, outputs)
        return pose

    def _smoothed(self, pose: Floats) -> Floats:
        if len(self._poses_before) == 2:
            now, last, earlier = shares(self._options.alpha, self._options.beta)
            pose = now * pose + last * self._poses_before[1] + earlier * self._poses_before[0]
        self._poses_before = [*self._poses_before[-1:], pose]
        return pose


def _stood(pose: Floats, view: View) -> Floats:
    """The configuration (55,) of what was learnt (55,)."""
    cosine, sine = math.cos(view.yaw_rad), math.sin(view.yaw_rad)
    height, roll, pitch, _ = pose[:4].tolist()
    forward, left, turn = pose[52:].tolist()
    half = 0.5 * (view.yaw_rad + turn)
    c, s = math.cos(half), math.sin(half)
    lean = math.hypot(roll, pitch)
    w = math.cos(0.5 * lean)
    by = math.sin(0.5 * lean) / lean if lean > 0.0 else 0.5
    x, y = by * roll, by * pitch
    out = np.empty(55)
    out[:7] = (
        view.x_m + cosine * forward - sine * left,
        view.y_m + sine * forward + cosine * left,
        height,
        c * w,
        c * x - s * y,
        c * y + s * x,
        s * w,
    )
    out[7:] = pose[4:52]
    return out
