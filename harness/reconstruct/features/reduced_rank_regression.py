"""What posture to expect: one linear map of everything that is known, and in its terms a search and a local model.

Known at a frame are the window of the last m answers (Liu et al. 2011, eq. 6 and 8) and the readings of the trackers
(docs/methods.md G3). A ridge regression over the whole database turns both into the posture that goes with them; its
leading directions are the coordinates z in which neighbours are sought and from which local models regress. So eq. 6's
D_w is learnt rather than the identity: what says nothing about the posture does not count, and 40 numbers do.

Readings are seen from above the station on the trunk, along its heading or, where its orientation is not measured,
along one that the positions themselves define: a heading lent by the last answer feeds its error back. What was not
read is replaced by what the rest of the evidence leads to expect of it, which for a linear map is the same as learning
it without.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints, Singles
from harness.core.calibration import Calibration
from harness.reconstruct.database import Windows
from harness.reconstruct.features.anchor_frame import AnchorFrame, HeadingEstimator, anchor_of, twist_rad
from harness.reconstruct.features.ground_step import features_from_readings
from harness.reconstruct.features.virtual_trackers import VirtualTrackers
from harness.reconstruct.index import Index, Neighbours, make_index
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE

_CHUNK = 256
"""Windows worked on at a time."""
_ORIGIN: Floats = np.zeros(3)
"""A ground frame to stand on."""
_CACHED_MAPS = 64
"""Combinations of silent stations whose maps are kept."""
_TRAINING_WINDOWS = 20_000
"""Windows, evenly spread, that the map is learnt from."""
_MIN_HEADING_EXPLAINED = 0.8
"""Share of the heading that positions must tell to be asked for it: six stations told 0.94 or more, two below 0.78."""


@dataclass(frozen=True)
class ReducedRankOptions:
    """In which terms postures are expected."""

    window_weight: float = 0.3
    """What a window's numbers are multiplied by, beside readings in metres."""
    lever_m: float = 0.3
    """A turn by one radian counts like so many metres."""
    directions: int = 40
    """Coordinates that are kept."""
    ridge: float = 1e-5
    """Of the map, as a share of the evidence's variance."""


class ReducedRankRegression:
    """What is known before each frame of a database, for stations worn as a calibration says.

    A row is the window before the frame (D), then each station's place (3) and two axes of its bone (6).
    """

    def __init__(
        self,
        body: Body,
        windows: Windows,
        worn: Calibration,
        terms: ReducedRankOptions,
        bearing: HeadingEstimator | None = None,
    ) -> None:
        """Seen along a `bearing`; None for along the anchor's own heading."""
        self.terms, self.count, self.anchor, self.bearing = terms, len(worn.stations), anchor_of(worn.bones), bearing
        self.windows, self._trackers = windows, VirtualTrackers(body, worn)
        self.size = windows.size + 9 * self.count
        self._body, self._worn, self._by_positions = body, worn, dict[bytes, ReducedRankRegression]()
        self._expectations: dict[bytes, ReducedRankSearch] = {}
        rows = self._learnt_from()
        self.mean, self._mean_after = np.zeros(self.size), np.zeros(POSTURE_SIZE)
        for known, after in self.training_data(windows, rows):
            self.mean += known.sum(axis=0) / len(rows)
            self._mean_after += after.sum(axis=0) / len(rows)
        self.scatter: Floats = np.zeros((self.size, self.size))
        """(D + 9 S, D + 9 S) covariance of the evidence."""
        self._shared = np.zeros((self.size, POSTURE_SIZE))
        for known, after in self.training_data(windows, rows):
            away = known - self.mean
            self.scatter += away.T @ away / len(rows)
            self._shared += away.T @ (after - self._mean_after) / len(rows)
        windows.database.release_memory()
        self.least = terms.ridge * float(np.trace(self.scatter)) + 1e-12

    def _learnt_from(self) -> Ints:
        every = np.arange(len(self.windows))
        return (
            every
            if len(every) <= _TRAINING_WINDOWS
            else np.linspace(0, len(every) - 1, _TRAINING_WINDOWS).astype(np.int64)
        )

    def with_usual_heading(self, usual: Bools) -> "ReducedRankRegression":
        """The same seen as a session sees it that has the `usual` readings (2 S,) of positions, then orientations."""
        places = usual[: self.count]
        if usual[self.count + self.anchor] or not places[self.anchor]:
            return self
        key = places.tobytes()
        if key not in self._by_positions:
            at_m = [at_m for _, at_m, _ in self._station_poses(self.windows, self._learnt_from())]
            bearing = HeadingEstimator.fit(np.concatenate(at_m), self.anchor, places)
            told = bearing.explained > _MIN_HEADING_EXPLAINED
            seen = ReducedRankRegression(self._body, self.windows, self._worn, self.terms, bearing) if told else self
            self._by_positions[key] = seen
        return self._by_positions[key]

    def search(self, usual: Bools, index: str, wanted: int) -> "ReducedRankSearch":
        """The search for sessions that know the `usual` columns; made once."""
        key = usual.tobytes()
        if key not in self._expectations:
            self._expectations[key] = ReducedRankSearch(self, usual, index, wanted)
        return self._expectations[key]

    def training_data(self, windows: Windows, rows: Ints) -> Iterator[tuple[Floats, Floats]]:
        """The evidence (K, D + 9 S) of some windows and the postures (K, 52) that came of it, chunk by chunk."""
        for some, at_m, turned in self._station_poses(windows, rows):
            after = windows.successors(some)[:, :POSTURE_SIZE].astype(float)
            facing = twist_rad(turned[:, self.anchor]) if self.bearing is None else self.bearing.heading_rad(at_m)
            level = rotations.about_z(-facing)[:, None]
            place = rotations.rotate(level, at_m - at_m[:, self.anchor, None] * [1.0, 1.0, 0.0])
            axes = self.terms.lever_m * rotations.to_matrix(rotations.multiply(level, turned))[..., :2]
            window = self.terms.window_weight * windows.gather(some)
            read = np.concatenate([place, axes.reshape(*place.shape[:2], 6)], axis=2)
            yield np.concatenate([window, read.reshape(len(some), -1)], axis=1), after

    def _station_poses(self, windows: Windows, rows: Ints) -> Iterator[tuple[Ints, Floats, Floats]]:
        """Rows (K,), station positions (K, S, 3) and orientations (K, S, 4), roots heading along x, chunk by chunk."""
        for start in range(0, len(rows), _CHUNK):
            some = rows[start : start + _CHUNK]
            yield some, *self._trackers.station_poses(windows.database.qpos(windows.frames[some] + 1, _ORIGIN))

    def predictors(self, window: Singles, position_m: Floats, turned: Floats, view: AnchorFrame) -> Floats:
        """The row (D + 9 S,) of a window's vector (D,) and readings (S, 3), (S, 4) in the world."""
        read = features_from_readings(position_m, turned, np.array(view), self.terms.lever_m)
        return np.concatenate([self.terms.window_weight * window, read])

    def columns(self, measured: Bools) -> Bools:
        """(D + 9 S,) which columns are known when these rows (2 S,) of positions, then orientations, are."""
        window = np.ones(self.windows.size, bool)
        places, turns = measured[: self.count], measured[self.count :]
        return np.concatenate([window, np.repeat(np.stack([places, turns], axis=1), [3, 6], axis=1).reshape(-1)])

    def directions(self, columns: Bools) -> Floats:
        """(C, 40) from the known columns C to the leading directions of the posture that they lead to expect."""
        scatter = self.scatter[np.ix_(columns, columns)]
        damped = scatter + self.least * np.eye(len(scatter))
        to_posture = solve(damped, self._shared[columns], assume_a="pos")
        _, vector = np.linalg.eigh(to_posture.T @ scatter @ to_posture)
        out: Floats = to_posture @ vector[:, ::-1][:, : self.terms.directions]
        return out

    def imputation_map(self, columns: Bools, wanted: Bools) -> Floats:
        """(C, W) from known columns to the wanted ones: themselves, or what the known ones lead to expect."""
        damped = self.scatter[np.ix_(columns, columns)] + self.least * np.eye(int(columns.sum()))
        out: Floats = solve(damped, self.scatter[np.ix_(columns, wanted)], assume_a="pos")
        out[:, columns[wanted]] = np.eye(len(out))[:, wanted[columns]]
        return out


@dataclass(frozen=True, eq=False)
class ReducedRankVectors:
    """`Vectors`: z of windows, worked out anew whenever it is asked for."""

    evidence: ReducedRankRegression
    windows: Windows
    usual: Bools
    """(D + 9 S,) columns of the evidence that are known."""
    directions: Floats
    """(C, 40) from them to z."""

    def __len__(self) -> int:
        return len(self.windows)

    @property
    def size(self) -> int:
        return int(self.directions.shape[1])

    def gather(self, rows: Ints | slice) -> Singles:
        wanted, start = np.arange(len(self))[rows], 0
        out: Singles = np.empty((len(wanted), self.size), np.float32)
        for known, _ in self.evidence.training_data(self.windows, wanted):
            out[start : start + len(known)] = (known - self.evidence.mean)[:, self.usual] @ self.directions
            start += len(known)
        self.windows.database.release_memory()
        return out


class ReducedRankSearch:
    """The search among N windows, in terms of the postures that certain readings lead to expect."""

    def __init__(self, evidence: ReducedRankRegression, usual: Bools, index: str, wanted: int) -> None:
        """For sessions that know the `usual` columns (D + 9 S,) as a rule and ask for so many neighbours."""
        self.vectors = ReducedRankVectors(evidence, evidence.windows, usual, evidence.directions(usual))
        self.index: Index = make_index(index, self.vectors, wanted)
        self._maps: dict[bytes, tuple[Floats, Floats]] = {}

    def nearest(self, known: Floats, measured: Bools, count: int) -> Neighbours:
        """Windows whose z is nearest to that of evidence (D + 9 S,), of which only some readings (2 S,) were measured.

        What they differ by are z, or as much of it along other axes.
        """
        key = measured.tobytes()
        found = self._maps.get(key)
        if found is None:
            if len(self._maps) >= _CACHED_MAPS:
                self._maps.clear()
            found = self._maps[key] = self._map(self.vectors.evidence.columns(measured))
        to_z, mean = found
        return self.index.nearest_with_offsets((known @ to_z - mean).astype(np.float32), count)

    def _map(self, columns: Bools) -> tuple[Floats, Floats]:
        """(D + 9 S, 40) from evidence to z when some columns are known, the others count nothing; (40,) of the mean."""
        vectors, evidence = self.vectors, self.vectors.evidence
        to_z = np.zeros((evidence.size, vectors.size))
        to_z[columns] = evidence.imputation_map(columns, vectors.usual) @ vectors.directions
        return to_z, evidence.mean @ to_z
