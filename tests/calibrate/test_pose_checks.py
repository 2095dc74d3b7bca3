"""Which rotations of stations are taken for straps and for boresights, at their limits; rotations in words."""

import numpy as np
import pytest

from harness.body import DEFAULT_MOUNTS, locate_mount
from harness.calibrate.pose_checks import estimate_boresight_rad, rotation_text, strap_hints
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.core.seeds import generator


def off_z(tilt_deg: float, angle_deg: float = 90.0) -> Floats:
    """A rotation vector about an axis that is tilted from z towards x [rad]."""
    tilt = np.deg2rad(tilt_deg)
    turn_rad: Floats = np.deg2rad(angle_deg) * np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    return turn_rad


@pytest.mark.parametrize(
    ("turn_rad", "said"),
    [
        (off_z(0.0), "90 deg about z"),
        (off_z(19.0), "90 deg about z"),
        (-off_z(0.0, 30.0), "-30 deg about z"),
        (off_z(22.0), "90 deg about (0.4, 0.0, 0.9)"),
    ],
)
def test_an_axis_of_the_station_names_the_rotation_if_it_is_near(turn_rad: Floats, said: str) -> None:
    assert rotation_text(turn_rad) == said


def test_a_strap_is_named_from_30_degrees_on() -> None:
    names, skeleton = ("left_wrist", "torso", "head"), standard_skeleton()
    mounts = [DEFAULT_MOUNTS[name] for name in names]
    nominal = np.array([locate_mount(skeleton, mount)[1] for mount in mounts])
    turned = rotations.multiply(nominal, rotations.exp(np.deg2rad([29.0, 31.0, 0.0])[:, None] * [1.0, 0.0, 0.0]))
    (hint,) = strap_hints(skeleton, mounts, turned)
    assert hint.startswith("station 2 (torso) is rotated by 31 deg about x on its strap")


@pytest.mark.parametrize(
    ("angle_deg", "miss_deg", "found_deg"), [(31.0, 0.0, 31.0), (29.0, 0.0, 0.0), (45.0, 10.0, 45.0), (45.0, 22.0, 0.0)]
)
def test_a_boresight_is_found_from_30_degrees_on_where_it_explains_the_angles(
    angle_deg: float, miss_deg: float, found_deg: float
) -> None:
    """Poses missed by 10 deg on each axis leave 0.15 of the squared angles, by 22 deg 0.45; 0.3 is the limit."""
    draw = generator(4, "boresight")
    turn = draw.normal(size=(8, 1, 4))
    world_from_bone = rotations.to_matrix(turn / np.linalg.norm(turn, axis=-1, keepdims=True))
    room, missed = (
        rotations.to_matrix(rotations.exp(np.deg2rad(vector)))
        for vector in (angle_deg * np.array([0.0, 0.0, 1.0]), miss_deg * draw.normal(size=(8, 1, 3)))
    )
    (found_rad,) = estimate_boresight_rad(world_from_bone, room @ world_from_bone @ missed)
    np.testing.assert_allclose(np.rad2deg(found_rad), [0.0, 0.0, found_deg], atol=6.0 if miss_deg else 0.1)
