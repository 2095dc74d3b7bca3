"""References from files: what the package writes is read back, and damaged files give one clear error."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.errors import BadFile, BadInput
from harness.measure import TruthPoses
from harness.mocap import MarkerClip
from harness.mocap.write import export_motion
from harness.score import compute_poses
from harness.stream import FRAME_COLUMNS, TrackerFrame, format_csv_row, frame_rows
from harness.study.trust.truth_files import read_csv, read_truth_file, read_tum, truth_of_markers
from tests.mocap.write.test_export import NAMES, SKELETON, Written, arbitrary_motion, joints_m

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


def relative(truth: TruthPoses, rows: Bools | slice = slice(None)) -> tuple[Floats, Floats]:
    """The mount that relates a fitted body to the moved one: constant for a rigid body. Positions, rotation vectors."""
    place, turn = poses()
    back = rotations.inverse(truth.world_from_body[rows])
    offset_m = rotations.rotate(back, place[rows] - truth.position_m[rows])
    return offset_m, rotations.log(rotations.multiply(back, turn[rows]))


@pytest.mark.parametrize("count", [3, 4])
def test_markers_of_a_rigid_body_move_with_it(count: int) -> None:
    truth = truth_of_markers(Path("bar.c3d"), markers(names(count)), ["head"])
    offset_m, turn = relative(truth.bodies["head"])
    assert np.ptp(offset_m, axis=0).max() < 1e-9
    assert np.ptp(turn, axis=0).max() < 1e-7
    assert f"The {count} markers of head fit one rigid body to" in truth.notes[0]
    np.testing.assert_allclose(truth.bodies["head"].time_s, np.arange(FRAMES) / 100.0)


def test_a_hidden_marker_of_four_changes_nothing_and_two_hide_the_body() -> None:
    seen = np.ones((FRAMES, 4), bool)
    seen[10:20, 2] = seen[30:35, 1:3] = False
    body = truth_of_markers(Path("bar.c3d"), markers(names(4), seen), ["head"]).bodies["head"]
    missing = np.isnan(body.position_m[:, 0])
    assert np.flatnonzero(missing).tolist() == list(range(30, 35))
    offset_m, _ = relative(body, ~missing)
    assert np.ptp(offset_m, axis=0).max() < 1e-9


def test_the_residual_is_the_noise_of_the_markers() -> None:
    truth = truth_of_markers(Path("bar.c3d"), markers(names(4), noise_m=0.001), ["head"])
    # 12 coordinates of a frame less 6 of the pose
    assert float(truth.notes[0].split("to ")[1].split(" mm")[0]) == pytest.approx(np.sqrt(3.0 * 0.5), rel=0.1)
    _, turn_rad = relative(truth.bodies["head"])
    deviation_m, deviation_rad = truth.noise["head"]
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
    assert set(truth_of_markers(Path("bar.c3d"), markers(labels), ["head"]).bodies) == {"head"}


@pytest.mark.parametrize(
    ("clip", "words"),
    [
        (markers(names(2)), "2 marker"),
        (markers(names(3, "hand")), "0 marker"),
        (markers(names(3), shape_m=np.outer([0.0, 0.1, 0.2], [1.0, 0.0, 0.0])), "on one line"),
        (markers(names(3), np.arange(3) < np.full((FRAMES, 1), 2)), "no frame with all markers"),
        (markers(names(4), noise_m=0.1), "fit a rigid body to .* mm .* only"),
    ],
)
def test_markers_that_fix_no_pose_are_refused(clip: MarkerClip, words: str) -> None:
    with pytest.raises(BadFile, match=words):
        truth_of_markers(Path("bar.c3d"), clip, ["head"])


def test_an_exported_tum_trajectory_is_read_back(rng: np.random.Generator, tmp_path: Path) -> None:
    cell = Written(arbitrary_motion(rng), arbitrary_motion(rng))
    for file in export_motion([cell], "tum", tmp_path):
        if ".estimate." in file.name:
            file.unlink()
    truth = read_truth_file(tmp_path, ["head", "lhand"])
    assert truth.body_of == {"head": "head", "lhand": "lhand"}
    pose = compute_poses(SKELETON, cell.truth_qpos)
    world_from_hand = rotations.from_matrix(pose.world_from_bone[:, SKELETON.index("lhand")])
    hand = truth.bodies["lhand"]
    np.testing.assert_allclose(hand.time_s, cell.time_s, atol=1e-9)
    np.testing.assert_allclose(hand.position_m, joints_m(cell.truth_qpos, SKELETON)[:, NAMES.index("lhand")], atol=1e-8)
    assert np.max(rotations.angle_between_rad(hand.world_from_body, world_from_hand)) < 1e-7


def frames_table(stations: tuple[str, ...], hidden: int = -1) -> str:
    """What `harness replay --frames` prints, with its last line; one frame has no pose of the first station."""
    place, turn = poses()
    rows = [",".join(FRAME_COLUMNS)]
    for number in range(FRAMES):
        valid = np.array([number != hidden] + [True] * (len(stations) - 1))
        frame = TrackerFrame(
            100.0 + number / 40.0,
            number / 40.0 + 1e-3 * np.arange(len(stations), dtype=np.float64),
            np.where(valid[:, None], place[number] + np.arange(len(stations))[:, None], np.nan),
            np.where(valid[:, None], turn[number], np.nan),
            valid,
            valid,
            np.where(valid, 1.0, 0.0),
            ~valid,
        )
        rows += [format_csv_row(row) for row in frame_rows(frame, stations, 0.0)]
    return "\n".join([*rows, "pass"]) + "\n"


def test_the_table_of_replay_is_read_back(tmp_path: Path) -> None:
    path = tmp_path / "frames.csv"
    path.write_text(frames_table(("head", "hand"), hidden=7), encoding="utf-8")
    truth = read_truth_file(path, ["hand", "head"])
    place, turn = poses()
    np.testing.assert_array_equal(truth.bodies["hand"].position_m, place + 1.0)
    assert np.flatnonzero(np.isnan(truth.bodies["head"].position_m[:, 0])).tolist() == [7]
    np.testing.assert_allclose(truth.bodies["hand"].world_from_body, turn, atol=1e-15)
    np.testing.assert_array_equal(truth.bodies["hand"].time_s, np.arange(FRAMES) / 40.0 + 1e-3)


def test_a_body_that_the_table_lacks_is_named(tmp_path: Path) -> None:
    path = tmp_path / "frames.csv"
    path.write_text(frames_table(("head",)), encoding="utf-8")
    with pytest.raises(BadInput, match="no body 'hand'; it has head"):
        read_truth_file(path, ["head", "hand"])


HEAD = "time_s,station,x_m,y_m,z_m,qw,qx,qy,qz"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no column time_s"),
        ("time_s,station,x_m\n", "no column y_m"),
        (f"{HEAD}\n0,head,0,0,0,1,0,0\n", "line 2 has 8 of 9 values"),
        (f"{HEAD}\n0,head,0,0,0,1,0,0,zero\n", "line 2 has no 8 numbers"),
        (f"{HEAD}\n0,head,0,0,0,2,0,0,0\n", "not of length 1"),
        (f"{HEAD}\n0,head,0,0,0,1e300,0,0,0\n", "not of length 1"),
        (f"{HEAD}\n0,head,inf,0,0,1,0,0,0\n", "not of length 1"),
        (f"{HEAD}\nnan,head,0,0,0,1,0,0,0\n", "no times"),
        (f"{HEAD}\n0,{'x' * 200_000},0,0,0,1,0,0,0\n", "no table"),
    ],
)
def test_a_table_that_cannot_be_used_is_refused_with_its_place(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadFile, match=words):
        read_csv(path)


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.tum"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadFile, match="no text"):
        read_tum(path, ["head"])


@pytest.mark.parametrize(
    ("files", "stations", "words"),
    [
        (["head.tum"], ["head", "hand"], "no trajectory of station 'hand'"),
        (["a.head.tum", "b.head.tum"], ["head"], "2 trajectories of station 'head'"),
        (["forehead.tum"], ["head"], "no trajectory of station 'head'"),
    ],
)
def test_a_folder_needs_one_trajectory_a_station(
    files: list[str], stations: list[str], words: str, tmp_path: Path
) -> None:
    for name in files:
        (tmp_path / name).write_text("0 0 0 0 0 0 0 1\n", encoding="utf-8")
    with pytest.raises(BadFile, match=words):
        read_tum(tmp_path, stations)


def test_one_trajectory_is_for_one_station(tmp_path: Path) -> None:
    path = tmp_path / "any.tum"
    path.write_text("# time x y z qx qy qz qw\n2 1 2 3 0 0 0 1\n1 4 5 6 0 0 1 0\n", encoding="utf-8")
    read = read_tum(path, ["head"])["head"]
    assert read.time_s.tolist() == [1.0, 2.0]
    assert read.position_m.tolist() == [[4.0, 5.0, 6.0], [1.0, 2.0, 3.0]]
    assert read.world_from_body.tolist() == [[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0]]
    with pytest.raises(BadFile, match="one trajectory for 2 stations"):
        read_tum(path, ["head", "hand"])


TUM = "".join(f"{n / 40.0:.4f} 0.1 0.2 {n / 10.0:.3f} 0 0 0 1\n" for n in range(8))
PLACE = st.floats(0.0, 1.0, exclude_max=True)
CHANGE = st.one_of(
    st.tuples(st.just("byte"), PLACE, st.binary(min_size=1, max_size=1)),
    st.tuples(st.just("insert"), PLACE, st.sampled_from([b"nan", b"-inf", b"1e308", b"\n", b"\0", b'"', b",", b"#"])),
    st.tuples(st.just("cut"), PLACE, st.just(b"")),
)


@pytest.mark.parametrize(
    ("sound", "suffix", "read"),
    [
        (TUM, ".tum", lambda path: read_tum(path, ["head"])),
        (frames_table(("head",), hidden=3)[:1500], ".csv", read_csv),
    ],
    ids=["tum", "csv"],
)
@settings(max_examples=200, deadline=None)
@given(changes=st.lists(CHANGE, min_size=1, max_size=3))
def test_a_damaged_file_is_read_or_refused(
    sound: str,
    suffix: str,
    read: Callable[[Path], dict[str, TruthPoses]],
    changes: list[tuple[str, float, bytes]],
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    data = sound.encode()
    for kind, where, new in changes:
        at = int(where * len(data))
        end = {"byte": at + 1, "insert": at, "cut": len(data)}[kind]
        data = data[:at] + new + data[end:]
    path = tmp_path_factory.getbasetemp() / f"damaged{suffix}"
    path.write_bytes(data)
    try:
        bodies = read(path)
    except BadFile:
        return
    for body in bodies.values():
        assert np.all(np.diff(body.time_s) > 0.0)
        length = np.linalg.norm(body.world_from_body, axis=1)
        np.testing.assert_allclose(length[np.isfinite(length)], 1.0, atol=1e-12)


@pytest.mark.parametrize(
    ("factor", "shift", "cause"),
    [
        (1e9, 0.0, "nanoseconds"),
        (1e6, 0.0, "microseconds"),
        (1e3, 0.0, "milliseconds"),
        (1.0, 1.7e9, "a stray time"),
    ],
)
@pytest.mark.parametrize("suffix", [".csv", ".tum"])
def test_times_that_are_no_seconds_are_refused_before_any_array_is_made(
    tmp_path: Path, factor: float, shift: float, cause: str, suffix: str
) -> None:
    times_s = np.concatenate([[0.0], shift + np.arange(1, 400) / 40.0]) * factor
    path = tmp_path / f"truth{suffix}"
    lines = [f"{at_s!r},bar,0,0,0,1,0,0,0" for at_s in times_s.tolist()]
    text = "\n".join(["time_s,station,x_m,y_m,z_m,qw,qx,qy,qz", *lines])
    if suffix == ".tum":
        text = "\n".join(f"{at_s!r} 0 0 0 0 0 0 1" for at_s in times_s.tolist())
    path.write_text(text + "\n")
    with pytest.raises(BadInput, match=cause) as refused:
        read_truth_file(path, ["bar"])
    assert str(refused.value).startswith(str(path))


def test_two_poses_at_one_time_and_a_row_that_is_too_long_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "frames.csv"
    head = "time_s,station,x_m,y_m,z_m,qw,qx,qy,qz\n"
    rows = [f"{0.1 * k:g},head,{k},0,1,1,0,0,0\n" for k in range(4)]
    file.write_text(head + "".join([*rows, rows[2]]))
    assert len(read_csv(file)["head"].time_s) == 4  # the same pose twice
    for more, found in (("0.2,head,9,0,1,1,0,0,0\n", "two poses at 0.2 s"), ("0.4,head,9,0,1,1,0,0,0,7\n", "10 of 9")):
        file.write_text(head + "".join(rows) + more)
        with pytest.raises(BadFile, match=found):
            read_csv(file)
    file.write_text(head + "".join(rows) + "0.4,head,1e160,0,1,1,0,0,0\n")
    with pytest.raises(BadInput, match="farther than"):
        read_csv(file)


def test_poses_at_the_origin_among_others_are_gaps(tmp_path: Path) -> None:
    file = tmp_path / "frames.csv"
    rows = "".join(f"{0.1 * k:g},head,{k % 3},0,0,1,0,0,0\n" for k in range(9))
    file.write_text(f"time_s,station,x_m,y_m,z_m,qw,qx,qy,qz\n{rows}")
    truth = read_truth_file(file, ["head"])
    assert np.flatnonzero(np.isnan(truth.bodies["head"].position_m[:, 0])).tolist() == [0, 3, 6]
    assert truth.notes == ("3 poses of head at exactly (0, 0, 0) count as not seen.",)
