"""Fixtures: motions of a boxer and a walker, and stations at rest."""

from typing import Protocol

import numpy as np
import pytest

from harness.body import DEFAULT_MOUNTS, Body, Mount, retarget_to_own_body
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.mocap import synthetic
from harness.simulate.readings import SimulatedReadings

SIX = ("left_wrist", "right_wrist", "left_ankle", "right_ankle", "torso", "head")


class Still(Protocol):
    """Makes readings of stations at rest at random poses; their quaternions make products exact."""

    def __call__(self, duration_s: float, stations: int = 4, *, seed: int = 1) -> SimulatedReadings: ...


@pytest.fixture
def still() -> Still:
    def made(duration_s: float, stations: int = 4, *, seed: int = 1) -> SimulatedReadings:
        rng = generator(1, "still")
        time_s = np.repeat(np.arange(round(40.0 * duration_s))[:, None] / 40.0, stations, axis=1)
        places_m, turns = rng.uniform(0.5, 2.0, (stations, 3)), rng.choice([-0.5, 0.5], (stations, 4))
        return SimulatedReadings(
            seed=seed,
            take="still",
            stations=tuple(f"s{row}" for row in range(stations)),
            time_s=time_s,
            rate_hz=40.0,
            velocity_m_s=np.zeros((*time_s.shape, 3)),
            radius_m=np.full(stations, 0.05),
            tissue_m=np.full(stations, 0.02),
            force_m_s2=np.zeros((*time_s.shape, 3)),
            position_m=np.tile(places_m, (len(time_s), 1, 1)),
            turn=np.tile(turns, (len(time_s), 1, 1)),
            quality=np.ones(time_s.shape),
            device_s=time_s.copy(),
        )

    return made


def worn(*stations: str) -> list[Mount]:
    """Default mounts of these stations; the six standard ones by default."""
    return [DEFAULT_MOUNTS[station] for station in stations or SIX]


@pytest.fixture(scope="session")
def boxer() -> tuple[Body, BodyMotion]:
    """Twelve seconds of the built-in performer, on the performer's own body."""
    return retarget_to_own_body(synthetic.generate("boxing", "p1", 1, seed=1, duration_s=12.0))


@pytest.fixture(scope="session")
def walker() -> tuple[Body, BodyMotion]:
    """Five seconds of the built-in performer's walk, on the performer's own body."""
    return retarget_to_own_body(synthetic.generate("walking", "p1", 1, seed=1, duration_s=5.0))
