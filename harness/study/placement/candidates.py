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

What may be worn by itself is a `Unit`: one place, or a mirrored pair.
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from harness.body.mounts import Mount, place
from harness.core.humanoid24 import standard_skeleton
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, HarnessError
from harness.experiment.scenario import Station
from harness.results.placement_findings import Place

Pair = Literal["", "each", "together"]
Unit = tuple[Place, ...]
"""Worn together or not at all."""
Worn = tuple[Place, ...]
"""A set of trackers, in the order of the candidates."""
_OTHER: dict[str, Literal["left", "right"]] = {"left": "right", "right": "left"}
_SIDES: dict[str, Literal["left", "right"]] = {"l": "left", "r": "right"}


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

    def units(self) -> tuple[Unit, ...]:
        """BadInput for a pair in the middle of the body, or a name that says another side than the bone."""
        side = side_of(self.bone, self.along)
        one = Place(self.name, self.bone, self.along, self.around_deg, self.stand_off_m, side)
        if not self.pair:
            return ((one,),)
        if not one.side:
            what = f"Candidate {self.name!r} is a pair on {self.bone}, which is in the middle."
            raise BadInput(what, "Leave `pair` out, or name a bone of one side.")
        bare = self.name.removeprefix("left_").removeprefix("right_")
        if self.name not in (bare, f"{one.side}_{bare}"):
            raise BadInput(f"Candidate {self.name!r} sits on {self.bone}.", f"Call it {bare!r}: both sides are meant.")
        one = replace(one, name=f"{one.side}_{bare}")
        both = tuple(sorted((one, mirrored(one)), key=lambda each: each.side, reverse=True))  # the right one first
        return (both,) if self.pair == "together" else tuple((each,) for each in both)


@dataclass(frozen=True)
class Grid:
    """One [[grid]]: a candidate for each bone, position and angle."""

    bones: tuple[str, ...]
    along: tuple[float, ...]
    around_deg: tuple[float, ...]
    stand_off_m: float = 0.01
    pair: Pair = ""

    def units(self) -> tuple[Unit, ...]:
        found = itertools.product(self.bones, self.along, self.around_deg)
        each = [Candidate(self._name(*at), *at, self.stand_off_m, self.pair).units() for at in found]
        return tuple(itertools.chain.from_iterable(each))

    def _name(self, bone: str, along: float, around_deg: float) -> str:
        """Such as "rtibia_50_90", or "tibia_50_90" of a pair: per cent along, degrees around."""
        sided = bool(self.pair) and other_bone(bone) != bone
        return f"{bone[1:] if sided else bone}_{100 * along:g}_{around_deg:g}"


def side_of(bone: str, along: float) -> Literal["", "left", "right"]:
    """Of the body; "" in the middle, where the hip bones begin as well."""
    standard_skeleton().index(bone)
    middle = other_bone(bone) == bone or (bone in ("lhipjoint", "rhipjoint") and along == 0.0)
    return "" if middle else _SIDES[bone[0]]


def other_bone(bone: str) -> str:
    """On the other side; the same in the middle."""
    swapped = {"l": "r", "r": "l"}.get(bone[0], "") + bone[1:]
    return swapped if swapped in standard_skeleton().names else bone


def mirrored(one: Place) -> Place:
    """The same place on the other side: the mirror image of a point of the skin is a point of the other's skin.

    Angles grow by the right-hand rule about the bone's direction, which a mirror reverses.
    """
    moved = replace(one, bone=other_bone(one.bone), around_deg=0.0 - one.around_deg)
    if not one.side:
        return moved
    other = _OTHER[one.side]
    return replace(moved, name=f"{other}_{one.name.removeprefix(f'{one.side}_')}", side=other)


def units_of(tables: Iterable[Candidate | Grid], skeleton: Skeleton | None = None) -> tuple[Unit, ...]:
    """All that a study may let a performer wear; BadInput names every place without flesh, and names given twice."""
    units = tuple(itertools.chain.from_iterable(table.units() for table in tables))
    places = [one for unit in units for one in unit]
    names = [one.name for one in places]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise BadInput(f"Candidates called {', '.join(map(repr, twice))} twice.", "Each has a name of its own.")
    if not units:
        raise BadInput("No candidates.", "Name places in [[candidate]] or [[grid]].")
    if bad := [f"{one.name} ({text})" for one in places if (text := refused(one, skeleton))]:
        raise BadInput(f"{len(bad)} of {len(places)} candidates cannot be worn: {'; '.join(bad)}", "Leave them out.")
    return units


def refused(one: Place, skeleton: Skeleton | None = None) -> str:
    """Why nobody can wear a tracker there; "" if they can. By default on the standard body."""
    if not 0.0 <= one.along <= 1.0:
        return f"along = {one.along:g}, not from 0 to 1"
    if not 0.0 <= one.stand_off_m < 1.0:
        return f"stand_off_m = {one.stand_off_m:g}, not from 0"
    try:
        place(skeleton or standard_skeleton(), mount(one))
    except HarnessError as error:
        return error.what if isinstance(error, BadInput) else str(error)
    return ""


def mount(one: Place) -> Mount:
    return Mount(station_name(one), one.bone, one.along, math.radians(one.around_deg), one.stand_off_m)


def station(one: Place) -> Station:
    return Station(one.bone, one.along, one.around_deg, one.stand_off_m)


def station_name(one: Place) -> str:
    """What the stream calls it: one that was moved keeps its name, and with it its draws of noise."""
    return one.moved_from or one.name


def worn(units: Iterable[Unit], order: Sequence[Unit]) -> Worn:
    """The places of some units, each once, in the order of the candidates."""
    taken = set(itertools.chain.from_iterable(units))
    return tuple(one for unit in order for one in unit if one in taken)


def chosen(names: Sequence[str], units: Sequence[Unit], where: str) -> tuple[Unit, ...]:
    """The units that these names stand for, () for all: of a place, or "ankle" for both of a pair. BadInput."""
    if not names:
        return tuple(units)
    found: dict[Unit, None] = {}
    for name in names:
        meant = [unit for unit in units if any(name in called(one) for one in unit)]
        if not meant:
            known = ", ".join(one.name for unit in units for one in unit)
            raise BadInput(f"{where} names {name!r}, which is no candidate.", f"Known: {known}.")
        found |= dict.fromkeys(meant)
    return tuple(unit for unit in units if unit in found)


def called(one: Place) -> Iterator[str]:
    """Its name, and the name of the pair that it is of."""
    yield one.name
    if one.side:
        yield one.name.removeprefix(f"{one.side}_")
