"""The speed that a paper states, beside that of the same methods here with databases as large.

What the papers state was measured on machines of their own, and what it includes they do not say.
"""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from harness.experiment import benchmark_clips
from harness.results.findings import BarChart, Claim, FindingsTable, PaperExperiment
from harness.study.papers.method_speed import REFERENCE_METHOD, MethodSpeed, measure_speed, processor_name
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.speed_dataset import MAX_TEST_S, build_speed_dataset, missing_clips

_REAL_NOTE = (
    "Clips of the library, as many frames as there are. The longest judged clip of each behaviour is followed, and not "
    "learnt from; what is all together has clips of every kind."
)
_SYNTHETIC_NOTE = (
    "Takes of the built-in performer, exactly as many frames as the paper's; none of the takes that are followed."
)


@dataclass(frozen=True)
class PublishedSpeed:
    """What a paper says of its speed, and on what."""

    statement: str
    """In words."""
    scenario: str
    """Whose stations are worn."""
    databases: Mapping[str, Mapping[str, int]]
    """Name -> behaviour -> frames."""
    methods: tuple[str, ...]
    paper_methods: tuple[str, ...]
    """Those that stand for the paper's own."""
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
    """Each database in turn, measured once and kept."""
    folder, found, absent = study.out / "measured" / "databases", dict[str, list[MethodSpeed]](), []
    for database, frames in published.databases.items():
        kept = study.cached_measurement(
            f"speed_{database}".replace(" ", "_"), partial(_measure, study, published, frames, folder)
        )
        if "absent" in kept:
            absent.append(f"{database}: {kept['absent']}")
        else:
            found[database] = [MethodSpeed(**row) for row in kept["paces"]]
    shutil.rmtree(folder, ignore_errors=True)  # measured now
    return make_speed_experiment(published, found, on=kept["machine"], real=study.library is not None, absent=absent)


def _measure(study: PaperStudy, published: PublishedSpeed, frames: Mapping[str, int], folder: Path) -> dict[str, Any]:
    """For the study to keep: paces, or why there are none."""
    if absent := missing_clips(study, frames):
        return {"absent": absent, "machine": processor_name()}
    motion = build_speed_dataset(study, frames, benchmark_clips.load_clean_scenario(published.scenario), folder)
    return {
        "paces": [asdict(pace) for pace in measure_speed(published.methods, motion, study.seed)],
        "machine": processor_name(),
    }


def make_speed_experiment(
    published: PublishedSpeed,
    found: Mapping[str, Sequence[MethodSpeed]],
    *,
    on: str,
    real: bool,
    absent: Sequence[str] = (),
) -> PaperExperiment:
    """The experiment of what was measured: database -> paces."""
    claims = [_frame_rate_claim(published, found, own) for own in published.paper_methods]
    if published.latency_ms is not None:
        claims += [_latency_claim(published, published.latency_ms, found, own) for own in published.paper_methods]
    return PaperExperiment(
        name="speed",
        title="Frame rate and latency",
        question=f"{published.statement} How fast are its methods here, with databases as large?",
        differences=(
            _REAL_NOTE if real else _SYNTHETIC_NOTE,
            f"Another machine: {on}. An absolute speed says as much of it as of a method; beside each stands how "
            f"many times as fast as `{REFERENCE_METHOD}` it is in the same turns.",
            "What the published figures contain (device, line, drawing) is not known. Here it is the step of the "
            "method alone; `harness bench wire` measures the whole way from a device through a line to the answer.",
        ),
        claims=tuple(claims),
        tables=(_speed_table(found),),
        figures=(_speed_bars(published, found),),
        notes=(
            f"Held-out takes of {MAX_TEST_S:g} s or less; the first second of each is not counted, and its first frame "
            "stands apart: a session has no history yet. Errors are mean joint angles on clean trackers: what this "
            "speed buys.",
            *(f"Not measured, {why}" for why in absent),
        ),
    )


def _frame_rate_claim(published: PublishedSpeed, found: Mapping[str, Sequence[MethodSpeed]], own: str) -> Claim:
    text = f"{own} follows {published.fps:g} frames a second with databases of the paper's size, the slowest of them"
    said, unit = f"{published.fps:g} frames/s", "frames/s"
    paces = _speeds_of_method(found, own)
    if not paces:
        return Claim(text, said, "not measured", "not run", "there is no such motion", unit=unit)
    database, slowest = min(paces.items(), key=lambda pace: pace[1].fps)
    small = _undersized_databases(published, paces)
    return Claim(
        text=text,
        published=said,
        ours=f"{slowest.fps:,.0f} frames/s ({database}, {slowest.frames:,} frames)",
        verdict="not comparable" if small else "reproduced" if slowest.fps >= published.fps else "not reproduced",
        why=small or ("" if slowest.fps >= published.fps else "another machine, and other code"),
        difference=slowest.fps,
        unit=unit,
    )


def _latency_claim(
    published: PublishedSpeed, latency_ms: float, found: Mapping[str, Sequence[MethodSpeed]], own: str
) -> Claim:
    text = f"99 of 100 steps of {own} end within the published latency, with the slowest database"
    said = f"{latency_ms:g} ms"
    paces = _speeds_of_method(found, own)
    if not paces:
        return Claim(text, said, "not measured", "not run", "there is no such motion", unit="ms")
    database, slowest = max(paces.items(), key=lambda pace: pace[1].p99_ms)
    small, within = _undersized_databases(published, paces), slowest.p99_ms <= latency_ms
    return Claim(
        text=text,
        published=said,
        ours=f"p99 {slowest.p99_ms:.2f} ms, p50 {slowest.p50_ms:.2f} ms ({database}, {slowest.frames:,} frames)",
        verdict="not comparable" if small else "reproduced" if within else "not reproduced",
        why=small or ("" if within else "another machine, and other code"),
        difference=slowest.p99_ms,
        unit="ms",
    )


def _speeds_of_method(found: Mapping[str, Sequence[MethodSpeed]], method: str) -> dict[str, MethodSpeed]:
    """Database -> pace of a method."""
    return {database: pace for database, paces in found.items() for pace in paces if pace.method == method}


def _undersized_databases(published: PublishedSpeed, paces: Mapping[str, MethodSpeed]) -> str:
    """Which databases have fewer frames than the paper's, or ""."""
    wanted = {database: sum(published.databases[database].values()) for database in paces}
    short = [f"{d} {paces[d].frames:,} of {count:,}" for d, count in wanted.items() if paces[d].frames < count]
    return f"the library has fewer frames than the paper: {', '.join(short)}" if short else ""


def _speed_table(found: Mapping[str, Sequence[MethodSpeed]]) -> FindingsTable:
    times = "frames/s", "p50 [ms]", "p99 [ms]", "first [ms]", "ready [s]", f"times {REFERENCE_METHOD}"
    rows = [
        (
            database,
            f"{p.frames:,}",
            p.method,
            f"{p.fps:,.0f}",
            *(f"{ms:.2f}" for ms in (p.p50_ms, p.p99_ms, p.first_ms)),
            f"{p.ready_s:.1f}",
            f"{p.to_ik:.2f}",
            f"{p.error_deg:.2f}",
        )
        for database, paces in found.items()
        for p in paces
    ]
    return FindingsTable("Speed", ("database", "frames", "method", *times, "error [deg]"), tuple(rows))


def _speed_bars(published: PublishedSpeed, found: Mapping[str, Sequence[MethodSpeed]]) -> BarChart:
    rates: dict[str, tuple[float | None, ...]] = {
        method: tuple(pace.fps for pace in _speeds_of_method(found, method).values()) for method in published.methods
    }
    return BarChart(
        title="Frames a second",
        unit="frames/s",
        groups=tuple(f"{database}, {paces[0].frames:,}" for database, paces in found.items()),
        series=rates,
        published={own: (published.fps,) * len(found) for own in published.paper_methods},
        caption="1 / mean step, warm; groups are databases with their frames.",
    )
