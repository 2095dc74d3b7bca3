"""Findings of a trust study (does the simulation rank methods as the device does), as plain records.

An *arm* is a method with a set of stations and, where the plan varies them, parameters. Every arm runs on the device's
captures and on simulations of the same motion. Each side has one error for each clip.
"""

from dataclasses import dataclass, field
from typing import Literal

from harness.errors import Outcome

EquivalenceVerdict = Literal["equivalent", "beyond the margin", "cannot tell"]
PairVerdict = Literal["agree", "contradict", "cannot tell"]


@dataclass(frozen=True)
class TrustCapture:
    """One capture of the device."""

    file: str
    clip: str
    """The motion that was performed or played."""
    sha256: str
    """SHA-256 of the file."""
    plan: str
    """Digest of the plan that the capture names; "" without one."""
    frames: int
    """Number of frames."""
    damage: tuple[str, ...] = ()
    """What was lost of a damaged file."""


@dataclass(frozen=True)
class StreamHealth:
    """Health of one station's stream, over all clips."""

    rate_hz: float
    """Frames a second, with those that never arrived."""
    lost_share: float
    """Share of the frames without a usable position."""
    gaps_per_min: float
    """Gaps, which are runs of frames without a usable position, a minute."""
    gap_s: float | None
    """Mean duration of a gap [s]; None without gaps."""
    quality: float
    """Mean quality of the frames with a usable position, 0 to 1."""
    suspect_share: float
    """Share of the frames in which the record looks damaged."""


@dataclass(frozen=True)
class StationHealth:
    """Health of one station on both sides."""

    station: str
    device: StreamHealth
    simulated: StreamHealth


@dataclass(frozen=True)
class ErrorDistance:
    """Energy distance between the errors of one station on the device and in the simulation (Szekely & Rizzo 2013)."""

    station: str
    feature: str
    """Name of the error, such as "position error"."""
    unit: str
    distance: float | None
    """Energy distance, unbiased and hence negative now and then, in the unit; None if it was not measured."""
    split_half: float | None
    """95th percentile of the distance between random halves of the device's own blocks, in the unit."""
    p: float | None
    """Share of the permutations of blocks whose distance is at least as large."""
    p_holm: float | None
    """`p` after Holm's correction over all rows."""
    block_s: float
    """Length of a block, five correlation times at least [s]."""
    blocks: tuple[int, int]
    """Number of blocks of the device and of the simulation."""
    reason: str = ""
    """Reason why it was not measured."""


@dataclass(frozen=True)
class Equivalence:
    """Equivalence of one metric of one arm: simulation minus device over units, by two one-sided tests."""

    arm: str
    metric: str
    margin: float
    """Largest difference without practical importance, in the metric's unit, as the difference and its interval."""
    clips: int
    device: float | None
    """Mean over the units."""
    simulated: float | None
    difference: float | None
    """Mean of simulation minus device."""
    low: float | None
    """Lower end of the interval of the level 1 - 2 x the plan's; None with too few units."""
    high: float | None
    verdict: EquivalenceVerdict
    why: str


@dataclass(frozen=True)
class SideDifference:
    """Error of arm a minus that of arm b on one side, over the units of the plan."""

    mean: float | None
    low: float | None
    """Lower end of the interval of the level 1 - 2 x the plan's, for these motions; None with too few units."""
    high: float | None
    p: float | None
    """One-sided p in the direction of the mean."""


@dataclass(frozen=True)
class PairAgreement:
    """Whether both sides order two arms alike."""

    a: str
    b: str
    clips: int
    device: SideDifference
    simulated: SideDifference
    p: float | None
    """The larger p of the two sides: both have to show a difference."""
    p_holm: float | None
    """`p` after Holm's correction over all pairs."""
    verdict: PairVerdict
    why: str


@dataclass(frozen=True)
class RankCorrelation:
    """A correlation of the arms' mean errors on both sides, with an interval."""

    name: str
    value: float | None
    low: float | None
    high: float | None
    reason: str = ""
    """Reason why it was not measured."""


@dataclass(frozen=True)
class TrustFindings:
    """What a trust study found."""

    title: str
    scenario: str
    unit: str
    """Name of the unit file, or of the noise preset without one."""
    unit_digest: str
    """SHA-256 of the unit file; "" without one."""
    plan_digest: str
    exploratory: bool
    """Whether captures of another plan, or of none, were used."""
    level: float
    ranked_metric: str
    """Metric by which arms are ranked."""
    seeds: tuple[int, ...]
    """Seeds of the simulated errors."""
    captures: tuple[TrustCapture, ...]
    arms: tuple[str, ...]
    health: tuple[StationHealth, ...] = ()
    distances: tuple[ErrorDistance, ...] = ()
    equivalences: tuple[Equivalence, ...] = ()
    pairs: tuple[PairAgreement, ...] = ()
    rank_correlations: tuple[RankCorrelation, ...] = ()
    failures: dict[str, str] = field(default_factory=dict)
    """Cell -> why it has no result."""
    outcome: Outcome = Outcome.NOT_COMPARABLE
    why: str = ""
    """Reason for the outcome, in one sentence."""
    notes: tuple[str, ...] = ()
