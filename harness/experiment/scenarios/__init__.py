"""Scenarios: read once, checked and expanded into frozen records."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.experiment.scenarios.fitted_unit import FITTED_PRESET as FITTED_PRESET
    from harness.experiment.scenarios.fitted_unit import read_fitted_unit as read_fitted_unit
    from harness.experiment.scenarios.motion_source import expand_clips as expand_clips
    from harness.experiment.scenarios.motion_source import open_scenario_motion as open_scenario_motion
    from harness.experiment.scenarios.scenario import SCHEMA as SCHEMA
    from harness.experiment.scenarios.scenario import CalibrationSettings as CalibrationSettings
    from harness.experiment.scenarios.scenario import Scenario as Scenario
    from harness.experiment.scenarios.scenario import Station as Station
    from harness.experiment.scenarios.scenario import dotted_keys as dotted_keys
    from harness.experiment.scenarios.scenario_checks import check_scenario as check_scenario
    from harness.experiment.scenarios.scenario_motion import ScenarioMotion as ScenarioMotion
    from harness.experiment.scenarios.scenario_reader import find_config as find_config
    from harness.experiment.scenarios.scenario_reader import find_scenario as find_scenario
    from harness.experiment.scenarios.scenario_reader import load_scenario as load_scenario
    from harness.experiment.scenarios.scenario_reader import read_station_sets as read_station_sets
    from harness.experiment.scenarios.scenario_reader import shipped_scenarios as shipped_scenarios
    from harness.experiment.scenarios.sweep_config import Sweep as Sweep
    from harness.experiment.scenarios.sweep_config import expand_sweep as expand_sweep
    from harness.experiment.scenarios.sweep_config import load_sweep as load_sweep
    from harness.experiment.scenarios.sweep_config import shipped_sweeps as shipped_sweeps
else:
    __getattr__, __dir__ = lazy_names(__name__)
