"""Every shipped scenario can still be planned: its values are within their ranges, and no clip is its own example."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import pytest

from harness.core.files import read_toml
from harness.core.motion import Clip
from harness.core.package_data import data_folder
from harness.core.split import ClipPart
from harness.experiment import clip_evaluation
from harness.experiment.clip_evaluation import Subject
from harness.experiment.plan import check_names
from harness.experiment.scenarios.motion_source import expand_clips
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.experiment.tasks import plan_tasks
from harness.mocap import MotionSource, SharedMotion, find_shared_motion, open_motion_source

FOLDER = data_folder("scenarios")
SCENARIOS = [
    path.relative_to(FOLDER).as_posix()
    for path in sorted(FOLDER.rglob("*.toml"))
    if "motion" in read_toml(path, "a scenario", "") and path.parent.name != "placement"
]


_COMPARED: set[tuple[object, ...]] = set()
"""What other scenarios have compared already: they share test clips and examples."""


def library_of(name: str, request: pytest.FixtureRequest) -> Path | None:
    """The library that a scenario needs."""
    source = read_toml(FOLDER / name, "a scenario", "")["motion"]["source"]
    return request.getfixturevalue("mocap") if source == "cmu" else None


@cache
def open_source(kind: str, folder: Path | None, seed: int, rate_hz: float | None) -> MotionSource:
    """Scenarios on the same motion get the same clips."""
    return open_motion_source(kind, folder, seed=seed, rate_hz=rate_hz)


@cache
def find_in_clips(first: Clip, second: Clip) -> SharedMotion | None:
    return find_shared_motion(first, [range(len(first))], second, [range(len(second))])


def find_once(
    first: Clip, first_runs: Sequence[range], second: Clip, second_runs: Sequence[range]
) -> SharedMotion | None:
    """Clips that share nothing share nothing in any runs: they are compared once for all scenarios."""
    if first is not second and find_in_clips(first, second) is None:
        return None
    return find_shared_motion(first, first_runs, second, second_runs)


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_shipped_scenario_is_planned(name: str, request: pytest.FixtureRequest) -> None:
    folder = library_of(name, request)
    scenario = expand_clips(load_scenario(FOLDER / name), folder)
    check_names([scenario], folder)
    assert plan_tasks([scenario], folder, "", 1)


@pytest.mark.long
@pytest.mark.parametrize("name", SCENARIOS)
def test_no_shipped_scenario_is_refused_for_a_copy(
    name: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clip_evaluation, "find_shared_motion", find_once)
    folder = library_of(name, request)
    scenario = expand_clips(load_scenario(FOLDER / name), folder)
    motion = scenario.motion
    source = open_source(motion.source, folder, scenario.seed, motion.rate_hz or None)
    for clip, behaviour in motion.tested:
        subject = Subject(motion, scenario.seed, scenario.tracker.rate_hz, source, ClipPart.parse(clip), behaviour)
        asked = clip, motion.split, source, subject.held_out_parts, tuple(subject.example_names)
        if asked not in _COMPARED:
            _COMPARED.add(asked)
            assert len(subject.example_clips) == len(subject.example_names)
