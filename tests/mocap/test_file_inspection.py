"""Inspection: facts with evidence, known glitches found, no findings in sound motion, and no guesses."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.motion import Clip
from harness.core.skeleton import forward_kinematics
from harness.errors import BadFile, BadInput
from harness.mocap.file_inspection import inspect_clip, inspect_file
from harness.mocap.library import MotionLibrary
from tests.mocap.sample_files import amass_arrays, asf_text, bvh_text, clip, write_clip

GLITCHES = {"05_13": 732, "16_01": 204, "16_15": 3, "16_23": 4, "16_28": 7}
"""Clip and frame of the glitches that the index of the library names."""
ALSO_FLAGGED = {
    "13_17": "frame 716: the right shoulder jumps by 0.14 m and stays there",
    "16_17": "frame 475: the whole body is 0.09 m off for one frame",
    "49_04": "frames 245 to 251 are all the same",
}
"""Clips with findings that the index does not mark."""


def _changed(motion: Clip, root_m: Floats) -> Clip:
    return replace(motion, root_m=root_m)


def test_sound_motion_is_left_in_peace() -> None:
    found = inspect_clip(clip(240))
    assert found.findings == ()
    assert found.lines()[-1].split() == ["finding", "none"]
    assert (found.frames, found.rate_hz, found.limits_share) == (240, 120.0, 0.0)
    assert found.duration_s == pytest.approx(239 / 120)
    assert found.height_m == pytest.approx(1.64, abs=0.08)
    assert "head is over the feet in 100 %" in found.up


@pytest.mark.parametrize("at", [1, 2, 100, 237, 238])
def test_a_point_that_jumps_is_found_in_its_frame(at: int) -> None:
    motion = clip(240)
    root = np.array(motion.root_m)
    root[at:] += [0.15, 0.0, 0.0]
    (spike,) = inspect_clip(_changed(motion, root)).spikes
    assert spike.frame == at + 1
    assert spike.speed_m_s == pytest.approx(0.15 * 120.0, rel=0.1)


@pytest.mark.parametrize("at", [3, 100, 200])
def test_a_single_frame_that_is_off_is_found(at: int) -> None:
    motion = clip(240)
    root = np.array(motion.root_m)
    root[at] += [0.0, 0.11, 0.0]
    (spike,) = inspect_clip(_changed(motion, root)).spikes
    assert abs(spike.frame - (at + 1)) <= 1


def test_a_small_shake_is_none(rng: np.random.Generator) -> None:
    motion = clip(240)
    shaken = motion.root_m + rng.normal(scale=0.004, size=motion.root_m.shape)
    assert inspect_clip(_changed(motion, shaken)).spikes == ()


@pytest.mark.parametrize(("turn_deg", "found"), [(29.0, False), (31.0, True), (180.0, True)])
@pytest.mark.parametrize("bone", ["lhand", "rhand", "lfoot", "rfoot", "lwrist", "rwrist"])
def test_a_sudden_turn_of_a_hand_or_foot_is_found(bone: str, turn_deg: float, found: bool) -> None:
    motion = _held(clip(1), 40)
    angles = np.array(motion.angles_rad)
    angles[25:, motion.skeleton.dof_of_bone[motion.skeleton.index(bone)].start] += np.deg2rad(turn_deg)
    turns = inspect_clip(replace(motion, angles_rad=angles)).turns
    assert [(t.frame, t.bone) for t in turns] == ([(26, bone)] if found else [])
    assert all(t.turn_deg == pytest.approx(turn_deg) for t in turns)


def test_the_least_turn_is_a_speed_at_low_rates() -> None:
    motion = _held(clip(1), 40)
    angles = np.array(motion.angles_rad)
    angles[25:, motion.skeleton.dof_of_bone[motion.skeleton.index("lhand")].start] += np.deg2rad(70.0)
    turned = replace(motion, angles_rad=angles)
    counts = [len(inspect_clip(replace(turned, rate_hz=rate_hz)).turns) for rate_hz in (480.0, 120.0, 60.0, 30.0)]
    assert counts == [1, 1, 1, 0]  # 70 deg a frame are 4200 deg/s at 60 Hz and 2100 deg/s at 30 Hz


def _held(still: Clip, frames: int) -> Clip:
    """The first frame of a clip for some frames."""
    first = np.zeros(frames, dtype=int)
    return replace(
        still,
        root_m=still.root_m[first],
        world_from_root=still.world_from_root[first],
        angles_rad=still.angles_rad[first],
    )


@pytest.mark.parametrize("every", [8, pytest.param(1, marks=pytest.mark.slow)])
def test_the_turns_of_recorded_hands_and_feet_are_all_found(mocap: Path, every: int) -> None:
    """Against a second way: the traces of the bones' world rotations relative to their parents'."""
    library = MotionLibrary(mocap)
    names = [entry.name for entry in library.entries() if entry.format == "amc"]
    total = 0
    for name in sorted({*names[::every], "49_07", "135_06"}):
        motion = library.load(name)
        pose = forward_kinematics(motion.skeleton, motion.root_m, motion.world_from_root, motion.angles_rad)
        expected = set()
        for bone in ("lhand", "rhand", "lfoot", "rfoot", "lwrist", "rwrist"):
            at = motion.skeleton.index(bone)
            parent = pose.world_from_bone[:, motion.skeleton.parents[at]]
            local = np.einsum("tji,tjk->tik", parent, pose.world_from_bone[:, at])
            trace = np.einsum("tij,tij->t", local[1:], local[:-1])
            expected |= {(int(t) + 2, bone) for t in np.flatnonzero(trace <= 1.0 + 2.0 * np.cos(np.deg2rad(30.0)))}
        assert {(t.frame, t.bone) for t in inspect_clip(motion).turns} == expected, name
        total += len(expected)
    assert total > 30


def test_frozen_frames_are_found() -> None:
    motion = clip(100)
    hold = np.concatenate([np.arange(40), np.full(9, 40), np.arange(49, 100)])
    stuck = replace(
        motion,
        root_m=motion.root_m[hold],
        world_from_root=motion.world_from_root[hold],
        angles_rad=motion.angles_rad[hold],
    )
    assert inspect_clip(stuck).frozen == ((41, 49),)
    assert "frames 41 to 49 are all the same" in inspect_clip(stuck).findings


def test_a_broken_limit_is_named() -> None:
    motion = clip(50)
    angles = np.array(motion.angles_rad)
    knee = motion.skeleton.dof_of_bone[motion.skeleton.index("ltibia")]
    angles[:25, knee] = np.deg2rad(-41.0)
    found = inspect_clip(replace(motion, angles_rad=angles))
    assert found.limits_share == pytest.approx(0.5)
    assert "50.0 % of the frames break a joint limit (ltibia.rx by 30.0 deg)" in found.findings


def test_a_root_in_another_unit_is_doubted() -> None:
    motion = clip(50)
    doubts = inspect_clip(_changed(motion, motion.root_m / 0.0564)).doubts
    assert any("are root and bones in one unit" in doubt for doubt in doubts)


def test_an_amc_tells_neither_rate_nor_skeleton(tmp_path: Path) -> None:
    amc = write_clip(tmp_path, clip())
    with pytest.raises(BadInput, match="--rate"):
        inspect_file(amc)
    found = inspect_file(amc, rate_hz=120.0)
    assert (found.format, found.rate_evidence, found.frames) == ("amc", "as given", 24)
    assert found.up.startswith("y (the rest pose stands along it")
    assert found.unit_evidence.startswith("length in the ASF's :units; legs of 0.8")
    (tmp_path / "manifest.csv").write_text("path,fps\n91/91_01.amc,60\n")
    assert inspect_file(amc).rate_hz == 60.0
    assert inspect_file(amc, library=tmp_path).rate_evidence == "from manifest.csv of the library"
    json.dumps(found.as_dict())
    (tmp_path / "91" / "91.asf").unlink()
    with pytest.raises(BadFile, match=r"91\.asf"):
        inspect_file(amc, rate_hz=120.0)


def test_a_given_unit_settles_a_wrong_one(tmp_path: Path) -> None:
    amc = write_clip(tmp_path, clip())
    asf = amc.with_name("91.asf")
    asf.write_text(asf_text(clip().skeleton).replace("length 0.45", "length 45"))
    with pytest.raises(BadFile, match="--unit"):
        inspect_file(amc, rate_hz=120.0)
    found = inspect_file(amc, rate_hz=120.0, unit=0.0254 / 0.45)
    assert found.unit_evidence.startswith("as given")
    assert found.findings == ()


def test_a_bvh_and_an_npz_know_their_rate(tmp_path: Path) -> None:
    file = tmp_path / "91_01.bvh"
    file.write_text(bvh_text(clip()))
    found = inspect_file(file)
    assert (found.format, found.rate_hz, found.frames, found.findings) == ("bvh", 120.0, 24, ())
    assert "frame 1, an added T-pose, was left out" in found.notes
    with pytest.raises(BadInput, match="Leave out --rate"):
        inspect_file(file, rate_hz=60.0)
    npz = tmp_path / "91_01.npz"
    np.savez(npz, allow_pickle=False, **amass_arrays(clip()))
    found = inspect_file(npz)
    assert (found.format, found.rate_hz, found.height_m) == ("npz", 120.0, None)
    with pytest.raises(BadInput, match="Leave out --unit"):
        inspect_file(npz, unit=0.01)


def test_a_bvh_of_another_skeleton_is_inspected_without_hinges(tmp_path: Path) -> None:
    file = tmp_path / "x.bvh"
    file.write_text(bvh_text(clip(), t_pose=False).replace("LowerBack", "Belly"))
    found = inspect_file(file)
    assert (found.limits_share, found.findings) == (None, ())
    assert "not checked" in "\n".join(found.lines())


def test_other_hinges_are_not_held_to_the_limits(tmp_path: Path) -> None:
    amc = write_clip(tmp_path, clip())
    asf = amc.with_name("91.asf")
    asf.write_text(asf.read_text().replace("dof rx ry rz", "dof rx ry", 1))  # of lowerback
    rows = [line.rsplit(" ", 1)[0] if line.startswith("lowerback") else line for line in amc.read_text().split("\n")]
    amc.write_text("\n".join(rows))
    found = inspect_file(amc, rate_hz=120.0)
    assert (found.limits_share, found.findings) == (None, ())
    assert found.unit_evidence.endswith("m")


@pytest.mark.parametrize("unit", [0.0, -1.0, float("nan"), float("inf")])
def test_a_unit_that_is_none_is_refused(tmp_path: Path, unit: float) -> None:
    with pytest.raises(BadInput, match="A unit of"):
        inspect_file(write_clip(tmp_path, clip(3)), rate_hz=120.0, unit=unit)


@pytest.mark.parametrize(("name", "error"), [("x.asf", BadInput), ("x.fbx", BadFile), ("absent.amc", BadFile)])
def test_other_files_are_refused(tmp_path: Path, name: str, error: type[Exception]) -> None:
    if not name.startswith("absent"):
        (tmp_path / name).write_text("anything")
    with pytest.raises(error):
        inspect_file(tmp_path / name, rate_hz=120.0)


def test_many_spikes_are_counted_not_listed() -> None:
    motion = clip(400)
    root = np.array(motion.root_m)
    for at in range(20, 380, 20):
        root[at:] += [0.3, 0.0, 0.0]
    found = inspect_clip(_changed(motion, root))
    assert len(found.spikes) == 18
    assert "and 10 more frames with spikes" in found.findings


@pytest.mark.parametrize("every", [4, pytest.param(1, marks=pytest.mark.slow)])
def test_the_known_glitches_are_found_and_few_others(mocap: Path, every: int) -> None:
    """Every glitch that the index names, in its frame; of unmarked clips only those of ALSO_FLAGGED."""
    library = MotionLibrary(mocap)
    names = [entry.name for entry in library.entries() if entry.format == "amc"]
    flagged = {}
    for name in sorted({*names[::every], *GLITCHES, *ALSO_FLAGGED}):
        found = replace(inspect_clip(library.load(name)), turns=())  # they have a test of their own
        if found.findings:
            flagged[name] = found
    for name, frame in GLITCHES.items():
        assert "glitch" in library.entry(name).note
        assert frame in [spike.frame for spike in flagged[name].spikes], name
    assert set(flagged) - set(GLITCHES) == set(ALSO_FLAGGED)
    assert len(ALSO_FLAGGED) <= 5


def test_markers_are_inspected(mocap: Path) -> None:
    found = inspect_file(mocap / "c3d" / "02_05.c3d")
    assert (found.format, found.rate_hz, found.up) == ("c3d", 120.0, "z (POINT:Y_SCREEN is +Z)")
    assert found.missing_markers == ("RSHN",)
    assert 0.0 < found.missing_share < 1e-3
    assert found.notes == ()
    (note,) = inspect_file(mocap / "c3d" / "02_05.c3d", library=mocap).notes
    assert "LANK ltibia 2" in note
    assert note.count(",") == 40
