"""Rotations of stations in words."""

import numpy as np
import pytest

from harness.calibrate.pose_checks import rotation_text
from harness.core.arrays import Floats


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
