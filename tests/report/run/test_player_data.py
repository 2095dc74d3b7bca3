"""What a run's player shows: whole clips with all methods, or the worst seconds of a large run."""

from pathlib import Path

import numpy as np
import pytest

from harness.body import DEFAULT_MOUNTS, Kinematics, build_body
from harness.core import rotations
from harness.core.estimate import HALF_WIDTH_95
from harness.report.kit.motion_player import NO_ESTIMATE, PlayerMotion
from harness.report.run import player_data
from harness.report.run.data import pose_pair, read_run
from harness.report.run.player_data import run_motion, station_poses
from harness.report.run.worst_window import WorstWindow, find_worst_window
from harness.score import compute_poses
from tests.planted import METHODS, Plan, planted_run

METRIC = "mpjpe_mm"


def motion_of(out: Path) -> tuple[PlayerMotion, str]:
    """The motion of a run, with the worst seconds of each method by one metric."""
    run = read_run(out)
    windows: dict[tuple[str, str], WorstWindow] = {}
    for t in run.traces:
        window = find_worst_window(t.key, METRIC, t.time_s, t.errors[METRIC], t.scored)
        if window is not None:
            windows[t.series, METRIC] = window
    return run_motion(run, windows, run.cell)


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return planted_run(
        tmp_path_factory.mktemp("player") / "run",
        Plan(duration_s=4.0, covered=0.8, components={"dropout": {"share": 0.1}}, sigma_deg={"ik": 3.0}),
    )


def test_every_clip_has_every_method_the_best_first(run_folder: Path) -> None:
    motion, note = motion_of(run_folder)
    assert note == ""
    assert [clip.name for clip in motion.clips] == ["walking_p1_01", "boxing_p1_01"]
    for clip in motion.clips:
        assert {track.name for track in clip.estimates} == set(METHODS)
        assert clip.estimates[0].name == "best_match+ik"
        assert clip.estimates[-1].name == "mean_pose"
    assert [moment.method for moment in motion.moments] == [track.name for track in motion.clips[0].estimates]
    assert all(motion.clips[moment.clip].name == "boxing_p1_01" for moment in motion.moments)


def test_frames_without_an_estimate_are_marked_and_others_are_the_cells(run_folder: Path) -> None:
    motion, _ = motion_of(run_folder)
    run, clip = read_run(run_folder), motion.clips[0]
    for track in clip.estimates:
        row = next(r for r in run.cells if r["method"] == track.name and r["clip"] == clip.name)
        cell = run.cell(str(row["key"]))
        answered = np.isin(np.round(clip.time_s * cell.rate_hz).astype(int), cell.frame_index)
        assert 0.6 < answered.mean() < 1.0
        np.testing.assert_array_equal(track.states == NO_ESTIMATE, ~answered)
        truth, estimate = pose_pair(cell, np.arange(len(cell)))
        np.testing.assert_array_equal(track.joints_m[answered], estimate.joints_m)
        assert clip.truth is not None
        np.testing.assert_array_equal(clip.truth.joints_m[answered], truth.joints_m)
        assert (cell.angle_sigma_rad is None) == (track.region_deg is None) == (track.name != "ik")
        if cell.angle_sigma_rad is not None and track.region_deg is not None:
            stated_deg = np.rad2deg(HALF_WIDTH_95 * cell.angle_sigma_rad.mean(axis=1))
            np.testing.assert_allclose(track.region_deg[answered], stated_deg, rtol=1e-6)
            assert np.isfinite(track.region_deg).all()


def test_stations_stand_where_mujoco_puts_them(run_folder: Path) -> None:
    motion, _ = motion_of(run_folder)
    run, clip = read_run(run_folder), motion.clips[0]
    cell = run.cell(str(next(r for r in run.cells if r["clip"] == clip.name)["key"]))
    assert clip.stations is not None
    assert tuple(clip.stations.names) == cell.stations
    body = build_body(motion.skeleton.with_bones(cell.bone_m), [DEFAULT_MOUNTS[name] for name in cell.stations])
    kinematics = Kinematics(body)
    poses = [
        station_poses(compute_poses(body.skeleton, cell.truth_qpos), DEFAULT_MOUNTS[name]) for name in cell.stations
    ]
    for row in (0, 17):
        kinematics.set(cell.truth_qpos[row])
        sites = [kinematics.data.site(name) for name in cell.stations]
        position_m = np.array([site.xpos for site in sites])
        orientation = rotations.from_matrix(np.array([site.xmat.reshape(3, 3) for site in sites]))
        place = int(np.flatnonzero(np.isclose(clip.time_s, cell.time_s[row]))[0])
        np.testing.assert_allclose(clip.stations.position_m[place], position_m, atol=1e-9)
        for (at_m, turn), expected_m, expected in zip(poses, position_m, orientation, strict=True):
            np.testing.assert_allclose(at_m[row], expected_m, atol=1e-9)
            assert rotations.angle_between_rad(turn[row], expected) < 1e-6


def test_lost_stations_are_marked(run_folder: Path) -> None:
    motion, _ = motion_of(run_folder)
    run, clip = read_run(run_folder), motion.clips[0]
    rows = [r for r in run.cells if r["clip"] == clip.name]
    assert clip.stations is not None
    for row in rows:
        cell = run.cell(str(row["key"]))
        places = np.searchsorted(clip.time_s, cell.time_s - 1e-9)
        np.testing.assert_array_equal(clip.stations.states[places] == 2, ~cell.position_valid)
        assert (clip.stations.states == 2).any()


def test_a_larger_run_leaves_frames_out(run_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = motion_of(run_folder)[0].clips[0].time_s
    monkeypatch.setattr(player_data, "_MOST_FRAMES", 600)
    motion, note = motion_of(run_folder)
    assert note == "Every second frame is shown."
    np.testing.assert_array_equal(motion.clips[0].time_s, whole[::2])


def test_a_still_larger_run_shows_the_worst_seconds(run_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(player_data, "_MOST_FRAMES", 250)
    motion, note = motion_of(run_folder)
    assert note.endswith("only the worst seconds of each method are shown, for 3 of 4 methods.")
    assert [clip.name.split(",")[0] for clip in motion.clips] == ["boxing_p1_01"] * 3
    assert [[track.name for track in clip.estimates] for clip in motion.clips] == [
        ["best_match+ik"],
        ["best_match+ik", "ik"],
        ["best_match+ik", "best_match"],
    ]
    for moment in motion.moments:
        time_s = motion.clips[moment.clip].time_s
        assert moment.start_s <= time_s[0]
        assert time_s[-1] <= moment.end_s


def test_clips_of_several_seeds_are_told_apart(tmp_path: Path) -> None:
    run = read_run(planted_run(tmp_path / "run", Plan(behaviours=("walking",), methods={"ik": 1.0}, duration_s=2.0)))
    both = [*run.cells, {**run.cells[0], "seed": 2}]
    summary = {**run.summary, "cells": both}
    motion, _ = run_motion(type(run)(run.out, run.manifest, summary, run.traces, summary), {}, run.cell)
    assert [clip.name for clip in motion.clips] == ["walking_p1_01, seed 1", "walking_p1_01, seed 2"]
