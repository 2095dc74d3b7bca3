"""A paper's claim that a set of stations suffices, tested on our results.

The claim is split into two:

- no other set of the same size, from the paper's stations, errs less. It is tested against the best of these, which is
  chosen on other clips where there are held-out clips;
- all of the paper's stations together err hardly less: the error of the set is within a margin of theirs.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace

from harness.compare.claims import claim_lower_error
from harness.results.benchmark_statement import BenchmarkStatement
from harness.results.placement_findings import StationNames
from harness.study.placement.candidates import CandidateGroup, StationSet, select_groups, station_set
from harness.study.placement.config import PublishedClaim
from harness.study.placement.ranking import Costs, complete_sets, join_names, mean_cost, sort_by_cost


def sets_of_claim(
    claim: PublishedClaim, units: Sequence[CandidateGroup]
) -> tuple[StationSet, list[StationSet], StationSet]:
    """The claimed set, the other sets of the same size, and the set of all of the paper's stations."""
    where = f"the claim {claim.text!r}"
    groups = select_groups(claim.among, units, where)
    claimed, full = station_set(select_groups(claim.set, units, where), units), station_set(groups, units)
    same_size = [
        station_set(combination, units)
        for n in range(1, len(claimed) + 1)
        for combination in itertools.combinations(groups, n)
        if sum(map(len, combination)) == len(claimed)
    ]
    return claimed, [stations for stations in same_size if stations != claimed], full


def best_alternative(others: Sequence[StationNames], costs: Mapping[StationNames, Costs]) -> StationNames:
    """The set with the least cost; () if none was measured."""
    complete, _ = complete_sets({names: costs[names] for names in others})
    return next(iter(sort_by_cost(complete)), ())


def evaluate_claim(
    claim: PublishedClaim,
    claimed: StationNames,
    other: StationNames,
    full: StationNames,
    costs: Mapping[StationNames, Costs],
    *,
    unit: str,
    basis: str,
) -> tuple[BenchmarkStatement, BenchmarkStatement]:
    """Evaluate both claims by costs of the units of the test clips, which `basis` describes in words."""
    measured = {
        names: {name: value for name, value in costs.get(names, {}).items() if value is not None}
        for names in (claimed, other, full)
    }
    allowed = {name: (1.0 + claim.margin) * value for name, value in measured[full].items()}
    best_of_size = f"{claim.text}: no other {len(claimed)} stations err less (against the best, {join_names(other)})"
    within = f"{claim.text}: {join_names(claimed)} err at most {claim.margin:.0%} more than all {len(full)}"
    published = f"stated by {claim.source}"
    why = "; ".join(filter(None, (claim.why_not, basis)))
    suffices = claim_lower_error(within, measured[claimed], allowed, published=published, unit=unit, why=why)
    if suffices.verdict != "not run":
        shared = measured[claimed].keys() & measured[full].keys()
        mean, mean_of_all = (mean_cost({name: measured[names][name] for name in shared}) for names in (claimed, full))
        limit = f"limit {(1.0 + claim.margin) * mean_of_all:.2f} {unit}, {1.0 + claim.margin:.0%} of {mean_of_all:.2f}"
        suffices = replace(suffices, measured=f"{mean:.2f} {unit}; {limit} of all {len(full)}")
    return (
        claim_lower_error(best_of_size, measured[claimed], measured[other], published=published, unit=unit, why=why),
        suffices,
    )
