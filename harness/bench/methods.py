"""Speed, error and memory of the methods with their current options.

All methods learn from one database of synthetic takes and follow held-out takes, under the conditions of the accuracy
tables (`benchmark_clips`). They take turns with `ik` and mink (`round_robin_timing`). Memory is measured in a process
of its own for each method (`peak_memory`).
"""

import hashlib
import math
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from harness.bench import neighbour_search
from harness.bench.common import in_world
from harness.bench.cpu_time import hold_cpu_to_limit, overbooked, time_cpu
from harness.bench.limits import hold_to_limit
from harness.bench.peak_memory import NO_METHOD, measure_peak_bytes
from harness.body import build_body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.progress import ProgressBar, ProgressCallback
from harness.experiment.scenarios import load_scenario
from harness.mocap import synthetic
from harness.reconstruct import (
    FEATURES,
    HISTORY_AXES,
    DynamicMap,
    ExpertMap,
    LocalPca,
    Method,
    MotionDatabase,
    cells_for,
    make_method,
)
from harness.reconstruct.index import AUTO_INDEX, FlatIndex, make_index
from harness.reconstruct.solver import POSTURE_SIZE
from harness.results.findings import BenchmarkStatement
from harness.stream import TrackerFrame
from harness.study.speed import benchmark_clips
from harness.study.speed.benchmark_clips import BenchmarkClip
from harness.study.speed.round_robin_timing import (
    REFERENCE_METHOD,
    MethodSpeed,
    TimedStep,
    measure_speed,
    time_method,
    time_round_robin,
)

MIN_SPEED_RATIO = {"expert_map": 0.1, "dynamic_map": 0.1, "local_pca": 0.1, "kernel_cca": 0.2, "weighted_blend": 0.25}
"""Least speed of each method with its final inverse kinematics, relative to that of `ik` in the same turns."""
UNTARGETED_METHODS = ("kernel_ridge", "ik")
FRAMES, LARGE_FRAMES = 66_000, 1_000_000
CLIP_S = 9.0
"""Length of every held-out take [s]."""
MINK = "mink"
WORKERS = 2
MAX_P99_RATIO, MAX_MEMORY_RATIO, MAX_LARGE_RATIO = 3.0, 1.5, 1.3
MAX_LEARNING_UNITS = 400.0
"""Most CPU time to learn from a million frames (see `cpu_time`)."""
MIN_RECALL = 0.95
_COST_KEYS = ("peak_memory_ratio", "large_slowdown", "large_peak_memory_ratio", "large_learning_units")
"""Keys of the rows of a method's other costs in the JSON output, in their order."""


def bench_methods(seed: int = 1, *, large: bool = False) -> list[BenchmarkStatement]:
    """Rows of each method; with `large`, also with a database of a million frames."""
    costs: dict[str, list[BenchmarkStatement]] = {name: [] for name in (*MIN_SPEED_RATIO, *UNTARGETED_METHODS)}
    recalls: list[BenchmarkStatement] = []
    with tempfile.TemporaryDirectory(prefix="harness-bench-") as folder:
        small_path, large_path = Path(folder) / "small", Path(folder) / "large"
        small = _build_database(small_path, FRAMES, seed)
        clips = benchmark_clips.generate_held_out_clips(seed, CLIP_S)
        with ProgressBar("turns") as bar:
            speeds = measure_speed(tuple(costs), small, clips, seed, references={MINK: _mink_contender}, progress=bar)
        baseline_bytes = measure_peak_bytes(NO_METHOD, small_path, seed)
        with ProgressBar("methods") as bar:
            for done, name in enumerate(MIN_SPEED_RATIO):
                bar(name, done, len(MIN_SPEED_RATIO))
                peak_bytes = measure_peak_bytes(name, small_path, seed)
                costs[name].append(memory_row(name, baseline_bytes, peak_bytes, len(small)))
        if large:
            many = _build_database(large_path, LARGE_FRAMES, seed)
            for name in MIN_SPEED_RATIO:
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


def method_rows(speed: MethodSpeed, costs: Sequence[BenchmarkStatement]) -> list[BenchmarkStatement]:
    """Rows of speed and error of one method; the first also lists its other costs in the JSON output."""
    name, options = speed.method, config_hash(make_method(speed.method))
    target, to_ik, to_mink = MIN_SPEED_RATIO.get(name), speed.ratios[REFERENCE_METHOD], speed.ratios[MINK]
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
        more[key] = math.nan if cost.value is None else cost.value
    reference = f"error {speed.error_deg:.2f} deg, options {options}; mink x {to_mink:.1f}"
    rows = [hold_to_limit(name, speed.fps, "frames/s", reference=reference, more=more)]
    if target:
        text = f"p50 {speed.p50_ms:.3f} ms, p99 {speed.p99_ms:.3f} ms"
        ratio, doubt = speed.p99_ms / speed.p50_ms, overbooked()
        rows += [
            hold_to_limit(f"{name}, speed / ik", to_ik, "x", least=target, reference="the same frames"),
            hold_to_limit(f"{name}, p99 / p50", ratio, "x", most=MAX_P99_RATIO, reference=text, doubt=doubt),
        ]
    return rows


def memory_row(name: str, baseline_bytes: int, peak_bytes: int, frames: int) -> BenchmarkStatement:
    """Memory above that of a process without a method, relative to one float32 copy of poses and query vectors.

    The tables of `expert_map` are counted apart.
    """
    needed = 4 * frames * (POSTURE_SIZE + 3 + query_dimension(make_method(name)))
    tables = _table_bytes(name, frames)
    used = peak_bytes - baseline_bytes - tables
    text = f"{used / 1e6:.0f} MB for {needed / 1e6:.0f} MB of poses and query vectors, {frames:,} frames"
    if tables:
        text += f"; beside them {tables / 1e6:.0f} MB of tables"
    label = f"{name}, peak memory, {frames:,} frames"
    return hold_to_limit(label, used / needed, "x", most=MAX_MEMORY_RATIO, reference=text)


def large_database_row(
    name: str, small: MotionDatabase, large: MotionDatabase, seed: int, progress: ProgressCallback
) -> BenchmarkStatement:
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
    return hold_to_limit(f"{name}, larger / smaller database", ratio, "x", most=MAX_LARGE_RATIO, reference=text)


def learning_row(name: str, database: MotionDatabase, seed: int) -> BenchmarkStatement:
    """CPU time to learn from a database that lies on the disk."""
    cpu_s = time_cpu(lambda: benchmark_clips.fit_named_method(name, database, seed))
    return hold_cpu_to_limit(f"{name}, learning from {len(database):,} frames", cpu_s, MAX_LEARNING_UNITS)


def recall_rows(database: MotionDatabase, seed: int, every: int = 4) -> list[BenchmarkStatement]:
    """Share of the true neighbours that each method's index finds, measured on every `every`th query."""
    held_out = benchmark_clips.generate_held_out_takes(len(synthetic.BEHAVIOURS), seed, benchmark_clips.TAKE_S)
    rows = []
    for kind in (
        neighbour_search.reading_problem,
        neighbour_search.pose_and_reading_problem,
        neighbour_search.feature_problem,
    ):
        search = kind(benchmark_clips.build_common_body(), database, held_out)
        exact, index, shares = FlatIndex(search.vectors), make_index(AUTO_INDEX, search.vectors, search.count), []
        for query in np.concatenate(search.queries)[::every]:
            true, approximate = (set(i.nearest(query, search.count)[0].tolist()) for i in (exact, index))
            shares.append(len(true & approximate) / len(true))
        label = f"recall@{search.count}, {search.name}, {len(search.vectors):,} frames"
        rows.append(hold_to_limit(label, float(np.mean(shares)), least=MIN_RECALL, reference="exact search"))
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
    if not isinstance(make_method(name), ExpertMap):
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
    body = build_body(trackers=load_scenario(benchmark_clips.DEFAULT_SCENARIO).nominal_mounts)
    solve = mink_solver(body, in_world(calibration))

    def timed_step(frame: TrackerFrame, previous_truth: Floats) -> tuple[Floats, float]:
        return solve(_to_world(frame, calibration), previous_truth)

    return timed_step


def _to_world(frame: TrackerFrame, calibration: Calibration) -> TrackerFrame:
    return replace(
        frame,
        position_m=rotations.rotate(calibration.world_from_tracker, frame.position_m) + calibration.tracker_origin_m,
        tracker_from_station=rotations.multiply(calibration.world_from_tracker, frame.tracker_from_station),
    )
