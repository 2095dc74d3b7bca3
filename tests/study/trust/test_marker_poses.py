"""Poses of clusters of markers: a rigid body is fitted, and markers that fix no pose are refused."""

from pathlib import Path

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints
from harness.errors import BadFile
from harness.mocap import MarkerClip
from harness.stream import BodyPoses
from harness.study.trust.marker_poses import fit_markers

PATH = Path("bar.c3d")
SHAPE_M = np.array([[0.05, 0.0, 0.0], [0.0, 0.06, 0.0], [0.0, 0.0, 0.07], [0.03, -0.04, 0.02]])
FRAMES = 60


def poses() -> tuple[Floats, Floats]:
    """Positions (T, 3) [m] and orientations (T, 4) of a body that moves about all axes."""
    phase = np.linspace(0.0, 6.0, FRAMES)[:, None] * np.array([1.0, 1.3, 0.7])
    return 0.3 * np.sin(phase) + [0.0, 0.0, 1.0], rotations.exp(np.cos(phase))


def markers(
    labels: list[str], seen: Bools | None = None, noise_m: float = 0.0, shape_m: Floats = SHAPE_M
) -> MarkerClip:
    """Markers of the body, the first ones of the shape; `seen` (T, M) hides some."""
    place, turn = poses()
    points = place[:, None] + rotations.rotate(turn[:, None], shape_m[None, : len(labels)])
    points += noise_m * np.random.default_rng(1).normal(size=points.shape)
    if seen is not None:
        points = np.where(seen[..., None], points, np.nan)
    return MarkerClip("bar", "bar", tuple(labels), 100.0, points, 0.001, "", "")


def names(count: int, station: str = "head") -> list[str]:
    return [f"{station}_{number + 1}" for number in range(count)]


def relative(body: BodyPoses, rows: Ints | slice) -> tuple[Floats, Floats]:
    """The mount that relates a fitted body to the moved one: constant for a rigid body. Positions, rotation vectors."""
    place, turn = poses()
    back = rotations.inverse(body.quaternions)
    offset_m = rotations.rotate(back, place[rows] - body.positions_m)
    return offset_m, rotations.log(rotations.multiply(back, turn[rows]))


@pytest.mark.parametrize("count", [3, 4])
def test_markers_of_a_rigid_body_move_with_it(count: int) -> None:
    log = fit_markers(PATH, markers(names(count))).log
    offset_m, turn = relative(log.body("head"), slice(None))
    assert np.ptp(offset_m, axis=0).max() < 1e-9
    assert np.ptp(turn, axis=0).max() < 1e-7
    assert str(log.findings[0]).startswith(f"body head: {count} markers that fit a rigid body to")
    np.testing.assert_allclose(log.body("head").times_s, np.arange(FRAMES) / 100.0)


def test_a_hidden_marker_of_four_changes_nothing_and_two_hide_the_body() -> None:
    seen = np.ones((FRAMES, 4), bool)
    seen[10:20, 2] = seen[30:35, 1:3] = False
    body = fit_markers(PATH, markers(names(4), seen)).log.body("head")
    rows = np.rint(body.times_s * 100.0).astype(int)
    assert sorted(set(range(FRAMES)) - set(rows.tolist())) == list(range(30, 35))
    offset_m, _ = relative(body, rows)
    assert np.ptp(offset_m, axis=0).max() < 1e-9


def test_the_residual_is_the_noise_of_the_markers() -> None:
    found = fit_markers(PATH, markers(names(4), noise_m=0.001))
    # 12 coordinates of a frame less 6 of the pose
    residual_mm = float(found.log.findings[0].value.split("to ")[1].split(" mm")[0])
    assert residual_mm == pytest.approx(np.sqrt(3.0 * 0.5), rel=0.1)
    _, turn_rad = relative(found.log.body("head"), slice(None))
    deviation_m, deviation_rad = found.noise["head"]
    assert deviation_m == pytest.approx(0.001 / np.sqrt(4.0), rel=0.1)
    assert deviation_rad == pytest.approx(float(np.sqrt(np.mean(np.var(turn_rad, axis=0)))), rel=0.25)


@pytest.mark.parametrize(
    "labels",
    [
        ["head_1", "head_2", "head_3"],
        ["HEAD1", "HEAD2", "HEAD3"],
        ["head-a", "head-b", "head-c"],
        ["Head 1", "Head.2", "head:3"],
    ],
)
def test_labels_are_the_station_and_a_number_or_a_letter(labels: list[str]) -> None:
    assert fit_markers(PATH, markers(labels)).log.names == ("head",)


@pytest.mark.parametrize(
    ("clip", "words"),
    [
        (markers(names(2)), "no three markers of one body among head_1, head_2"),
        (markers(names(3), shape_m=np.outer([0.0, 0.1, 0.2], [1.0, 0.0, 0.0])), "on one line"),
        (markers(names(3), np.arange(3) < np.full((FRAMES, 1), 2)), "no frame with all markers"),
        (markers(names(4), noise_m=0.1), "fit a rigid body to .* mm .* only"),
    ],
)
def test_markers_that_fix_no_pose_are_refused(clip: MarkerClip, words: str) -> None:
    with pytest.raises(BadFile, match=words):
        fit_markers(PATH, clip)


def test_labels_that_are_too_few_for_a_body_are_named() -> None:
    clip = markers([*names(3), "hand_1"])
    found = fit_markers(PATH, clip).log
    assert found.names == ("head",)
    assert "left out: hand_1 (a body needs three markers)" in map(str, found.findings)
