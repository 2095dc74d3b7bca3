"""A body motion as the stream of a tracker: readings, error components, clock and line."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.simulate.calibration_motion import hold_poses, hold_times_s
    from harness.simulate.components.faults import LostStation
    from harness.simulate.components.mount import perturb_mounts
    from harness.simulate.components.soft_tissue import SoftTissueArtefact
    from harness.simulate.components.stationary import (
        Clock,
        DriftNoise,
        SessionBias,
        SpeedError,
        WhiteNoise,
        gauss_markov,
    )
    from harness.simulate.components.transient import Dropout, Echo, Excursion
    from harness.simulate.disturbance import Disturbance
    from harness.simulate.link import TrackerConfig, transmit
    from harness.simulate.loop import loop_motion, simulate_loop
    from harness.simulate.noise import STATISTICAL_COMPONENTS, Noise, noise_preset
    from harness.simulate.readings import GRAVITY_M_S2, FilterReadings, SimulatedReadings
    from harness.simulate.simulation import (
        WORLD_FROM_TRACKER,
        Simulation,
        exact_calibration,
        sampling_times_s,
        simulate_readings,
        simulate_tracker,
        transmit_readings,
    )
    from harness.simulate.trajectory import Trajectory
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "GRAVITY_M_S2",
    "STATISTICAL_COMPONENTS",
    "WORLD_FROM_TRACKER",
    "Clock",
    "Disturbance",
    "DriftNoise",
    "Dropout",
    "Echo",
    "Excursion",
    "FilterReadings",
    "LostStation",
    "Noise",
    "SessionBias",
    "SimulatedReadings",
    "Simulation",
    "SoftTissueArtefact",
    "SpeedError",
    "TrackerConfig",
    "Trajectory",
    "WhiteNoise",
    "exact_calibration",
    "gauss_markov",
    "hold_poses",
    "hold_times_s",
    "loop_motion",
    "noise_preset",
    "perturb_mounts",
    "sampling_times_s",
    "simulate_loop",
    "simulate_readings",
    "simulate_tracker",
    "transmit",
    "transmit_readings",
]
