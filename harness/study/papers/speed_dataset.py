"""Databases of the papers' sizes and held-out takes for the speed experiment: synthetic motion, or a library's.

The conditions are those of `harness.experiment.benchmark_clips`. A database is built once, in a folder of the study; a
resumed study opens it again.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from harness.core.files import content_key
from harness.core.motion import BodyMotion
from harness.core.split import ClipPart
from harness.experiment import benchmark_clips
from harness.experiment.benchmark_clips import BenchmarkClip
from harness.experiment.cells import open_scenario_motion
from harness.experiment.clip_evaluation import ClipEvaluation
from harness.experiment.scenario import Scenario
from harness.mocap.library import LibraryFolders, MotionLibrary
from harness.reconstruct.database import MotionDatabase
from harness.results import manifest
from harness.study.papers.paper_study import PaperStudy

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
    path = folder / content_key({"source": manifest.source_hash(), "defined_by": defined_by})
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
