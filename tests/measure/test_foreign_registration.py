"""Pairs of foreign streams with planted values: what is found lies in its interval, or the pair is refused."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core import rotations
from harness.core.seeds import generator
from harness.errors import BadInput, NotComparable
from harness.measure.pose_directions import find_directions, same_directions
from harness.measure.pose_registration import register_poses
from harness.measure.pose_series import MeasuredPoses, TruthPoses
from harness.measure.registration import Registration
from tests.measure.foreign_streams import MOUNT, MOUNT_M, Source, foreign_pair
from tests.measure.moving_bodies import Tracker

PAIR = {"body": "body"}
QUIET = Source(replace(Source().tracker, white=(0.0, 0.0), drift=(0.0, 0.0)))


def register(
    capture: MeasuredPoses, truth: TruthPoses, least: float = 0.6, noise: tuple[float, float] | None = None
) -> Registration:
    stations, truths, _ = same_directions({"body": capture}, {"body": truth}, PAIR)
    known = {"body": noise} if noise else None
    return register_poses(stations, truths, least_matched=least, plain=True, truth_noise=known)


def covered(found: Registration, tracker: Tracker) -> dict[str, bool]:
    values, mount = found.values, found.mounts["body"]
    offset_s = tracker.offset_s + tracker.ratio * (found.reference_s - 30.0)
    return {
        "offset": values["time_offset_orientation_s"].contains(offset_s),
        "offset of positions": values["time_offset_position_s"].contains(offset_s - tracker.ahead_s),
        "clock": values["clock_ratio_ppm"].contains(1e6 * tracker.ratio),
        "scale": values["scale"].contains(tracker.scale),
        **{f"mount {axis}": mount.position(axis).contains(float(MOUNT_M[axis])) for axis in range(3)},
        **{f"turn {axis}": turn.contains(0.0) for axis, turn in enumerate(mount.turn_from(MOUNT))},
    }


def test_exact_poses_at_rounded_uneven_times_give_the_planted_values(rng: np.random.Generator) -> None:
    found = register(*foreign_pair(rng, QUIET))
    assert found.values["time_offset_orientation_s"].value == pytest.approx(3.7, abs=5e-4)
    assert found.values["scale"].value == pytest.approx(-0.06, abs=1e-3)
    np.testing.assert_allclose(found.mounts["body"].position_m, MOUNT_M, atol=1e-3)
    assert rotations.angle_between_rad(found.mounts["body"].body_from_station, MOUNT) < 1e-3
    assert found.matched == pytest.approx(1.0 - 3.5 / 60.0, abs=0.04)
    assert min(found.explained["body"]) > 0.999
    assert found.values["heading_rad"].value == 0.0


def test_planted_values_lie_in_their_intervals() -> None:
    """Of 8 pairs with gaps, drift, a scale of -6 %, an offset of seconds and signs that flip."""
    tracker = replace(Source().tracker, ratio=80e-6, ahead_s=0.004)
    inside: list[bool] = []
    for seed in range(8):
        pair = foreign_pair(generator(seed, "foreign"), Source(tracker))
        inside += covered(register(*pair), tracker).values()
    assert np.mean(inside) >= 0.88


@pytest.mark.slow
def test_intervals_hold_the_planted_values_in_95_of_100_pairs() -> None:
    tracker, shares = replace(Source().tracker, ratio=80e-6, ahead_s=0.004), dict[str, list[bool]]()
    for seed in range(150):
        found = covered(register(*foreign_pair(generator(seed, "foreign slow"), Source(tracker))), tracker)
        for key, inside in found.items():
            shares.setdefault(key, []).append(inside)
    print({key: float(np.mean(values)) for key, values in shares.items()})
    assert all(np.mean(values) >= 0.9 for values in shares.values())


@pytest.mark.parametrize("capture", [False, True])
@pytest.mark.parametrize("truth", [False, True])
def test_poses_of_the_other_direction_are_found(capture: bool, truth: bool, rng: np.random.Generator) -> None:
    pair = foreign_pair(rng, replace(Source(), capture_inverted=capture, truth_inverted=truth))
    found = find_directions({"body": pair[0]}, {"body": pair[1]}, PAIR)
    assert (found.capture, found.truth) == (capture, truth)
    assert bool(found.reason) == (capture or truth)
    np.testing.assert_allclose(register(*pair).mounts["body"].position_m, MOUNT_M, atol=0.02)


def test_motion_about_one_axis_is_refused(rng: np.random.Generator) -> None:
    with pytest.raises(NotComparable, match="about one axis only"):
        register(*foreign_pair(rng, replace(QUIET, turns=(0.8, 0.0, 0.0))))


def test_drift_of_a_sixth_of_the_motion_is_measured_and_other_axes_are_refused(rng: np.random.Generator) -> None:
    drifting = replace(Source().tracker, drift=(0.06, 0.02), correlation_s=20.0)
    capture, truth = foreign_pair(rng, Source(drifting))
    assert register(capture, truth).explained["body"][0] > 0.8
    quarter = rotations.rotate(rotations.about_z(np.pi / 2.0), truth.position_m)
    with pytest.raises(BadInput, match="Positions of capture or reference disagree with their orientations"):
        register_poses({"body": capture}, {"body": replace(truth, position_m=quarter)}, plain=True, least_matched=0.6)


def test_another_motion_is_refused_with_its_correlation(rng: np.random.Generator) -> None:
    capture, (_, truth) = foreign_pair(rng, QUIET)[0], foreign_pair(rng, QUIET)
    with pytest.raises(BadInput, match=r"correlate by 0\.\d\d at best"):
        register_poses({"body": capture}, {"body": truth}, plain=True, least_matched=0.1)


def test_a_stream_that_is_incomplete_is_accepted_where_it_is_allowed(rng: np.random.Generator) -> None:
    pair = foreign_pair(rng, replace(QUIET, gap_s=((5.0, 15.0), (30.0, 42.0))))
    with pytest.raises(NotComparable, match=r"6\d\.\d % of the records due .*--least-matched"):
        register(*pair, least=0.95)
    assert register(*pair).matched == pytest.approx(1.0 - 22.0 / 60.0, abs=0.03)


def test_odometry_that_runs_away_at_the_end_is_registered_by_the_rest(rng: np.random.Generator) -> None:
    capture, truth = foreign_pair(rng, QUIET)
    lost_s = np.maximum(capture.measured_s - capture.measured_s[0] - 50.0, 0.0)
    away = MeasuredPoses(
        capture.measured_s, capture.position_m + lost_s[:, None] ** 2, capture.tracker_from_station, capture.valid
    )
    found = register(away, truth)
    assert found.values["scale"].value == pytest.approx(-0.06, abs=5e-3)
    np.testing.assert_allclose(found.mounts["body"].position_m, MOUNT_M, atol=5e-3)
    errors = found.errors["body"]
    assert not errors.used[errors.valid & (np.linalg.norm(errors.position_m, axis=1) > 1.0), 0].any()


def test_noise_of_the_reference_is_corrected_and_widens_the_intervals() -> None:
    """White noise of 2 mm and 0.5 deg at 100 poses a second makes the error along the velocity come out too small."""
    tracker, noise = replace(QUIET.tracker, ahead_s=0.02, scale=0.0), (0.002, float(np.deg2rad(0.5)))
    source = Source(tracker, truth_noise=noise, gap_s=())
    known, ignored, width = [], [], []
    for seed in range(3):
        pair = foreign_pair(generator(seed, "reference"), source)
        plain, corrected = register(*pair), register(*pair, noise=noise)
        ignored.append(plain.values["position_ahead_s"].value)
        known.append(corrected.values["position_ahead_s"])
        width.append(
            known[-1].high - known[-1].low
            > plain.values["position_ahead_s"].high - plain.values["position_ahead_s"].low
        )
    assert abs(np.mean([one.value for one in known]) - 0.02) < 0.5 * abs(np.mean(ignored) - 0.02)
    assert all(one.contains(0.02) for one in known)
    assert all(width)
