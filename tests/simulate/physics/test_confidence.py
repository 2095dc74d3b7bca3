"""The filter's quality over seeded scenarios with wrong assumptions: no confident error of a metre for a second."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.simulate.physics.fusion import Fusion
from harness.simulate.physics.inertial import Inertial
from tests.simulate.physics.free_station import EMITTER_M, TICK_HZ, FreeStation, free_station, new_filter, noisy, run

SECONDS, RECORD_TICKS, SCENARIOS = 12.0, 10, 1000
KINDS = ("temperature", "survey", "two exchanged", "four exchanged", "all exchanged", "shadow", "echoes")


def scenario(seed: int) -> tuple[FreeStation, Floats, Floats]:
    """The truth, the measured ranges and the emitters that the filter is told, for a kind of fault."""
    rng, kind = generator(seed, "confidence"), KINDS[seed % len(KINDS)]
    station = free_station(SECONDS, seed, speed=float(rng.choice([0.0, 1.0, 2.0, 3.0])))
    measured, _ = noisy(station, seed, Inertial())
    emitters, heard = EMITTER_M.copy(), measured.range_m.copy()
    if kind == "temperature":
        heard *= 1.0 + 0.0017 * rng.uniform(-20.0, 20.0)
    elif kind == "survey":
        emitters += rng.normal(0.0, rng.choice([0.01, 0.05, 0.2, 1.0]), emitters.shape)
    elif kind.endswith("exchanged"):
        some = rng.choice(9, {"two": 2, "four": 4, "all": 9}[kind.split()[0]], replace=False)
        emitters[some] = emitters[np.roll(some, 1)]
    else:
        slots = np.arange(len(heard))
        for _ in range(6):
            begin, length = rng.integers(0, len(heard)), rng.integers(8, 240)
            covered = np.isin(slots % 9, rng.choice(9, rng.integers(3, 9), replace=False))
            covered &= (slots >= begin) & (slots < begin + length)
            longer = rng.uniform(0.02, 1.0, 9)[slots % 9] if kind == "echoes" else np.full(len(slots), np.nan)
            heard[covered] += longer[covered, None]
    heard[rng.random(heard.shape) < rng.choice([0.0, 0.3, 0.6])] = np.nan
    return replace(measured, range_m=heard), station.position_m, emitters


def longest_error_s(seed: int) -> float:
    """Longest time in which the quality is above 0 and the error above 1 m [s]."""
    measured, position_m, emitters = scenario(seed)
    outputs = run(new_filter(fusion=Fusion(), emitter_m=emitters), measured, ticks=RECORD_TICKS)
    assert np.isfinite(outputs.position_m).all()
    assert np.abs(outputs.position_m).max() < 50.0
    error = np.linalg.norm(outputs.position_m[:, 0, 0] - position_m[outputs.tick[:, 0]], axis=1)
    longest = current = 0
    for wrong in (outputs.report[:, 0, 0] > 0.0) & (error > 1.0):
        current = current + 1 if wrong else 0
        longest = max(longest, current)
    return longest * RECORD_TICKS / TICK_HZ


@pytest.mark.parametrize("seed", range(2 * len(KINDS)))
def test_no_confident_error(seed: int) -> None:
    assert longest_error_s(seed) < 1.0


@pytest.mark.slow
def test_no_confident_error_in_a_thousand_scenarios() -> None:
    assert not [seed for seed in range(SCENARIOS) if longest_error_s(seed) >= 1.0]
