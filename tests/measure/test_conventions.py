"""Axes, units and quaternions of a reference that are not the package's, with the cause that is named."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.measure.conventions import (
    require_clock,
    require_orientations,
    require_positions,
    require_same_hand,
    require_scale,
)
from harness.measure.pose_registration import register_poses
from harness.measure.pose_series import MeasuredPoses, TruthPoses
from tests.measure.moving_bodies import Tracker, draw_mounts, move_bodies, report_poses

pytestmark = pytest.mark.long
NAMES = ("hand", "head")
NOISY = Tracker(scale=1e-3, ahead_s=0.002, offset_s=7.0, white=(0.00075, 0.0009), drift=(0.0015, 0.006))
MIRROR = np.array([1.0, -1.0, 1.0])
MIRROR_TURN = np.array([1.0, -1.0, 1.0, -1.0])
QUARTER_TURN = rotations.to_matrix(rotations.about_z(np.pi / 2.0))
INVERSE = np.array([1.0, -1.0, -1.0, -1.0])


@pytest.fixture(scope="module")
def capture() -> tuple[dict[str, MeasuredPoses], dict[str, TruthPoses]]:
    rng = np.random.default_rng(5)
    truths, mounts = move_bodies(rng, NAMES, 20.0), draw_mounts(rng, NAMES)
    return report_poses(rng, truths, mounts, NOISY), truths


def changed(truths: dict[str, TruthPoses], place: Floats | float, turn: Floats | float) -> dict[str, TruthPoses]:
    return {
        name: replace(
            one,
            position_m=one.position_m @ place.T
            if isinstance(place, np.ndarray) and place.ndim == 2
            else place * one.position_m,
            world_from_body=turn * one.world_from_body,
        )
        for name, one in truths.items()
    }


@pytest.mark.parametrize(
    ("place", "turn", "cause"),
    [
        (MIRROR, MIRROR_TURN, "are mirror images.*left-handed.*negate z"),
        (MIRROR, 1.0, "left-handed"),
        (-1.0, 1.0, "left-handed"),
        (100.0 * MIRROR, MIRROR_TURN, "left-handed"),
        (
            1.0,
            MIRROR_TURN,
            "Quaternions of one|disagree with their orientations|Positions of h",
        ),
        (QUARTER_TURN, 1.0, "Positions of capture or reference disagree with their orientations"),
        (np.array([1.0, 1.0, 0.5]), 1.0, "Positions of"),
        (1.0, INVERSE, "Quaternions of one|Positions of"),
        (1.0 / 0.3048, 1.0, "reference is in feet"),
        (1.0 / 0.0254, 1.0, "reference is in inches"),
        (100.0, 1.0, "reference is in centimetres"),
        (1000.0, 1.0, "reference is in millimetres"),
        (0.01, 1.0, "capture is in centimetres"),
        (1.0 / 0.79, 1.0, "0.79"),
        (1.0 / 1.21, 1.0, "1.21"),
    ],
)
def test_a_reference_of_other_conventions_is_refused_with_its_cause(
    capture: tuple[dict[str, MeasuredPoses], dict[str, TruthPoses]],
    place: Floats | float,
    turn: Floats | float,
    cause: str,
) -> None:
    stations, truths = capture
    with pytest.raises(BadInput, match=cause):
        register_poses(stations, changed(truths, place, turn))


@pytest.mark.parametrize("factor", [0.81, 1.0, 1.19])
def test_a_scale_error_of_a_tracker_is_measured(
    capture: tuple[dict[str, MeasuredPoses], dict[str, TruthPoses]], factor: float
) -> None:
    stations, truths = capture
    found = register_poses(stations, changed(truths, 1.0 / factor, 1.0)).values["scale"].value
    assert found == pytest.approx(1.001 * factor - 1.0, abs=0.002)


def test_the_nearest_unit_is_named() -> None:
    for factor, words in (
        (0.00102, "reference is in millimetres"),
        (0.29, "reference is in feet"),
        (39.0, "capture is in inches instead of metres"),
        (1e-6, "reference is in micrometres"),
        (0.3937, "capture is in inches instead of centimetres"),
        (2.54, "reference is in inches instead of centimetres"),
        (0.75, "scaled, by no usual unit"),
    ):
        with pytest.raises(BadInput, match=words):
            require_scale(factor)


@pytest.mark.parametrize("factor", [0.0, -0.001, -1.0, -1.0007])
def test_a_scale_below_zero_is_a_mirror(factor: float) -> None:
    with pytest.raises(BadInput, match="left-handed"):
        require_scale(factor)


@pytest.mark.parametrize("factor", [np.nan, np.inf])
def test_a_scale_that_is_no_number_is_refused(factor: float) -> None:
    with pytest.raises(BadInput, match="no scale"):
        require_scale(factor)


def test_motion_in_one_plane_is_in_no_mirror(rng: np.random.Generator) -> None:
    """A plane's mirror image is the plane turned over: nothing says that it is mirrored."""
    place = rng.normal(size=(100, 3)) * np.array([1.0, 1.0, 0.0])
    noise = 0.003 * rng.normal(size=(100, 3))
    require_same_hand([place + noise], [place * MIRROR])
    with pytest.raises(BadInput, match="mirror images"):
        require_same_hand([place + 10.0 * noise], [(place + 10.0 * noise) * MIRROR])


def test_orientations_that_disagree_by_little_are_those_of_a_tracker(rng: np.random.Generator) -> None:
    turns = rotations.log(rotations.exp(0.1 * rng.normal(size=(100, 3))))
    require_orientations([turns, turns])
    with pytest.raises(BadInput, match="disagree by 180 deg"):
        require_orientations([np.tile([np.pi, 0.0, 0.0], (300, 1)), turns])


def test_positions_that_do_not_follow_are_named(rng: np.random.Generator) -> None:
    small, large = 0.004 * rng.normal(size=(100, 3)), 0.2 * rng.normal(size=(100, 3))
    require_positions({"head": small, "hand": 1000.0 * small}, 1000.0, 0.1)
    with pytest.raises(BadInput, match=r"Positions of hand .* those of the other stations agree"):
        require_positions({"head": small, "hand": large}, 1.0, 0.0)
    for heading_rad, residual in ((0.0, large), (-1.5, small), (np.nan, small)):
        with pytest.raises(BadInput, match="disagree with their orientations"):
            require_positions({"head": residual}, 1.0, heading_rad)


def test_a_frame_rate_of_television_is_no_error_of_a_clock() -> None:
    for ratio, deviation in ((20e-6, 1e-6), (-200e-6, 5e-6), (1e-3, 4e-4)):
        require_clock(ratio, deviation)
    for ratio in (1.0 / 1001.0, -1.0 / 1001.0, 0.01):
        with pytest.raises(BadInput, match="frame rate of the reference is another one"):
            require_clock(ratio, 10e-6)
