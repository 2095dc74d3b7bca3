"""References from files of poses: one reader for every kind, and bodies by the names of stations."""

from pathlib import Path

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadFile, BadInput
from harness.mocap.write import export_motion
from harness.score import compute_poses
from harness.stream import FRAME_COLUMNS, PoseFileOptions, TrackerFrame, format_csv_row, frame_rows
from harness.study.trust.capture_readings import CaptureReadings
from harness.study.trust.truth_motion import TruthMotion
from harness.study.trust.truth_source import TruthSource, load_truth
from tests.mocap.c3d_bytes import c3d_bytes
from tests.mocap.write.test_export import NAMES, SKELETON, Written, arbitrary_motion, joints_m

FRAMES = 60


def load(path: Path, *stations: str, **options: object) -> TruthMotion:
    """The reference of a capture of these stations."""
    capture = CaptureReadings(Path("capture.csv"), {}, None, dict.fromkeys(stations), (), ())  # type: ignore[arg-type]
    return load_truth(capture, TruthSource(str(path), options=PoseFileOptions(**options)))  # type: ignore[arg-type]


def poses() -> tuple[Floats, Floats]:
    """Positions (T, 3) [m] and orientations (T, 4) of a body that moves about all axes."""
    phase = np.linspace(0.0, 6.0, FRAMES)[:, None] * np.array([1.0, 1.3, 0.7])
    return 0.3 * np.sin(phase) + [0.0, 0.0, 1.0], rotations.exp(np.cos(phase))


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


def write_tum(path: Path, begin_s: float = 0.0, unit: float = 1.0) -> Path:
    place, turn = poses()
    time_s = begin_s + np.arange(FRAMES) / 40.0
    np.savetxt(path, np.column_stack([time_s, unit * place, np.roll(turn, -1, axis=1)]), fmt="%.9f")
    return path


def test_an_exported_tum_trajectory_is_read_back(rng: np.random.Generator, tmp_path: Path) -> None:
    cell = Written(arbitrary_motion(rng), arbitrary_motion(rng))
    for file in export_motion([cell], "tum", tmp_path):
        if ".estimate." in file.name:
            file.unlink()
    truth = load(tmp_path, "head", "lhand")
    assert truth.body_of == {"head": "head", "lhand": "lhand"}
    pose = compute_poses(SKELETON, cell.truth_qpos)
    world_from_hand = rotations.from_matrix(pose.world_from_bone[:, SKELETON.index("lhand")])
    hand = truth.bodies["lhand"]
    np.testing.assert_allclose(hand.time_s, cell.time_s - cell.time_s[0], atol=1e-9)
    np.testing.assert_allclose(hand.position_m, joints_m(cell.truth_qpos, SKELETON)[:, NAMES.index("lhand")], atol=1e-8)
    assert np.max(rotations.angle_between_rad(hand.world_from_body, world_from_hand)) < 1e-7


def test_the_table_of_replay_is_read_back(tmp_path: Path) -> None:
    path = tmp_path / "frames.csv"
    path.write_text(frames_table(("head", "hand"), hidden=7), encoding="utf-8")
    truth = load(path, "hand", "head")
    place, turn = poses()
    np.testing.assert_allclose(truth.bodies["hand"].position_m, place + 1.0, atol=1e-12)
    np.testing.assert_allclose(truth.bodies["hand"].world_from_body, turn, atol=1e-12)
    np.testing.assert_allclose(truth.bodies["hand"].time_s, np.arange(FRAMES) / 40.0 + 1e-3, atol=1e-12)
    assert len(truth.bodies["head"].time_s) == FRAMES - 1
    assert any(note.startswith("Reference: untracked rows of head: 1 of 60 left out") for note in truth.notes)


def test_bodies_have_the_names_of_stations_in_any_letters_and_some_suffice(tmp_path: Path) -> None:
    path = tmp_path / "frames.csv"
    path.write_text(frames_table(("Head", "hand")), encoding="utf-8")
    assert load(path, "head", "nose").body_of == {"head": "Head"}
    with pytest.raises(BadInput, match="no body nose, ear; it has Head, hand"):
        load(path, "nose", "ear")
    assert load(write_tum(tmp_path / "any.tum"), "nose").body_of == {"nose": "any"}
    with pytest.raises(BadInput, match="no body nose, ear; it has any"):
        load(tmp_path / "any.tum", "nose", "ear")


def test_files_of_a_folder_keep_their_common_clock(tmp_path: Path) -> None:
    write_tum(tmp_path / "take.head.tum", 12.0)
    write_tum(tmp_path / "hand.tum", 12.4)
    write_tum(tmp_path / "forehand.tum", 100.0)
    truth = load(tmp_path, "head", "hand", "nose")
    assert truth.body_of == {"head": "head", "hand": "hand"}
    assert truth.bodies["hand"].time_s[0] - truth.bodies["head"].time_s[0] == pytest.approx(0.4)
    write_tum(tmp_path / "again.head.csv")
    with pytest.raises(BadFile, match=r"again.head.csv and take.head.tum of station 'head'"):
        load(tmp_path, "head")
    with pytest.raises(BadFile, match=r"no file of a station"):
        load(tmp_path, "nose")
    head = "time," + ",".join(f"{body}_{axis}" for body in "ab" for axis in ("x", "y", "z", "qw", "qx", "qy", "qz"))
    rows = [f"{k / 40.0},{k},0,0,1,0,0,0,0,{k},0,1,0,0,0" for k in range(9)]
    (tmp_path / "hand.tum").write_text("\n".join([head, *rows]) + "\n")
    with pytest.raises(BadFile, match="2 bodies in 1 files"):
        load(tmp_path, "hand")


def test_what_the_user_knows_overrides_the_evidence_and_the_note_says_so(tmp_path: Path) -> None:
    path = write_tum(tmp_path / "body.tum")
    truth = load(path, "body", unit_m=0.0254, quaternion="wxyz")
    place, turn = poses()
    np.testing.assert_allclose(truth.bodies["body"].position_m, 0.0254 * place, atol=1e-9)
    assert rotations.angle_between_rad(truth.bodies["body"].world_from_body[0], np.roll(turn[0], -1)) < 1e-6
    assert any("length unit: 0.0254 m (given by --unit" in note for note in truth.notes)
    with pytest.raises(BadInput, match="It is for poses of another program"):
        load(tmp_path / "walk.bvh", "body", unit_m=1.0)


def test_markers_are_a_reference_with_their_noise(tmp_path: Path, rng: np.random.Generator) -> None:
    place, turn = poses()
    shape = np.array([[0.05, 0.0, 0.0], [0.0, 0.06, 0.0], [0.0, 0.0, 0.07]])
    points = place[:, None] + rotations.rotate(turn[:, None], shape[None]) + 0.001 * rng.normal(size=(FRAMES, 3, 3))
    path = tmp_path / "bar.c3d"
    path.write_bytes(c3d_bytes(points, labels=["Bar_1", "Bar_2", "Bar_3"]))
    truth = load(path, "bar")
    assert truth.noise["bar"][0] == pytest.approx(0.001 / np.sqrt(3.0), rel=0.25)
    assert any(note.startswith("Reference: body bar: 3 markers that fit") for note in truth.notes)
    with pytest.raises(BadInput, match="takes the unit alone"):
        load(path, "bar", up="y")


def test_a_file_that_is_no_reference_is_named(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("a,b\nno,numbers\n", encoding="utf-8")
    with pytest.raises(BadFile, match=r"x\.csv"):
        load(path, "head")
