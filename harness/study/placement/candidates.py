"""Candidate places for stations: bone, position along it and angle around it; single, in pairs and in grids.

    [[candidate]]
    name = "ankle"       # right_ankle and left_ankle
    bone = "rtibia"
    along = 0.9
    around_deg = 90.0
    pair = "each"        # also its mirror image, independently; "together": both or neither

    [[grid]]             # all combinations: tibia_50_90 is half way along, 90 deg around
    bones = ["rtibia", "rfemur"]
    along = [0.3, 0.5]
    around_deg = [0.0, 90.0]
    pair = "together"

A `CandidateGroup` is one place, or a mirrored pair that is used together.
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from harness.body import Mount, locate_mount
from harness.core.humanoid24 import standard_skeleton
from harness.core.ranges import Name, Range
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, HarnessError
from harness.results.findings import CandidatePlace, StationNames

Pair = Literal["", "each", "together"]
CandidateGroup = tuple[CandidatePlace, ...]
"""Places that are used together."""
StationSet = tuple[CandidatePlace, ...]
"""A set of places, in the order of the candidates."""
_OPPOSITE_SIDE: dict[str, Literal["left", "right"]] = {"left": "right", "right": "left"}
MOST_PLACES = 10_000
"""Most places of a grid [choice]."""
_SIDE_BY_PREFIX: dict[str, Literal["left", "right"]] = {"l": "left", "r": "right"}


@dataclass(frozen=True)
class Candidate:
    """One [[candidate]] of a study."""

    name: Name
    bone: Name
    along: Annotated[float, Range(0.0, 1.0)] = 0.5
    """Position along the bone, 0 at its joint to 1 at its far end."""
    around_deg: Annotated[float, Range(-360.0, 360.0)] = 0.0
    """Angle around the bone [deg] (see `harness.body.mounts`)."""
    stand_off_m: Annotated[float, Range(0.0, 0.5)] = 0.01
    """Distance of the station's origin from the skin [m]."""
    pair: Pair = ""
    """Also use the mirror image: `each` independently, or both `together`; "" for the place alone."""

    def groups(self) -> tuple[CandidateGroup, ...]:
        """The groups of places; BadInput for a pair in the middle of the body, or a name that contradicts the side."""
        side = body_side(self.bone, self.along)
        place = CandidatePlace(self.name, self.bone, self.along, self.around_deg, self.stand_off_m, side)
        if not self.pair:
            return ((place,),)
        if not place.side:
            fault = f"Candidate {self.name!r} is a pair, but {self.bone} is in the middle of the body."
            raise BadInput(fault, "Leave `pair` out, or name a bone of one side.")
        bare = self.name.removeprefix("left_").removeprefix("right_")
        if self.name not in (bare, f"{place.side}_{bare}"):
            raise BadInput(
                f"Candidate {self.name!r} is on {self.bone}.", f"Name it {bare!r}, since it stands for both sides."
            )
        place = replace(place, name=f"{place.side}_{bare}")
        both = tuple(
            sorted((place, mirror_place(place)), key=lambda each: each.side, reverse=True)
        )  # the right one first
        return (both,) if self.pair == "together" else tuple((each,) for each in both)


@dataclass(frozen=True)
class CandidateGrid:
    """One [[grid]]: a candidate for each bone, position and angle."""

    bones: tuple[str, ...]
    along: Annotated[tuple[float, ...], Range(0.0, 1.0)]
    around_deg: Annotated[tuple[float, ...], Range(-360.0, 360.0)]
    stand_off_m: Annotated[float, Range(0.0, 0.5)] = 0.01
    pair: Pair = ""

    def groups(self) -> tuple[CandidateGroup, ...]:
        """The groups of places of all combinations."""
        count = len(self.bones) * len(self.along) * len(self.around_deg)
        if count > MOST_PLACES:
            raise BadInput(f"A grid of {count:,} places.", f"At most {MOST_PLACES:,}: choose coarser steps.")
        places = itertools.product(self.bones, self.along, self.around_deg)
        groups = [Candidate(self._name(*place), *place, self.stand_off_m, self.pair).groups() for place in places]
        return tuple(itertools.chain.from_iterable(groups))

    def _name(self, bone: str, along: float, around_deg: float) -> str:
        """The name of a place: "rtibia_50_90", or "tibia_50_90" for a pair (per cent along, degrees around)."""
        sided = bool(self.pair) and opposite_bone(bone) != bone
        return f"{bone[1:] if sided else bone}_{100 * along:g}_{around_deg:g}"


def body_side(bone: str, along: float) -> Literal["", "left", "right"]:
    """The side of the body; "" in the middle, where the hip bones also begin."""
    standard_skeleton().index(bone)
    middle = opposite_bone(bone) == bone or (bone in ("lhipjoint", "rhipjoint") and along == 0.0)
    return "" if middle else _SIDE_BY_PREFIX[bone[0]]


def opposite_bone(bone: str) -> str:
    """The bone on the other side; for a bone in the middle, the same."""
    swapped = {"l": "r", "r": "l"}.get(bone[0], "") + bone[1:]
    return swapped if swapped in standard_skeleton().names else bone


def mirror_place(place: CandidatePlace) -> CandidatePlace:
    """The mirror image of a place on the other side of the body.

    Angles around a bone follow the right-hand rule about its direction. Mirroring reverses their sign.
    """
    moved = replace(place, bone=opposite_bone(place.bone), around_deg=0.0 - place.around_deg)
    if not place.side:
        return moved
    other = _OPPOSITE_SIDE[place.side]
    return replace(moved, name=f"{other}_{place.name.removeprefix(f'{place.side}_')}", side=other)


def make_candidate_groups(
    tables: Iterable[Candidate | CandidateGrid], skeleton: Skeleton | None = None
) -> tuple[CandidateGroup, ...]:
    """All candidates of a study; BadInput lists impossible places and duplicate names."""
    units = tuple(itertools.chain.from_iterable(table.groups() for table in tables))
    places = [place for unit in units for place in unit]
    names = [place.name for place in places]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise BadInput(f"Duplicate names of candidates: {', '.join(map(repr, twice))}.", "Give each a name of its own.")
    if not units:
        raise BadInput("No candidates.", "Name places in [[candidate]] or [[grid]].")
    if bad := [f"{place.name} ({text})" for place in places if (text := placement_fault(place, skeleton))]:
        raise BadInput(f"{len(bad)} of {len(places)} candidates are impossible: {'; '.join(bad)}", "Leave them out.")
    return units


def placement_fault(place: CandidatePlace, skeleton: Skeleton | None = None) -> str:
    """Explain why a station cannot be placed there, by default on the standard body; "" where it can."""
    if not 0.0 <= place.along <= 1.0:
        return f"along = {place.along:g}, not in 0 to 1"
    if not 0.0 <= place.stand_off_m < 1.0:
        return f"stand_off_m = {place.stand_off_m:g}, not in 0 to 1"
    try:
        locate_mount(skeleton or standard_skeleton(), to_mount(place))
    except HarnessError as error:
        return error.what if isinstance(error, BadInput) else str(error)
    return ""


def to_mount(place: CandidatePlace) -> Mount:
    """The mount of a place."""
    return Mount(station_name(place), place.bone, place.along, math.radians(place.around_deg), place.stand_off_m)


def station_name(place: CandidatePlace) -> str:
    """Name of the station in the stream. A moved station keeps its name, and with it its random draws of noise."""
    return place.moved_from or place.name


def station_set(units: Iterable[CandidateGroup], order: Sequence[CandidateGroup]) -> StationSet:
    """The places of some units without duplicates, in the order of the candidates."""
    selected = set(itertools.chain.from_iterable(units))
    return tuple(place for unit in order for place in unit if place in selected)


def names_of_places(stations: StationSet) -> StationNames:
    """Names of the places of a set."""
    return tuple(place.name for place in stations)


def select_groups(names: Sequence[str], units: Sequence[CandidateGroup], where: str) -> tuple[CandidateGroup, ...]:
    """Select units by names of places or of pairs, such as "ankle"; all units without names. BadInput."""
    if not names:
        return tuple(units)
    selected: dict[CandidateGroup, None] = {}
    for name in names:
        matching = [unit for unit in units if any(name in candidate_names(place) for place in unit)]
        if not matching:
            known = ", ".join(place.name for unit in units for place in unit)
            raise BadInput(f"{where} has {name!r}, which is not a candidate.", f"The candidates are {known}.")
        selected |= dict.fromkeys(matching)
    return tuple(unit for unit in units if unit in selected)


def candidate_names(place: CandidatePlace) -> Iterator[str]:
    """Yield the name of a place, and the name of its pair."""
    yield place.name
    if place.side:
        yield place.name.removeprefix(f"{place.side}_")
