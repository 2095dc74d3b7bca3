"""Poses of other programs as a user meets them: `inspect`, `record`, `replay` and `view`."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

from harness.cli import build_parser
from harness.stream.recording import open_poses
from harness.study.trust.plan import plan_digest
from tests.command import Command
from tests.mocap.c3d_bytes import c3d_bytes
from tests.report.reading import text_of
from tests.stream.poses.pose_files import (
    COUNT,
    SAMPLES,
    TIMES_S,
    UNTIMED,
    angles,
    motive,
    numbers,
    pose,
    rows,
    tum,
    write,
)
from tests.verb_examples import unpack_files


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "rig.tum", tum())
    write(tmp_path / "plain.csv", SAMPLES["no names"])
    write(tmp_path / "take.csv", motive(range(5)))
    write(tmp_path / "jug.traj", UNTIMED["matrices"])
    return tmp_path


def test_inspect_says_what_was_concluded_and_why(folder: Path, command: Command) -> None:
    shown = command("inspect", "plain.csv")
    assert shown.lines[:8] == [
        f"plain.csv: {COUNT} poses of 1 body, {TIMES_S[-1]:.2f} s, seconds from an unknown start",
        "kind: rows of numbers, 8 columns separated by commas (the file's lines)",
        "columns: time 1, position 2 to 4, quaternion 5 to 8 (no header; a quaternion's columns have the norm 1)",
        "time unit: s (the median step of 0.02 is then 20 ms)",
        "quaternion order: xyzw (a lever arm explains 1.00 of the movement, in the order wxyz 0.28)",
        "length unit: m (coordinates reach 1.545 and speeds 0.512 a second)",
        "up: z (assumed: poses do not show it)",
        "handedness: right (assumed: poses do not show it)",
    ]
    assert shown.lines[-2].split()[:3] == ["plain", str(COUNT), "50.00"]
    assert shown.line("next: ") == "harness characterize plain.csv"


def test_inspect_prints_the_numbers_as_json(folder: Path, command: Command) -> None:
    content = command("inspect", "take.csv", "--up=-z", "--json").content
    assert [body["name"] for body in content["bodies"]] == ["head", "hand"]
    assert content["bodies"][0]["rate_hz"] == pytest.approx(50.0)
    assert {"subject": "up", "value": "-z, turned to z", "reason": "given by --up", "assumed": False} in content[
        "findings"
    ]
    assert content["next"] == "harness characterize take.csv --up=-z"


def test_inspect_of_a_file_without_times_asks_for_its_rate(folder: Path, command: Command) -> None:
    shown = command("inspect", "jug.traj")
    assert shown.lines[0] == f"jug.traj: {COUNT} poses of 1 body, numbers of samples"
    assert "time: none: give the samples per second with --rate HZ (it has no times)" in shown.lines
    assert "not measured" in shown.lines[-2]
    assert shown.line("next: ") == "harness inspect jug.traj --rate HZ"
    content = command("inspect", "jug.traj", "--json").content
    assert (content["duration_s"], content["bodies"][0].keys()) == (None, {"name", "poses", "repeated_share"})
    assert "rate_hz" in command("inspect", "jug.traj", "--rate", "50", "--json").content["bodies"][0]


def test_a_single_pose_and_a_header_alone(folder: Path, command: Command) -> None:
    write(folder / "one.csv", f"t,x,y,z,qw,qx,qy,qz\n0.5,{pose(0)}\n")
    shown = command("inspect", "one.csv")
    assert shown.lines[0].startswith("one.csv: 1 pose of 1 body, ")
    assert shown.line("next: ") == "harness view one.csv"
    command("view", "one.csv", "--out", "one.html")
    write(folder / "header.csv", "t,x,y,z,qw,qx,qy,qz\n")
    assert "What other poses lack, `harness inspect` says" in command("view", "header.csv", code=2).err
    assert "no rows of numbers" in command("inspect", "header.csv", code=2).err


@pytest.mark.parametrize(("count", "verb"), [(19, "view"), (20, "characterize")])
def test_inspect_names_a_verb_that_takes_so_few_poses(count: int, verb: str, folder: Path, command: Command) -> None:
    write(folder / "few.csv", rows(lambda n: f"{TIMES_S[n]:.4f},{pose(n)}", ["t,x,y,z,qw,qx,qy,qz"], count))
    assert command("inspect", "few.csv").line("next: ") == f"harness {verb} few.csv"
    command("characterize", "few.csv", code=0 if verb == "characterize" else 2)
    shown = command("inspect", "few.csv", "plain.csv")
    assert ("next: harness validate" in shown.out + shown.err) == (verb == "characterize")


def test_inspect_takes_angles_and_the_next_command_too(folder: Path, command: Command) -> None:
    values = angles("zyx", np.pi / 180.0)[:, ::-1]
    write(folder / "fastrak.txt", rows(lambda n: f"{TIMES_S[n]:.4f} 1 2 3 {numbers(values[n], ' ')}"))
    words = ["fastrak.txt", "--columns", "t,x,y,z,yaw,pitch,roll", "--euler", "zyx"]
    shown = command("inspect", *words)
    assert "axes of the angles: zyx (given by --euler)" in shown.lines
    assert shown.line("next: ") == shlex.join(["harness", "characterize", *words])


def test_inspect_reads_several_files_on_one_clock(folder: Path, command: Command) -> None:
    write(folder / "hand.tum", tum())
    shown = command("inspect", "rig.tum", "hand.tum")
    assert shown.lines[0].startswith(f"rig.tum, hand.tum: {2 * COUNT} poses of 2 bodies, ")
    assert shown.lines[0].endswith("Unix time from 2014-06-24 19:02:59 UTC")
    assert "common clock: one for all files (assumed: Unix times)" in shown.lines
    assert shown.line("next: ") == "harness validate rig.tum --truth hand.tum"


def test_a_recording_keeps_poses_marks_and_the_plan(folder: Path, command: Command) -> None:
    unpack_files(folder)
    plan = Path("plan.toml")
    said = command("record", "rig.tum", "rig.rec", "--mark", "slow=2", "--mark", "static=0", "--plan", plan)
    assert said.lines[-2] == f"rig.rec: {COUNT} poses of rig in {TIMES_S[-1]:.2f} s"
    assert said.line("next: ") == "harness inspect rig.rec"
    found = open_poses([Path("rig.rec")])
    assert found.marks == ((0.0, "static"), (2.0, "slow"))
    assert found.plan == plan_digest(plan)
    assert (found.note["source"], found.note["file"]) == ("poses", "rig.tum")
    shown = command("inspect", "rig.rec")
    assert "marks: static from 0 s, slow from 2 s" in shown.lines
    assert f"plan: {plan_digest(plan)[:12]}" in shown.lines
    assert shown.lines[1] == command("inspect", "rig.tum").lines[1]
    again = command("record", "rig.rec", "copy.rec")
    assert again.lines[-2] == f"copy.rec: {COUNT} poses of rig in {TIMES_S[-1]:.2f} s"
    assert open_poses([Path("copy.rec")]).marks == found.marks


def test_some_bodies_are_recorded(folder: Path, command: Command) -> None:
    assert command("record", "take.csv", "a.rec", "--stations", "hand", "--json").content["bodies"] == ["hand"]
    write(folder / "hand.tum", tum())
    assert command("record", "rig.tum", "hand.tum", "b.rec", "--json").content["bodies"] == ["rig", "hand"]


def test_replay_prints_frames_that_inspect_reads_again(folder: Path, command: Command) -> None:
    shown = command("replay", "take.csv")
    assert shown.lines[0].startswith(f"{COUNT} frames in {TIMES_S[-1]:.2f} s, 50.00 Hz")
    assert "length unit: mm (the file's header)" in shown.lines
    frames = command("replay", "take.csv", "--frames").out
    assert len(frames.splitlines()) == 1 + 2 * COUNT + 1
    write(folder / "frames.csv", frames)
    first, again = (open_poses([Path(name)]).log for name in ("take.csv", "frames.csv"))
    assert again.names == first.names
    for body, other in zip(first.bodies, again.bodies, strict=True):
        np.testing.assert_allclose(other.positions_m, body.positions_m, atol=1e-12)
    rows = [json.loads(line) for line in command("replay", "take.csv", "--frames", "--json").lines[:-1]]
    assert [row["station"] for row in rows[:2]] == ["head", "hand"]
    assert rows[0]["x_m"] is None


def test_view_writes_a_page_of_the_bodies(folder: Path, command: Command) -> None:
    command("view", "take.csv", "--out", "page.html", "--up", "z")
    page = (folder / "page.html").read_text(encoding="utf-8")
    assert '"head"' in page
    assert "handedness: right (assumed: poses do not show it)" in text_of(folder / "page.html")


def test_markers_of_a_cluster_are_a_body(folder: Path, command: Command) -> None:
    shape_m = np.array([[0.05, 0.0, 0.0], [0.0, 0.06, 0.0], [0.0, 0.0, 0.07]])
    points_m = np.linspace(0.0, 0.4, 50)[:, None, None] * [1.0, 0.0, 0.0] + shape_m + [0.1, 0.2, 1.0]
    labels = ["bar_1", "bar_2", "bar_3", "loose"]
    values = np.concatenate([points_m, points_m[:, :1]], axis=1)
    write(folder / "bar.c3d", c3d_bytes(values, labels=labels))
    said = command("record", "bar.c3d", "bar.rec")
    assert said.lines[-2] == "bar.rec: 50 poses of bar in 0.49 s"
    assert "body bar: 3 markers that fit a rigid body to" in said.out
    body = open_poses([Path("bar.rec")]).log.body("bar")
    np.testing.assert_allclose(body.positions_m[-1] - body.positions_m[0], [0.4, 0.0, 0.0], atol=1e-4)
    assert "A C3D file takes the unit alone" in command("record", "bar.c3d", "b.rec", "--up", "y", code=2).err
    assert "no three markers of one body" in command("replay", write_markers(folder), code=2).err


def write_markers(folder: Path) -> Path:
    points = np.ones((5, 2, 3))
    return write(folder / "two.c3d", c3d_bytes(points, labels=["bar_1", "bar_2"]))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("replay take.csv --methods ik", "--methods with the poses of take.csv. Poses of another program name no perf"),
        ("replay jug.traj", "jug.traj has no times (300 samples). Give its samples per second: --rate HZ."),
        ("replay rig.tum --rate 50", "rig.tum has times of its own. Leave out --rate."),
        ("replay rig.rec --up y", "rig.rec is a recording of poses."),
        ("view take.csv --methods ik --out a.html", "--methods with the poses of take.csv."),
        ("view walking_p1_01 --out a.html --up y", "--up with walking_p1_01. It is for poses"),
        ("record take.csv a.rec --baud 9600", "--baud with a file of poses. It is for a line"),
        ("record take.csv a.rec --seconds 3", "--seconds with a file of poses."),
        ("record take.csv a.rec --stations foot", "no body called 'foot'. Known: head, hand."),
        ("record take.csv a.rec --mark static=99", "--mark 'static=99'. Write NAME=S with S from 0 to 5.98"),
        ("record take.csv a.rec --mark static", "--mark 'static'. Write NAME=S"),
        ("record take.csv rig.rec", "rig.rec: it exists; expected a new file."),
        ("record sim:demo a.rec --up y", "--up with sim:demo. It is for files of poses"),
        ("record sim:demo rig.rec", "rig.rec: a recording of poses; expected a recording of a device's line."),
        ("record none.csv take.csv a.rec", "none.csv: no such file; expected timed poses"),
        ("calibrate rig.rec --out a.toml", "a recording of poses; expected a recording of a device's line."),
        ("inspect plain.csv --quaternion zyxw", "--quaternion 'zyxw'. Choose one of xyzw, wxyz."),
        ("inspect plain.csv --unit furlong", "Unit 'furlong'. Name one of m, mm, cm, in, ft"),
        ("inspect none.csv", "none.csv: no such file; expected a motion file, poses, or a list of emitters. Check the"),
        ("inspect plain.csv none.csv", "none.csv: no such file; expected a motion file"),
        ("inspect plain.csv --euler zyx", "--euler, but plain.csv has no angles alone. Leave it out."),
        ("inspect plain.csv --euler zz", "--euler 'zz'. Choose one of xyz, xzy, yxz, yzx, zxy, zyx."),
        ("inspect plain.csv --euler zyx:turns", "Unit of --euler 'turns'. Choose one of deg, rad."),
        ("inspect plain.csv --clip walking_p1_01", "--clip with poses."),
        ("inspect walking.bvh --columns a,b", "--columns with walking.bvh. It is for poses of another program."),
    ],
)
def test_what_does_not_fit_is_refused(words: str, message: str, folder: Path, command: Command) -> None:
    command("record", "rig.tum", "rig.rec")
    before = (folder / "rig.rec").read_bytes()
    assert message in command(*shlex.split(words), code=2).err
    assert (folder / "rig.rec").read_bytes() == before
    assert not (folder / "a.rec").exists()


@pytest.mark.long
def test_inspect_names_every_real_file_and_the_next_command(real: Path, command: Command) -> None:
    files = sorted(path for path in real.rglob("*") if path.is_file())
    assert len(files) > 100
    for path in files:
        if path.suffix not in (".csv", ".traj"):  # labels, licences and pages
            assert command("inspect", path, code=2).line("harness: ").startswith(f"{path}: ")
            continue
        shown = command("inspect", path)
        assert shown.lines[0].startswith(f"{path.name}: ")
        program, verb, *rest = shlex.split(shown.line("next: "))
        assert (program, verb) == ("harness", "inspect" if path.suffix == ".traj" else "characterize")
        build_parser().parse_args([verb, *(word.replace("HZ", "100") for word in rest)])
