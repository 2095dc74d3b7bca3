"""Neighbour searches of `dynamic_map`: by the last estimates alone, or by the readings as well.

Both return the windows' rows, their squared distances, and the windows minus the query, on which the local model
regresses.
"""

from typing import Protocol

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.reconstruct.database import Windows
from harness.reconstruct.features.reduced_rank_regression import ReducedRankRegression, ReducedRankSearch
from harness.reconstruct.index import Index, Neighbours
from harness.reconstruct.solver.anchor_frame import AnchorFrame, twist_rad
from harness.reconstruct.solver.residuals import Residuals


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

    def __init__(self, windows: Windows, regression: ReducedRankRegression, residuals: Residuals, index: str) -> None:
        self._windows, self._regression, self._residuals, self._index_name = windows, regression, residuals, index
        self._measured_before: Bools = np.zeros(2 * regression.count, bool)
        """(2 S,) readings that this session has had. A station that appears later only takes part in the solver."""
        self._search: tuple[ReducedRankSearch, Index]
        """The search, and this session's use of its index."""
        self._usual: Bools = np.zeros(2 * regression.count, bool)
        """(2 S,) readings for which `_search` was made."""
        self._fixed = False
        """Whether `_search` stays, as it does once there is a history."""
        self._by_orientation = regression
        """The regression whose heading is that of the anchor's orientation."""
        self._identity = np.tile(rotations.IDENTITY, (regression.count, 1))

    def nearest(self, past: Floats, count: int, history: bool = True) -> Neighbours:
        residuals = self._residuals
        if not self._fixed:
            self._prepare(count)
            self._fixed = history
        window = self._windows.query(past)
        predictors = self._regression.predictors(
            window, residuals.target_m, residuals.world_from_target, self._anchor_frame(past[0])
        )
        return self._search[0].nearest(predictors, residuals.measured, count, self._search[1], history)

    def _prepare(self, count: int) -> None:
        """Make the search for the readings that this session has had so far, unless it is there."""
        usual = self._measured_before | self._residuals.measured
        if not np.array_equal(usual, self._usual):
            self._usual, self._regression = usual, self._by_orientation.with_usual_heading(usual)
            search = self._regression.search(self._regression.columns(usual), self._index_name, count)
            self._search = search, search.index.begin_search()

    def readings_suffice(self) -> bool:
        measured, count, heading = self._residuals.measured, self._regression.count, self._regression.heading
        places, anchor = measured[:count], self._regression.anchor
        if not self._fixed:
            heading = self._by_orientation.with_usual_heading(self._measured_before | measured).heading
        return bool(places[anchor] and measured[count + anchor] if heading is None else places[heading.stations].all())

    def record(self) -> None:
        self._measured_before |= self._residuals.measured

    def _anchor_frame(self, last: Floats) -> AnchorFrame:
        """Anchor frame of the readings; the last estimate (55,) supplies what was not measured."""
        residuals, anchor, heading = self._residuals, self._regression.anchor, self._regression.heading
        has_position, has_orientation = (
            residuals.measured[: len(residuals.bones)],
            residuals.measured[len(residuals.bones) + anchor],
        )
        at_m, turned = residuals.target_m, residuals.world_from_target[anchor]
        if not (has_position[anchor] and has_orientation if heading is None else has_position[heading.stations].all()):
            residuals.kinematics.set(last)
            last_m, last_orientation = residuals.kinematics.station_poses(
                residuals.bones, residuals.mount_m, self._identity
            )
            at_m, turned = (
                np.where(has_position[:, None], at_m, last_m),
                (turned if has_orientation else last_orientation[anchor]),
            )
        yaw = twist_rad(turned) if heading is None else heading.heading_rad(at_m)
        return AnchorFrame(float(at_m[anchor, 0]), float(at_m[anchor, 1]), float(yaw))
