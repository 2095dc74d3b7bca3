"""Agreement of a ranking on built-in motion with that on real motion, over performers.

A unit is a performer, because the clips of one performer are not independent. Both sides have performers of their own.
A pair of items is decided where both sides show a difference, and the interval of Kendall's tau follows from the
decided pairs (see `compare.rank_correlation`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy import special

from harness.compare import MIN_UNITS, SIGNIFICANCE, compare_orders, tau_b, tau_interval
from harness.core.arrays import Floats
from harness.results.findings import PairAgreement, PairVerdict

MIN_ITEMS = 3
"""Least number of items with a rank correlation."""
MOST_UNITS = 1000
"""Most performers that are called enough for a pair."""

ErrorsByUnit = Mapping[str, Mapping[str, float | None]]
"""Item (a method or a set of stations) -> performer -> error; None where it was not measured."""


@dataclass(frozen=True)
class RankingAgreement:
    """Agreement of the two sides on the order of items."""

    builtin: tuple[str, ...]
    """Performers of the built-in side."""
    real: tuple[str, ...]
    """Performers of the real side."""
    means: Mapping[str, tuple[float, float]]
    """Item -> its mean error on built-in and on real motion, the lowest on built-in motion first."""
    tau: float | None
    """Kendall's tau-b of the means; None for fewer than `MIN_ITEMS` items, or where one side has only ties."""
    low: float | None
    """Lower end of the 95 % interval of tau; None with fewer than `MIN_UNITS` performers on a side."""
    high: float | None
    pairs: tuple[PairAgreement, ...]
    """Pairs of items, of which `a` has the lower mean on built-in motion. `device` is the real side, and a difference
    has an interval of 95 %."""
    enough: tuple[int | None, ...]
    """For each pair the number of performers on each side that would decide it, if both differences and their spread
    stay as measured; None above `MOST_UNITS`, and with fewer than `MIN_UNITS` performers."""
    left_out: Mapping[str, str]
    """Item -> why it is not ranked."""

    @property
    def reason(self) -> str:
        """Why tau has no interval; "" where it has one."""
        few = {"built-in": len(self.builtin), "real": len(self.real)}
        short = [f"{count} {name} performers" for name, count in few.items() if count < MIN_UNITS]
        if short:
            return f"too few units: {' and '.join(short)}, of at least {MIN_UNITS}"
        return "" if self.tau is not None else f"{len(self.means)} items, of at least {MIN_ITEMS}, or only ties"

    def with_verdict(self, verdict: PairVerdict) -> list[PairAgreement]:
        """The pairs with a verdict."""
        return [pair for pair in self.pairs if pair.verdict == verdict]


def compare_rankings(builtin: ErrorsByUnit, real: ErrorsByUnit) -> RankingAgreement:
    """Compare the order of the items on both sides. An item that misses a performer of a side is left out."""
    sides = {"built-in": builtin, "real": real}
    units = {name: tuple(dict.fromkeys(unit for of in side.values() for unit in of)) for name, side in sides.items()}
    left_out = {
        item: f"not measured on {name} motion of {', '.join(missing)}"
        for name, side in sides.items()
        for item in dict.fromkeys((*builtin, *real))
        if (missing := [unit for unit in units[name] if side.get(item, {}).get(unit) is None])
    }
    items = [item for item in builtin if item not in left_out]
    tables = [
        np.array([[side[item][u] for u in units[name]] for item in items], float).reshape(len(items), len(units[name]))
        for name, side in sides.items()
    ]
    order = sorted(range(len(items)), key=lambda at: tables[0][at].mean())
    items, tables = [items[at] for at in order], [table[order] for table in tables]
    means = [table.mean(axis=1) for table in tables]
    tau = float(tau_b(*means)) if len(items) >= MIN_ITEMS else float("nan")
    real_first = (tables[1], tables[0])
    pairs = tuple(compare_orders(items, real_first, ("real side", "built-in side"), "performers"))
    low, high = tau_interval(pairs) if np.isfinite(tau) else (None, None)
    return RankingAgreement(
        units["built-in"],
        units["real"],
        {item: (float(a), float(b)) for item, a, b in zip(items, *means, strict=True)},
        tau if np.isfinite(tau) else None,
        low,
        high,
        pairs,
        _enough_units(tables),
        left_out,
    )


def _enough_units(tables: Sequence[Floats]) -> tuple[int | None, ...]:
    """For each pair the number of performers on each side with which both differences would be significant."""
    indices = list(combinations(range(len(tables[0])), 2))
    if min(table.shape[1] for table in tables) < MIN_UNITS:
        return (None,) * len(indices)
    counts = np.arange(MIN_UNITS, MOST_UNITS + 1)
    least = special.stdtrit(counts - 1, 1.0 - SIGNIFICANCE / max(len(indices), 1)) / np.sqrt(counts)
    found = []
    for a, b in indices:
        differences = [table[a] - table[b] for table in tables]
        shown = np.all([abs(d.mean()) >= least * d.std(ddof=1) for d in differences], axis=0)
        found.append(int(counts[shown][0]) if shown.any() and all(d.any() for d in differences) else None)
    return tuple(found)
