"""One motion file as a clip, in every format."""

from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadFile, BadInput
from harness.mocap.clip_file import read_clip
from tests.mocap.sample_files import amass_arrays, bvh_text, clip, mvnx_text, write_clip


def test_every_format_gives_the_same_motion(tmp_path: Path) -> None:
    motion = clip()
    amc = write_clip(tmp_path, motion)
    bvh, npz, mvnx = (tmp_path / name for name in ("91_02.bvh", "91_03_poses.npz", "91_04.mvnx"))
    bvh.write_text(bvh_text(motion))
    np.savez(npz, allow_pickle=False, **amass_arrays(motion))
    mvnx.write_text(mvnx_text(motion))
    femur = motion.skeleton.dof_of_bone[motion.skeleton.index("lfemur")]
    for path, name in ((amc, "91_01"), (bvh, "91_02"), (npz, "91_03"), (mvnx, "91_04")):
        read = read_clip(str(path), 120.0 if path is amc else None)
        assert (read.name, read.subject, read.rate_hz, len(read)) == (name, "91", 120.0, len(motion))
        np.testing.assert_allclose(read.root_m, motion.root_m, atol=1e-6)
        angles_rad = read.angles_rad[:, read.skeleton.dof_of_bone[read.skeleton.index("lfemur")]]
        np.testing.assert_allclose(angles_rad, motion.angles_rad[:, femur], atol=1e-5)


def test_a_missing_rate_names_every_key_that_gives_it(tmp_path: Path) -> None:
    amc = write_clip(tmp_path, clip())
    with pytest.raises(BadInput) as error:
        read_clip(amc)
    for key in ("`motion.rate_hz` in the scenario", "column fps of manifest.csv", "--rate", "`rate_hz` (`read_clip`)"):
        assert key in str(error.value)
    (tmp_path / "manifest.csv").write_text("path,fps\n91/91_01.amc,60\n")
    assert read_clip(amc).rate_hz == 60.0
    assert read_clip(amc, 30.0).rate_hz == 30.0  # a rate that is given goes before the index


def test_files_that_hold_no_clip_are_refused(tmp_path: Path) -> None:
    bvh = tmp_path / "91_01.bvh"
    bvh.write_text(bvh_text(clip()))
    with pytest.raises(BadInput, match="records its own frame rate"):
        read_clip(bvh, 60.0)
    with pytest.raises(BadInput, match="holds markers"):
        read_clip(tmp_path / "91_01.c3d")
    with pytest.raises(BadInput, match="skeleton without motion"):
        read_clip(tmp_path / "91.asf")
    with pytest.raises(BadFile, match="no such file; expected a motion file"):
        read_clip(tmp_path / "91_01.fbx")
    (tmp_path / "91_01.fbx").write_text("; FBX 7.4.0 project file")
    with pytest.raises(BadFile, match=r"suffix '\.fbx'"):
        read_clip(tmp_path / "91_01.fbx")
