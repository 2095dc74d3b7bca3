"""Time and recall of the search for neighbours, for each index and kind of query.

The vectors are those of the methods, for synthetic takes: the last two poses (Liu et al. 2011), the readings of six
stations (eq. 2 of Kim et al. 2012), both, and the evidence of `dynamic_map`. The queries follow held-out takes frame by
frame, as those of a method do. The indexes take turns of one second of motion, so that load on the machine affects all
equally. Exact search is the reference for recall; faiss's inverted file is measured for comparison.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from harness.bench.common import STATIONS, world_calibration
from harness.bench.limits import hold_to_limit
from harness.body import Body, build_body
from harness.core.arrays import Ints, Singles
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.mocap import synthetic
from harness.reconstruct import DynamicMap, ExampleFeatures, FeatureWeights, LocalPca, MotionDatabase
from harness.reconstruct.index import (
    FLAT_MAX_VECTORS,
    INDEXES,
    ArrayVectors,
    Lookup,
    Vectors,
    best_index,
    cells_for,
    probes_for,
)
from harness.results.findings import BenchmarkStatement
from harness.study.speed import benchmark_clips

SIZES = (6_600, 66_000)
QUERIES_PER_TURN, TURNS_PER_CLIP = 40, 2
"""Consecutive queries of a turn, and turns in each of five held-out takes."""
POSES, EXAMPLES, NEIGHBOURS = 2, 100, 8
EXACT_INDEX = "flat"
MIN_RECALL = 0.95
"""Least recall of the index that is used for vectors of this number and kind."""
MAX_TIME_RATIO = 0.5
"""Most time of that index, relative to exact search."""


@dataclass(frozen=True, eq=False)
class SearchProblem:
    """Vectors to search, and queries in their order in time."""

    name: str
    vectors: Vectors
    queries: list[Singles]
    """(Q, D) queries of each held-out take."""
    count: int
    """Number of neighbours to find."""


def bench_index(seed: int = 1, sizes: Sequence[int] = SIZES) -> list[BenchmarkStatement]:
    """Medians over the queries, for all kinds of vectors and databases of `sizes` frames."""
    body = build_body()
    held_out = benchmark_clips.generate_held_out_takes(len(synthetic.BEHAVIOURS), seed, benchmark_clips.TAKE_S)
    rows: list[BenchmarkStatement] = []
    for size in sizes:
        database = MotionDatabase.build(body, benchmark_clips.make_take_factories(size, seed))
        for kind in PROBLEMS:
            rows += _compare_indexes(kind(body, database, held_out))
    return rows


def pose_problem(body: Body, database: MotionDatabase, held_out: Sequence[BodyMotion]) -> SearchProblem:
    """The last poses, as windows: `dynamic_map:window`."""
    windows = database.windows(POSES, with_successor=True)
    queries = [
        _single_motion_database(body, take).windows(POSES, with_successor=True).gather(_QUERY_FRAMES)
        for take in held_out
    ]
    return SearchProblem(f"{POSES} poses", windows, queries, EXAMPLES)


def reading_problem(body: Body, database: MotionDatabase, held_out: Sequence[BodyMotion]) -> SearchProblem:
    """The readings of six stations: `kernel_cca`, `weighted_blend`."""
    calibration, queries = world_calibration(body), list[Singles]()
    examples = ExampleFeatures(body, database, calibration, FeatureWeights(), "flat", NEIGHBOURS)
    for take in held_out:
        vectors = ExampleFeatures(
            body, _single_motion_database(body, take), calibration, FeatureWeights(), "flat", NEIGHBOURS
        ).gather(_QUERY_FRAMES)
        orientations = vectors[:, 3 * len(STATIONS) : 7 * len(STATIONS)].reshape(len(vectors), -1, 4)
        signs = np.copysign(1.0, np.vecdot(orientations, examples.hemisphere * orientations.dtype.type(1.0)))
        orientations *= signs[..., None]
        queries.append(vectors)
    return SearchProblem(f"{len(STATIONS)} stations", ArrayVectors(examples.gather(slice(None))), queries, NEIGHBOURS)


def pose_and_reading_problem(body: Body, database: MotionDatabase, held_out: Sequence[BodyMotion]) -> SearchProblem:
    """The last poses and the readings of six stations: `local_pca`."""
    method, calibration = LocalPca(), world_calibration(body)

    def vectors(source: MotionDatabase) -> Vectors:
        return method.fit_database(body, source, generator(0, "bench")).station_features(calibration)[1]

    queries = [vectors(_single_motion_database(body, take)).gather(_QUERY_FRAMES) for take in held_out]
    return SearchProblem("poses and stations", vectors(database), queries, method.neighbours)


def feature_problem(body: Body, database: MotionDatabase, held_out: Sequence[BodyMotion]) -> SearchProblem:
    """Features of poses and readings: `dynamic_map`."""
    method = DynamicMap()
    regression = method.fit_database(body, database, generator(0, "bench")).regression(world_calibration(body))
    vectors = regression.search(np.ones(regression.size, bool), method.index, method.neighbours).vectors
    queries = [
        replace(vectors, windows=_single_motion_database(body, take).windows(method.poses, with_successor=True))
        for take in held_out
    ]
    return SearchProblem("evidence", vectors, [z.gather(_QUERY_FRAMES) for z in queries], method.neighbours)


PROBLEMS = (pose_problem, reading_problem, pose_and_reading_problem, feature_problem)
_QUERY_FRAMES = np.arange(1, 1 + QUERIES_PER_TURN * TURNS_PER_CLIP)
"""Frames of a held-out take that are used as queries."""


def _single_motion_database(body: Body, take: BodyMotion) -> MotionDatabase:
    return MotionDatabase.build(body, [take])


def _compare_indexes(search: SearchProblem) -> list[BenchmarkStatement]:
    """Compare all indexes; exact search is the reference for recall and speed."""
    indexes = {name: kind(search.vectors, search.count) for name, kind in INDEXES.items()}
    begin: dict[str, Callable[[], Lookup]] = {name: index.begin_search for name, index in indexes.items()}
    if len(search.vectors) > FLAT_MAX_VECTORS:
        faiss = FaissInvertedFile(search.vectors, search.count)
        begin["faiss"] = lambda: faiss  # an index without state is its own session
    seconds: dict[str, list[float]] = {name: [] for name in begin}
    hits: dict[str, list[float]] = {name: [] for name in begin}
    for queries in search.queries:
        sessions = {name: start() for name, start in begin.items()}
        for turn in range(0, len(queries), QUERIES_PER_TURN):
            block = queries[turn : turn + QUERIES_PER_TURN]
            true = [set(indexes[EXACT_INDEX].nearest(query, search.count)[0].tolist()) for query in block]
            for name, session in sessions.items():
                for query, wanted in zip(block, true, strict=True):
                    start_s = time.perf_counter()
                    rows, _ = session.nearest(query, search.count)
                    seconds[name].append(time.perf_counter() - start_s)
                    hits[name].append(len(wanted.intersection(rows.tolist())) / len(wanted))
    best, out = best_index(len(search.vectors), search.vectors.size, search.count), []
    exact_us = 1e6 * float(np.median(seconds[EXACT_INDEX]))
    for name in begin:
        label = f"{name}, {search.name}, {len(search.vectors):,} frames"
        gated, us, share = name == best, 1e6 * float(np.median(seconds[name])), float(np.mean(hits[name]))
        out += [
            hold_to_limit(label, us, "us/query", reference=f"exact search {exact_us:,.0f} us"),
            hold_to_limit(f"{label}, recall@{search.count}", share, least=MIN_RECALL if gated else None),
        ]
        if gated and name != EXACT_INDEX:
            text = f"{us:,.0f} and {exact_us:,.0f} us"
            out.append(
                hold_to_limit(f"{label}, time / exact search", us / exact_us, "x", most=MAX_TIME_RATIO, reference=text)
            )
    return out


class FaissInvertedFile:
    """faiss's inverted file with the same number of cells and vectors in half precision; a `Lookup`."""

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
        """Rows and squared distances of the nearest vectors."""
        squared, rows = self._file.search(query[None], count)
        return rows[0], squared[0]
