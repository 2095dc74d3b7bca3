"""How a session looks at a frame: from where, at which features, and how far it trusts each of them.

The anchor's own orientation gives the heading. Where that was not measured, the last answer is stood where the
readings are and lends whatever is missing; the missing columns only help to propose neighbours (`index.masked`).
"""

import math

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.reconstruct.features.anchor_frame import AnchorFrame
from harness.reconstruct.features.example_features import ExampleFeatures
from harness.reconstruct.solver.residuals import Residuals
from harness.reconstruct.solver.root_placement import place_root
from harness.stream.frame import TrackerFrame


class QueryFeatures:
    """On one performer through one session."""

    def __init__(
        self, residuals: Residuals, worn: Calibration, examples: ExampleFeatures, longest_gap_s: float
    ) -> None:
        count = len(worn.stations)
        self._residuals, self._examples, self._longest_gap_s = residuals, examples, longest_gap_s
        self._no_turn = np.tile(rotations.IDENTITY, (count, 1))
        self._before_m, self._before_s = np.zeros((count, 3)), np.full(count, np.nan)
        self._before_valid: Bools = np.zeros(count, bool)

    def compute(self, frame: TrackerFrame, answer: Floats) -> tuple[AnchorFrame, Floats, Floats]:
        """The view, the features (10 S,) and their trust (10 S,), 0 where not measured to 1.

        `answer` (55,) is the last one.
        """
        residuals, examples = self._residuals, self._examples
        velocity_m_s, moving = np.empty_like(self._before_m), np.empty_like(self._before_valid)
        whole = _estimate_velocities(
            *(residuals.target_m, frame.measured_s, residuals.measured),
            *(self._before_m, self._before_s, self._before_valid),
            *(self._longest_gap_s, velocity_m_s, moving),
        )
        position_m, turned = residuals.target_m, residuals.world_from_target
        facing = turned[examples.anchor]
        if not whole:
            position_m, turned, facing = self._filled(answer)
        w, _, _, z = facing.tolist()
        x_m, y_m, _ = position_m[examples.anchor].tolist()
        view = AnchorFrame(x_m, y_m, 2.0 * math.atan2(z, w))
        query, trust = _compute_features(
            *(position_m, turned, velocity_m_s, x_m, y_m, view.yaw_rad, examples.hemisphere, examples.scale),
            *(residuals.confidence, moving),
        )
        return view, query, trust

    def _filled(self, answer: Floats) -> tuple[Floats, Floats, Floats]:
        """Positions (S, 3), orientations (S, 4), and the anchor's (4,), from the last answer where nothing was read."""
        residuals, count = self._residuals, self._examples.count
        here, facing = residuals.measured[:count, None], residuals.measured[count:, None]
        residuals.kinematics.set(place_root(residuals, answer))
        at_m, turned = residuals.kinematics.station_poses(residuals.bones, residuals.mount_m, self._no_turn)
        turned = np.where(facing, residuals.world_from_target, turned)
        return np.where(here, residuals.target_m, at_m), turned, turned[self._examples.anchor]


@compiled
def _estimate_velocities(
    target_m: Floats,
    measured_s: Floats,
    measured: Bools,
    before_m: Floats,
    before_s: Floats,
    before_valid: Bools,
    longest_gap_s: float,
    velocity_m_s: Floats,
    known: Bools,
) -> bool:
    """Velocities (S, 3) since the frame before [m/s], 0 where not known; where they are (S,); whether all was measured.

    This frame then takes the place of the one before.
    """
    for s in range(len(target_m)):
        gap_s = measured_s[s] - before_s[s]
        known[s] = measured[s] and before_valid[s] and 0.0 < gap_s <= longest_gap_s
        for i in range(3):
            velocity_m_s[s, i] = (target_m[s, i] - before_m[s, i]) / gap_s if known[s] else 0.0
            before_m[s, i] = target_m[s, i]
        before_s[s], before_valid[s] = measured_s[s], measured[s]
    return bool(measured.all())


@compiled
def _compute_features(
    position_m: Floats,
    turned: Floats,
    velocity_m_s: Floats,
    x_m: float,
    y_m: float,
    yaw_rad: float,
    hemisphere: Floats,
    scale: Floats,
    trusted: Floats,
    moving: Bools,
) -> tuple[Floats, Floats]:
    """The features (10 S,) of positions (S, 3), bone orientations (S, 4) and velocities (S, 3), and their trust.

    Readings (2S,) are trusted as said, velocities only where something is moving (S,).
    """
    count = len(position_m)
    out, trust = np.empty(10 * count), np.empty(10 * count)
    cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
    c, s = np.cos(0.5 * yaw_rad), np.sin(0.5 * yaw_rad)
    for k in range(count):
        at, turn, gone = 3 * k, 3 * count + 4 * k, 7 * count + 3 * k
        x, y = position_m[k, 0] - x_m, position_m[k, 1] - y_m
        out[at], out[at + 1], out[at + 2] = cosine * x + sine * y, cosine * y - sine * x, position_m[k, 2]
        x, y = velocity_m_s[k, 0], velocity_m_s[k, 1]
        out[gone], out[gone + 1], out[gone + 2] = cosine * x + sine * y, cosine * y - sine * x, velocity_m_s[k, 2]
        q, like = turned[k], 0.0
        out[turn], out[turn + 1] = c * q[0] + s * q[3], c * q[1] + s * q[2]  # about_z(-yaw) q
        out[turn + 2], out[turn + 3] = c * q[2] - s * q[1], c * q[3] - s * q[0]
        for i in range(4):
            like += out[turn + i] * hemisphere[k, i]
        for i in range(4):
            out[turn + i] *= np.copysign(1.0, like)
        trust[at : at + 3], trust[turn : turn + 4] = trusted[k], trusted[count + k]
        trust[gone : gone + 3] = trusted[k] * moving[k]
    return out * scale, trust
