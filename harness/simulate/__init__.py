"""A body motion as the stream of a tracker: readings, error components, clock and line."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.simulate.calibration_motion import hold_poses as hold_poses
    from harness.simulate.calibration_motion import hold_times_s as hold_times_s
    from harness.simulate.components.faults import LostStation as LostStation
    from harness.simulate.components.mount import perturb_mounts as perturb_mounts
    from harness.simulate.components.soft_tissue import SoftTissueArtefact as SoftTissueArtefact
    from harness.simulate.components.stationary import Clock as Clock
    from harness.simulate.components.stationary import DriftNoise as DriftNoise
    from harness.simulate.components.stationary import SessionBias as SessionBias
    from harness.simulate.components.stationary import SpeedError as SpeedError
    from harness.simulate.components.stationary import WhiteNoise as WhiteNoise
    from harness.simulate.components.stationary import gauss_markov as gauss_markov
    from harness.simulate.components.transient import Dropout as Dropout
    from harness.simulate.components.transient import Echo as Echo
    from harness.simulate.components.transient import Excursion as Excursion
    from harness.simulate.disturbance import Disturbance as Disturbance
    from harness.simulate.link import TrackerConfig as TrackerConfig
    from harness.simulate.link import transmit as transmit
    from harness.simulate.loop import loop_motion as loop_motion
    from harness.simulate.loop import simulate_loop as simulate_loop
    from harness.simulate.noise import STATISTICAL_COMPONENTS as STATISTICAL_COMPONENTS
    from harness.simulate.noise import Noise as Noise
    from harness.simulate.noise import noise_preset as noise_preset
    from harness.simulate.readings import GRAVITY_M_S2 as GRAVITY_M_S2
    from harness.simulate.readings import FilterReadings as FilterReadings
    from harness.simulate.readings import SimulatedReadings as SimulatedReadings
    from harness.simulate.simulation import WORLD_FROM_TRACKER as WORLD_FROM_TRACKER
    from harness.simulate.simulation import Simulation as Simulation
    from harness.simulate.simulation import exact_calibration as exact_calibration
    from harness.simulate.simulation import sampling_times_s as sampling_times_s
    from harness.simulate.simulation import simulate_readings as simulate_readings
    from harness.simulate.simulation import simulate_tracker as simulate_tracker
    from harness.simulate.simulation import transmit_readings as transmit_readings
    from harness.simulate.trajectory import Trajectory as Trajectory
else:
    __getattr__, __dir__ = lazy_names(__name__)
