"""How fast the methods are, how far off with these very options, and how much memory they take.

All learn from one database of built-in takes and follow held-out ones, in the setting of the accuracy tables
(`benchmark_clips`). They take turns, a second of motion each, beside `ik` and mink, so that whatever else the machine does meets
all alike. What memory and a larger database cost is measured in processes of their own (`alone`).
"""

import hashlib
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from harness.bench import neighbour_search
from harness.bench.peak_memory import NO_METHOD, measure_peak_bytes
from harness.bench.rows import BenchmarkRow
from harness.body import humanoid
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.progress import ProgressBar
from harness.experiment import benchmark_clips
from harness.experiment.benchmark_clips import BenchmarkClip
from harness.experiment.clip_evaluation import mounts_of
from harness.experiment.round_robin_timing import (
    MethodTimings,
    ProgressCallback,
    TimedStep,
    time_method,
    time_round_robin,
)
from harness.experiment.scenario import load_scenario
from harness.mocap import synthetic
from harness.reconstruct import registry
from harness.reconstruct.contract import Method, Reconstructor
from harness.reconstruct.database import MotionDatabase
from harness.reconstruct.index import FlatIndex, make_index
from harness.reconstruct.index.selection import AUTO
from harness.reconstruct.methods.dynamic_map import DynamicMap
from harness.reconstruct.methods.local_pca import LocalPca
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE
from harness.stream.frame import TrackerFrame

TARGET_FPS = {"dynamic_map": 1000, "local_pca": 1000, "kernel_cca": 2000, "weighted_blend": 2000}
"""Frames a second on one core, final inverse kinematics included where the method ends with it."""
UNTARGETED_METHODS = ("kernel_ridge", "ik")
FRAMES, LARGE_FRAMES = 66_000, 1_000_000
CLIP_S = 9.0
"""Of every held-out take."""
REFERENCE_METHOD, MINK = "ik", "mink"
WORKERS = 2
MAX_P99_RATIO, MAX_MEMORY_RATIO, MAX_LARGE_RATIO = 3.0, 1.3, 1.5


def bench_methods(seed: int = 1, *, large: bool = False) -> list[BenchmarkRow]:
    """Rows of each method; with `large`, also beside a database of a million frames."""
    others: dict[str, list[BenchmarkRow]] = {name: [] for name in (*TARGET_FPS, *UNTARGETED_METHODS)}
    recalls: list[BenchmarkRow] = []
    with tempfile.TemporaryDirectory(prefix="harness-bench-") as folder:
        small, vast = Path(folder) / "small", Path(folder) / "large"
        with ProgressBar("takes") as bar:
            learnt = build_synthetic_database(small, FRAMES, seed, bar)
        with ProgressBar("turns") as bar:
            tallies = time_with_mink(
                {name: benchmark_clips.fit_named_method(name, learnt, seed) for name in others}, seed, bar
            )
        nothing = measure_peak_bytes(NO_METHOD, small, seed)
        with ProgressBar("methods") as bar:
            for done, name in enumerate(TARGET_FPS):
                bar(name, done, len(TARGET_FPS))
                others[name].append(memory_row(name, nothing, measure_peak_bytes(name, small, seed), len(learnt)))
        if large:
            with ProgressBar("takes") as bar:
                many = build_synthetic_database(vast, LARGE_FRAMES, seed, bar)
            for name in TARGET_FPS:
                with ProgressBar(name) as bar:
                    others[name].append(large_database_row(name, learnt, many, seed, bar))
                others[name].append(memory_row(name, nothing, measure_peak_bytes(name, vast, seed), len(many)))
            recalls = recall_rows(many, seed)
    rows = [row for name in others for row in (*method_rows(name, tallies, others[name]), *others[name])]
    return [*rows, *recalls]


def build_synthetic_database(folder: Path, frames: int, seed: int, progress: ProgressCallback) -> MotionDatabase:
    """So many frames of built-in takes, on disk and memory-mapped."""
    takes = benchmark_clips.make_take_factories(frames, seed)
    return MotionDatabase.build(
        benchmark_clips.build_common_body(), takes, workers=WORKERS, progress=progress, folder=folder
    )


def method_rows(name: str, tallies: dict[str, MethodTimings], others: Sequence[BenchmarkRow]) -> list[BenchmarkRow]:
    """Speed and error of one method, beside the references of the same run; programs are told of the others as well."""
    tally, to = (
        tallies[name],
        {other: _median_speed_ratio(tallies[other], tallies[name]) for other in (REFERENCE_METHOD, MINK)},
    )
    p50_ms, p99_ms = np.percentile(tally.step_ms, [50, 99]).tolist()
    error_deg, options = float(np.mean(tally.error_deg)), config_hash(registry.resolve(name))
    held = TARGET_FPS.get(name)
    more = {
        "method": name,
        "fps": tally.fps,
        "p50_ms": p50_ms,
        "p99_ms": p99_ms,
        "error_deg": error_deg,
        "config_hash": options,
        "ratio_to_ik": to[REFERENCE_METHOD],
        "ratio_to_mink": to[MINK],
    }
    for other, key in zip(others, ("peak_memory_ratio", "large_slowdown", "large_peak_memory_ratio"), strict=False):
        more[key] = other.value
    beside = f"error {error_deg:.2f} deg, options {options}; ik x {to[REFERENCE_METHOD]:.2f}, mink x {to[MINK]:.1f}"
    rows = [BenchmarkRow(name, tally.fps, "frames/s", beside, f">= {held}" if held else "", more)]
    if held:
        text = f"p50 {p50_ms:.3f} ms, p99 {p99_ms:.3f} ms"
        rows.append(BenchmarkRow(f"{name}, p99 / p50", p99_ms / p50_ms, "x", text, f"<= {MAX_P99_RATIO:g}"))
    return rows


def memory_row(name: str, nothing_bytes: int, peak_bytes: int, frames: int) -> BenchmarkRow:
    """Above an empty process, over one float32 copy of poses and query vectors."""
    needed = 4 * frames * (POSTURE_SIZE + 3 + query_dimension(registry.resolve(name)))
    took = peak_bytes - nothing_bytes
    text = f"{took / 1e6:.0f} MB for {needed / 1e6:.0f} MB of poses and query vectors, {frames:,} frames"
    return BenchmarkRow(f"{name}, peak memory, {frames:,} frames", took / needed, "x", text, f"<= {MAX_MEMORY_RATIO:g}")


def large_database_row(
    name: str, few: MotionDatabase, many: MotionDatabase, seed: int, progress: ProgressCallback
) -> BenchmarkRow:
    """What a larger database costs: both take turns."""
    both = {
        which: time_method(benchmark_clips.fit_named_method(name, known, seed))
        for which, known in (("few", few), ("many", many))
    }
    tallies = time_round_robin(both, benchmark_clips.generate_held_out_clips(seed, CLIP_S), progress)
    few_ms, many_ms = (float(np.median(tallies[which].step_ms)) for which in ("few", "many"))
    text = f"{many_ms:.3f} against {few_ms:.3f} ms a step, {len(many):,} against {len(few):,} frames"
    ratio = _median_speed_ratio(tallies["many"], tallies["few"])
    return BenchmarkRow(f"{name}, larger / smaller database", ratio, "x", text, f"<= {MAX_LARGE_RATIO:g}")


def recall_rows(learnt: MotionDatabase, seed: int, every: int = 4) -> list[BenchmarkRow]:
    """The share of the true neighbours that each method's index finds, for every so manyth query."""
    held_out = benchmark_clips.generate_held_out_takes(len(synthetic.BEHAVIOURS), seed, benchmark_clips.TAKE_S)
    rows = []
    for kind in (
        neighbour_search.reading_problem,
        neighbour_search.pose_and_reading_problem,
        neighbour_search.feature_problem,
    ):
        search = kind(benchmark_clips.build_common_body(), learnt, held_out)
        judge, used, shares = FlatIndex(search.vectors), make_index(AUTO, search.vectors, search.count), []
        for query in np.concatenate(search.queries)[::every]:
            true, found = (set(one.nearest(query, search.count)[0].tolist()) for one in (judge, used))
            shares.append(len(true & found) / len(true))
        what = f"recall@{search.count}, {search.name}, {len(search.vectors):,} frames"
        rows.append(BenchmarkRow(what, float(np.mean(shares)), "", "exact search", ">= 0.95"))
    return rows


def query_dimension(method: Method) -> int:
    """Numbers in the vector by which a method finds examples: poses, what the stations read, or both."""
    stations = len(load_scenario(benchmark_clips.DEFAULT_SCENARIO).stations)
    if isinstance(method, LocalPca):
        return (POSTURE_SIZE + 3) * 2 - 3 + 9 * stations
    if isinstance(method, DynamicMap) and method.search == "features":
        return method.regression.directions
    if isinstance(method, DynamicMap):
        return (POSTURE_SIZE + 3) * method.poses - 3
    return 10 * stations  # eq. 2 of Kim et al. 2012


def config_hash(method: Method) -> str:
    """A short digest of a method's options, as `repr` tells them."""
    return hashlib.blake2b(repr(method).encode(), digest_size=6).hexdigest()


def _median_speed_ratio(other: MethodTimings, own: MethodTimings) -> float:
    """How many times faster than the other, turn by turn."""
    return float(np.median(np.array(other.turn_s) / np.array(own.turn_s)))


def time_with_mink(
    fitted: Mapping[str, Reconstructor], seed: int, progress: ProgressCallback
) -> dict[str, MethodTimings]:
    """The contest of these and mink on the first seconds of a held-out take of each behaviour."""
    contenders = {name: time_method(learnt) for name, learnt in fitted.items()}
    return time_round_robin(
        {**contenders, MINK: _mink_contender}, benchmark_clips.generate_held_out_clips(seed, CLIP_S), progress
    )


def _mink_contender(trial: BenchmarkClip) -> TimedStep:
    """mink from the true pose of the frame before, on readings brought to the world's frame off its clock."""
    from harness.bench.ik import IKBenchmarkCase, mink_solver

    worn = trial.simulation.calibration
    body = humanoid.build_body(trackers=mounts_of(load_scenario(benchmark_clips.DEFAULT_SCENARIO)))
    at_home = replace(worn, world_from_tracker=rotations.IDENTITY, tracker_origin_m=np.zeros(3))
    solve = mink_solver(IKBenchmarkCase(body, at_home, [], np.zeros((0, 55)), ()))

    def follow(frame: TrackerFrame, before: Floats) -> tuple[Floats, float]:
        return solve(_to_world(frame, worn), before)

    return follow


def _to_world(frame: TrackerFrame, worn: Calibration) -> TrackerFrame:
    return replace(
        frame,
        position_m=rotations.rotate(worn.world_from_tracker, frame.position_m) + worn.tracker_origin_m,
        tracker_from_station=rotations.multiply(worn.world_from_tracker, frame.tracker_from_station),
    )
