"""Sources of motion: their folders, and the skeletons that they know."""

import os
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadInput
from harness.mocap import synthetic
from harness.mocap.sources import MOCAP_VARIABLE, POPULATION_SIZE, find_library_folders, open_motion_source
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
