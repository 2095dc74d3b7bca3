"""Databases of so many frames, and takes that are not in them: of the built-in performer, or of a library.

The setting is that of the accuracy tables at level `clean` (`harness.experiment.benchmark_clips`). A database is built once, in a folder of
the study's, and opened again by whoever goes on.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from harness.core.files import content_key
from harness.core.motion import BodyMotion
from harness.core.split import ClipPart
from harness.experiment import benchmark_clips
from harness.experiment.benchmark_clips import BenchmarkClip
from harness.experiment.cells import open_scenario_motion
from harness.experiment.clip_evaluation import ClipEvaluation
from harness.experiment.scenario import Scenario
from harness.mocap.library import MotionLibrary
from harness.reconstruct.database import MotionDatabase
from harness.results import manifest
from harness.study.papers.paper_study import PaperStudy

MAX_TEST_S = 12.0
"""Of each held-out take, at most."""


@dataclass(frozen=True, eq=False)
class SpeedDataset:
    """What to learn from, and what to follow."""

    database: MotionDatabase
    test_clips: list[BenchmarkClip]


def missing_clips(study: PaperStudy, frames: Mapping[str, int]) -> str:
    """Why there is no database of these behaviours, or ""; the built-in performer shows them all."""
    if study.library is None:
        return ""
    source, test = (
        open_scenario_motion(benchmark_clips.load_clean_scenario().motion, study.library, study.seed),
        list_test_clips(study),
    )
    names = {
        behaviour: [name for name in source.names() if source.behaviour(name) == behaviour] for behaviour in frames
    }
    if any(set(names[behaviour]) & test.get(behaviour, set()) and len(names[behaviour]) > 1 for behaviour in frames):
        return ""
    return f"the library lacks one clip to follow and another to learn from of {', '.join(frames)}"


def build_speed_dataset(study: PaperStudy, frames: Mapping[str, int], worn: Scenario, folder: Path) -> SpeedDataset:
    """So many frames of each behaviour, and a held-out take of each, as the stations of `worn` read it.

    On real motion as many as there are, of clips of every kind where several behaviours are asked for together. Not
    of what is `missing_clips`.
    """
    if study.library is None:
        makers = [
            take
            for behaviour, count in frames.items()
            for take in benchmark_clips.make_take_factories(count, study.seed, [behaviour])
        ]
        takes = [
            benchmark_clips.generate_held_out_takes(1, study.seed, MAX_TEST_S, [behaviour])[0] for behaviour in frames
        ]
        learnt = build_database(folder, {"seed": study.seed, "frames": frames}, lambda: makers)
        return SpeedDataset(learnt, benchmark_clips.simulate_clips(takes, study.seed, worn))
    settings, wanted = _test_clip_settings(study, study.library, frames, worn), sum(frames.values())
    files = {entry.name: _digest(entry.path) for entry in MotionLibrary(study.library).entries()}
    content = {"files": files, "examples": settings[0].scenario.motion.examples, "frames": wanted}
    learnt = build_database(folder, content, lambda: truncate_motions(settings[0].training.examples, wanted))
    return SpeedDataset(learnt, [_benchmark_clip(setting) for setting in settings])


def build_database(
    folder: Path, defined_by: object, takes: Callable[[], Iterable[BodyMotion | Callable[[], BodyMotion]]]
) -> MotionDatabase:
    """The database of takes on the common body, in a folder below this one that is named after what defines it."""
    own = folder / content_key({"source": manifest.source_hash(), "defined_by": defined_by})
    if own.is_dir():
        return MotionDatabase.open(own)
    return MotionDatabase.build(benchmark_clips.build_common_body(), takes(), folder=own)


def truncate_motions(takes: Iterable[BodyMotion], count: int) -> Iterator[BodyMotion]:
    """Takes up to so many frames together; the last is cut."""
    for take in takes:
        if count <= 0:
            return
        yield replace(take, qpos=take.qpos[:count])
        count -= len(take)


def list_test_clips(study: PaperStudy) -> dict[str, set[str]]:
    """Behaviour -> clips that runs of the study judge."""
    found: dict[str, set[str]] = {}
    for scenario in study.runs.values():
        motion = scenario.motion
        shown = motion.behaviours * (len(motion.test) if len(motion.behaviours) == 1 else 1)
        for text, behaviour in zip(motion.test, shown, strict=True):
            found.setdefault(behaviour, set()).add(ClipPart.parse(text).clip)
    return found


def _test_clip_settings(
    study: PaperStudy, library: Path, frames: Mapping[str, int], worn: Scenario
) -> list[ClipEvaluation]:
    """Of the longest judged clip of each behaviour; none of these is an example."""
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
    found = []
    for behaviour, clip in longest.items():
        shown = replace(worn, seed=study.seed, motion=replace(motion, test=(clip,), behaviours=(behaviour,)))
        found.append(ClipEvaluation(shown, source, ClipPart(clip), behaviour))
    return found


def _benchmark_clip(setting: ClipEvaluation) -> BenchmarkClip:
    seen = setting.simulation
    return BenchmarkClip(setting.part.clip, seen, seen.truth_qpos[seen.frame_index])


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "blake2b").hexdigest()[:16]
