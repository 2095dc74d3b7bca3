"""The speed that a paper states, beside the speed of the same methods here with databases of the same size.

The papers measured on machines of their own and do not say what their figures include.
"""

import hashlib
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from harness.core.files import content_key
from harness.core.motion import BodyMotion
from harness.core.split import ClipPart
from harness.experiment import ClipEvaluation
from harness.experiment.scenarios import Scenario, open_scenario_motion
from harness.mocap import LibraryFolders, MotionLibrary
from harness.reconstruct import MotionDatabase
from harness.results import current_circumstances, source_hash
from harness.results.findings import BarChart, BenchmarkStatement, FindingsTable, PaperExperiment
from harness.study.papers.paper_study import DATABASE_SHARE, PaperStudy
from harness.study.speed import benchmark_clips
from harness.study.speed.benchmark_clips import BenchmarkClip
from harness.study.speed.round_robin_timing import REFERENCE_METHOD, MethodSpeed, measure_speed

MAX_TEST_S = 12.0
"""Longest part of a held-out take that is followed [s]."""


def missing_clips(study: PaperStudy, frames: Mapping[str, int]) -> str:
    """Explain why the library has no clips for these behaviours; "" where it has, and always for synthetic motion."""
    if study.library is None:
        return ""
    source = open_scenario_motion(benchmark_clips.load_clean_scenario().motion, study.library, study.seed)
    test = list_test_clips(study)
    names = {
        behaviour: [name for name in source.names() if source.behaviour(name) == behaviour] for behaviour in frames
    }
    if any(set(names[behaviour]) & test.get(behaviour, set()) and len(names[behaviour]) > 1 for behaviour in frames):
        return ""
    return f"the library lacks one clip to follow and another to learn from for {', '.join(frames)}"


def build_speed_dataset(
    study: PaperStudy, frames: Mapping[str, int], scenario: Scenario, folder: Path
) -> tuple[MotionDatabase, list[BenchmarkClip]]:
    """Build a database with `frames` of each behaviour; simulate a held-out take of each as `scenario` reads it.

    A library may have fewer frames. Where several behaviours are asked for together, its clips of every behaviour are
    used. Call `missing_clips` first.
    """
    if study.library is None:
        factories = [
            take
            for behaviour, count in frames.items()
            for take in benchmark_clips.make_take_factories(count, study.seed, [behaviour])
        ]
        takes = [
            benchmark_clips.generate_held_out_takes(1, study.seed, MAX_TEST_S, [behaviour])[0] for behaviour in frames
        ]
        database = build_database(folder, {"seed": study.seed, "frames": frames}, lambda: factories)
        return database, benchmark_clips.simulate_clips(takes, study.seed, scenario)
    evaluations, wanted = _test_clip_evaluations(study, study.library, frames, scenario), sum(frames.values())
    files = {entry.name: _digest(entry.path) for entry in MotionLibrary(study.library).entries()}
    content = {"files": files, "examples": evaluations[0].scenario.motion.examples, "frames": wanted}
    database = build_database(folder, content, lambda: truncate_motions(evaluations[0].training.examples, wanted))
    return database, [BenchmarkClip.from_simulation(e.part.clip, e.simulation) for e in evaluations]


def build_database(
    folder: Path, defined_by: object, takes: Callable[[], Iterable[BodyMotion | Callable[[], BodyMotion]]]
) -> MotionDatabase:
    """Build or open the database below `folder` that is named by a hash of the source code and of `defined_by`."""
    path = folder / content_key({"source": source_hash(), "defined_by": defined_by})
    return benchmark_clips.build_database(path, () if path.is_dir() else takes())


def truncate_motions(takes: Iterable[BodyMotion], count: int) -> Iterator[BodyMotion]:
    """Yield takes until they have `count` frames in total; the last is cut."""
    for take in takes:
        if count <= 0:
            return
        yield replace(take, qpos=take.qpos[:count])
        count -= len(take)


def list_test_clips(study: PaperStudy) -> dict[str, set[str]]:
    """Behaviour -> test clips of the study's runs."""
    clips: dict[str, set[str]] = {}
    for scenario in study.runs.values():
        for text, behaviour in scenario.motion.tested:
            clips.setdefault(behaviour, set()).add(ClipPart.parse(text).clip)
    return clips


def _test_clip_evaluations(
    study: PaperStudy, library: LibraryFolders, frames: Mapping[str, int], scenario: Scenario
) -> list[ClipEvaluation]:
    """Evaluations of the longest test clip of each behaviour; none of these clips is an example."""
    tables = benchmark_clips.load_clean_scenario().motion
    source = open_scenario_motion(tables, library, study.seed)
    longest = {
        behaviour: max(sorted(clips), key=lambda clip: source.load(clip).duration_s)
        for behaviour, clips in list_test_clips(study).items()
        if behaviour in frames
    }
    others = [name for name in source.names() if name not in longest.values()]
    examples = tuple(name for name in others if len(frames) > 1 or source.behaviour(name) in frames)
    motion = replace(tables, examples=examples, withheld=(), database="all", longest_s=MAX_TEST_S)
    evaluations = []
    for behaviour, clip in longest.items():
        tested = replace(scenario, seed=study.seed, motion=replace(motion, test=(clip,), behaviours=(behaviour,)))
        evaluations.append(ClipEvaluation(tested, source, ClipPart(clip), behaviour))
    return evaluations


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "blake2b").hexdigest()[:16]


_REAL_NOTE = (
    "Clips of the library, as many frames as there are. The longest test clip of each behaviour is followed and is not "
    "learnt from. The database 'all together' has clips of every behaviour."
)
_SYNTHETIC_NOTE = (
    "Synthetic takes with exactly as many frames as the paper's. None of them is among the takes that are followed."
)


@dataclass(frozen=True)
class PublishedSpeed:
    """What a paper states about its speed, and the databases that it names."""

    statement: str
    """The statement in words."""
    scenario: str
    """Name of the scenario whose stations are used."""
    databases: Mapping[str, Mapping[str, int]]
    """Name -> behaviour -> frames."""
    methods: tuple[str, ...]
    paper_methods: tuple[str, ...]
    """The methods that reproduce the paper's own."""
    fps: float
    latency_ms: float | None = None


_LIU_FRAMES = {"walking": 18_160, "boxing": 31_358, "jumping": 6_483, "golf": 2_339, "table_tennis": 7_582}
LIU2011 = PublishedSpeed(
    "The paper's system runs at 35 frames a second on average with 0.025 s of latency, which is also one period of its "
    "six trackers at 40 Hz; it has one database for each behaviour, 65,922 frames in all.",
    "walking",
    {**{name: {name: count} for name, count in _LIU_FRAMES.items()}, "all together": _LIU_FRAMES},
    ("dynamic_map", "dynamic_map:literal", "local_pca", REFERENCE_METHOD),
    ("dynamic_map", "dynamic_map:literal"),
    fps=35.0,
    latency_ms=25.0,
)
_KIM_FRAMES = {"boxing": 7_233, "table_tennis": 4_271, "walking": 1_317}
KIM2012 = PublishedSpeed(
    "The paper's system runs at about 80 frames a second on an Intel Core i7 with 16 GB, with five trackers; its "
    "databases have 7,233 frames of boxing, 4,271 of table tennis and 1,317 of walking.",
    "walking_five_stations",
    {name: {name: count} for name, count in _KIM_FRAMES.items()},
    ("kernel_cca", "weighted_blend", REFERENCE_METHOD),
    ("kernel_cca",),
    fps=80.0,
)


def compare_speed(study: PaperStudy, published: PublishedSpeed) -> PaperExperiment:
    """Compare the published speed with each database in turn; each is measured once and cached."""
    folder, speeds, absent = study.out / "measured" / "databases", dict[str, list[MethodSpeed]](), []
    for database, published_frames in published.databases.items():
        share = DATABASE_SHARE if study.quick else 1.0
        frames = {behaviour: round(share * count) for behaviour, count in published_frames.items()}
        measured = study.cached_measurement(
            f"speed_{database}".replace(" ", "_"), partial(_measure, study, published, frames, folder)
        )
        if "absent" in measured:
            absent.append(f"{database}: {measured['absent']}")
        else:
            speeds[database] = [MethodSpeed(**row) for row in measured["speeds"]]
    shutil.rmtree(folder, ignore_errors=True)  # the databases are no longer needed
    return make_speed_experiment(
        *(published, speeds),
        machine=measured["machine"],
        real=study.library is not None,
        absent=absent,
        share=DATABASE_SHARE if study.quick else 1.0,
    )


def _measure(study: PaperStudy, published: PublishedSpeed, frames: Mapping[str, int], folder: Path) -> dict[str, Any]:
    """Measure the methods with one database: their speeds, or the reason why there are none."""
    circumstances = current_circumstances()
    machine = f"{circumstances['processor']}, {circumstances['cpu_count']} cores"
    if absent := missing_clips(study, frames):
        return {"absent": absent, "machine": machine}
    scenario = benchmark_clips.load_clean_scenario(published.scenario)
    speeds = measure_speed(published.methods, *build_speed_dataset(study, frames, scenario, folder), study.seed)
    return {"speeds": [asdict(speed) for speed in speeds], "machine": machine}


def make_speed_experiment(
    published: PublishedSpeed,
    speeds: Mapping[str, Sequence[MethodSpeed]],
    *,
    machine: str,
    real: bool,
    absent: Sequence[str] = (),
    share: float = 1.0,
) -> PaperExperiment:
    """Make the experiment of measured speeds: database -> methods; `share` is that of the paper's frames."""
    claims = [_frame_rate_claim(published, speeds, method) for method in published.paper_methods]
    if published.latency_ms is not None:
        claims += [
            _latency_claim(published, published.latency_ms, speeds, method) for method in published.paper_methods
        ]
    return PaperExperiment(
        name="speed",
        title="Frame rate and latency",
        question=f"{published.statement} How fast are its methods here, with databases as large?",
        differences=(
            _REAL_NOTE if real else _SYNTHETIC_NOTE,
            *((f"Quick form: databases of {share:.0%} of these frames.",) if share < 1.0 else ()),
            f"Another machine: {machine}. An absolute speed depends on the machine as much as on the method. The table "
            f"therefore also gives the speed relative to `{REFERENCE_METHOD}`, measured in the same turns.",
            "It is not known what the published figures include (device, line, drawing). Here only the step of the "
            "method is timed. `harness bench wire` measures the whole path from a device over a line to the estimate.",
        ),
        claims=tuple(claims),
        tables=(_speed_table(speeds),),
        figures=(_speed_bars(published, speeds),),
        notes=(
            f"Held-out takes last at most {MAX_TEST_S:g} s. The first second of each is left out. Its first frame is "
            "listed separately, because a session has no history yet. Errors are mean joint angles with noise preset "
            "clean.",
            *(f"Not measured: {reason}" for reason in absent),
        ),
    )


def _frame_rate_claim(
    published: PublishedSpeed, speeds: Mapping[str, Sequence[MethodSpeed]], method: str
) -> BenchmarkStatement:
    text = f"{method} runs at {published.fps:g} frames/s or more with the slowest of the databases of the paper's size"
    stated, unit = f"{published.fps:g} frames/s", "frames/s"
    by_database = _speeds_of_method(speeds, method)
    if not by_database:
        return BenchmarkStatement(
            text, stated, "not measured", "not run", "the library has no such motion", unit=unit, kind="speed"
        )
    database, slowest = min(by_database.items(), key=lambda item: item[1].fps)
    small = _undersized_databases(published, by_database)
    return BenchmarkStatement(
        text=text,
        target=stated,
        measured=f"{slowest.fps:,.0f} frames/s ({database}, {slowest.frames:,} frames)",
        verdict="not comparable" if small else "reproduced" if slowest.fps >= published.fps else "not reproduced",
        why=small or ("" if slowest.fps >= published.fps else "another machine and other code"),
        value=slowest.fps,
        unit=unit,
        kind="speed",
    )


def _latency_claim(
    published: PublishedSpeed, latency_ms: float, speeds: Mapping[str, Sequence[MethodSpeed]], method: str
) -> BenchmarkStatement:
    text = f"99 % of the steps of {method} take at most the published latency, with the slowest database"
    stated = f"{latency_ms:g} ms"
    by_database = _speeds_of_method(speeds, method)
    if not by_database:
        return BenchmarkStatement(
            text, stated, "not measured", "not run", "the library has no such motion", unit="ms", kind="speed"
        )
    database, slowest = max(by_database.items(), key=lambda item: item[1].p99_ms)
    small = _undersized_databases(published, by_database)
    return BenchmarkStatement(
        text=text,
        target=stated,
        measured=f"p99 {slowest.p99_ms:.2f} ms, p50 {slowest.p50_ms:.2f} ms ({database}, {slowest.frames:,} frames)",
        verdict="not comparable",
        why=small or "the paper's latency is that of its whole system; here a step of the method is timed",
        value=slowest.p99_ms,
        unit="ms",
        kind="speed",
    )


def _speeds_of_method(speeds: Mapping[str, Sequence[MethodSpeed]], method: str) -> dict[str, MethodSpeed]:
    """Database -> speed of one method."""
    return {database: speed for database, rows in speeds.items() for speed in rows if speed.method == method}


def _undersized_databases(published: PublishedSpeed, by_database: Mapping[str, MethodSpeed]) -> str:
    """Name the databases that have fewer frames than the paper's; "" where there is none."""
    wanted = {database: sum(published.databases[database].values()) for database in by_database}
    short = [f"{d} {by_database[d].frames:,} of {n:,}" for d, n in wanted.items() if by_database[d].frames < n]
    return f"fewer frames than the paper: {', '.join(short)}" if short else ""


def _speed_table(speeds: Mapping[str, Sequence[MethodSpeed]]) -> FindingsTable:
    times = "frames/s", "p50 [ms]", "p99 [ms]", "first [ms]", "ready [s]", f"times {REFERENCE_METHOD}"
    table = [
        (
            database,
            f"{p.frames:,}",
            p.method,
            f"{p.fps:,.0f}",
            *(f"{ms:.2f}" for ms in (p.p50_ms, p.p99_ms, p.first_ms)),
            f"{p.ready_s:.1f}",
            f"{p.ratios[REFERENCE_METHOD]:.2f}",
            f"{p.error_deg:.2f}",
        )
        for database, rows in speeds.items()
        for p in rows
    ]
    return FindingsTable("Speed", ("database", "frames", "method", *times, "error [deg]"), tuple(table))


def _speed_bars(published: PublishedSpeed, speeds: Mapping[str, Sequence[MethodSpeed]]) -> BarChart:
    rates: dict[str, tuple[float | None, ...]] = {
        method: tuple(speed.fps for speed in _speeds_of_method(speeds, method).values()) for method in published.methods
    }
    return BarChart(
        title="Frames per second",
        unit="frames/s",
        groups=tuple(f"{database}, {rows[0].frames:,}" for database, rows in speeds.items()),
        series=rates,
        published={method: (published.fps,) * len(speeds) for method in published.paper_methods},
        caption="1 / mean step after the first second. A group is a database with its number of frames.",
    )
