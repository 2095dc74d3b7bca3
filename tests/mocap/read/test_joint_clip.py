"""BVH and AMASS: joint rotations are read as hinge angles, and the residual of the fit is reported."""

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.humanoid24 import BONES, standard_skeleton
from harness.core.skeleton import forward_kinematics
from harness.errors import BadFile, BadInput
from harness.mocap.library import MotionLibrary
from harness.mocap.read import amass, bvh
from harness.mocap.read.joint_clip import fit_hinges
from tests.mocap.sample_files import LEFT_OUT, UNIT_M, amass_arrays, bvh_text, clip

SHARED = ["02_01", "02_05", "05_13", "07_05", "14_08", "16_16", "29_01", "49_06"]
"""Takes of the library in AMC and in BVH."""
LEGS = {"LeftLeg": "lfemur", "RightLeg": "rfemur", "LeftFoot": "ltibia", "RightFoot": "rtibia", "LeftToeBase": "lfoot"}
ABOVE = {"Neck": "thorax", "Head_end": "head", "LeftForeArm": "lhumerus", "LeftHand": "lradius", "RightHand": "rradius"}


def test_bvh_comes_back_as_angles(tmp_path: Path) -> None:
    motion = clip()
    file = tmp_path / "91_01.bvh"
    file.write_text(bvh_text(motion))
    joint_clip = bvh.read_bvh(file)
    assert (len(joint_clip), joint_clip.rate_hz) == (len(motion) + 1, 120.0)
    assert joint_clip.unit_m == pytest.approx(UNIT_M)
    assert "ASF units" in joint_clip.unit_evidence
    assert bvh.starts_in_t_pose(joint_clip)
    found = bvh.read_bvh_clip(file)
    np.testing.assert_allclose(found.angles_rad, motion.angles_rad, atol=1e-6)
    np.testing.assert_allclose(found.root_m, motion.root_m, atol=1e-9)
    kept = [b for b, name in enumerate(BONES) if name not in LEFT_OUT]
    np.testing.assert_allclose(found.skeleton.bone_m[kept], motion.skeleton.bone_m[kept], atol=1e-9)
    np.testing.assert_allclose(found.skeleton.bone_m, motion.skeleton.bone_m, atol=1e-3)
    assert any("leaves out the length of thorax, lwrist, rwrist" in note for note in found.notes)


@pytest.mark.parametrize("unit_m", [0.01, 0.001, 1.0, 0.0254])
def test_the_size_of_the_skeleton_tells_the_unit(tmp_path: Path, unit_m: float) -> None:
    file = tmp_path / "91_01.bvh"
    file.write_text(bvh_text(clip(3), unit_m=unit_m))
    assert bvh.read_bvh(file).unit_m == unit_m


def test_an_unusual_unit_is_not_guessed_but_can_be_given(tmp_path: Path) -> None:
    file = tmp_path / "91_01.bvh"
    file.write_text(bvh_text(clip(3), unit_m=0.3048))
    with pytest.raises(BadFile, match="--unit"):
        bvh.read_bvh(file)
    assert bvh.read_bvh(file, unit_m=0.3048).root_m[0] == pytest.approx(clip(3).root_m[0])


def test_without_a_t_pose_nothing_is_left_out(tmp_path: Path) -> None:
    file = tmp_path / "91_01.bvh"
    file.write_text(bvh_text(clip(), t_pose=False))
    assert len(bvh.read_bvh_clip(file)) == len(clip())


BVH = bvh_text(clip(3))
BAD_BVH = [
    ("HIERARCHY", ":version", "line 1: ':version'; expected HIERARCHY"),
    ("ROOT", "JOINT", "line 2: 'JOINT'; expected one ROOT"),
    ("MOTION", "MOTIONS", "no line MOTION"),
    ("}\nMOTION", "MOTION", "'MOTION'; expected JOINT, End Site or }"),
    ("JOINT LeftUpLeg", "JOINT LHipJoint", "'LHipJoint'; expected a new name"),
    ("JOINT LeftUpLeg", "BONE LeftUpLeg", "'BONE'; expected JOINT, End Site or }"),
    ("CHANNELS 6", "CHANNELS 5", "line 5: '5'; expected 6"),
    ("Zrotation Yrotation", "Zrotation Zrotation", "expected each rotation once after each position once"),
    ("OFFSET 0.0 0.0 0.0", "OFFSET 0.0 nan 0.0", "line 4: 'nan' for the offset of Hips"),
    ("Frames: 4", "Frames: 5", "4 frames; expected the 5 announced"),
    ("Frames: 4", "Frames: 3", "4 frames; expected the 3 announced"),
    ("Frames: 4", "Frames: 1e999", "'1e999' for the frame count"),
    ("Frame Time: .0083333", "Frame Time: 0", "a frame time of 0 s"),
    ("Frame Time", "Frame rate", "no frame count and time"),
]


@pytest.mark.parametrize(("old", "new", "found"), BAD_BVH)
def test_bad_bvh_is_refused_with_the_line(tmp_path: Path, old: str, new: str, found: str) -> None:
    assert old in BVH
    file = tmp_path / "x.bvh"
    file.write_text(BVH.replace(old, new, 1))
    with pytest.raises(BadFile) as error:
        bvh.read_bvh(file)
    assert found in str(error.value)


def test_a_bvh_lying_down_or_mirrored_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "x.bvh"
    lines = BVH.split("\n")
    swapped = [_swap(line, 1, 2) if "OFFSET" in line else line for line in lines]
    file.write_text("\n".join(swapped))
    with pytest.raises(BadFile, match="does not stand along y"):
        bvh.read_bvh(file)
    file.write_text(BVH.replace("JOINT Left", "JOINT @").replace("JOINT Right", "JOINT Left").replace("@", "Right"))
    with pytest.raises(BadFile, match="left joints at negative x"):
        bvh.read_bvh(file)


def _swap(line: str, a: int, b: int) -> str:
    words = line.split()
    words[a + 1], words[b + 1] = words[b + 1], words[a + 1]
    return " ".join(words)


@pytest.mark.parametrize("name", SHARED)
def test_bvh_agrees_with_the_amc_of_the_same_take(mocap: Path, name: str) -> None:
    """Legs agree to 0.01 mm; joints above the upper back are closer to the hips by the thorax's length."""
    amc = MotionLibrary(mocap).load(name)
    joint_clip = bvh.read_bvh(mocap / "bvh" / f"{name}.bvh").cut(1)
    pose = forward_kinematics(amc.skeleton, amc.root_m, amc.world_from_root, amc.angles_rad)
    at, _ = joint_clip.world()

    def apart_m(joint: str, bone: str) -> Floats:
        gap = at[:, joint_clip.names.index(joint)] - pose.end_m[:, amc.skeleton.index(bone)]
        out: Floats = np.sqrt(np.sum(gap**2, axis=1))
        return out

    assert len(joint_clip) == len(amc)
    for joint, bone in LEGS.items():
        assert apart_m(joint, bone).max() < 1e-5
    thorax_m = amc.skeleton.length_m[amc.skeleton.index("thorax")]
    assert 0.10 < thorax_m < 0.13
    for joint, bone in ABOVE.items():
        np.testing.assert_allclose(apart_m(joint, bone), thorax_m, atol=1e-5)


@pytest.mark.parametrize("name", SHARED)
def test_hinges_fitted_to_bvh_are_those_of_the_amc(mocap: Path, name: str) -> None:
    amc = MotionLibrary(mocap).load(name)
    joint_clip = bvh.read_bvh(mocap / "bvh" / f"{name}.bvh").cut(1)
    fit, residual_rad = fit_hinges(joint_clip, bvh.CMU_MAP)
    assert residual_rad.max() < 1e-4
    _, dofs = amc.skeleton.subset(BONES)
    turn = fit.angles_rad - amc.angles_rad[:, dofs]
    assert np.rad2deg(np.abs(np.angle(np.exp(1j * turn)))).max() < 0.01


@pytest.mark.long
def test_every_staged_bvh_loads(mocap: Path) -> None:
    library = MotionLibrary(mocap)
    for entry in library.entries():
        if entry.format == "bvh":
            motion = library.load(entry.name)
            assert len(motion) == (entry.frames or 0) - 1, entry.name  # the T-pose is left out
            assert 0.7 < motion.root_m[:, 2].mean() < 1.3, entry.name


def test_npz_comes_back_as_angles(tmp_path: Path) -> None:
    motion = clip()
    file = tmp_path / "91_01_poses.npz"
    np.savez(file, allow_pickle=False, **amass_arrays(motion))
    fit, residual_rad = fit_hinges(amass.read_amass(file), amass.SMPL_MAP)
    assert fit.rate_hz == motion.rate_hz
    np.testing.assert_allclose(fit.root_m, motion.root_m, atol=1e-12)
    np.testing.assert_allclose(fit.skeleton.bone_m, standard_skeleton().bone_m)
    whole = ("lfemur", "ltibia", "lfoot", "rfemur", "rtibia", "rfoot", "lowerback", "upperback", "thorax", "lclavicle")
    for bone in whole:
        where = motion.skeleton.dof_of_bone[motion.skeleton.index(bone)]
        np.testing.assert_allclose(fit.angles_rad[:, where], motion.angles_rad[:, where], atol=1e-6)
    for bone in ("lhand", "rhand", "head"):  # one joint moves two bones there: only the end of the chain is as it was
        assert residual_rad[:, BONES.index(bone)].max() < np.deg2rad(25.0)
    assert any("mean skeleton" in note for note in amass.read_amass_clip(file).notes)


def test_smpl_at_rest_is_a_t_with_straight_legs(tmp_path: Path) -> None:
    """Zero pose, facing as SMPL does: arms along the sides' axis, legs straight down, feet forward, no residual."""
    file = tmp_path / "rest.npz"
    np.savez(file, poses=np.zeros((2, 156)), trans=np.zeros((2, 3)), mocap_framerate=60.0)
    fit, residual_rad = fit_hinges(amass.read_amass(file), amass.SMPL_MAP)
    assert residual_rad.max() < np.deg2rad(0.5)
    pose = forward_kinematics(fit.skeleton, fit.root_m, fit.world_from_root, fit.angles_rad)
    bone = pose.end_m[0] - pose.start_m[0]
    unit = bone / np.linalg.norm(bone, axis=1)[:, None]
    # SMPL's rest pose, turned by no root vector: x left, y up, z forward
    np.testing.assert_allclose(unit[BONES.index("lhumerus")], [1.0, 0.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(unit[BONES.index("rradius")], [-1.0, 0.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(unit[BONES.index("ltibia")], [0.0, -1.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(unit[BONES.index("rfemur")], [0.0, -1.0, 0.0], atol=1e-3)
    assert unit[BONES.index("lfoot")][2] > 0.9
    np.testing.assert_allclose(unit[BONES.index("lowerback")], [0.0, 1.0, -0.083], atol=0.01)


def test_a_bent_elbow_bends_the_elbow(tmp_path: Path) -> None:
    """A left elbow bent by 80 deg about SMPL's y brings the forearm forward, almost entirely by its hinge."""
    poses = np.zeros((1, 156))
    poses[0, 18 * 3 + 1] = -np.deg2rad(80.0)
    file = tmp_path / "bent.npz"
    np.savez(file, poses=poses, trans=np.zeros((1, 3)), mocap_frame_rate=60)
    fit, residual_rad = fit_hinges(amass.read_amass(file), amass.SMPL_MAP)
    elbow = fit.skeleton.dof_of_bone[BONES.index("lradius")]
    np.testing.assert_allclose(np.rad2deg(fit.angles_rad[0, elbow]), 80.0, atol=0.5)
    assert residual_rad.max() < np.deg2rad(0.5)


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({"poses": None}, "no array poses"),
        ({"mocap_framerate": None}, "no frame rate"),
        ({"mocap_framerate": np.array(0.0)}, "mocap_framerate of 0.0"),
        ({"mocap_frame_rate": np.array(60.0)}, "mocap_framerate and mocap_frame_rate that differ"),
        ({"trans": np.zeros((5, 3))}, "poses (24, 156) and trans (5, 3)"),
        ({"trans": np.array(1.0)}, "trans ()"),
        ({"poses": np.zeros((24, 63))}, "poses (24, 63)"),
        ({"poses": np.full((24, 156), np.nan)}, "a value of poses that is not a finite number"),
        ({"poses": np.array([object()])}, "array poses: object"),
        ({"trans": np.array(["a", "b"])}, "array trans of <U1"),
        ({"trans": np.zeros((0, 3)), "poses": np.zeros((0, 156))}, "poses (0, 156)"),
    ],
)
def test_a_bad_npz_is_refused(tmp_path: Path, change: dict[str, Floats | None], found: str) -> None:
    arrays = {key: value for key, value in {**amass_arrays(clip()), **change}.items() if value is not None}
    file = tmp_path / "x.npz"
    np.savez(file, **cast(Any, arrays))  # objects too: what must be refused has to be written first
    with pytest.raises(BadFile) as error:
        amass.read_amass(file)
    assert found in str(error.value)


def test_a_map_must_fit_the_joints(tmp_path: Path) -> None:
    file = tmp_path / "91_01.bvh"
    file.write_text(BVH)
    joint_clip = bvh.read_bvh(file)
    with pytest.raises(BadInput, match="no joint pelvis for root"):
        fit_hinges(joint_clip, amass.SMPL_MAP)
    with pytest.raises(BadInput, match="lacks head"):
        fit_hinges(joint_clip, {bone: drive for bone, drive in bvh.CMU_MAP.items() if bone != "head"})
