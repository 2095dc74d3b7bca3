"""Coverage of the intervals that comparisons use, on simulated units with a known mean of the population.

Each world is a distribution of the differences of units. A study draws some units, and its interval contains the mean
of the population or not. Where clips are clusters, a unit is the mean of its clips. The reference in each row is the
interval of earlier versions on the same draws: the bias-corrected and accelerated bootstrap (Efron 1987) over clips,
with a level that is expanded for few clips (Hesterberg 2015).
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import special, stats

from harness.bench.limits import hold_to_limit
from harness.compare import CONFIDENCE_LEVEL, SIGNIFICANCE, mean_interval, sign_flip_p
from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.results.findings import BenchmarkStatement

UNITS = (6, 8, 12, 15, 24, 32)
STUDIES = 400
ENOUGH = 12
"""Number of units from which on the targets hold."""
EQUIVALENCE_LEVEL = 0.05
_CORRELATION = 0.8
"""Correlation of the clips of one unit."""
_FEW = 0.2
"""Share of units that differ where few do."""


@dataclass(frozen=True)
class World:
    """A distribution of differences."""

    name: str
    draw: Callable[[np.random.Generator, int], Floats]
    """Draws (units, clips) differences."""
    mean: float
    differing: float = 1.0
    """Share of units that differ at all. A study in which none does has an interval of no width."""

    def bound(self, units: int) -> float:
        """The greatest coverage that samples of this size allow."""
        return 1.0 - (1.0 - self.differing) ** units


def _clusters(size: int) -> Callable[[np.random.Generator, int], Floats]:
    def draw(rng: np.random.Generator, units: int) -> Floats:
        shared, own = rng.normal(size=(units, 1)), rng.normal(size=(units, size))
        drawn: Floats = np.sqrt(_CORRELATION) * shared + np.sqrt(1.0 - _CORRELATION) * own
        return drawn

    return draw


def _few_differ(rng: np.random.Generator, units: int) -> Floats:
    return np.where(rng.random((units, 1)) < _FEW, 1.0 + 0.3 * rng.normal(size=(units, 1)), 0.0)


WORLDS = (
    World("normal", lambda rng, units: rng.normal(size=(units, 1)), 0.0),
    World("skewed", lambda rng, units: rng.exponential(size=(units, 1)), 1.0),
    World("heavy tails", lambda rng, units: rng.standard_t(3, (units, 1)), 0.0),
    World("one unit in five differs", _few_differ, _FEW, _FEW),
    World("clusters of 2", _clusters(2), 0.0),
    World("clusters of 3", _clusters(3), 0.0),
    World(
        "half are zero",
        lambda rng, units: np.where(rng.random((units, 1)) < 0.5, np.exp(0.5 * rng.normal(size=(units, 1))), 0.0),
        0.5 * float(np.exp(0.125)),
        0.5,
    ),
    World("ties", lambda rng, units: np.rint(rng.normal(size=(units, 1))), 0.0, 1.0 - float(special.erf(8.0**-0.5))),
)
"""The differences are exponential, Student's t with 3 degrees of freedom, log-normal or zero, and whole numbers."""


class Coverage(NamedTuple):
    """Shares of the studies of one world and number of units."""

    answered: float
    """Share whose interval has a width: some units differ."""
    contained: float
    """Share whose interval contains the mean of the population."""
    alarms: float
    """Called worse although the mean is zero, for the direction with more of them."""
    equivalent: float
    """Called equivalent although the mean is at the margin, for the direction with more of them."""


def measure_coverage(
    world: World, units: int, studies: int, seed: int, interval: Callable[[Floats, float], tuple[float, float]]
) -> Coverage:
    """Simulate studies; `interval` takes (n,) differences and a level."""
    rows: list[tuple[bool, ...]] = []
    for n in range(studies):
        drawn = world.draw(generator(seed, "coverage", world.name, units, n), units) - world.mean
        values = drawn.ravel() if interval is earlier_interval else drawn.mean(axis=1)
        if not np.ptp(values):
            rows.append((False,) * 6)
            continue
        (low, high), (above, below) = (interval(values, level) for level in (0.95, 1.0 - 2.0 * EQUIVALENCE_LEVEL))
        differs = sign_flip_p(values) <= SIGNIFICANCE
        rows.append((True, low <= 0.0 <= high, differs and low > 0.0, differs and high < 0.0, below < 0.0, above > 0.0))
    answered, contained, worse, better, *equivalent = (float(share) for share in np.mean(rows, axis=0))
    return Coverage(answered, contained, max(worse, better), max(equivalent))


def earlier_interval(values: Floats, level: float = CONFIDENCE_LEVEL) -> tuple[float, float]:
    """The interval of earlier versions of (n,) values, n >= 2, which are not all equal."""
    count = len(values)
    t = special.stdtrit(count - 1, 0.5 + 0.5 * level)
    expanded = 1.0 - 2.0 * special.ndtr(-np.sqrt(count / (count - 1)) * t)
    found = stats.bootstrap(
        (values,), np.mean, method="BCa", confidence_level=expanded, n_resamples=999, rng=generator(0, "paired")
    ).confidence_interval
    return float(found.low), float(found.high)


def coverage_rows(seed: int, studies: int = STUDIES, units: Iterable[int] = UNITS) -> list[BenchmarkStatement]:
    """For each world and number of units: coverage, answers, false alarms, and false claims of equivalence."""
    rows = []
    for world in WORLDS:
        for count in units:
            ours = measure_coverage(world, count, studies, seed, mean_interval)
            earlier = measure_coverage(world, count, studies, seed, earlier_interval)
            answers = (95.0, None) if world.bound(count) > 0.95 else (None, None)
            shares: list[tuple[str, float, float, tuple[float | None, float | None]]] = [
                ("intervals that contain the mean", ours.contained, earlier.contained, (92.0, None)),
                ("studies that answer", ours.answered, earlier.answered, answers),
                ("called worse, equal sides", ours.alarms, earlier.alarms, (None, 5.0)),
                ("called equivalent at the margin", ours.equivalent, earlier.equivalent, (None, None)),
            ]
            for name, share, before, limit in shares:
                bound = f"; at most {world.bound(count):.1%} of samples differ" if world.bound(count) < 0.999 else ""
                reference = f"earlier version {before:.1%}; {studies} studies{bound}"
                title, held = f"{world.name}, {count} units: {name}", limit if count >= ENOUGH else (None, None)
                rows.append(hold_to_limit(title, 100.0 * share, "%", least=held[0], most=held[1], reference=reference))
    return rows
