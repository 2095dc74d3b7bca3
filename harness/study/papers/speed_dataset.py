"""Databases of so many frames, and takes that are not in them: of the built-in performer, or of a library.

The setting is that of the accuracy tables at level `clean` (`harness.experiment.benchmark_clips`). A database is built once, in a folder of
the study's, and opened again by whoever goes on.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from harness.core.files import content_key
from harness.core.motion import Take
from harness.core.split import Part
from harness.experiment import benchmark_clips
from harness.experiment.benchmark_clips import Trial
from harness.experiment.cells import source_of
from harness.experiment.clip_evaluation import Setting
from harness.experiment.scenario import Scenario
from harness.mocap.library import MotionLibrary
from harness.reconstruct.database import MotionDatabase
from harness.results import manifest
from harness.study.papers.paper_study import Study

SECONDS = 12.0
"""Of each held-out take, at most."""


@dataclass(frozen=True, eq=False)
class Gathered:
    """What to learn from, and what to follow."""

    learnt: MotionDatabase
    shown: list[Trial]


def lacking(study: Study, frames: Mapping[str, int]) -> str:
    """Why there is no database of these behaviours, or ""; the built-in performer shows them all."""
    if study.library is None:
        return ""
    source, test = source_of(benchmark_clips.scenario().motion, study.library, study.seed), judged(study)
    names = {
        behaviour: [name for name in source.names() if source.behaviour(name) == behaviour] for behaviour in frames
    }
    if any(set(names[behaviour]) & test.get(behaviour, set()) and len(names[behaviour]) > 1 for behaviour in frames):
        return ""
    return f"the library lacks one clip to follow and another to learn from of {', '.join(frames)}"


def gathered(study: Study, frames: Mapping[str, int], worn: Scenario, folder: Path) -> Gathered:
    """So many frames of each behaviour, and a held-out take of each, as the stations of `worn` read it.

    On real motion as many as there are, of clips of every kind where several behaviours are asked for together. Not
    of what is `lacking`.
    """
    if study.library is None:
        makers = [
            take
            for behaviour, count in frames.items()
            for take in benchmark_clips.makers(count, study.seed, [behaviour])
        ]
        takes = [benchmark_clips.held_out(1, study.seed, SECONDS, [behaviour])[0] for behaviour in frames]
        learnt = built(folder, {"seed": study.seed, "frames": frames}, lambda: makers)
        return Gathered(learnt, benchmark_clips.trials_of(takes, study.seed, worn))
    settings, wanted = _settings(study, study.library, frames, worn), sum(frames.values())
    files = {entry.name: _digest(entry.path) for entry in MotionLibrary(study.library).entries()}
    content = {"files": files, "examples": settings[0].scenario.motion.examples, "frames": wanted}
    learnt = built(folder, content, lambda: first_frames(settings[0].examples, wanted))
    return Gathered(learnt, [_trial(setting) for setting in settings])


def built(folder: Path, defined_by: object, takes: Callable[[], Iterable[Take | Callable[[], Take]]]) -> MotionDatabase:
    """The database of takes on the common body, in a folder below this one that is named after what defines it."""
    own = folder / content_key({"source": manifest.source_hash(), "defined_by": defined_by})
    if own.is_dir():
        return MotionDatabase.open(own)
    return MotionDatabase.build(benchmark_clips.body(), takes(), folder=own)


def first_frames(takes: Iterable[Take], count: int) -> Iterator[Take]:
    """Takes up to so many frames together; the last is cut."""
    for take in takes:
        if count <= 0:
            return
        yield replace(take, qpos=take.qpos[:count])
        count -= len(take)


def judged(study: Study) -> dict[str, set[str]]:
    """Behaviour -> clips that runs of the study judge."""
    found: dict[str, set[str]] = {}
    for scenario in study.runs.values():
        motion = scenario.motion
        shown = motion.behaviours * (len(motion.test) if len(motion.behaviours) == 1 else 1)
        for text, behaviour in zip(motion.test, shown, strict=True):
            found.setdefault(behaviour, set()).add(Part.parse(text).clip)
    return found


def _settings(study: Study, library: Path, frames: Mapping[str, int], worn: Scenario) -> list[Setting]:
    """Of the longest judged clip of each behaviour; none of these is an example."""
    tables = benchmark_clips.scenario().motion
    source = source_of(tables, library, study.seed)
    longest = {
        behaviour: max(sorted(clips), key=lambda clip: source.load(clip).duration_s)
        for behaviour, clips in judged(study).items()
        if behaviour in frames
    }
    others = [name for name in source.names() if name not in longest.values()]
    examples = tuple(name for name in others if len(frames) > 1 or source.behaviour(name) in frames)
    motion = replace(tables, examples=examples, withheld=(), database="all", longest_s=SECONDS)
    found = []
    for behaviour, clip in longest.items():
        shown = replace(worn, seed=study.seed, motion=replace(motion, test=(clip,), behaviours=(behaviour,)))
        found.append(Setting(shown, source, Part(clip), behaviour))
    return found


def _trial(setting: Setting) -> Trial:
    seen = setting.simulation
    return Trial(setting.part.clip, seen, seen.truth_qpos[seen.frame_index])


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "blake2b").hexdigest()[:16]
