"""Neighbour searches of `dynamic_map`: by the last estimates alone, or by the readings as well.

Both return the windows' rows, their squared distances, and the windows minus the query, on which the local model
regresses.
"""

from typing import Protocol

from harness.core.arrays import Floats
from harness.reconstruct.database import Windows
from harness.reconstruct.features.predictor_query import PredictorQuery
from harness.reconstruct.features.reduced_rank_regression import ReducedRankRegression, ReducedRankSearch
from harness.reconstruct.index import Index, Neighbours
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
