"""Simulation of one clip without a run."""

from pathlib import Path

from harness.body import retarget_to_own_body
from harness.core.motion import Clip
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.simulate import Simulation, simulate_tracker


def simulate_clip(clip: Clip, scenario: Scenario | Path | str = "demo") -> Simulation:
    """Simulate what a tracker reports while a clip is performed, on the performer's own body.

    Stations, tracker, noise and seed are the scenario's (a file, or the name of a shipped one). Returns frames as a
    driver would deliver them, and the truth beside them. Raises BadInput for a clip shorter than one frame, and for a
    skeleton that is not the humanoid of `harness.body`.
    """
    scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    body, motion = retarget_to_own_body(clip)
    return simulate_tracker(
        body, motion, scenario.nominal_mounts, scenario.device, scenario.noise_model, seed=scenario.seed
    )
