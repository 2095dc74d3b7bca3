"""Scenarios: read once, checked and expanded into frozen records."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.experiment.scenarios.fitted_unit import FITTED_PRESET, read_fitted_unit
    from harness.experiment.scenarios.motion_source import expand_clips, open_scenario_motion
    from harness.experiment.scenarios.scenario import SCHEMA, CalibrationSettings, Scenario, Station, dotted_keys
    from harness.experiment.scenarios.scenario_checks import check_scenario
    from harness.experiment.scenarios.scenario_motion import ScenarioMotion
    from harness.experiment.scenarios.scenario_reader import (
        find_config,
        find_scenario,
        load_scenario,
        read_station_sets,
        shipped_scenarios,
    )
    from harness.experiment.scenarios.sweep_config import Sweep, expand_sweep, load_sweep, shipped_sweeps
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "FITTED_PRESET",
    "SCHEMA",
    "CalibrationSettings",
    "Scenario",
    "ScenarioMotion",
    "Station",
    "Sweep",
    "check_scenario",
    "dotted_keys",
    "expand_clips",
    "expand_sweep",
    "find_config",
    "find_scenario",
    "load_scenario",
    "load_sweep",
    "open_scenario_motion",
    "read_fitted_unit",
    "read_station_sets",
    "shipped_scenarios",
    "shipped_sweeps",
]
