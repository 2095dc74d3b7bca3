"""Paired differences over clips: the mean, its 95 % interval, and the verdict on a claim.

The interval is the bias-corrected and accelerated bootstrap (BCa, Efron 1987) over clips, since another study would
sample other clips. The frames of a clip are not independent.

With few clips this interval is too narrow: nominal 95 % intervals contain the true mean in 83 to 91 % of simulated
studies of 6 to 12 clips. Its level is therefore expanded by the ratio of a t interval to a normal interval with the 1/n
variance (Hesterberg 2015, "expanded percentile"). The coverage is then 89 to 95 %, depending on skew and tails of the
differences, and 92 to 95 % for normal ones. `tests/compare/test_paired_statistics.py` (slow) measures it.
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
"""Least number of clips that can show a difference: with five, sign flips give a p of 2/32 or more."""
CONFIDENCE_LEVEL = 0.95
_RESAMPLES = 9999


@dataclass(frozen=True)
class PairedDifference:
    """Differences a - b over the clips on which both were measured."""

    clips: tuple[str, ...]
    mean: float | None
    """Mean difference; None without clips."""
    low: float | None = None
    """Lower end of the 95 % interval; None with fewer than `MIN_CLIPS` clips."""
    high: float | None = None
    """Upper end."""

    @property
    def verdict(self) -> ClaimVerdict:
        """Verdict on the claim that a is greater than b."""
        if not self.clips:
            return "not run"
        if self.low is None or self.high is None or self.low <= 0.0 <= self.high:
            return "cannot tell"
        return "reproduced" if self.low > 0.0 else "not reproduced"

    @property
    def why(self) -> str:
        """Reason for the verdict; "" where it is "reproduced"."""
        if not self.clips:
            return "no clip was measured on both sides"
        if self.low is None:
            return f"too few clips: {len(self.clips)}, of at least {MIN_CLIPS}"
        return {"cannot tell": "the interval contains zero", "not reproduced": "the difference has the other sign"}.get(
            self.verdict, ""
        )


def compare_paired(a: Mapping[str, float | None], b: Mapping[str, float | None]) -> PairedDifference:
    """Compare errors by clip; a clip that either side lacks (or has None for) is left out.

    All clips must be of one kind: never put known and new performers, or two splits, into one mapping. BadInput for a
    number that is not finite.
    """
    clips = tuple(sorted(clip for clip in a if a[clip] is not None and b.get(clip) is not None))
    difference = np.array([a[clip] for clip in clips], float) - np.array([b[clip] for clip in clips], float)
    if not np.isfinite(difference).all():
        wrong = clips[int(np.flatnonzero(~np.isfinite(difference))[0])]
        raise BadInput(f"The errors on {wrong} are not finite.", "Use None for what was not measured.")
    if not clips:
        return PairedDifference((), None)
    mean = float(difference.mean())
    if len(clips) < MIN_CLIPS:
        return PairedDifference(clips, mean)
    return PairedDifference(clips, mean, *bootstrap_interval(difference))


def mean_interval(values: Floats, level: float = CONFIDENCE_LEVEL) -> tuple[float, float]:
    """Interval of the mean of (n,) independent values, n >= 2: `bootstrap_interval` from `MIN_CLIPS` values on.

    Fewer values have too few resamples. They get Student's t interval, which is exact for normal values.
    """
    if len(values) >= MIN_CLIPS:
        return bootstrap_interval(values, level)
    mean = float(values.mean())
    width = float(special.stdtrit(len(values) - 1, 0.5 + 0.5 * level) * values.std(ddof=1) / np.sqrt(len(values)))
    return mean - width, mean + width


def bootstrap_interval(values: Floats, level: float = CONFIDENCE_LEVEL) -> tuple[float, float]:
    """Interval of the mean of (n,) independent values, n >= 2; deterministic."""
    spread = float(np.ptp(values))
    if spread <= 1e-9 * float(np.abs(values).max()):  # all equal: nothing to resample, and BCa is undefined
        return float(values.mean()), float(values.mean())
    from scipy import stats  # takes a second to load, and each worker loads this file

    interval = stats.bootstrap(
        (round_to_grid(values),),
        np.mean,
        method="BCa",
        confidence_level=expand_level(level, len(values)),
        n_resamples=_RESAMPLES,
        rng=generator(0, "paired"),
    ).confidence_interval
    return float(interval.low), float(interval.high)


def round_to_grid(values: Floats) -> Floats:
    """Round (n,) values, not all zero, to 2^-40 of the largest.

    Sums of the rounded values are exact in any order, so that sums which are equal on paper are equal here.
    """
    grid = 2.0 ** (np.ceil(np.log2(np.abs(values).max())) - 40)
    rounded: Floats = grid * np.round(values / grid)
    return rounded


def expand_level(level: float, count: int) -> float:
    """The bootstrap level whose interval is as wide as the t interval of `level` for `count` values."""
    t = special.stdtrit(count - 1, 0.5 + 0.5 * level)
    return float(1.0 - 2.0 * special.ndtr(-np.sqrt(count / (count - 1)) * t))
