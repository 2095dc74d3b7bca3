"""The motion that a scenario names: its source, opened once, and the clips that its patterns stand for."""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_checks import check_scenario
from harness.experiment.scenarios.scenario_motion import ScenarioMotion
from harness.mocap import LibraryFolders, MotionSource, open_motion_source


def open_scenario_motion(motion: ScenarioMotion, folder: LibraryFolders | None, seed: int) -> MotionSource:
    """The motion that a scenario names; BadInput when it needs a library and none is named."""
    return _open_once(motion.source, folder, seed, motion.rate_hz or None)


@lru_cache(maxsize=2)
def _open_once(kind: str, folder: LibraryFolders | None, seed: int, rate_hz: float | None) -> MotionSource:
    """One source for all clips of a run, which share examples."""
    return open_motion_source(kind, folder, seed=seed, rate_hz=rate_hz)


def forget_motion() -> None:
    """Close the sources that were opened: files may have changed since."""
    _open_once.cache_clear()


def expand_clips(scenario: Scenario, folder: LibraryFolders | None) -> Scenario:
    """The scenario with every pattern in its clip lists, such as "13_*", replaced by the clips that match it.

    Clips are the takes of the motion generator, or those of the library in `folder` (by default HARNESS_MOCAP). See
    `ScenarioMotion.match_clips`.
    """
    if not scenario.motion.has_patterns:
        return scenario
    source = open_scenario_motion(scenario.motion, folder, scenario.seed)
    expanded = replace(scenario, motion=scenario.motion.match_clips(source.names()))
    check_scenario(Path(scenario.name), expanded)
    return expanded
