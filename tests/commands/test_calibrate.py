"""`harness calibrate`, and what it found put to use, as a user meets them."""

import csv
import shlex
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.body import Body, build_body, tpose
from harness.calibrate import (
    POSES,
    CalibrationFile,
    CalibrationOutcome,
    GuidedPose,
    UnusableHold,
    read_calibration,
    write_calibration,
)
from harness.cli import main
from harness.core import rotations
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.humanoid24 import BONES
from harness.core.motion import BodyMotion
from harness.experiment import CalibrationSession, Playback, prepare_playback
from harness.reconstruct import Session, make_method
from harness.simulate import simulate_loop
from harness.stream import TrackerFrame, serve_emulator
from harness.stream.recording import RecordingStream
from tests.command import Command
from tests.interrupts import interrupt, start_harness

PREVIOUS = make_method("ik:previous")
CLIP = "boxing_p1_01"
STATIONS = ("left_hand", "right_hand", "left_ankle", "right_ankle")


@pytest.fixture(scope="module")
def model() -> Playback:
    return prepare_playback("demo", clip=CLIP, stations=4, posing=True)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recorded") / "model.rec"
    assert main(["record", "sim:demo", str(path), "--clip", CLIP, "--stations", "4", "--poses"]) == 0
    return path


@pytest.fixture(scope="module")
def calibrated(recording: Path) -> Path:
    """The file; beside it the report as text."""
    path, said = recording.with_name("me.toml"), StringIO()
    with redirect_stdout(said):
        assert main(["calibrate", str(recording), "--out", str(path)]) == 0
    path.with_suffix(".txt").write_text(said.getvalue())
    return path


def test_eight_poses_of_a_recording(recording: Path, tmp_path: Path, model: Playback, command: Command) -> None:
    """The bounds are those of docs/calibration.md for a miss of 5 deg; this performer's are off by 2.5."""
    path = tmp_path / "me.toml"
    said = command("calibrate", recording, "--scenario", "demo", "--out", path, "--json")
    content = said.content
    assert content["outcome"] == "pass"
    assert list(content["stations"]) == list(STATIONS)
    assert set(content["bones"]) == set(BONES)
    for number, pose in enumerate(POSES, 1):
        assert f"pose {number} of 8, {pose.name}: {pose.instruction}" in said.err
        assert f"pose {number} of 8 taken" in said.err
    kept, truth = read_calibration(path), model.calibration
    assert kept.skeleton is not None
    assert kept.diagnostics["scenario"] == "demo"
    off_m = kept.skeleton.length_m - model.body.skeleton.length_m
    mean_m = np.array([content["bones"][name]["mean_m"] for name in BONES]) - model.body.skeleton.length_m
    assert np.sqrt(np.mean(off_m**2)) < 0.015 < np.sqrt(np.mean(mean_m**2))
    assert np.linalg.norm(kept.calibration.mount_m - truth.mount_m, axis=1).max() < 0.025
    turned_rad = rotations.angle_between_rad(kept.calibration.bone_from_station, truth.bone_from_station)
    assert np.rad2deg(turned_rad).max() < 4.0


def test_the_report_has_a_row_for_each_bone_and_station(calibrated: Path) -> None:
    lines = calibrated.with_suffix(".txt").read_text().splitlines()
    firsts = [line.split()[0] for line in lines if line]
    assert firsts[0] == "bone"
    assert firsts[1:25] == list(BONES)
    assert firsts[26:30] == list(STATIONS)
    assert "from the prior" in next(line for line in lines if line.startswith("head "))
    assert lines[-2:] == [f"{calibrated}: written", "pass"]


def test_a_file_is_not_written_over_unasked(recording: Path, tmp_path: Path, command: Command) -> None:
    path = tmp_path / "me.toml"
    path.write_text("mine")
    assert "--force" in command("calibrate", recording, "--out", path, "--kind", "tpose", code=2).err
    assert path.read_text() == "mine"
    command("calibrate", recording, "--out", path, "--kind", "tpose", "--force")
    kept = read_calibration(path)
    assert (kept.calibration.kind, kept.performer) == ("tpose", CLIP.split("_")[1])
    assert kept.skeleton is not None


def test_poses_that_are_missing_are_told_and_nothing_is_written(tmp_path: Path, command: Command) -> None:
    recording = tmp_path / "short.rec"
    words = ["record", "sim:demo", str(recording), "--clip", CLIP, "--stations", "4", "--poses", "--seconds", "12"]
    command(*words)
    line = command("calibrate", recording, "--out", tmp_path / "me.toml", code=2).line("harness:")
    assert "3 of 8 poses were held" in line
    assert repr(POSES[3].name) in line
    assert list(tmp_path.iterdir()) == [recording]


def test_stations_without_names_are_told_by_the_user(recording: Path, tmp_path: Path) -> None:
    """A calibration of the same readings under other names, as far as a T-pose of these mounts goes."""
    words = ["calibrate", str(recording), "--kind", "tpose", "--out", str(tmp_path / "me.toml")]
    assert main([*words, "--stations", "left_hand,right_hand"]) == 2
    assert main([*words, "--stations", "left_hand,right_hand,left_ankle,right_ankle"]) == 0


@pytest.mark.long
def test_a_tpose_of_a_tracker_that_streams(model: Playback, tmp_path: Path) -> None:
    with serve_emulator(model.samples, tcp="127.0.0.1:0") as device:
        words = ["--port", device.name, "--scenario", "demo", "--clip", CLIP, "--kind", "tpose"]
        assert main(["calibrate", *words, "--out", str(tmp_path / "me.toml")]) == 0
        assert not device.emulator.device.streaming
    kept, truth = read_calibration(tmp_path / "me.toml"), model.calibration
    assert kept.calibration.stations == STATIONS
    turned_rad = rotations.angle_between_rad(kept.calibration.bone_from_station, truth.bone_from_station)
    assert np.rad2deg(turned_rad).max() < 25.0  # hinges missed by 2.5 deg, six or seven of them in a row
    assert np.linalg.norm(kept.calibration.mount_m - truth.mount_m, axis=1).max() < 0.06


@pytest.mark.long
def test_the_next_command_wears_the_calibrated_stations(tmp_path: Path, command: Command) -> None:
    """`--stations 6` was left out, so that the printed command wore four of the six."""
    model, out = prepare_playback("demo", clip=CLIP, stations=6, posing=True), tmp_path / "my calibration.toml"
    with serve_emulator(model.samples, pty=tmp_path / "a port") as device:
        words = ["--port", device.name, "--scenario", "demo", "--clip", CLIP, "--kind", "tpose", "--stations", "6"]
        program, *following = shlex.split(command("calibrate", *words, "--out", out).line("next: "))
        assert program == "harness"
        content = command(*following, "--method", "ik", "--seconds", "1", "--json").content
        assert content["stations"] == list(model.calibration.stations)
        words = shlex.split(content["next"])[1:]
        assert words == ["record", device.name, "take.rec", "--stations", ",".join(content["stations"])]
        forgotten = [word for word in following if word not in ("--stations", "6")]
        said = command(*forgotten, "--method", "ik", "--seconds", "1", code=2).err
        assert f"worn are {', '.join(model.calibration.stations[:4])}." in said


def test_ctrl_c_leaves_nothing_behind(model: Playback, tmp_path: Path) -> None:
    with serve_emulator(model.samples, tcp="127.0.0.1:0") as device:
        words = ("--port", device.name, "--scenario", "demo", "--out", tmp_path / "me.toml")
        with start_harness("calibrate", *words) as program:
            assert program.stderr is not None
            while "pose 1 of 8" not in program.stderr.readline():
                assert program.poll() is None
            code, said, talk = interrupt(program)
        assert not device.emulator.device.streaming
    assert code == 130
    assert said.splitlines()[-1] == "interrupted"
    assert "Traceback" not in talk
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_live_session_begins_with_eight_poses(model: Playback, monkeypatch: pytest.MonkeyPatch) -> None:
    witness = Witness()
    monkeypatch.setattr("harness.experiment.methods.remote_method.make_method", lambda name: witness)
    with serve_emulator(model.samples, tcp="127.0.0.1:0") as device:
        what = ["--scenario", "demo", "--clip", CLIP, "--calibration", "poses", "--seconds", "1"]
        assert main(["live", "--port", device.name, *what]) == 0
    told, frames = witness.sessions[-1]
    assert told.kind == "poses"
    assert len(frames) > 10
    assert np.linalg.norm(told.mount_m - model.calibration.mount_m, axis=1).max() < 0.025


@pytest.mark.long
def test_a_live_session_begins_with_a_t_pose(
    model: Playback, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A performer half a metre aside; the first T-pose is refused, as if the stations did not tell the heading."""
    witness, refused = Witness(), list[UnusableHold]()
    monkeypatch.setattr("harness.experiment.methods.remote_method.make_method", lambda name: witness)
    solve = CalibrationSession.solve

    def refuse_once(session: CalibrationSession, held: Any, source: str) -> CalibrationOutcome:
        if not refused:
            refused.append(UnusableHold("Stations look exchanged.", "Exchange them."))
            raise refused[-1]
        return solve(session, held, source)

    monkeypatch.setattr(CalibrationSession, "solve", refuse_once)
    upright = np.array(tpose(model.body.skeleton))
    upright[1] += 0.5
    take = BodyMotion("stand", "p1", "test", "", 40.0, np.tile(upright, (400, 1)))
    noise = model.scenario.noise_model
    standing = simulate_loop(model.body, take, model.scenario.nominal_mounts, model.tracker, noise, seed=1)
    with serve_emulator(standing, tcp="127.0.0.1:0") as device:
        what = ["--scenario", "demo", "--clip", CLIP, "--calibration", "tpose", "--seconds", "1"]
        assert main(["live", "--port", device.name, *what]) == 0
    told, frames = witness.sessions[-1]
    assert told.kind == "tpose"
    assert len(frames) > 10
    np.testing.assert_allclose(told.tracker_origin_m, model.calibration.tracker_origin_m - [0.0, 0.5, 0.0], atol=0.05)
    said = capsys.readouterr().err
    assert "Stand upright, arms straight out" in said
    assert "Stations look exchanged. Exchange them. Trying again." in said


@pytest.mark.slow
def test_eight_poses_of_a_tracker_that_streams(model: Playback, recording: Path, tmp_path: Path) -> None:
    """On a pty, with pictures; it takes as long as the poses do."""
    pytest.importorskip("pyvista", reason="pyvista is not installed (extra `viz`)")
    with serve_emulator(model.samples, pty=tmp_path / "tracker") as device:
        words = ["--port", device.name, "--scenario", "demo", "--out", str(tmp_path / "me.toml")]
        pictures = ["--view", "frames", "--pictures", str(tmp_path / "pictures")]
        assert main(["calibrate", *words, *pictures]) == 0
    assert len(list((tmp_path / "pictures").glob("0000000[1-8].png"))) == 8
    kept, truth = read_calibration(tmp_path / "me.toml"), model.calibration
    assert np.linalg.norm(kept.calibration.mount_m - truth.mount_m, axis=1).max() < 0.025


class Witness:
    """A method that notes what it is told and what it sees."""

    name, summary, needs_examples = "witness", "notes what it is told", False

    def __init__(self) -> None:
        self.bodies: list[Body] = []
        self.sessions: list[tuple[Calibration, list[TrackerFrame]]] = []

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "Witness":
        self.bodies.append(body)
        return self

    def begin(self, calibration: Calibration) -> "Noted":
        self.sessions.append((calibration, []))
        inner = PREVIOUS.fit(self.bodies[-1], [], np.random.default_rng(1)).begin(calibration)
        return Noted(inner, self.sessions[-1][1])


@dataclass
class Noted:
    inner: Session
    frames: list[TrackerFrame]

    def step(self, frame: TrackerFrame) -> Estimate:
        self.frames.append(frame)
        return self.inner.step(frame)


def test_a_live_session_goes_by_a_file(calibrated: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On its skeleton, with its mounts in the order of the stream: bit by bit what Python gives for the same frames."""
    kept, reordered, table = read_calibration(calibrated), tmp_path / "other.toml", tmp_path / "poses.csv"
    write_calibration(reordered, kept.select(STATIONS[::-1]))
    witness = Witness()
    monkeypatch.setattr("harness.experiment.methods.remote_method.make_method", lambda name: witness)
    rehearsal = prepare_playback("demo", clip=CLIP, stations=4)
    what = ["--scenario", "demo", "--clip", CLIP, "--calibration", str(reordered), "--poses", str(table)]
    with serve_emulator(rehearsal.samples, tcp="127.0.0.1:0") as device:
        assert main(["live", "--port", device.name, *what, "--seconds", "1"]) == 0
    assert kept.skeleton is not None
    np.testing.assert_array_equal(witness.bodies[0].skeleton.bone_m, kept.skeleton.bone_m)
    told, frames = witness.sessions[-1]
    assert told.stations == STATIONS
    np.testing.assert_array_equal(told.mount_m, kept.calibration.mount_m)
    np.testing.assert_array_equal(told.bone_from_station, kept.calibration.bone_from_station)
    fitted = PREVIOUS.fit(build_body(kept.skeleton), [], np.random.default_rng(1))
    session = fitted.begin(kept.calibration)
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(frames) > 10
    for frame, row in zip(frames, rows, strict=True):
        qpos = [float(value) for value in list(row.values())[6 + len(STATIONS) :]]
        np.testing.assert_array_equal(qpos, session.step(frame).qpos)


def test_a_recording_is_judged_by_a_file(calibrated: Path, tmp_path: Path, command: Command) -> None:
    """Calibrating costs something, and less than a body does that is nobody's."""
    take = tmp_path / "take.rec"
    command("record", "sim:demo", take, "--clip", CLIP, "--stations", "4", "--seconds", "4")
    errors_mm = {}
    for name, words in {"exact": [], "poses": ["--calibration", str(calibrated)]}.items():
        (judged,) = command("replay", take, "--methods", "ik:previous", "--json", *words).content["methods"]
        errors_mm[name] = judged["metrics"]["mpjpe_mm"]
    assert errors_mm["poses"] != errors_mm["exact"]
    assert errors_mm["poses"] < errors_mm["exact"] + 40.0


@pytest.mark.parametrize("verb", ["live", "replay"])
def test_a_station_that_was_not_calibrated_is_named(
    verb: str, calibrated: Path, recording: Path, tmp_path: Path, command: Command
) -> None:
    three = tmp_path / "three.toml"
    kept = read_calibration(calibrated)
    write_calibration(three, CalibrationFile(kept.select(STATIONS[:3]).calibration, kept.skeleton))
    words = {"live": ["--port", "no_such_port", "--scenario", "demo"], "replay": [str(recording)]}[verb]
    line = command(verb, *words, "--calibration", three, code=2).line("harness:")
    assert "Station 'right_ankle' is not in the calibration, which has left_hand, right_hand, left_ankle" in line


def test_simulated_performers(command: Command) -> None:
    content = command("calibrate", "--simulate", "1", "--miss", "1", "--noise", "clean", "--json").content
    assert (content["performers"], content["noise"], content["miss_deg"]) == (1, "clean", pytest.approx(1.0))
    assert content["errors"]["bone lengths"]["rms"] < content["errors"]["bone lengths"]["mean_skeleton"]


def test_what_is_recorded_is_what_is_played(model: Playback, recording: Path) -> None:
    """The same frames, in the session of the clip: where trackers sit is the same as in the clip itself."""
    frames = list(RecordingStream(recording))
    assert len(frames) == model.samples.take_frames
    np.testing.assert_array_equal(
        [frame.position_m for frame in frames], [frame.position_m for frame in model.simulation.frames]
    )
    clip = prepare_playback("demo", clip=CLIP, stations=4)
    np.testing.assert_array_equal(clip.calibration.mount_m, model.calibration.mount_m)


def test_a_performer_is_told_what_to_do_and_may_stop(recording: Path) -> None:
    posing = CalibrationSession("demo", STATIONS, "tpose", CLIP)
    told: list[str] = []
    window, other = Displayed(fails=True), Displayed()
    collector = posing.collect_poses(RecordingStream(recording), told.append, [window, other])
    assert [guided.number for guided in window.shown] == [1]
    assert told[1] == "its window was closed; from here on, it does not show the poses"
    assert len(other.shown) > 5
    assert len(collector.holds) == 1


class Displayed:
    """A display that notes what it is shown."""

    def __init__(self, *, fails: bool = False) -> None:
        self.shown: list[GuidedPose] = []
        self._fails = fails

    def show(self, guided: GuidedPose) -> None:
        self.shown.append(guided)
        if self._fails:
            raise OSError("its window was closed")


def test_the_performer_and_the_meter_stand_beside_the_pose(recording: Path) -> None:
    """Of a performer who holds what is shown the meter fills, and each hold ends near the wanted pose."""
    display = Displayed()
    CalibrationSession("demo", STATIONS).collect_poses(RecordingStream(recording), lambda text: None, [display])
    assert [guided.number for guided in display.shown] == sorted(guided.number for guided in display.shown)
    first = next(guided for guided in display.shown if guided.performer is not None)
    assert first.still_s < 0.5
    for number in range(1, 9):
        shown = [guided for guided in display.shown if guided.number == number and guided.performer is not None]
        assert shown[-1].still_s > 2.0
        assert shown[-1].performer is not None
        assert shown[-1].performer.distance_m.max() < 0.3
        assert np.abs(shown[-1].performer.qpos[7:] - shown[-1].target[7:]).max() < np.deg2rad(60.0)
        if number > 1:  # while the performer moves on, the meter starts anew and stations are away from their places
            assert min(guided.still_s for guided in shown) < 1.0
            assert max(float(guided.performer.distance_m.max()) for guided in shown if guided.performer) > 0.3
