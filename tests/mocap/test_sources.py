"""Sources of motion: their folders, and the skeletons that they know."""

import os
from pathlib import Path

import numpy as np
import pytest

from harness.core.humanoid24 import BONES, standard_skeleton
from harness.errors import BadFile, BadInput
from harness.mocap import synthetic
from harness.mocap.sources import (
    MOCAP_VARIABLE,
    POPULATION_SIZE,
    find_library_folders,
    open_motion_source,
    read_skeletons,
)
from tests.mocap.sample_files import asf_text, clip, write_clip


def test_a_library_s_people_are_its_skeletons_but_one(tmp_path: Path) -> None:
    for subject, person in zip(("07", "08", "09"), synthetic.sample_skeletons(3, seed=1), strict=True):
        (tmp_path / f"{subject}.asf").write_text(asf_text(person))
    source = open_motion_source("cmu", tmp_path, seed=1, rate_hz=None)
    assert list(source.other_skeletons(without="08")) == ["07", "09"]
    assert list(source.other_skeletons(without="99")) == ["07", "08", "09"]


def test_built_in_people_are_the_same_for_every_seed_and_performer() -> None:
    one, other = (
        open_motion_source("builtin", None, seed=seed, rate_hz=None).other_skeletons(who)
        for seed, who in ((1, "p1"), (2, "p2"))
    )
    assert len(one) == POPULATION_SIZE
    for a, b in zip(one.values(), other.values(), strict=True):
        np.testing.assert_array_equal(a.bone_m, b.bone_m)


def test_a_library_may_be_spread_over_folders(tmp_path: Path) -> None:
    folders = [tmp_path / "a", tmp_path / "b"]
    for folder, name in zip(folders, ("91_01", "92_01"), strict=True):
        write_clip(folder, clip(name=name))
    source = open_motion_source("cmu", folders, seed=1, rate_hz=120.0)
    assert source.names() == ("91_01", "92_01")
    assert list(source.other_skeletons(without="91")) == ["92"]
    assert open_motion_source("cmu", folders[0], seed=1, rate_hz=120.0).names() == ("91_01",)


def test_folders_are_those_of_the_option_or_of_the_variable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(MOCAP_VARIABLE, str(tmp_path))
    assert find_library_folders(None) == find_library_folders([]) == (tmp_path,)
    (tmp_path / "other").mkdir()
    assert find_library_folders([tmp_path / "other", tmp_path]) == (tmp_path / "other", tmp_path)
    with pytest.raises(BadInput, match="absent is no folder"):
        find_library_folders([tmp_path, tmp_path / "absent"])
    monkeypatch.delenv(MOCAP_VARIABLE)
    with pytest.raises(BadInput, match="--mocap DIR"):
        find_library_folders(None)


def test_the_variable_names_folders_as_path_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    monkeypatch.setenv(MOCAP_VARIABLE, os.pathsep.join((str(tmp_path / "a"), "", str(tmp_path / "b"))))
    assert find_library_folders(None) == (tmp_path / "a", tmp_path / "b")


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
