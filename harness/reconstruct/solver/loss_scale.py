"""The Lorentzian's scale for positions, estimated on line from the residuals.

A position that is off by 5 to 30 mm for seconds (`simulate.components.excursion`) has the square's full weight under a
scale of 30 mm, and little under one of a few millimetres. Performers unlike the examples, however, have residuals
of that size without any error of the readings. The scale is therefore a multiple of the residuals that a session
usually has: of the running mean of each frame's median distance. The median ignores up to two stations of six that are
off. Huber 1981 (ch. 5 and 7) scales a robust loss by a robust estimate of the residuals' size in the same way.
"""

import numpy as np

from harness.core.compiled import compiled
from harness.reconstruct.solver.kinematic_tree import KinematicState
from harness.reconstruct.solver.normal_equations import StationTargets

_MULTIPLE = 6.0
"""The scale over the usual median distance."""
_MIN_SCALE_M = 0.005
"""Lower limit of the scale [m]; the loss gives the upper one."""
_MEAN_S = 0.5
"""Time constant of the running mean [s]."""


class LossScale:
    """The scale of one session. It starts at its upper limit."""

    def __init__(self, position_scale_m: float, rate_hz: float) -> None:
        """`position_scale_m` is the loss's scale, the upper limit [m]; `rate_hz` is that of the frames."""
        self._max_m, self._usual_m = position_scale_m, position_scale_m / _MULTIPLE
        self._weight = min(1.0, 1.0 / (_MEAN_S * rate_hz))

    @property
    def position_m(self) -> float:
        """The Lorentzian's scale for positions [m]."""
        return min(max(_MULTIPLE * self._usual_m, _MIN_SCALE_M), self._max_m)

    def update(self, targets: StationTargets, state: KinematicState) -> None:
        """Take the residuals of one frame's answer; nothing changes when no position was measured."""
        distance_m = median_distance(targets, state)
        if distance_m >= 0.0:
            self._usual_m += self._weight * (min(distance_m, self._max_m) - self._usual_m)


@compiled
def median_distance(targets: StationTargets, state: KinematicState) -> float:
    """Median distance of the measured positions from the modelled ones [m]; -1 when none was measured."""
    squared, measured = np.empty(len(targets.target_m)), 0
    for s in range(len(squared)):
        if targets.precision[s] > 0.0:
            squared[measured] = state.squared[s]
            measured += 1
    if measured == 0:
        return -1.0
    ordered = np.sort(squared[:measured])
    return float(0.5 * (np.sqrt(ordered[(measured - 1) // 2]) + np.sqrt(ordered[measured // 2])))
