"""Named places: each is on the skin of its bone, sides are mirror images, and names are found or refused."""

import math

import pytest

from harness.body.mounts import DEFAULT_MOUNTS, Mount, locate_mount
from harness.body.places import COMMON_PLACES, NAMED_PLACES, select_places
from harness.core.humanoid24 import standard_skeleton
from harness.errors import BadInput, UnknownName


@pytest.mark.parametrize("name", NAMED_PLACES)
def test_every_place_is_on_its_bone(name: str) -> None:
    place = NAMED_PLACES[name]
    assert place.name == name
    at_m, _ = locate_mount(
        standard_skeleton(), Mount(name, place.bone, place.along, math.radians(place.around_deg), 0.0)
    )
    bone = standard_skeleton().bone_m[standard_skeleton().index(place.bone)]
    assert 0.0 < sum((at_m - place.along * bone) ** 2) ** 0.5 < 0.25


def test_sides_are_mirror_images() -> None:
    for name, right in NAMED_PLACES.items():
        if name.startswith("right_"):
            left = NAMED_PLACES[name.replace("right_", "left_")]
            assert (left.bone[1:], left.along, left.around_deg) == (right.bone[1:], right.along, -right.around_deg)
            assert (right.bone[0], left.bone[0], left.common) == ("r", "l", right.common)
            assert left.text == right.text.replace(", right", ", left")


def test_stations_that_scenarios_name_are_at_the_place_of_that_name() -> None:
    for name, mount in DEFAULT_MOUNTS.items():
        place = NAMED_PLACES[name]
        assert (mount.bone, mount.along) == (place.bone, place.along)
        assert math.degrees(mount.around_rad) == pytest.approx(place.around_deg)


def test_places_are_selected_from_the_head_down() -> None:
    assert [p.name for p in select_places(["left_thigh", "hand", "head", "left_hand"])] == [
        *("head", "right_hand", "left_hand", "left_thigh")
    ]
    assert tuple(p.name for p in select_places([])) == COMMON_PLACES
    assert len(COMMON_PLACES) == 11
    assert len({NAMED_PLACES[name].bone for name in COMMON_PLACES}) == 11


def test_unknown_places_are_refused_with_the_nearest_name() -> None:
    with pytest.raises(UnknownName, match=r"no place called 'hand_r'\. Did you mean 'hand'\?"):
        select_places(["hand_r"])
    with pytest.raises(UnknownName, match="Did you mean 'left_thigh'"):
        select_places(["left_tigh"])
    with pytest.raises(BadInput, match="empty name"):
        select_places(["head", ""])
