"""Speed, error and memory of the methods with their current options.

All methods learn from one database of synthetic takes and follow held-out takes, under the conditions of the accuracy
tables (`benchmark_clips`). They take turns with `ik` and mink (`round_robin_timing`). Memory is measured in a process
of its own for each method (`peak_memory`).
"""

import hashlib
import tempfile
import time
from collections.abc import Sequence
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
from harness.core.progress import ProgressBar, ProgressCallback
from harness.experiment import benchmark_clips
from harness.experiment.benchmark_clips import BenchmarkClip
from harness.experiment.clip_evaluation import mounts_of
from harness.experiment.round_robin_timing import (
    REFERENCE_METHOD,
    MethodSpeed,
    TimedStep,
    measure_speed,
    time_method,
    time_round_robin,
)
from harness.experiment.scenario import load_scenario
from harness.mocap import synthetic
from harness.reconstruct import registry
from harness.reconstruct.contract import Method
from harness.reconstruct.database import MotionDatabase
from harness.reconstruct.features.local_experts import HISTORY_AXES
from harness.reconstruct.features.moment_table import cells_for
from harness.reconstruct.index import FlatIndex, make_index
from harness.reconstruct.index.selection import AUTO
from harness.reconstruct.methods.dynamic_map import DynamicMap
from harness.reconstruct.methods.expert_map import FEATURES, ExpertMap
from harness.reconstruct.methods.local_pca import LocalPca
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE
from harness.stream.frame import TrackerFrame

TARGET_FPS = {"expert_map": 2000, "dynamic_map": 2000, "local_pca": 2000, "kernel_cca": 4000, "weighted_blend": 5000}
"""Frames per second on one core that each method must reach, including its final inverse kinematics."""
UNTARGETED_METHODS = ("kernel_ridge", "ik")
FRAMES, LARGE_FRAMES = 66_000, 1_000_000
CLIP_S = 9.0
"""Length of every held-out take [s]."""
MINK = "mink"
WORKERS = 2
MAX_P99_RATIO, MAX_MEMORY_RATIO, MAX_LARGE_RATIO = 3.0, 1.5, 1.3
MAX_LEARNING_S = 60.0
_COST_KEYS = ("peak_memory_ratio", "large_slowdown", "large_peak_memory_ratio", "large_learning_s")
"""Keys of the rows of a method's other costs in the JSON output, in their order."""


def bench_methods(seed: int = 1, *, large: bool = False) -> list[BenchmarkRow]:
    """Rows of each method; with `large`, also with a database of a million frames."""
    costs: dict[str, list[BenchmarkRow]] = {name: [] for name in (*TARGET_FPS, *UNTARGETED_METHODS)}
    recalls: list[BenchmarkRow] = []
    with tempfile.TemporaryDirectory(prefix="harness-bench-") as folder:
        small_path, large_path = Path(folder) / "small", Path(folder) / "large"
        small = _build_database(small_path, FRAMES, seed)
        clips = benchmark_clips.generate_held_out_clips(seed, CLIP_S)
        with ProgressBar("turns") as bar:
            speeds = measure_speed(tuple(costs), small, clips, seed, references={MINK: _mink_contender}, progress=bar)
        baseline_bytes = measure_peak_bytes(NO_METHOD, small_path, seed)
        with ProgressBar("methods") as bar:
            for done, name in enumerate(TARGET_FPS):
                bar(name, done, len(TARGET_FPS))
                peak_bytes = measure_peak_bytes(name, small_path, seed)
                costs[name].append(memory_row(name, baseline_bytes, peak_bytes, len(small)))
        if large:
            many = _build_database(large_path, LARGE_FRAMES, seed)
            for name in TARGET_FPS:
                with ProgressBar(name) as bar:
                    costs[name].append(large_database_row(name, small, many, seed, bar))
                peak_bytes = measure_peak_bytes(name, large_path, seed)
                costs[name].append(memory_row(name, baseline_bytes, peak_bytes, len(many)))
                costs[name].append(learning_row(name, many, seed))
            recalls = recall_rows(many, seed)
    rows = [row for speed in speeds for row in (*method_rows(speed, costs[speed.method]), *costs[speed.method])]
    return [*rows, *recalls]


def _build_database(folder: Path, frames: int, seed: int) -> MotionDatabase:
    with ProgressBar("takes") as bar:
        takes = benchmark_clips.make_take_factories(frames, seed)
        return benchmark_clips.build_database(folder, takes, workers=WORKERS, progress=bar)


def method_rows(speed: MethodSpeed, costs: Sequence[BenchmarkRow]) -> list[BenchmarkRow]:
    """Rows of speed and error of one method; the first also lists its other costs in the JSON output."""
    name, options = speed.method, config_hash(registry.resolve(speed.method))
    target, to_ik, to_mink = TARGET_FPS.get(name), speed.ratios[REFERENCE_METHOD], speed.ratios[MINK]
    more: dict[str, str | float] = {
        "method": name,
        "fps": speed.fps,
        "p50_ms": speed.p50_ms,
        "p99_ms": speed.p99_ms,
        "error_deg": speed.error_deg,
        "config_hash": options,
        "ratio_to_ik": to_ik,
        "ratio_to_mink": to_mink,
    }
    for cost, key in zip(costs, _COST_KEYS, strict=False):
        more[key] = cost.value
    reference = f"error {speed.error_deg:.2f} deg, options {options}; ik x {to_ik:.2f}, mink x {to_mink:.1f}"
    rows = [BenchmarkRow(name, speed.fps, "frames/s", reference, f">= {target}" if target else "", more)]
    if target:
        text = f"p50 {speed.p50_ms:.3f} ms, p99 {speed.p99_ms:.3f} ms"
        ratio = speed.p99_ms / speed.p50_ms
        rows.append(BenchmarkRow(f"{name}, p99 / p50", ratio, "x", text, f"<= {MAX_P99_RATIO:g}"))
    return rows


def memory_row(name: str, baseline_bytes: int, peak_bytes: int, frames: int) -> BenchmarkRow:
    """Memory above that of a process without a method, relative to one float32 copy of poses and query vectors.

    The tables of `expert_map` are counted apart.
    """
    needed = 4 * frames * (POSTURE_SIZE + 3 + query_dimension(registry.resolve(name)))
    tables = _table_bytes(name, frames)
    used = peak_bytes - baseline_bytes - tables
    text = f"{used / 1e6:.0f} MB for {needed / 1e6:.0f} MB of poses and query vectors, {frames:,} frames"
    if tables:
        text += f"; beside them {tables / 1e6:.0f} MB of tables"
    return BenchmarkRow(f"{name}, peak memory, {frames:,} frames", used / needed, "x", text, f"<= {MAX_MEMORY_RATIO:g}")


def large_database_row(
    name: str, small: MotionDatabase, large: MotionDatabase, seed: int, progress: ProgressCallback
) -> BenchmarkRow:
    """Slowdown by a larger database: the method takes turns with itself."""
    contenders = {
        size: time_method(benchmark_clips.fit_named_method(name, database, seed))
        for size, database in (("small", small), ("large", large))
    }
    timings = time_round_robin(contenders, benchmark_clips.generate_held_out_clips(seed, CLIP_S), progress)
    text = (
        f"{timings['large'].p50_ms:.3f} against {timings['small'].p50_ms:.3f} ms a step, "
        f"{len(large):,} against {len(small):,} frames"
    )
    ratio = timings["small"].speed_ratio(timings["large"])
    return BenchmarkRow(f"{name}, larger / smaller database", ratio, "x", text, f"<= {MAX_LARGE_RATIO:g}")


def learning_row(name: str, database: MotionDatabase, seed: int) -> BenchmarkRow:
    """Time to learn from a database that lies on the disk."""
    start_s, start_cpu_s = time.perf_counter(), time.process_time()
    benchmark_clips.fit_named_method(name, database, seed)
    wall_s, cpu_s = time.perf_counter() - start_s, time.process_time() - start_cpu_s
    label = f"{name}, learning from {len(database):,} frames"
    return BenchmarkRow(label, wall_s, "s", f"{cpu_s:.1f} s CPU", f"<= {MAX_LEARNING_S:g}")


def recall_rows(database: MotionDatabase, seed: int, every: int = 4) -> list[BenchmarkRow]:
    """Share of the true neighbours that each method's index finds, measured on every `every`th query."""
    held_out = benchmark_clips.generate_held_out_takes(len(synthetic.BEHAVIOURS), seed, benchmark_clips.TAKE_S)
    rows = []
    for kind in (
        neighbour_search.reading_problem,
        neighbour_search.pose_and_reading_problem,
        neighbour_search.feature_problem,
    ):
        search = kind(benchmark_clips.build_common_body(), database, held_out)
        exact, index, shares = FlatIndex(search.vectors), make_index(AUTO, search.vectors, search.count), []
        for query in np.concatenate(search.queries)[::every]:
            true, approximate = (set(i.nearest(query, search.count)[0].tolist()) for i in (exact, index))
            shares.append(len(true & approximate) / len(true))
        label = f"recall@{search.count}, {search.name}, {len(search.vectors):,} frames"
        rows.append(BenchmarkRow(label, float(np.mean(shares)), "", "exact search", ">= 0.95"))
    return rows


def query_dimension(method: Method) -> int:
    """Dimension of the vector by which a method finds examples: poses, station readings, or both."""
    stations = len(load_scenario(benchmark_clips.DEFAULT_SCENARIO).stations)
    if isinstance(method, LocalPca):
        return (POSTURE_SIZE + 3) * 2 - 3 + 9 * stations
    if isinstance(method, ExpertMap):
        return FEATURES + HISTORY_AXES
    if isinstance(method, DynamicMap) and method.search == "features":
        return method.regression.directions
    if isinstance(method, DynamicMap):
        return (POSTURE_SIZE + 3) * method.poses - 3
    return 10 * stations  # eq. 2 of Kim et al. 2012


def _table_bytes(name: str, frames: int) -> int:
    """Size of the moment tables of `expert_map` for a database of so many frames; 0 for other methods."""
    if not isinstance(registry.resolve(name), ExpertMap):
        return 0
    sizes = [size + POSTURE_SIZE for size in (FEATURES, HISTORY_AXES)]
    return sum(4 * cells_for(frames) * (size + size * (size + 1) // 2) for size in sizes)


def config_hash(method: Method) -> str:
    """A short hash of a method's options, taken from its `repr`."""
    return hashlib.blake2b(repr(method).encode(), digest_size=6).hexdigest()


def _mink_contender(clip: BenchmarkClip) -> TimedStep:
    """mink from the true pose of the frame before; readings are moved to the world frame outside the timed part."""
    from harness.bench.ik import mink_solver

    calibration = clip.simulation.calibration
    body = humanoid.build_body(trackers=mounts_of(load_scenario(benchmark_clips.DEFAULT_SCENARIO)))
    in_world = replace(calibration, world_from_tracker=rotations.IDENTITY, tracker_origin_m=np.zeros(3))
    solve = mink_solver(body, in_world)

    def timed_step(frame: TrackerFrame, previous_truth: Floats) -> tuple[Floats, float]:
        return solve(_to_world(frame, calibration), previous_truth)

    return timed_step


def _to_world(frame: TrackerFrame, calibration: Calibration) -> TrackerFrame:
    return replace(
        frame,
        position_m=rotations.rotate(calibration.world_from_tracker, frame.position_m) + calibration.tracker_origin_m,
        tracker_from_station=rotations.multiply(calibration.world_from_tracker, frame.tracker_from_station),
    )
