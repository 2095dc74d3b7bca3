"""Which frames of the database are like this one: by the last answers alone, or by the readings as well.

Both answer a `DynamicMapSession`: which windows, how far (squared), and the windows minus the query, from which the
local model regresses.
"""

from typing import Protocol

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.reconstruct.database import Windows
from harness.reconstruct.features.anchor_frame import AnchorFrame, twist_rad
from harness.reconstruct.features.reduced_rank_regression import ReducedRankRegression, ReducedRankSearch
from harness.reconstruct.index import Index, Neighbours
from harness.reconstruct.solver.residuals import Residuals


class NeighbourSearch(Protocol):
    """A session's search."""

    def nearest(self, past: Floats, count: int) -> Neighbours:
        """For the last answers (m, 55), newest first, and the readings at hand."""
        ...

    def record(self) -> None:
        """A frame was answered; its readings are still at hand."""
        ...


class PoseHistorySearch:
    """Liu et al. 2011: the windows nearest to the last m answers, D_w = 1."""

    def __init__(self, windows: Windows, index: Index) -> None:
        self._windows, self._index = windows, index

    def nearest(self, past: Floats, count: int) -> Neighbours:
        query = self._windows.query(past)
        rows, squared = self._index.nearest(query, count)
        away = self._windows.gather(rows)
        away -= query
        return Neighbours(rows, squared, away)

    def record(self) -> None:
        pass


class FeatureSearch:
    """The windows and readings that lead to expect a posture like this one (`expectation`)."""

    def __init__(self, windows: Windows, evidence: ReducedRankRegression, residuals: Residuals, index: str) -> None:
        self._windows, self._evidence, self._residuals, self._kind = windows, evidence, residuals, index
        self._ever: Bools = np.zeros(2 * evidence.count, bool)
        """Rows of readings that this session has had; a station that comes later only takes part in the solving."""
        self._expectation: ReducedRankSearch | None = None
        self._no_turn = np.tile(rotations.IDENTITY, (evidence.count, 1))

    def nearest(self, past: Floats, count: int) -> Neighbours:
        residuals = self._residuals
        if self._expectation is None:
            usual = self._ever | residuals.measured
            self._evidence = self._evidence.with_usual_heading(usual)
            self._expectation = self._evidence.search(self._evidence.columns(usual), self._kind, count)
        window = self._windows.query(past)
        known = self._evidence.predictors(window, residuals.target_m, residuals.world_from_target, self._view(past[0]))
        return self._expectation.nearest(known, residuals.measured, count)

    def record(self) -> None:
        self._ever |= self._residuals.measured

    def _view(self, last: Floats) -> AnchorFrame:
        """From above the anchor, along its heading or the positions'; the last answer (55,) lends what was not read."""
        residuals, anchor, bearing = self._residuals, self._evidence.anchor, self._evidence.bearing
        here, facing = residuals.measured[: len(residuals.bones)], residuals.measured[len(residuals.bones) + anchor]
        at_m, turned = residuals.target_m, residuals.world_from_target[anchor]
        if not (here[anchor] and facing if bearing is None else here[bearing.stations].all()):
            residuals.kinematics.set(last)
            lent_m, lent = residuals.kinematics.station_poses(residuals.bones, residuals.mount_m, self._no_turn)
            at_m, turned = np.where(here[:, None], at_m, lent_m), (turned if facing else lent[anchor])
        yaw = twist_rad(turned) if bearing is None else bearing.heading_rad(at_m)
        return AnchorFrame(float(at_m[anchor, 0]), float(at_m[anchor, 1]), float(yaw))
