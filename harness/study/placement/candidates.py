"""Places where a tracker could be worn: by bone, position along it and angle around it, alone, in pairs and in grids.

    [[candidate]]
    name = "ankle"       # right_ankle and left_ankle
    bone = "rtibia"
    along = 0.9
    around_deg = 90.0
    pair = "each"        # and its mirror image, to be worn or not by itself; "together": both or neither

    [[grid]]             # every combination: rtibia_50_90 sits half way along, 90 deg around
    bones = ["rtibia", "rfemur"]
    along = [0.3, 0.5]
    around_deg = [0.0, 90.0]
    pair = "together"

What may be worn by itself is a `CandidateGroup`: one place, or a mirrored pair.
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from harness.body.mounts import Mount, locate_mount
from harness.core.humanoid24 import standard_skeleton
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, HarnessError
from harness.experiment.scenario import Station
from harness.results.placement_findings import StationPlacement

Pair = Literal["", "each", "together"]
CandidateGroup = tuple[StationPlacement, ...]
"""Worn together or not at all."""
StationSet = tuple[StationPlacement, ...]
"""A set of trackers, in the order of the candidates."""
_OPPOSITE_SIDE: dict[str, Literal["left", "right"]] = {"left": "right", "right": "left"}
_SIDE_BY_PREFIX: dict[str, Literal["left", "right"]] = {"l": "left", "r": "right"}


@dataclass(frozen=True)
class Candidate:
    """One [[candidate]] of a study."""

    name: str
    bone: str
    along: float = 0.5
    """Position along the bone, 0 at its joint to 1 at its far end."""
    around_deg: float = 0.0
    """Angle around the bone [deg] (see `harness.body.mounts`)."""
    stand_off_m: float = 0.01
    """Distance of the tracker's origin from the skin [m]."""
    pair: Pair = ""
    """With its mirror image: `each` by itself, or both `together`."""

    def groups(self) -> tuple[CandidateGroup, ...]:
        """BadInput for a pair in the middle of the body, or a name that says another side than the bone."""
        side = body_side(self.bone, self.along)
        one = StationPlacement(self.name, self.bone, self.along, self.around_deg, self.stand_off_m, side)
        if not self.pair:
            return ((one,),)
        if not one.side:
            what = f"Candidate {self.name!r} is a pair on {self.bone}, which is in the middle."
            raise BadInput(what, "Leave `pair` out, or name a bone of one side.")
        bare = self.name.removeprefix("left_").removeprefix("right_")
        if self.name not in (bare, f"{one.side}_{bare}"):
            raise BadInput(f"Candidate {self.name!r} sits on {self.bone}.", f"Call it {bare!r}: both sides are meant.")
        one = replace(one, name=f"{one.side}_{bare}")
        both = tuple(sorted((one, mirror_place(one)), key=lambda each: each.side, reverse=True))  # the right one first
        return (both,) if self.pair == "together" else tuple((each,) for each in both)


@dataclass(frozen=True)
class CandidateGrid:
    """One [[grid]]: a candidate for each bone, position and angle."""

    bones: tuple[str, ...]
    along: tuple[float, ...]
    around_deg: tuple[float, ...]
    stand_off_m: float = 0.01
    pair: Pair = ""

    def groups(self) -> tuple[CandidateGroup, ...]:
        found = itertools.product(self.bones, self.along, self.around_deg)
        each = [Candidate(self._name(*at), *at, self.stand_off_m, self.pair).groups() for at in found]
        return tuple(itertools.chain.from_iterable(each))

    def _name(self, bone: str, along: float, around_deg: float) -> str:
        """Such as "rtibia_50_90", or "tibia_50_90" of a pair: per cent along, degrees around."""
        sided = bool(self.pair) and opposite_bone(bone) != bone
        return f"{bone[1:] if sided else bone}_{100 * along:g}_{around_deg:g}"


def body_side(bone: str, along: float) -> Literal["", "left", "right"]:
    """Of the body; "" in the middle, where the hip bones begin as well."""
    standard_skeleton().index(bone)
    middle = opposite_bone(bone) == bone or (bone in ("lhipjoint", "rhipjoint") and along == 0.0)
    return "" if middle else _SIDE_BY_PREFIX[bone[0]]


def opposite_bone(bone: str) -> str:
    """On the other side; the same in the middle."""
    swapped = {"l": "r", "r": "l"}.get(bone[0], "") + bone[1:]
    return swapped if swapped in standard_skeleton().names else bone


def mirror_place(one: StationPlacement) -> StationPlacement:
    """The same place on the other side: the mirror image of a point of the skin is a point of the other's skin.

    Angles grow by the right-hand rule about the bone's direction, which a mirror reverses.
    """
    moved = replace(one, bone=opposite_bone(one.bone), around_deg=0.0 - one.around_deg)
    if not one.side:
        return moved
    other = _OPPOSITE_SIDE[one.side]
    return replace(moved, name=f"{other}_{one.name.removeprefix(f'{one.side}_')}", side=other)


def make_candidate_groups(
    tables: Iterable[Candidate | CandidateGrid], skeleton: Skeleton | None = None
) -> tuple[CandidateGroup, ...]:
    """All that a study may let a performer wear; BadInput names every place without flesh, and names given twice."""
    units = tuple(itertools.chain.from_iterable(table.groups() for table in tables))
    places = [one for unit in units for one in unit]
    names = [one.name for one in places]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise BadInput(f"Candidates called {', '.join(map(repr, twice))} twice.", "Each has a name of its own.")
    if not units:
        raise BadInput("No candidates.", "Name places in [[candidate]] or [[grid]].")
    if bad := [f"{one.name} ({text})" for one in places if (text := placement_fault(one, skeleton))]:
        raise BadInput(f"{len(bad)} of {len(places)} candidates cannot be worn: {'; '.join(bad)}", "Leave them out.")
    return units


def placement_fault(one: StationPlacement, skeleton: Skeleton | None = None) -> str:
    """Why nobody can wear a tracker there; "" if they can. By default on the standard body."""
    if not 0.0 <= one.along <= 1.0:
        return f"along = {one.along:g}, not from 0 to 1"
    if not 0.0 <= one.stand_off_m < 1.0:
        return f"stand_off_m = {one.stand_off_m:g}, not from 0"
    try:
        locate_mount(skeleton or standard_skeleton(), to_mount(one))
    except HarnessError as error:
        return error.what if isinstance(error, BadInput) else str(error)
    return ""


def to_mount(one: StationPlacement) -> Mount:
    return Mount(station_name(one), one.bone, one.along, math.radians(one.around_deg), one.stand_off_m)


def to_station(one: StationPlacement) -> Station:
    return Station(one.bone, one.along, one.around_deg, one.stand_off_m)


def station_name(one: StationPlacement) -> str:
    """What the stream calls it: one that was moved keeps its name, and with it its draws of noise."""
    return one.moved_from or one.name


def station_set(units: Iterable[CandidateGroup], order: Sequence[CandidateGroup]) -> StationSet:
    """The places of some units, each once, in the order of the candidates."""
    taken = set(itertools.chain.from_iterable(units))
    return tuple(one for unit in order for one in unit if one in taken)


def select_groups(names: Sequence[str], units: Sequence[CandidateGroup], where: str) -> tuple[CandidateGroup, ...]:
    """The units that these names stand for, () for all: of a place, or "ankle" for both of a pair. BadInput."""
    if not names:
        return tuple(units)
    found: dict[CandidateGroup, None] = {}
    for name in names:
        meant = [unit for unit in units if any(name in candidate_names(one) for one in unit)]
        if not meant:
            known = ", ".join(one.name for unit in units for one in unit)
            raise BadInput(f"{where} names {name!r}, which is no candidate.", f"Known: {known}.")
        found |= dict.fromkeys(meant)
    return tuple(unit for unit in units if unit in found)


def candidate_names(one: StationPlacement) -> Iterator[str]:
    """Its name, and the name of the pair that it is of."""
    yield one.name
    if one.side:
        yield one.name.removeprefix(f"{one.side}_")
