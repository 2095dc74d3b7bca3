"""Stations of a set moved along and around their bones, as long as it helps beyond noise.

From where it stands the search looks at every place one step along or around for each station, a mirrored pair moving
together. The best of them is taken if it is surely better: sign flips over clips, corrected for how many were looked at
(Holm). When none is, the next smaller step is tried; after the smallest the search ends.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from harness.compare.paired_statistics import paired
from harness.compare.significance import SIGNIFICANCE, holm, sign_flip_p
from harness.errors import BadInput
from harness.results.placement_findings import Place, Search, Step
from harness.study.placement.candidates import Worn, mirrored, refused, station_name
from harness.study.placement.config import Refine
from harness.study.placement.ranking import complete, fewest_clips, in_order, names
from harness.study.placement.search import Measure, stations

Mover = tuple[int, ...]
"""Which places of a set move together."""


def refine(table: Refine, start: Worn, measure: Measure, clips: int) -> tuple[Search, Worn]:
    """What it came to, and every step; BadInput on too few clips."""
    refuse_few(start, clips)
    movers = movers_of(start)
    origin = {station_name(one): one for one in start}
    now, steps, looked = start, [Step(stations(start), "")], 0
    for along, around_deg in zip(table.along, table.around_deg, strict=True):
        while len(steps) <= table.most_moves:
            moves = {moved: text for moved, text in _moves(now, movers, along, around_deg, origin) if moved != now}
            looked += len(moves)
            best, step = _best(now, moves, measure)
            if step is None:
                break
            now = best
            steps.append(step)
    ended = f"no place a step of {table.along[-1]:g} along or {table.around_deg[-1]:g} deg around is surely better"
    if len(steps) > table.most_moves:
        ended = f"{table.most_moves} moves, the most that were asked for"
    title = f"{names(stations(start))}: moved along and around"
    return Search("refine", title, tuple(steps), f"{ended}; {looked} places were looked at"), now


def refuse_few(start: Worn, clips: int) -> None:
    """BadInput when so few clips could never show that a move helps."""
    moves = 4 * len(movers_of(start))
    if clips < (least := fewest_clips(moves)):
        found = f"refine: on {clips} clips none of {moves} moves could ever be surely better."
        raise BadInput(found, f"Judge on {least} clips or more, or refine a smaller set.")


def movers_of(start: Worn) -> tuple[Mover, ...]:
    """Stations that move by themselves, and mirrored pairs, which move together."""
    found: list[Mover] = []
    for at, one in enumerate(start):
        if any(at in mover for mover in found):
            continue
        image = mirrored(one)
        others = [i for i, other in enumerate(start) if i > at and _same_place(other, image)]
        found.append((at, *others[:1]))
    return tuple(found)


def _same_place(a: Place, b: Place) -> bool:
    turn = (a.around_deg - b.around_deg) % 360.0
    return (a.bone, a.along, a.stand_off_m) == (b.bone, b.along, b.stand_off_m) and min(turn, 360.0 - turn) < 1e-6


def _moves(
    now: Worn, movers: Sequence[Mover], along: float, around_deg: float, origin: dict[str, Place]
) -> Iterator[tuple[Worn, str]]:
    """Every set one step from here that can be worn, and what moved."""
    for mover in movers:
        lead = now[mover[0]]
        for d_along, d_around in ((along, 0.0), (-along, 0.0), (0.0, around_deg), (0.0, -around_deg)):
            there = _moved(lead, lead.along + d_along, lead.around_deg + d_around, origin)
            if refused(there):
                continue
            image = mirrored(there)
            places = list(now)
            places[mover[0]] = there
            for other in mover[1:]:
                places[other] = _moved(now[other], image.along, image.around_deg, origin)
            who = names(station_name(now[at]) for at in mover)
            how = f"along {lead.along:.2f} to {there.along:.2f}"
            if d_around:
                how = f"around {lead.around_deg:g} to {there.around_deg:g} deg"
            yield tuple(places), f"{who}: {how}"


def _moved(one: Place, along: float, around_deg: float, origin: dict[str, Place]) -> Place:
    """The same station elsewhere; back where it began it is the candidate again."""
    first = origin[station_name(one)]
    along, around_deg = round(along, 6), round(180.0 - (180.0 - around_deg) % 360.0, 6)
    there = replace(first, along=along, around_deg=around_deg)
    if _same_place(there, first):
        return first
    root = station_name(first)
    return replace(there, name=f"{root}@{along:.2f}/{around_deg:g}", moved_from=root)


def _best(now: Worn, moves: dict[Worn, str], measure: Measure) -> tuple[Worn, Step | None]:
    """The least cost of them if it is surely less than that of now."""
    costs = measure([now, *moves])
    by_name = {stations(one): one for one in (now, *moves)}
    whole, _ = complete({name: costs[one] for name, one in by_name.items()})
    here = whole.pop(stations(now), None)
    if here is None or not whole:
        return now, None
    order = in_order(whole)
    best = paired(here, whole[order[0]])
    p = holm([sign_flip_p(np.array([here[clip] - whole[name][clip] for clip in here])) for name in order])
    if best.mean is None or best.mean <= 0.0 or p[0] > SIGNIFICANCE:
        return now, None
    there = by_name[order[0]]
    return there, Step(order[0], moves[there], best.mean, best.low, best.high)
