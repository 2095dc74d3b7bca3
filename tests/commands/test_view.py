"""`harness view` as a user meets it: clips, runs and recordings, files that it writes, and its server."""

import http.client
import json
import re
from pathlib import Path

import numpy as np
import pytest

from harness.commands.viewed_motion import open_motion, view_clip
from harness.core import rotations
from harness.experiment import prepare_playback
from harness.mocap import MOCAP_VARIABLE, SyntheticSource
from harness.report.kit import NO_ESTIMATE
from harness.results import select_cells
from harness.score import compute_poses
from harness.view import ViewedMotion
from tests.command import Command
from tests.interrupts import interrupt, start_harness
from tests.planted import Plan, planted_run
from tests.report.conftest import renders as renders

CLIP = "boxing_p1_01"


def opened(what: Path | str, methods: list[str] | None = None, **playback: str | None) -> ViewedMotion:
    return open_motion(str(what), methods=methods, mocap=None, rate_hz=None, playback=playback)


def test_a_built_in_take_is_shown_on_its_own_skeleton() -> None:
    clip = opened("walking_p1_01").clip(0)
    made = SyntheticSource(1).load("walking_p1_01")
    assert clip.truth is not None
    np.testing.assert_array_equal(clip.truth.joints_m[:, 0], made.root_m)
    assert clip.time_s[-1] == pytest.approx(made.duration_s)
    assert clip.estimates == ()


def test_a_clip_faces_where_its_root_does() -> None:
    made = SyntheticSource(1).load("walking_p1_01")
    ahead = rotations.mean_heading_rad(made.world_from_root)
    assert view_clip(made).clip(0).heading_rad == ahead
    turned = rotations.multiply(rotations.about_z(1.0), made.world_from_root)
    assert rotations.mean_heading_rad(turned) == pytest.approx(ahead + 1.0)
    assert rotations.mean_heading_rad(np.zeros((0, 4))) == 0.0


def test_a_run_has_its_methods_the_best_first_or_the_chosen_ones(viewed: Path) -> None:
    every = opened(viewed)
    assert every.names == ("walking_p1_01", CLIP)
    assert [track.name for track in every.clip(1).estimates] == ["map", "ik", "far"]
    chosen = opened(viewed, ["far", "map"])
    assert chosen.shown == ("far", "map")
    clip = chosen.clip(0)
    assert [track.name for track in clip.estimates] == ["far", "map"]
    (cell,) = [cell for cell in select_cells(viewed) if (cell.clip, cell.method) == (clip.name, "far")]
    poses = compute_poses(chosen.skeleton.with_bones(cell.estimate_bone_m), cell.estimate_qpos)
    answered = clip.estimates[0].states != NO_ESTIMATE
    assert not answered.all()
    np.testing.assert_array_equal(clip.estimates[0].joints_m[answered], poses.joints_m)


def test_a_recording_has_readings_truth_and_estimates(simulated: Path) -> None:
    motion = opened(simulated, ["ik", "expert_map"], scenario="demo", clip=CLIP)
    clip = motion.clip(0)
    assert clip.truth is not None
    assert clip.stations is not None
    assert [track.name for track in clip.estimates] == ["ik", "expert_map"]
    none, region_deg = (track.region_deg for track in clip.estimates)
    assert none is None
    assert region_deg is not None
    assert region_deg.shape == clip.time_s.shape
    assert 2.0 < np.median(region_deg) < 20.0
    assert (clip.truth.states == 0).all()
    assert (clip.estimates[0].states != NO_ESTIMATE).all()
    off_m = np.linalg.norm(clip.estimates[0].joints_m - clip.truth.joints_m, axis=2)
    assert off_m[10:].mean() < 0.1
    body = prepare_playback("demo", clip=CLIP, stations=4).body
    hand = clip.stations.names.index("left_hand")
    hand_m = clip.truth.joints_m[:, body.skeleton.index("lhand") + 1]
    assert np.median(np.linalg.norm(clip.stations.position_m[:, hand] - hand_m, axis=1)) < 0.08, "in the same room"


def test_a_recording_of_an_unknown_room_shows_its_stations(
    simulated: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("harness.stream.recording.recording.Recording.note", {})
    motion = opened(simulated)
    clip = motion.clip(0)
    assert "The room is not known" in motion.note
    assert clip.truth is None
    assert clip.stations is not None
    assert len(clip.stations.names) == 4
    assert 0.0 < np.median(clip.stations.position_m[..., 2]) < 2.5
    np.testing.assert_allclose(np.linalg.norm(clip.stations.world_from_station, axis=2), 1.0)
    assert set(clip.stations.states.ravel().tolist()) <= {0, 1, 2}
    with pytest.raises(Exception, match="Name the scenario with --scenario"):
        opened(simulated, ["ik"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nothing.bvh"], "nothing.bvh: no such file or folder"),
        (["nothing"], "There is no file, folder or built-in take 'nothing', and no library was named."),
        (["{tmp}"], "no results of the harness; expected a run"),
        (["{text}"], "no recording; expected a recording"),
        (["{empty}"], "an empty file"),
        (["{markers}"], "an empty file; expected a C3D marker file"),
        (["walking_p1_01", "--methods", "ik"], "A clip has no estimates"),
        (["walking_p1_01", "--scenario", "demo"], "A clip takes no --scenario"),
        (["{run}", "--methods", "pca"], "no method of this run called 'pca'. Known: ik, map, far."),
        (["{run}", "--clip", "golf_p1_01"], "no clip called 'golf_p1_01'"),
        (["{run}", "--scenario", "demo"], "A run takes no --scenario"),
        (["{run}", "--save", "a.avi"], "Its end must be .mp4 or .gif"),
        (["{run}", "--out", "{text}"], "Choose another name, or overwrite it with --force."),
    ],
)
def test_what_cannot_be_shown_is_refused(
    words: list[str], said: str, viewed: Path, tmp_path: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(MOCAP_VARIABLE, raising=False)
    files = {"text": tmp_path / "text.rec", "empty": tmp_path / "empty", "markers": tmp_path / "a.c3d"}
    files["text"].write_text("no recording", encoding="utf-8")
    files["empty"].touch()
    files["markers"].touch()
    given = (word.format(run=viewed, tmp=tmp_path, **files) for word in words)
    assert said in command("view", "--no-browser", *given, code=2).err.replace("\n", " ")


def test_a_run_without_estimates_is_refused(tmp_path: Path, command: Command) -> None:
    plan = Plan(behaviours=("walking",), methods={"ik": 1.0}, duration_s=2.0, silent=("ik",))
    assert "no frames with an estimate" in command("view", planted_run(tmp_path / "run", plan), code=2).err


def test_a_damaged_recording_is_refused(simulated: Path, tmp_path: Path, command: Command) -> None:
    """What is left holds no configuration of the device."""
    damaged = tmp_path / "damaged.rec"
    damaged.write_bytes(simulated.read_bytes()[:60])
    assert "the device was never configured in it" in command("view", damaged, code=2).err


def test_a_page_is_written(viewed: Path, tmp_path: Path, command: Command) -> None:
    page = tmp_path / "page.html"
    words = ["view", str(viewed), "--methods", "map,ik", "--out", str(page), "--json"]
    assert command(*words).content["page"] == str(page)
    text = page.read_text(encoding="utf-8")
    assert '"shown":["map","ik"]' in text
    assert '"name":"far"' not in text
    command(*words, code=2)
    command(*words, "--force")


@pytest.mark.long
def test_a_movie_is_written(viewed: Path, tmp_path: Path, command: Command, renders: None) -> None:
    movie = tmp_path / "a.gif"
    said = command("view", viewed, "--clip", CLIP, "--save", movie, "--from", "1", "--to", "1.2")
    assert "a.gif: 3 frames" in said.out
    assert f"drawing {CLIP} with map" in said.err
    assert movie.read_bytes().startswith(b"GIF89a")


def test_the_server_shows_the_run_until_ctrl_c(viewed: Path) -> None:
    with start_harness("view", viewed, "--no-browser") as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith("view: loading")
        line = process.stderr.readline()
        address = re.search(r"http://127\.0\.0\.1:(\d+)/", line)
        assert address is not None, line
        connection = http.client.HTTPConnection("127.0.0.1", int(address[1]), timeout=30)
        connection.request("GET", "/clip/1.json")
        clip = json.load(connection.getresponse())
        connection.close()
        assert [track["name"] for track in clip["tracks"]] == ["truth", "map", "ik", "far"]
        code, out, _ = interrupt(process)
    assert code == 0
    assert out.endswith("pass\n")
