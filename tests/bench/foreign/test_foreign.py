"""The estimators of others on planted poses, what a pair is held to, and the streams of HARNESS_REAL."""

import math
from pathlib import Path

import numpy as np
import pytest

from harness.bench.foreign import references
from harness.bench.foreign.benchmark import describe_stream
from harness.bench.foreign.pair_statements import pair_statements
from harness.bench.foreign.streams import NoRealStreams, StreamPair, real_folder, stream_pairs
from harness.core import rotations
from harness.core.arrays import Floats
from harness.measure import MeasuredPoses, TruthPoses, measure_allan
from tests.command import Command
from tests.measure.foreign_streams import MOUNT, MOUNT_M, Source, foreign_pair
from tests.measure.moving_bodies import Tracker

QUIET = Tracker(offset_s=3.7, rate_hz=370.0)


def write_csv(path: Path, time_s: Floats, place: Floats, turn: Floats) -> Path:
    table = np.concatenate([1.5e9 + time_s[:, None], place, np.roll(turn, -1, axis=1)], axis=1)
    np.savetxt(path, table, delimiter=",", fmt=["%.2f", *["%.6f"] * 7])
    return path


def write_pair(folder: Path, capture: MeasuredPoses, truth: TruthPoses) -> StreamPair:
    folder.mkdir(parents=True, exist_ok=True)
    first = write_csv(folder / "phone.csv", capture.measured_s, capture.position_m, capture.tracker_from_station)
    return StreamPair(
        "set phone, vicon",
        first,
        write_csv(folder / "vicon.csv", truth.time_s, truth.position_m, truth.world_from_body),
    )


def keyframes(rng: np.random.Generator, noise_m: float) -> tuple[Floats, Floats]:
    """Poses (N, 4, 4) of a station and of its body."""
    body_m, body = rng.normal(size=(60, 3)), rotations.exp(rng.normal(size=(60, 3)))
    room = references.pose_matrices(np.array([[0.5, -1.0, 0.2]]), rotations.exp(np.array([[0.1, 0.7, -2.0]])))[0]
    mount = references.pose_matrices(MOUNT_M[None], MOUNT[None])[0]
    bodies = references.pose_matrices(body_m, body)
    stations = room @ bodies @ mount
    stations[:, :3, 3] += noise_m * rng.normal(size=(60, 3))
    return stations, bodies


def test_the_grid_search_finds_a_planted_offset(rng: np.random.Generator) -> None:
    capture, truth = foreign_pair(rng, Source(QUIET))
    assert references.search_offset(capture, truth, 3.69) == pytest.approx(3.7, abs=1e-3)


def test_each_solver_of_opencv_finds_a_planted_mount(rng: np.random.Generator) -> None:
    stations, bodies = keyframes(rng, 0.0)
    found = references.opencv_solutions(stations, bodies)
    assert len(found) == 7
    for name, one in found.items():
        np.testing.assert_allclose(one.mount[:3, 3], MOUNT_M, atol=1e-6, err_msg=name)
        place_m, turn_rad = references.hand_eye_residuals(stations, bodies, one)
        assert place_m < 1e-6, name
        assert turn_rad < 1e-6, name


def test_evo_and_allantools_tell_planted_numbers(rng: np.random.Generator) -> None:
    place = rng.normal(size=(400, 3))
    moved = 0.94 * rotations.rotate(MOUNT, place) + 0.003 * rng.normal(size=place.shape)
    scale, rms_m = references.evo_alignment(moved, place)
    assert scale == pytest.approx(-0.06, abs=1e-3)
    assert rms_m == pytest.approx(0.003 * math.sqrt(3.0), rel=0.1)
    found = measure_allan(place, np.ones(400, bool), 10.0, longest_s=8.0)
    np.testing.assert_allclose(references.allantools_deviation(place, 10.0, found.tau_s), found.deviation, rtol=1e-9)


def test_a_pair_whose_mounts_agree_is_held_to_their_median(rng: np.random.Generator, tmp_path: Path) -> None:
    rows = pair_statements(write_pair(tmp_path, *foreign_pair(rng, Source(QUIET))))
    verdicts = {row.text.partition(": ")[2]: row.verdict for row in rows}
    assert verdicts["mount, from OpenCV's median"] == "met"
    assert verdicts["offset, from that of the grid search"] == "met"
    assert verdicts["Allan deviation, from allantools"] == "met"
    assert len(rows) == 7


def test_a_pair_with_drift_is_held_to_the_least_residual(rng: np.random.Generator, tmp_path: Path) -> None:
    rows = pair_statements(write_pair(tmp_path, *foreign_pair(rng, Source())))
    (mount,) = (row for row in rows if "mount" in row.text)
    assert mount.text.endswith("mount, residual / OpenCV's least")
    assert mount.verdict == "met"
    assert mount.value is not None
    assert mount.value > 0.5


def test_a_refused_pair_has_its_reason_and_no_verdict(rng: np.random.Generator, tmp_path: Path) -> None:
    (row,) = pair_statements(write_pair(tmp_path, *foreign_pair(rng, Source(QUIET, turns=(0.8, 0.0, 0.0)))))
    assert (row.verdict, row.target) == ("", "")
    assert "one axis only" in row.measured


def test_a_stream_is_described_with_its_rate_and_the_scatter_of_neighbours(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    described = describe_stream(write_pair(tmp_path / "set", *foreign_pair(rng, Source(QUIET))).capture)
    assert described.text == "set phone: characterize"
    assert "Hz" in described.measured
    assert "scatter" in described.reference


def test_streams_are_paired_with_the_best_reference(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("camera.csv", "odometry.csv", "vicon.csv"):
        (tmp_path / "hand_eye" / "head").mkdir(parents=True, exist_ok=True)
        (tmp_path / "hand_eye" / "head" / name).touch()
    monkeypatch.setenv("HARNESS_REAL", str(tmp_path))
    names = [pair.name for pair in stream_pairs(real_folder())]
    assert names == ["head odometry, vicon", "head camera, vicon", "head camera, odometry"]
    monkeypatch.delenv("HARNESS_REAL")
    with pytest.raises(NoRealStreams, match="nothing measured is no pass"):
        real_folder()


def test_the_verb_refuses_without_streams(monkeypatch: pytest.MonkeyPatch, command: Command) -> None:
    monkeypatch.delenv("HARNESS_REAL", raising=False)
    assert "HARNESS_REAL" in command("bench", "foreign", code=2).err


@pytest.mark.long
def test_no_target_is_missed_on_the_real_streams(real: Path, command: Command) -> None:
    said = command("bench", "foreign")
    assert "0 of 25 targets missed" in said.out
    assert "arm_sim camera, hand: refused" in said.out
