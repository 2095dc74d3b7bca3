"""How long a search for neighbours takes, and how many of the true ones it finds, for each index and kind of query.

The sets are built-in takes; the queries follow held-out takes frame by frame, as a method's do: the last two poses
(k = 100, what Liu et al. 2011 look for) and what six stations read (eq. 2 of Kim et al. 2012, k = 8). The contenders
take turns, a second of motion each, so that whatever else the machine does meets all alike; exact search is the judge.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from harness.bench.rows import Row
from harness.body import humanoid, mounts
from harness.core import rotations
from harness.core.arrays import Bools, Singles
from harness.core.calibration import Calibration
from harness.core.humanoid24 import pack
from harness.core.motion import Take
from harness.mocap import performer
from harness.reconstruct.database import MotionDatabase
from harness.reconstruct.examples import station_poses
from harness.reconstruct.index import INDEXES, Graph, Index, Lookup, Table, Vectors
from harness.reconstruct.index.choose import best_for
from harness.reconstruct.local_examples import LocalExamples, Weights
from harness.reconstruct.viewpoint import View, twist_rad

STATIONS = ("left_wrist", "right_wrist", "left_ankle", "right_ankle", "torso", "head")
RATE_HZ, TAKE_S, SIZES = 40.0, 20.0, (6_600, 66_000)
TURN, TURNS = 40, 2
"""Queries in a row, and how often, in each of five held-out takes."""
POSES, EXAMPLES, NEIGHBOURS = 2, 100, 8
JUDGE = "flat"


@dataclass(frozen=True, eq=False)
class Search:
    """Something to search in, and queries in the order in which they come."""

    name: str
    vectors: Vectors
    queries: list[Singles]
    """(Q, D) of each held-out take."""
    count: int
    """Neighbours asked for."""
    follows: Bools | None
    """(N,) whether the next vector is that of the next moment; None where nobody follows."""


def bench_index(seed: int = 1, sizes: Sequence[int] = SIZES) -> list[Row]:
    """Medians over the queries, for sets of about so many frames of both kinds."""
    body = humanoid.build()
    held_out = [built_in(which, seed + 1_000_000) for which in range(len(performer.BEHAVIOURS))]
    rows: list[Row] = []
    for size in sizes:
        takes = (built_in(which, seed) for which in range(-(-size // round(TAKE_S * RATE_HZ))))
        database = MotionDatabase.build(body, takes)
        for search in (poses(database, held_out), readings(body, database, held_out)):
            rows += _compared(search)
    return rows


def built_in(which: int, seed: int) -> Take:
    """One of endlessly many takes: behaviours and performers in turn, then a new seed; the angles as they are."""
    behaviours, people = performer.BEHAVIOURS, performer.performers()
    again, which = divmod(which, len(behaviours) * len(people))
    behaviour, who = behaviours[which % len(behaviours)], people[which // len(behaviours)]
    clip = performer.generate(behaviour, who, 1, seed=seed + again, duration_s=TAKE_S, rate_hz=RATE_HZ)
    qpos = pack(clip.root_m, clip.world_from_root, clip.angles_rad)
    return Take(f"{clip.name}_{seed + again}", clip.subject, clip.source, clip.behaviour, RATE_HZ, qpos)


def poses(database: MotionDatabase, held_out: Sequence[Take]) -> Search:
    """The last answers, as windows."""
    windows = database.windows(POSES, followed=True)
    queries = [
        np.array([windows.query(take.qpos[k : k - POSES : -1]) for k in range(POSES, POSES + TURN * TURNS)])
        for take in held_out
    ]
    return Search(f"{POSES} poses", windows, queries, EXAMPLES, windows.follows)


def readings(body: humanoid.Body, database: MotionDatabase, held_out: Sequence[Take]) -> Search:
    """What six stations read."""
    worn = _worn(body)
    examples, queries = LocalExamples(body, database, worn, Weights(), "flat"), []
    for take in held_out:
        at_m, turned = station_poses(body, take, worn)
        velocity, asked = np.diff(at_m, axis=0, prepend=at_m[:1]) * RATE_HZ, []
        for k in range(1, 1 + TURN * TURNS):
            x_m, y_m, _ = at_m[k, examples.anchor]
            view = View(x_m, y_m, float(twist_rad(turned[k, examples.anchor])))
            asked.append(examples.query(at_m[k], turned[k], velocity[k], view))
        queries.append(np.array(asked, np.float32))
    return Search(f"{len(STATIONS)} stations", Table(examples.features), queries, NEIGHBOURS, None)


def _worn(body: humanoid.Body) -> Calibration:
    places = [mounts.place(body.skeleton, mounts.DEFAULTS[station]) for station in STATIONS]
    return Calibration(
        "exact",
        STATIONS,
        tuple(mounts.DEFAULTS[station].bone for station in STATIONS),
        np.array([mount_m for mount_m, _ in places]),
        np.array([turned for _, turned in places]),
        rotations.IDENTITY,
        np.zeros(3),
    )


def _compared(search: Search) -> list[Row]:
    """Exact search is the judge, and the reference for speed."""
    indexes = {name: kind(search.vectors, search.count) for name, kind in INDEXES.items()}
    begin: dict[str, Callable[[], Lookup]] = {name: partial(_same, index) for name, index in indexes.items()}
    if search.follows is not None:
        begin["graph"] = Graph(search.vectors, search.follows, indexes["inverted_file"]).follow
    seconds: dict[str, list[float]] = {name: [] for name in begin}
    hits: dict[str, list[float]] = {name: [] for name in begin}
    for queries in search.queries:
        sessions = {name: start() for name, start in begin.items()}
        for turn in range(0, len(queries), TURN):
            some = queries[turn : turn + TURN]
            true = [set(indexes[JUDGE].nearest(query, search.count)[0].tolist()) for query in some]
            for name, session in sessions.items():
                for query, wanted in zip(some, true, strict=True):
                    start_s = time.perf_counter()
                    rows, _ = session.nearest(query, search.count)
                    seconds[name].append(time.perf_counter() - start_s)
                    hits[name].append(len(wanted.intersection(rows.tolist())) / search.count)
    best, out = best_for(len(search.vectors), search.vectors.size, search.count), []
    judge_us = 1e6 * float(np.median(seconds[JUDGE]))
    for name in begin:
        what = f"{name}, {search.name}, {len(search.vectors):,} frames"
        held = name == best
        beside = f"all looked at {judge_us:,.0f} us"
        out.append(Row(what, 1e6 * float(np.median(seconds[name])), "us/query", beside, "<= 100" if held else ""))
        share = float(np.mean(hits[name]))
        out.append(Row(f"{what}, recall@{search.count}", share, "", "exact search", ">= 0.95" if held else ""))
    return out


def _same(index: Index) -> Lookup:
    """One without memory is its own session."""
    return index
