"""Rows of `harness bench physics --truth` on `hall`: a station at rest, and performers who walk."""

from collections.abc import Iterator, Sequence

import numpy as np

from harness.bench.limits import state_verdict
from harness.bench.physics.scenes import HEIGHT_M, ORIGIN_M, measure_free_station, resting_source, simulate_performer
from harness.core.seeds import generator
from harness.results.findings import BenchmarkStatement
from harness.simulate import Noise
from harness.simulate.physics import FACING_UP, ConstellationSettings, Physics

HALL = Physics(constellation=ConstellationSettings(name="hall"))
REST_S, WALK_S = 60.0, 10.0
SIDE_M = 5.0
"""Side of the square below the middle of the emitters in which stations rest [m]."""
RANGES = 12
"""Ranges of a cycle: two microphones, six emitters (docs/is900.md 7)."""
MOVING_M, LARGEST_M = 0.03, 0.10
"""Largest error of a moving station by Gilson et al. 2006, and an error that must not occur [m]."""


def hall_rows(seeds: Sequence[int]) -> Iterator[BenchmarkStatement]:
    """The rows, each over all seeds."""
    yield from rest_rows(seeds)
    yield from walking_rows(seeds)


def rest_rows(seeds: Sequence[int]) -> list[BenchmarkStatement]:
    """Ranges and spread of a station that rests below `hall`, at another place for each seed."""
    ranges, spread_m = np.array([_rest(seed) for seed in seeds]).T
    spread_mm = 1e3 * spread_m
    counted, middle = float(np.median(ranges)), float(np.median(spread_mm))
    return [
        state_verdict(
            "static in `hall`: ranges of a cycle",
            f"median {RANGES - 0.5:g} or more",
            f"median {counted:.1f}, {ranges.min():.1f} to {ranges.max():.1f}",
            counted >= RANGES - 0.5,
            "up to 12 (docs/is900.md 7)",
            f"one station at rest for {REST_S:.0f} s at {HEIGHT_M:g} m, anywhere in {SIDE_M:g} m by {SIDE_M:g} m",
        ),
        state_verdict(
            "the same: spread of 3-D position",
            "1.0 to 2.0 mm",
            f"median {middle:.2f} mm, {spread_mm.min():.2f} to {spread_mm.max():.2f} mm",
            bool(1.0 <= middle <= 2.0),
            "about 1.5 mm (Gilson et al. 2006)",
        ),
    ]


def walking_rows(seeds: Sequence[int]) -> list[BenchmarkStatement]:
    """Errors of six stations on performers who walk below `hall`."""
    pairs = [simulate_performer("walking", seed, WALK_S, Noise(physics=HALL)) for seed in seeds]
    tracked = np.concatenate([found.quality for found, _ in pairs]) > 0.0
    error_m = np.concatenate([found.position_m - true.position_m for found, true in pairs])
    size_m = np.sqrt(np.sum(error_m[tracked] ** 2, axis=1))
    beyond, largest_mm = float(np.mean(size_m > MOVING_M)), 1e3 * float(size_m.max())
    return [
        state_verdict(
            "walking in `hall`: errors beyond 3 cm",
            "at most 1 % of the tracked readings",
            f"{beyond:.2%}; median error {1e3 * np.median(size_m):.1f} mm, lost for {1.0 - np.mean(tracked):.1%}",
            beyond <= 0.01,
            "up to 3 cm for several seconds, now and then (Gilson et al. 2006)",
            f"{len(seeds)} performers, six stations, {WALK_S:.0f} s",
        ),
        state_verdict(
            "the same: error while the quality is above 0",
            "none above 10 cm",
            f"at most {largest_mm:.0f} mm",
            largest_mm <= 1e3 * LARGEST_M,
        ),
    ]


def _rest(seed: int) -> tuple[float, float]:
    """Mean number of ranges in a cycle, and standard deviation of the 3-D position [m], of a station at rest."""
    x, y = SIDE_M * (generator(seed, "physics", "hall", "place").random(2) - 0.5)
    source = resting_source(np.array([x, y, ORIGIN_M[2] - HEIGHT_M]), FACING_UP, REST_S, HALL)
    _, found = measure_free_station(source, REST_S, HALL, seed)
    spread_m = np.sqrt(np.sum(np.var(found.position_m[found.quality > 0.0], axis=0)))
    return float(np.mean(found.ranges_received)), float(spread_m)
