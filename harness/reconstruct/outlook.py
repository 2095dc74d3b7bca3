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
from harness.reconstruct.local_examples import LocalExamples
from harness.reconstruct.placing import nearest_placed
from harness.reconstruct.residuals import Residuals
from harness.reconstruct.viewpoint import View, on_trunk
from harness.stream.frame import TrackerFrame


class Outlook:
    """On one performer through one session."""

    def __init__(self, residuals: Residuals, worn: Calibration, examples: LocalExamples, longest_gap_s: float) -> None:
        count = len(worn.stations)
        self._residuals, self._examples, self._longest_gap_s = residuals, examples, longest_gap_s
        self._on_trunk = on_trunk(worn.bones[examples.anchor])
        self._no_turn = np.tile(rotations.IDENTITY, (count, 1))
        self._ones, self._trust = np.ones(10 * count), np.ones(10 * count)
        self._before_m, self._before_s = np.zeros((count, 3)), np.full(count, np.nan)
        self._before_valid: Bools = np.zeros(count, bool)

    def seen(self, frame: TrackerFrame, answer: Floats) -> tuple[View, Floats, Floats]:
        """The view, the features (10 S,) and their trust (10 S,), 0 where not measured to 1.

        `answer` (55,) is the last one.
        """
        residuals, anchor, count = self._residuals, self._examples.anchor, self._examples.count
        before = self._before_m, self._before_s, self._before_valid
        velocity_m_s, moving = _velocities(
            residuals.target_m, frame.measured_s, residuals.measured, *before, self._longest_gap_s
        )
        position_m, turned = residuals.target_m, residuals.world_from_target
        whole = bool(residuals.measured.all())
        facing = turned[anchor]
        if not whole:
            position_m, turned, facing = self._filled(answer)
        w, _, _, z = facing.tolist()
        x_m, y_m, _ = position_m[anchor].tolist()
        view = View(x_m, y_m, 2.0 * math.atan2(z, w))
        trust = self._ones
        if not (whole and moving.all() and residuals.trust.min() == 1.0):
            trust = self._trust
            positions, orientations = residuals.trust[:count], residuals.trust[count:]
            trust[: 3 * count] = np.repeat(positions, 3)
            trust[3 * count : 7 * count] = np.repeat(orientations, 4)
            trust[7 * count :] = np.repeat(positions * moving, 3)
        return view, self._examples.query(position_m, turned, velocity_m_s, view), trust

    def _filled(self, answer: Floats) -> tuple[Floats, Floats, Floats]:
        """Positions (S, 3), orientations (S, 4), and the anchor's (4,), from the last answer where nothing was read."""
        residuals, count = self._residuals, self._examples.count
        here, facing = residuals.measured[:count, None], residuals.measured[count:, None]
        residuals.kinematics.set(nearest_placed(residuals, answer))
        at_m, turned = residuals.kinematics.station_poses(residuals.bones, residuals.mount_m, self._no_turn)
        turned = np.where(facing, residuals.world_from_target, turned)
        return np.where(here, residuals.target_m, at_m), turned, turned[self._examples.anchor]


@compiled
def _velocities(
    target_m: Floats,
    measured_s: Floats,
    measured: Bools,
    before_m: Floats,
    before_s: Floats,
    before_valid: Bools,
    longest_gap_s: float,
) -> tuple[Floats, Bools]:
    """(S, 3) since the frame before [m/s], 0 where it is not known, and where it is (S,).

    This frame then takes the place of the one before.
    """
    velocity_m_s, known = np.zeros_like(target_m), np.zeros(len(target_m), np.bool_)
    for s in range(len(target_m)):
        gap_s = measured_s[s] - before_s[s]
        known[s] = measured[s] and before_valid[s] and 0.0 < gap_s <= longest_gap_s
        for i in range(3):
            if known[s]:
                velocity_m_s[s, i] = (target_m[s, i] - before_m[s, i]) / gap_s
            before_m[s, i] = target_m[s, i]
        before_s[s], before_valid[s] = measured_s[s], measured[s]
    return velocity_m_s, known
