"""Predictors of a frame during a session, seen from the anchor frame, and the neighbour searches of `dynamic_map`.

Predictors are the readings and the last estimates. A search goes by the last estimates alone, or by the readings as
well. It returns the windows' rows, their squared distances, and the windows minus the query, on which the local model
regresses.
"""

from typing import Protocol

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.reconstruct.database.frames import Windows
from harness.reconstruct.features.reduced_rank_regression import ReducedRankRegression, ReducedRankSearch
from harness.reconstruct.index.protocol import Index, Neighbours
from harness.reconstruct.solver.ground_frame import AnchorFrame, twist_rad
from harness.reconstruct.solver.residuals import Residuals


class PredictorQuery:
    """Predictors for a `ReducedRankRegression`, and the readings that one session usually has.

    The view depends on them: without the anchor's orientation, its heading is estimated from the positions. The choice
    stays once there is a history.
    """

    def __init__(self, regression: ReducedRankRegression, residuals: Residuals) -> None:
        self._by_orientation, self._residuals = regression, residuals
        self.regression = regression
        """The regression whose heading is that of the usual readings."""
        self.usual: Bools = np.zeros(2 * regression.count, bool)
        """(2 S,) readings that the session has had. A station that appears later only takes part in the solver."""
        self._measured_before: Bools = np.zeros(2 * regression.count, bool)
        self._fixed = False

    def prepare(self, history: bool) -> bool:
        """Choose the regression for the readings that were measured so far; returns whether they have changed.

        With a `history` the choice is final.
        """
        if self._fixed:
            return False
        usual = self._measured_before | self._residuals.measured
        changed = not np.array_equal(usual, self.usual)
        if changed:
            self.usual, self.regression = usual, self._by_orientation.with_usual_heading(usual)
        self._fixed = history
        return changed

    def predictors(self, past: Floats) -> Floats:
        """(D + 9 S,) predictors of the last estimates (m, 55), newest first, and of the readings."""
        residuals, regression = self._residuals, self.regression
        view = self._anchor_frame(past[0])
        window = regression.windows.query(past)
        return regression.predictors(window, residuals.target_m, residuals.world_from_target, view)

    def readings_suffice(self) -> bool:
        """Whether the current readings alone show the place and the heading."""
        measured, count, heading = self._residuals.measured, self.regression.count, self.regression.heading
        places, anchor = measured[:count], self.regression.anchor
        if not self._fixed:
            heading = self._by_orientation.with_usual_heading(self._measured_before | measured).heading
        return bool(places[anchor] and measured[count + anchor] if heading is None else places[heading.stations].all())

    def record(self) -> None:
        """Note which readings the current frame had, after its estimate is made."""
        self._measured_before |= self._residuals.measured

    def _anchor_frame(self, last: Floats) -> AnchorFrame:
        """Anchor frame of the readings; the last estimate (55,) supplies what was not measured."""
        residuals, anchor, heading = self._residuals, self.regression.anchor, self.regression.heading
        count = len(residuals.bones)
        has_position, has_orientation = residuals.measured[:count], residuals.measured[count + anchor]
        at_m, turned = residuals.target_m, residuals.world_from_target[anchor]
        if not (has_position[anchor] and has_orientation if heading is None else has_position[heading.stations].all()):
            at_m, orientations = residuals.completed(last)
            turned = orientations[anchor]
        yaw = twist_rad(turned) if heading is None else heading.heading_rad(at_m)
        return AnchorFrame(float(at_m[anchor, 0]), float(at_m[anchor, 1]), float(yaw))


class NeighbourSearch(Protocol):
    """Neighbour search of one session."""

    def nearest(self, past: Floats, count: int, history: bool = True) -> Neighbours:
        """The `count` nearest windows for the last estimates (m, 55), newest first, and the current readings.

        `history` is whether these estimates are known.
        """
        ...

    def readings_suffice(self) -> bool:
        """Whether the current readings can be searched without estimates."""
        ...

    def record(self) -> None:
        """Note which readings the current frame had, after its estimate is made."""
        ...


class PoseHistorySearch:
    """Search by the last m estimates, D_w = 1 (Liu et al. 2011)."""

    def __init__(self, windows: Windows, index: Index) -> None:
        self._windows, self._index = windows, index.begin_search()

    def nearest(self, past: Floats, count: int, history: bool = True) -> Neighbours:
        query = self._windows.query(past)
        rows, squared = self._index.nearest(query, count)
        offsets = self._windows.gather(rows)
        offsets -= query
        return Neighbours(rows, squared, offsets)

    def readings_suffice(self) -> bool:
        return False

    def record(self) -> None:
        pass


class FeatureSearch:
    """Search by the features of a `ReducedRankRegression`, from the last estimates and the readings."""

    def __init__(self, regression: ReducedRankRegression, residuals: Residuals, index: str) -> None:
        self._query, self._residuals, self._index_name = PredictorQuery(regression, residuals), residuals, index
        self._search: tuple[ReducedRankSearch, Index]
        """The search for the usual readings, and this session's use of its index."""

    def nearest(self, past: Floats, count: int, history: bool = True) -> Neighbours:
        query = self._query
        if query.prepare(history):
            regression = query.regression
            search = regression.search(regression.columns(query.usual), self._index_name, count)
            self._search = search, search.index.begin_search()
        predictors = query.predictors(past)
        return self._search[0].nearest(predictors, self._residuals.measured, count, self._search[1], history)

    def readings_suffice(self) -> bool:
        return self._query.readings_suffice()

    def record(self) -> None:
        self._query.record()
