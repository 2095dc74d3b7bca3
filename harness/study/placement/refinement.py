"""Stations of a set moved along and around their bones, as long as it helps beyond noise.

From where it stands the search looks at every place one step along or around for each station, a mirrored pair moving
together. The best of them is taken if it is surely better: sign flips over clips, corrected for how many were looked at
(Holm). When none is, the next smaller step is tried; after the smallest the search ends.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from harness.compare.paired_statistics import compare_paired
from harness.compare.significance import SIGNIFICANCE, holm, sign_flip_p
from harness.errors import BadInput
from harness.results.placement_findings import PlacementSearch, SearchStep, StationPlacement
from harness.study.placement.candidates import StationSet, mirror_place, placement_fault, station_name
from harness.study.placement.config import RefineOptions
from harness.study.placement.ranking import complete_sets, join_names, min_clips, sort_by_cost
from harness.study.placement.search import Measure, names_of_places

MoveGroup = tuple[int, ...]
"""Which places of a set move together."""


def refine_set(
    table: RefineOptions, start: StationSet, measure: Measure, clips: int
) -> tuple[PlacementSearch, StationSet]:
    """What it came to, and every step; BadInput on too few clips."""
    check_clip_count(start, clips)
    movers = find_move_groups(start)
    origin = {station_name(one): one for one in start}
    now, steps, looked = start, [SearchStep(names_of_places(start), "")], 0
    for along, around_deg in zip(table.along, table.around_deg, strict=True):
        while len(steps) <= table.most_moves:
            moves = {
                moved: text for moved, text in _candidate_moves(now, movers, along, around_deg, origin) if moved != now
            }
            looked += len(moves)
            best, step = _best_move(now, moves, measure)
            if step is None:
                break
            now = best
            steps.append(step)
    ended = f"no place a step of {table.along[-1]:g} along or {table.around_deg[-1]:g} deg around is surely better"
    if len(steps) > table.most_moves:
        ended = f"{table.most_moves} moves, the most that were asked for"
    title = f"{join_names(names_of_places(start))}: moved along and around"
    return PlacementSearch("refine", title, tuple(steps), f"{ended}; {looked} places were looked at"), now


def check_clip_count(start: StationSet, clips: int) -> None:
    """BadInput when so few clips could never show that a move helps."""
    moves = 4 * len(find_move_groups(start))
    if clips < (least := min_clips(moves)):
        found = f"refine: on {clips} clips none of {moves} moves could ever be surely better."
        raise BadInput(found, f"Judge on {least} clips or more, or refine a smaller set.")


def find_move_groups(start: StationSet) -> tuple[MoveGroup, ...]:
    """Stations that move by themselves, and mirrored pairs, which move together."""
    found: list[MoveGroup] = []
    for at, one in enumerate(start):
        if any(at in mover for mover in found):
            continue
        image = mirror_place(one)
        others = [i for i, other in enumerate(start) if i > at and _same_place(other, image)]
        found.append((at, *others[:1]))
    return tuple(found)


def _same_place(a: StationPlacement, b: StationPlacement) -> bool:
    turn = (a.around_deg - b.around_deg) % 360.0
    return (a.bone, a.along, a.stand_off_m) == (b.bone, b.along, b.stand_off_m) and min(turn, 360.0 - turn) < 1e-6


def _candidate_moves(
    now: StationSet, movers: Sequence[MoveGroup], along: float, around_deg: float, origin: dict[str, StationPlacement]
) -> Iterator[tuple[StationSet, str]]:
    """Every set one step from here that can be worn, and what moved."""
    for mover in movers:
        lead = now[mover[0]]
        for d_along, d_around in ((along, 0.0), (-along, 0.0), (0.0, around_deg), (0.0, -around_deg)):
            there = _move_place(lead, lead.along + d_along, lead.around_deg + d_around, origin)
            if placement_fault(there):
                continue
            image = mirror_place(there)
            places = list(now)
            places[mover[0]] = there
            for other in mover[1:]:
                places[other] = _move_place(now[other], image.along, image.around_deg, origin)
            who = join_names(station_name(now[at]) for at in mover)
            how = f"along {lead.along:.2f} to {there.along:.2f}"
            if d_around:
                how = f"around {lead.around_deg:g} to {there.around_deg:g} deg"
            yield tuple(places), f"{who}: {how}"


def _move_place(
    one: StationPlacement, along: float, around_deg: float, origin: dict[str, StationPlacement]
) -> StationPlacement:
    """The same station elsewhere; back where it began it is the candidate again."""
    first = origin[station_name(one)]
    along, around_deg = round(along, 6), round(180.0 - (180.0 - around_deg) % 360.0, 6)
    there = replace(first, along=along, around_deg=around_deg)
    if _same_place(there, first):
        return first
    root = station_name(first)
    return replace(there, name=f"{root}@{along:.2f}/{around_deg:g}", moved_from=root)


def _best_move(now: StationSet, moves: dict[StationSet, str], measure: Measure) -> tuple[StationSet, SearchStep | None]:
    """The least cost of them if it is surely less than that of now."""
    costs = measure([now, *moves])
    by_name = {names_of_places(one): one for one in (now, *moves)}
    whole, _ = complete_sets({name: costs[one] for name, one in by_name.items()})
    here = whole.pop(names_of_places(now), None)
    if here is None or not whole:
        return now, None
    order = sort_by_cost(whole)
    best = compare_paired(here, whole[order[0]])
    p = holm([sign_flip_p(np.array([here[clip] - whole[name][clip] for clip in here])) for name in order])
    if best.mean is None or best.mean <= 0.0 or p[0] > SIGNIFICANCE:
        return now, None
    there = by_name[order[0]]
    return there, SearchStep(order[0], moves[there], best.mean, best.low, best.high)
