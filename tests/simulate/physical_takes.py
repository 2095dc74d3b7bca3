"""Takes of the boxer under the physics of the tracker, for tests."""

from functools import cache
from typing import Any

import numpy as np

from harness.body import Body, retarget_to_own_body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.mocap import synthetic
from harness.simulate.link import TrackerConfig
from harness.simulate.noise import Noise
from harness.simulate.physics.settings import Physics
from harness.simulate.simulation import Simulation, simulate_tracker
from tests.simulate.conftest import SIX, worn

SEED, DURATION_S = 3, 3.0
TRACKER = TrackerConfig(slot_s=0.0033)


@cache
def performed(behaviour: str = "boxing", duration_s: float = DURATION_S) -> tuple[Body, BodyMotion]:
    """A take of the built-in performer on the performer's own body."""
    return retarget_to_own_body(synthetic.generate(behaviour, "p1", 1, seed=1, duration_s=duration_s))


def physical(preset: str = "clean", physics: Physics | None = None, **components: Any) -> Noise:
    """The physics under a preset, with more components."""
    return Noise(physics=(physics or Physics()).with_preset(preset), **components)


def observed(
    noise: Noise, stations: tuple[str, ...] = SIX, tracker: TrackerConfig = TRACKER, *, seed: int = SEED
) -> Simulation:
    """What the tracker reports of the boxer."""
    return simulate_tracker(*performed(), worn(*stations), tracker, noise, seed=seed)


def positions_m(simulation: Simulation) -> Floats:
    """(F, S, 3) reported positions; NaN where a station is lost."""
    return np.array([frame.position_m for frame in simulation.frames])


def errors(simulation: Simulation, true: Simulation) -> tuple[Floats, Floats]:
    """Distance [m] and angle [rad] (F, S) of reported poses from those of an ideal tracker; NaN where lost."""
    turned, truth = ([frame.tracker_from_station for frame in s.frames] for s in (simulation, true))
    off_m = np.linalg.norm(positions_m(simulation) - positions_m(true), axis=2)
    return off_m, rotations.angle_between_rad(np.array(turned), np.array(truth))
