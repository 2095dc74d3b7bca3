"""Named places for stations on the body: what a person calls them, and where the model has them.

A name of a place on one side, such as "right_hand", is one place; without the side it means both.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from harness.errors import BadInput, UnknownName

SIDES = ("right", "left")


@dataclass(frozen=True)
class NamedPlace:
    """A place on the skin that has a name; see `harness.body.mounts` for its coordinates."""

    name: str
    text: str
    """Where on the body it is, in words."""
    bone: str
    along: float
    """Position along the bone, 0 at its joint to 1 at its far end."""
    around_deg: float
    """Angle around the bone [deg]."""
    common: bool = False
    """Whether a question that names no places tries it: one place for each part of the body."""


def _both(
    name: str, text: str, bone: str, along: float, around_deg: float, *, common: bool = False
) -> tuple[NamedPlace, NamedPlace]:
    """A place on the right side and its mirror image, for which the angle has the other sign."""
    right = NamedPlace(f"right_{name}", f"{text}, right", f"r{bone}", along, around_deg, common)
    return right, NamedPlace(f"left_{name}", f"{text}, left", f"l{bone}", along, 0.0 - around_deg, common)


NAMED_PLACES: Mapping[str, NamedPlace] = MappingProxyType(
    {
        place.name: place
        for place in (
            NamedPlace("head", "forehead", "head", 1.0, 0.0, common=True),
            NamedPlace("torso", "breastbone", "thorax", 0.5, 0.0, common=True),
            NamedPlace("upper_back", "between the shoulder blades", "thorax", 0.5, 180.0),
            NamedPlace(
                "pelvis",
                "sacrum, on the midline of the back (a bone of the model that is rigid with the pelvis)",
                "lhipjoint",
                0.0,
                165.0,
                common=True,
            ),
            *_both("upper_arm", "outside of the upper arm, half way", "humerus", 0.5, 90.0, common=True),
            *_both("wrist", "back of the forearm, as a watch (the bone that carries its twist)", "wrist", 0.6, 90.0),
            *_both("hand", "back of the hand", "hand", 1.0, 90.0, common=True),
            *_both("thigh", "outside of the thigh, above the knee", "femur", 0.6, 90.0, common=True),
            *_both("shin", "front of the shin, half way", "tibia", 0.5, 0.0),
            *_both("ankle", "outside of the shin, above the ankle", "tibia", 0.9, 90.0, common=True),
            *_both("foot", "instep", "foot", 0.5, 0.0),
        )
    }
)
"""Name -> place, from the head down."""
COMMON_PLACES = tuple(place.name for place in NAMED_PLACES.values() if place.common)
"""The places that a question tries when it names none."""


def select_places(names: Iterable[str]) -> tuple[NamedPlace, ...]:
    """Places by name, without duplicates, from the head down; "hand" is both hands, and no names all common places.

    UnknownName gives the nearest name; BadInput for an empty one.
    """
    known = {**{name: (name,) for name in NAMED_PLACES}, **_pairs()}
    chosen = set[str]()
    for name in names:
        if not name:
            raise BadInput("An empty name of a place.", "Separate names by commas: head,right_hand.")
        if name not in known:
            raise UnknownName("place", name, known)
        chosen.update(known[name])
    return tuple(place for place in NAMED_PLACES.values() if place.name in (chosen or COMMON_PLACES))


def _pairs() -> dict[str, tuple[str, ...]]:
    """Name without a side -> the names of both places."""
    bare = [name.removeprefix("right_") for name in NAMED_PLACES if name.startswith("right_")]
    return {name: tuple(f"{side}_{name}" for side in SIDES) for name in bare}
