"""The skeletons of a library: one for each subject, whatever the number of copies, and never that of another."""

from pathlib import Path

import numpy as np
import pytest

from harness.core.humanoid24 import BONES, standard_skeleton
from harness.errors import BadFile, BadInput
from harness.mocap import synthetic
from harness.mocap.sources import read_skeletons
from tests.mocap.sample_files import asf_text


def test_copies_count_once_and_lengths_come_back_in_metres(tmp_path: Path) -> None:
    people = synthetic.sample_skeletons(3, seed=1)
    for subject, person in zip(("9", "10", "11"), people, strict=True):
        for where in ("asf", f"cmu/{subject}"):
            (tmp_path / where).mkdir(parents=True, exist_ok=True)
            (tmp_path / where / f"{subject}.asf").write_text(asf_text(person))
    found = read_skeletons(tmp_path)
    assert tuple(found) == ("10", "11", "9")
    for subject, person in zip(("9", "10", "11"), people, strict=True):
        assert found[subject].names == BONES
        np.testing.assert_allclose(found[subject].bone_m, person.bone_m, atol=1e-12)
        np.testing.assert_allclose(found[subject].axes, person.axes, atol=1e-9)


def test_two_skeletons_of_one_subject_are_refused(tmp_path: Path) -> None:
    first, second = synthetic.sample_skeletons(2, seed=1)
    for where, person in (("a", first), ("b", second)):
        (tmp_path / where).mkdir()
        (tmp_path / where / "91.asf").write_text(asf_text(person))
    with pytest.raises(BadFile, match="another skeleton of subject 91"):
        read_skeletons(tmp_path)


def test_what_is_no_skeleton_of_24_bones_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no ASF"):
        read_skeletons(tmp_path)
    trunk = standard_skeleton().subset(BONES[:6])[0]
    (tmp_path / "91.asf").write_text(asf_text(trunk))
    with pytest.raises(BadFile, match=r"91\.asf.*lclavicle"):
        read_skeletons(tmp_path)


def test_files_outside_the_folder_are_not_read(tmp_path: Path) -> None:
    (tmp_path / "elsewhere.asf").write_text(asf_text(standard_skeleton()))
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "91.asf").symlink_to(tmp_path / "elsewhere.asf")
    with pytest.raises(BadInput, match="no ASF"):
        read_skeletons(tmp_path / "library")


def test_the_library_has_twenty_people_of_a_persons_size(mocap: Path) -> None:
    found = read_skeletons(mocap)
    assert len(found) == len(list((mocap / "asf").glob("*.asf"))) == 20
    legs = [person.length_m[[BONES.index("ltibia"), BONES.index("lfemur")]].sum() for person in found.values()]
    assert 0.73 < min(legs) < max(legs) < 0.91
    vectors = np.mean([person.bone_m for person in found.values()], axis=0)
    mirrored = np.array([vectors[BONES.index(_other_side(name))] for name in BONES]) * [1.0, -1.0, 1.0]
    np.testing.assert_allclose((vectors + mirrored) / 2, standard_skeleton().bone_m, atol=2e-4)


def _other_side(bone: str) -> str:
    flipped = {"l": "r", "r": "l"}[bone[0]] + bone[1:] if bone[0] in "lr" else bone
    return flipped if flipped in BONES else bone
