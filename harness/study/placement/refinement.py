"""Refinement of a set: stations are moved along and around their bones as long as the improvement is significant.

In each iteration the search measures all places one step along or around the bone, for each station; a mirrored pair
moves together. It takes the best of them if that is significantly better: sign flips over units, corrected for the
number of places (Holm). Otherwise it continues with the next smaller step, and ends after the smallest.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from harness.compare import SIGNIFICANCE, compare_paired, count_needed, holm, sign_flip_p
from harness.core.number_format import count_noun
from harness.errors import BadInput
from harness.results.findings import CandidatePlace, PlacementSearch, SearchStep
from harness.study.placement.candidates import StationSet, mirror_place, names_of_places, placement_fault, station_name
from harness.study.placement.config import RefineOptions
from harness.study.placement.ranking import Measure, complete_sets, join_names, sort_by_cost

MoveGroup = tuple[int, ...]
"""Indices of the places of a set that move together."""


def refine_set(
    table: RefineOptions, start: StationSet, measure: Measure, units: int
) -> tuple[PlacementSearch, StationSet]:
    """Refine a set; returns the steps and the final set. BadInput with too few units."""
    check_unit_count(start, units)
    groups = find_move_groups(start)
    origin = {station_name(place): place for place in start}
    current, steps, measured = start, [SearchStep(names_of_places(start), "")], 0
    for along, around_deg in zip(table.along, table.around_deg, strict=True):
        while len(steps) <= table.most_moves:
            moves = {
                moved: text
                for moved, text in _candidate_moves(current, groups, along, around_deg, origin)
                if moved != current
            }
            measured += len(moves)
            best, step = _best_move(current, moves, measure)
            if step is None:
                break
            current = best
            steps.append(step)
    steps_text = f"{table.along[-1]:g} along or {table.around_deg[-1]:g} deg around"
    end = f"no place at a step of {steps_text} is significantly better"
    if len(steps) > table.most_moves:
        end = f"{table.most_moves} moves, the limit"
    title = f"{join_names(names_of_places(start))}: moved along and around"
    return PlacementSearch("refine", title, tuple(steps), f"{end}; {measured} places were measured"), current


def check_unit_count(start: StationSet, units: int) -> None:
    """BadInput when the units are too few for any move to be significant."""
    moves = 4 * len(find_move_groups(start))
    if units < (least := count_needed(moves)):
        fault = f"refine: with {count_noun(units, 'unit')}, none of {moves} moves can be significantly better."
        raise BadInput(fault, f"Use {least} units (performers) or more, or refine a smaller set.")


def find_move_groups(start: StationSet) -> tuple[MoveGroup, ...]:
    """Group the stations of a set: mirrored pairs move together, others by themselves."""
    groups: list[MoveGroup] = []
    for at, place in enumerate(start):
        if any(at in group for group in groups):
            continue
        image = mirror_place(place)
        others = [i for i, other in enumerate(start) if i > at and _same_place(other, image)]
        groups.append((at, *others[:1]))
    return tuple(groups)


def _same_place(a: CandidatePlace, b: CandidatePlace) -> bool:
    turn = (a.around_deg - b.around_deg) % 360.0
    return (a.bone, a.along, a.stand_off_m) == (b.bone, b.along, b.stand_off_m) and min(turn, 360.0 - turn) < 1e-6


def _candidate_moves(
    current: StationSet,
    groups: Sequence[MoveGroup],
    along: float,
    around_deg: float,
    origin: dict[str, CandidatePlace],
) -> Iterator[tuple[StationSet, str]]:
    """Yield every possible set one step from the current one, and a description of the move."""
    for group in groups:
        lead = current[group[0]]
        for d_along, d_around in ((along, 0.0), (-along, 0.0), (0.0, around_deg), (0.0, -around_deg)):
            target = _move_place(lead, lead.along + d_along, lead.around_deg + d_around, origin)
            if placement_fault(target):
                continue
            image = mirror_place(target)
            places = list(current)
            places[group[0]] = target
            for other in group[1:]:
                places[other] = _move_place(current[other], image.along, image.around_deg, origin)
            names = join_names(station_name(current[at]) for at in group)
            change = f"along {lead.along:.2f} to {target.along:.2f}"
            if d_around:
                change = f"around {lead.around_deg:g} to {target.around_deg:g} deg"
            yield tuple(places), f"{names}: {change}"


def _move_place(
    place: CandidatePlace, along: float, around_deg: float, origin: dict[str, CandidatePlace]
) -> CandidatePlace:
    """Move a station; at its original place it is the candidate itself again."""
    first = origin[station_name(place)]
    along, around_deg = round(along, 6), round(180.0 - (180.0 - around_deg) % 360.0, 6)
    moved = replace(first, along=along, around_deg=around_deg)
    if _same_place(moved, first):
        return first
    root = station_name(first)
    return replace(moved, name=f"{root}@{along:.2f}/{around_deg:g}", moved_from=root)


def _best_move(
    current: StationSet, moves: dict[StationSet, str], measure: Measure
) -> tuple[StationSet, SearchStep | None]:
    """The best move if it is significantly better than the current set, else the current set and None."""
    costs = measure([current, *moves])
    by_name = {names_of_places(place): place for place in (current, *moves)}
    complete, _ = complete_sets({name: costs[place] for name, place in by_name.items()})
    before = complete.pop(names_of_places(current), None)
    if before is None or not complete:
        return current, None
    order = sort_by_cost(complete)
    best = compare_paired(before, complete[order[0]])
    p = holm([sign_flip_p(np.array([before[unit] - complete[name][unit] for unit in before])) for name in order])
    if best.mean is None or best.mean <= 0.0 or p[0] > SIGNIFICANCE:
        return current, None
    target = by_name[order[0]]
    return target, SearchStep(order[0], moves[target], best.mean, best.low, best.high)
