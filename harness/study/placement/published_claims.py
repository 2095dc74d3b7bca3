"""What a paper says of a set of trackers, held against ours: that it suffices.

To suffice is taken apart into two claims. No other set of as many of the paper's trackers errs less: held against
the one that errs least among them, chosen on other clips than those it is judged on where there are such. And all of
the paper's trackers together err hardly less: the set's error is within a margin of theirs.
"""

import itertools
from collections.abc import Mapping, Sequence

from harness.results.findings import Claim
from harness.results.placement_findings import StationNames
from harness.study.papers.claims import claim_lower_error
from harness.study.placement.candidates import CandidateGroup, StationSet, select_groups, station_set
from harness.study.placement.config import PublishedClaim
from harness.study.placement.ranking import Costs, complete_sets, join_names, sort_by_cost


def sets_of_claim(
    claim: PublishedClaim, units: Sequence[CandidateGroup]
) -> tuple[StationSet, list[StationSet], StationSet]:
    """The set that suffices, the others of as many stations, and all of the paper's trackers."""
    where = f"the claim {claim.text!r}"
    of = select_groups(claim.among, units, where)
    suited, whole = station_set(select_groups(claim.set, units, where), units), station_set(of, units)
    alike = [
        station_set(each, units)
        for n in range(1, len(suited) + 1)
        for each in itertools.combinations(of, n)
        if sum(map(len, each)) == len(suited)
    ]
    return suited, [one for one in alike if one != suited], whole


def best_alternative(others: Sequence[StationNames], costs: Mapping[StationNames, Costs]) -> StationNames:
    """The one that errs least; () of none that was measured."""
    whole, _ = complete_sets({one: costs[one] for one in others})
    return next(iter(sort_by_cost(whole)), ())


def evaluate_claim(
    claim: PublishedClaim,
    suited: StationNames,
    other: StationNames,
    whole: StationNames,
    costs: Mapping[StationNames, Costs],
    *,
    unit: str,
    judged_on: str,
) -> tuple[Claim, Claim]:
    """Both claims, by costs on the clips that they are judged on, in the words of `judged_on`."""
    found = {
        one: {clip: value for clip, value in costs.get(one, {}).items() if value is not None}
        for one in (suited, other, whole)
    }
    allowed = {clip: (1.0 + claim.margin) * value for clip, value in found[whole].items()}
    of_its_size = f"{claim.text}: no other {len(suited)} of them err less (against the best other, {join_names(other)})"
    within = f"{claim.text}: {join_names(suited)} err at most {claim.margin:.0%} more than all {len(whole)}"
    published = f"said by {claim.source}"
    why = "; ".join(filter(None, (claim.why_not, judged_on)))
    return (
        claim_lower_error(of_its_size, found[suited], found[other], published=published, unit=unit, why=why),
        claim_lower_error(within, found[suited], allowed, published=published, unit=unit, why=why),
    )
