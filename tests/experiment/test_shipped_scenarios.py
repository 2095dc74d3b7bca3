"""Every shipped scenario can still be planned: its values are within their ranges, and no clip is its own example."""

from pathlib import Path

import pytest

from harness.core.files import read_toml
from harness.core.package_data import data_folder
from harness.core.split import ClipPart
from harness.experiment.cells import check_names, open_scenario_motion
from harness.experiment.clip_evaluation import Subject
from harness.experiment.planning import plan_tasks
from harness.experiment.scenario import expand_clips, load_scenario

FOLDER = data_folder("scenarios")
SCENARIOS = [
    path.relative_to(FOLDER).as_posix()
    for path in sorted(FOLDER.rglob("*.toml"))
    if "motion" in read_toml(path, "a scenario", "") and path.parent.name != "placement"
]


def library_of(name: str, request: pytest.FixtureRequest) -> Path | None:
    """The library that a scenario needs."""
    source = read_toml(FOLDER / name, "a scenario", "")["motion"]["source"]
    return request.getfixturevalue("mocap") if source == "cmu" else None


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_shipped_scenario_is_planned(name: str, request: pytest.FixtureRequest) -> None:
    folder = library_of(name, request)
    scenario = expand_clips(load_scenario(FOLDER / name), folder)
    check_names([scenario], folder)
    assert plan_tasks([scenario], folder, "", 1)


@pytest.mark.long
@pytest.mark.parametrize("name", SCENARIOS)
def test_no_shipped_scenario_is_refused_for_a_copy(name: str, request: pytest.FixtureRequest) -> None:
    folder = library_of(name, request)
    scenario = expand_clips(load_scenario(FOLDER / name), folder)
    motion, source = scenario.motion, open_scenario_motion(scenario.motion, folder, scenario.seed)
    parts = [ClipPart.parse(text) for text in motion.test]
    behaviours = motion.behaviours * (1 if len(motion.behaviours) > 1 else len(parts))
    for part, behaviour in zip(parts, behaviours, strict=True):
        subject = Subject(motion, scenario.seed, scenario.tracker.rate_hz, source, part, behaviour)
        assert len(subject.example_clips) == len(subject.example_names)
