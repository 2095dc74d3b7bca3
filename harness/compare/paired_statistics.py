"""Two sides compared on the same clips: the mean difference, its 95 % interval, and what it says of a claim.

The interval is the bias-corrected and accelerated bootstrap (BCa, Efron 1987) over clips, for these are what another
study would draw anew; the frames of a clip are no independent witnesses. On few clips it is too narrow: nominal 95 %
hold the truth in 83 to 91 % of simulated studies of 6 to 12 clips. Its level is therefore expanded by what a t interval
is wider than a normal one of the 1/n variance (Hesterberg 2015, "expanded percentile"): 89 to 95 %, by how skewed and
how heavy-tailed the differences are, 92 to 95 % for normal ones. `tests/compare/test_paired_statistics.py` (slow) measures it.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import special

from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.errors import BadInput
from harness.results.findings import ClaimVerdict

MIN_CLIPS = 6
"""With fewer there is no interval."""
CONFIDENCE_LEVEL = 0.95
_RESAMPLES = 9999


@dataclass(frozen=True)
class PairedDifference:
    """a - b over the clips on which both were measured."""

    clips: tuple[str, ...]
    mean: float | None
    """None without clips."""
    low: float | None = None
    """End of the 95 % interval; None with fewer than `MIN_CLIPS`."""
    high: float | None = None

    @property
    def verdict(self) -> ClaimVerdict:
        """Of the claim that a is greater than b."""
        if not self.clips:
            return "not run"
        if self.low is None or self.high is None or self.low <= 0.0 <= self.high:
            return "cannot tell"
        return "reproduced" if self.low > 0.0 else "not reproduced"

    @property
    def why(self) -> str:
        """Of a verdict that is not "reproduced"."""
        if not self.clips:
            return "no clip on which both were measured"
        if self.low is None:
            return f"too few clips: {len(self.clips)}, of at least {MIN_CLIPS}"
        return {"cannot tell": "the interval holds zero", "not reproduced": "the other way round"}.get(self.verdict, "")


def compare_paired(a: Mapping[str, float | None], b: Mapping[str, float | None]) -> PairedDifference:
    """Compare errors by clip; a clip that either side lacks (or has None for) does not count.

    Clips must be of one kind: known and new performers, or two protocols, are never put into one mapping. BadInput for
    a number that is not finite.
    """
    clips = tuple(sorted(clip for clip in a if a[clip] is not None and b.get(clip) is not None))
    difference = np.array([a[clip] for clip in clips], float) - np.array([b[clip] for clip in clips], float)
    if not np.isfinite(difference).all():
        wrong = clips[int(np.flatnonzero(~np.isfinite(difference))[0])]
        raise BadInput(f"The errors on {wrong} are no finite numbers.", "What was not measured is None.")
    if not clips:
        return PairedDifference((), None)
    mean = float(difference.mean())
    if len(clips) < MIN_CLIPS:
        return PairedDifference(clips, mean)
    return PairedDifference(clips, mean, *bootstrap_interval(difference))


def bootstrap_interval(values: Floats, level: float = CONFIDENCE_LEVEL) -> tuple[float, float]:
    """Of the mean of (n,) values that were drawn independently, n >= 2; the same values give the same ends."""
    spread = float(np.ptp(values))
    if spread <= 1e-9 * float(np.abs(values).max()):  # all equal: nothing to resample, and BCa is undefined
        return float(values.mean()), float(values.mean())
    from scipy import stats  # takes a second to load, and each worker loads this file

    found = stats.bootstrap(
        (round_to_grid(values),),
        np.mean,
        method="BCa",
        confidence_level=expand_level(level, len(values)),
        n_resamples=_RESAMPLES,
        rng=generator(0, "paired"),
    ).confidence_interval
    return float(found.low), float(found.high)


def round_to_grid(values: Floats) -> Floats:
    """(n,) values, not all zero, rounded at 2^-40 of the largest: their sums are exact in any order, so that what ties
    on paper ties here."""
    grain = 2.0 ** (np.ceil(np.log2(np.abs(values).max())) - 40)
    rounded: Floats = grain * np.round(values / grain)
    return rounded


def expand_level(level: float, count: int) -> float:
    """The bootstrap's level whose interval is as wide as the t interval of `level` on `count` even values."""
    t = special.stdtrit(count - 1, 0.5 + 0.5 * level)
    return float(1.0 - 2.0 * special.ndtr(-np.sqrt(count / (count - 1)) * t))
