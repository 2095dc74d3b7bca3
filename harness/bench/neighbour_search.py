"""How long a search for neighbours takes, and how many of the true ones it finds, for each index and kind of query.

The sets are built-in takes as each method sees them: the last two poses (what Liu et al. 2011 look for), what six
stations read (eq. 2 of Kim et al. 2012), both, and the evidence of `dynamic_map`. The queries follow held-out takes
frame by frame, as a method's do. The contenders take turns, a second of motion each, so that whatever else the machine
does meets all alike; exact search is the judge, and faiss's own inverted file stands beside ours.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from harness.bench.rows import BenchmarkRow
from harness.body import humanoid, mounts
from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Bools, Ints, Singles
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.experiment import benchmark_clips
from harness.mocap import synthetic
from harness.reconstruct.database import MotionDatabase
from harness.reconstruct.features.example_features import ExampleFeatures, FeatureWeights
from harness.reconstruct.index import INDEXES, ArrayVectors, Lookup, NeighbourGraph, Vectors
from harness.reconstruct.index.inverted_file import cells_for, probes_for
from harness.reconstruct.index.selection import FLAT_MAX_VECTORS, best_index
from harness.reconstruct.methods.dynamic_map import DynamicMap
from harness.reconstruct.methods.local_pca import LocalPca

STATIONS = ("left_wrist", "right_wrist", "left_ankle", "right_ankle", "torso", "head")
SIZES = (6_600, 66_000)
QUERIES_PER_TURN, TURNS_PER_CLIP = 40, 2
"""Queries in a row, and how often, in each of five held-out takes."""
POSES, EXAMPLES, NEIGHBOURS = 2, 100, 8
EXACT_INDEX = "flat"


@dataclass(frozen=True, eq=False)
class SearchProblem:
    """Something to search in, and queries in the order in which they come."""

    name: str
    vectors: Vectors
    queries: list[Singles]
    """(Q, D) of each held-out take."""
    count: int
    """Neighbours asked for."""
    follows: Bools | None
    """(N,) whether the next vector is that of the next moment; None where nobody follows."""


def bench_index(seed: int = 1, sizes: Sequence[int] = SIZES) -> list[BenchmarkRow]:
    """Medians over the queries, for sets of so many frames of every kind."""
    body = humanoid.build_body()
    held_out = benchmark_clips.generate_held_out_takes(len(synthetic.BEHAVIOURS), seed, benchmark_clips.TAKE_S)
    rows: list[BenchmarkRow] = []
    for size in sizes:
        database = MotionDatabase.build(body, benchmark_clips.make_take_factories(size, seed))
        for kind in PROBLEMS:
            rows += _compare_indexes(kind(body, database, held_out))
    return rows


def pose_problem(body: Body, database: MotionDatabase, held_out: Sequence[BodyMotion]) -> SearchProblem:
    """The last answers, as windows: `dynamic_map:window`."""
    windows = database.windows(POSES, with_successor=True)
    queries = [
        _single_motion_database(body, take).windows(POSES, with_successor=True).gather(_QUERY_FRAMES)
        for take in held_out
    ]
    return SearchProblem(f"{POSES} poses", windows, queries, EXAMPLES, windows.consecutive)


def reading_problem(body: Body, database: MotionDatabase, held_out: Sequence[BodyMotion]) -> SearchProblem:
    """What six stations read: `kernel_cca`, `weighted_blend`."""
    worn, queries = _exact_calibration(body), list[Singles]()
    examples = ExampleFeatures(body, database, worn, FeatureWeights(), "flat", NEIGHBOURS)
    for take in held_out:
        asked = ExampleFeatures(
            body, _single_motion_database(body, take), worn, FeatureWeights(), "flat", NEIGHBOURS
        ).gather(_QUERY_FRAMES)
        turned = asked[:, 3 * len(STATIONS) : 7 * len(STATIONS)].reshape(len(asked), -1, 4)
        turned *= np.copysign(1.0, np.vecdot(turned, examples.hemisphere * turned.dtype.type(1.0)))[..., None]
        queries.append(asked)
    return SearchProblem(
        f"{len(STATIONS)} stations", ArrayVectors(examples.gather(slice(None))), queries, NEIGHBOURS, None
    )


def pose_and_reading_problem(body: Body, database: MotionDatabase, held_out: Sequence[BodyMotion]) -> SearchProblem:
    """The last answers beside what six stations read: `local_pca`."""
    method, worn = LocalPca(), _exact_calibration(body)

    def vectors(learnt: MotionDatabase) -> Vectors:
        return method.fit_database(body, learnt, generator(0, "bench")).station_features(worn)[1]

    queries = [vectors(_single_motion_database(body, take)).gather(_QUERY_FRAMES) for take in held_out]
    return SearchProblem("poses and stations", vectors(database), queries, method.neighbours, None)


def feature_problem(body: Body, database: MotionDatabase, held_out: Sequence[BodyMotion]) -> SearchProblem:
    """What both lead to expect: `dynamic_map`."""
    method = DynamicMap()
    known = method.fit_database(body, database, generator(0, "bench")).regression(_exact_calibration(body))
    vectors = known.search(np.ones(known.size, bool), method.index, method.neighbours).vectors
    asked = [
        replace(vectors, windows=_single_motion_database(body, take).windows(method.poses, with_successor=True))
        for take in held_out
    ]
    return SearchProblem("evidence", vectors, [z.gather(_QUERY_FRAMES) for z in asked], method.neighbours, None)


PROBLEMS = (pose_problem, reading_problem, pose_and_reading_problem, feature_problem)
_QUERY_FRAMES = np.arange(1, 1 + QUERIES_PER_TURN * TURNS_PER_CLIP)
"""Frames of a held-out take that are asked for."""


def _single_motion_database(body: Body, take: BodyMotion) -> MotionDatabase:
    return MotionDatabase.build(body, [take])


def _exact_calibration(body: Body) -> Calibration:
    places = [mounts.locate_mount(body.skeleton, mounts.DEFAULT_MOUNTS[station]) for station in STATIONS]
    return Calibration(
        "exact",
        STATIONS,
        tuple(mounts.DEFAULT_MOUNTS[station].bone for station in STATIONS),
        np.array([mount_m for mount_m, _ in places]),
        np.array([turned for _, turned in places]),
        rotations.IDENTITY,
        np.zeros(3),
    )


def _compare_indexes(search: SearchProblem) -> list[BenchmarkRow]:
    """Exact search is the judge, and the reference for speed."""
    indexes = {name: kind(search.vectors, search.count) for name, kind in INDEXES.items()}
    begin: dict[str, Callable[[], Lookup]] = {
        name: partial(_stateless_lookup, index) for name, index in indexes.items()
    }
    if len(search.vectors) > FLAT_MAX_VECTORS:
        begin["faiss"] = partial(_stateless_lookup, FaissInvertedFile(search.vectors, search.count))
    if search.follows is not None:
        begin["graph"] = NeighbourGraph(search.vectors, search.follows, indexes["inverted_file"]).begin_search
    seconds: dict[str, list[float]] = {name: [] for name in begin}
    hits: dict[str, list[float]] = {name: [] for name in begin}
    for queries in search.queries:
        sessions = {name: start() for name, start in begin.items()}
        for turn in range(0, len(queries), QUERIES_PER_TURN):
            some = queries[turn : turn + QUERIES_PER_TURN]
            true = [set(indexes[EXACT_INDEX].nearest(query, search.count)[0].tolist()) for query in some]
            for name, session in sessions.items():
                for query, wanted in zip(some, true, strict=True):
                    start_s = time.perf_counter()
                    rows, _ = session.nearest(query, search.count)
                    seconds[name].append(time.perf_counter() - start_s)
                    hits[name].append(len(wanted.intersection(rows.tolist())) / len(wanted))
    best, out = best_index(len(search.vectors), search.vectors.size, search.count), []
    judge_us = 1e6 * float(np.median(seconds[EXACT_INDEX]))
    for name in begin:
        what = f"{name}, {search.name}, {len(search.vectors):,} frames"
        held = name == best
        beside = f"all looked at {judge_us:,.0f} us"
        out.append(
            BenchmarkRow(what, 1e6 * float(np.median(seconds[name])), "us/query", beside, "<= 200" if held else "")
        )
        share = float(np.mean(hits[name]))
        out.append(BenchmarkRow(f"{what}, recall@{search.count}", share, "", "exact search", ">= 0.95" if held else ""))
    return out


class FaissInvertedFile:
    """faiss's inverted file of as many cells, all numbers of each vector in half precision: a `Lookup`."""

    def __init__(self, vectors: Vectors, wanted: int) -> None:
        import faiss

        count, cells = len(vectors), cells_for(len(vectors))
        values, flat = vectors.gather(slice(0, count)), faiss.IndexFlatL2(vectors.size)
        half = faiss.ScalarQuantizer.QT_fp16
        self._file: Any = faiss.IndexIVFScalarQuantizer(flat, vectors.size, cells, half, faiss.METRIC_L2, False)
        self._file.train(values)
        self._file.add(values)
        self._file.nprobe = min(probes_for(wanted, count), cells)

    def nearest(self, query: Singles, count: int) -> tuple[Ints, Singles]:
        squared, rows = self._file.search(query[None], count)
        return rows[0], squared[0]


def _stateless_lookup(index: Lookup) -> Lookup:
    """One without memory is its own session."""
    return index
