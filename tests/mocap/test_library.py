"""The library: names, copies, rates and skeletons, and nothing outside its folder."""

from copy import copy
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadFile, BadInput, UnknownName
from harness.mocap.library import MotionLibrary, ignored_paths_note
from harness.mocap.sources import LibrarySource
from tests.mocap.sample_files import amass_arrays, asf_text, bvh_text, clip, mvnx_text, write_clip

INDEX = "path,subject,trial,behaviour,frames,fps,note\n91/91_01.amc,91,01,walking,24,60,limps\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Five clips: 91_01 in three formats, 91_02 as BVH, 91_03 as npz, 91_04 as C3D only, 91_05 as MVNX."""
    motion = clip()
    write_clip(tmp_path, motion)
    (tmp_path / "manifest.csv").write_text(INDEX)
    (tmp_path / "deep" / "down").mkdir(parents=True)
    for name in ("91_01", "91_02"):
        (tmp_path / "deep" / f"{name}.bvh").write_text(bvh_text(motion))
    for name in ("91_01", "91_03"):
        np.savez(tmp_path / "deep" / "down" / f"{name}_poses.npz", allow_pickle=False, **amass_arrays(motion))
    (tmp_path / "deep" / "91_04.c3d").write_bytes(b"not read before it is asked for")
    (tmp_path / "deep" / "91_05.MVNX").write_text(mvnx_text(motion))
    (tmp_path / "readme.txt").write_text("no motion")
    return tmp_path


def test_clips_are_found_by_name_whatever_their_format(folder: Path) -> None:
    library = MotionLibrary(folder)
    assert library.names() == ("91_01", "91_02", "91_03", "91_05")
    assert {entry.name: entry.format for entry in library.entries()} == {
        "91_01": "amc",
        "91_02": "bvh",
        "91_03": "npz",
        "91_04": "c3d",
        "91_05": "mvnx",
    }
    assert sorted(copy.suffix for copy in library.entry("91_01").copies) == [".bvh", ".npz"]
    told = library.entry("91_01").as_dict()
    assert (told["behaviour"], told["frames"], told["rate_hz"], told["subject"]) == ("walking", 24, 60.0, "91")
    assert "walking" in library.entry("91_01").line()
    assert "? Hz" in library.entry("91_02").line()


def test_what_is_loaded_carries_what_the_index_knows(folder: Path) -> None:
    found = MotionLibrary(folder).load("91_01")
    assert (found.name, found.subject, found.source, found.behaviour) == ("91_01", "91", "cmu", "walking")
    assert (found.rate_hz, found.notes, len(found)) == (60.0, ("limps",), 24)


@pytest.mark.parametrize("name", ["91_02", "91_03", "91_05"])
def test_other_formats_load_on_the_24_bones(folder: Path, name: str) -> None:
    found = MotionLibrary(folder).load(name)
    assert (found.name, found.rate_hz, len(found.skeleton.names)) == (name, 120.0, 24)
    femur = found.skeleton.dof_of_bone[found.skeleton.index("lfemur")]
    np.testing.assert_allclose(found.angles_rad[:, femur], clip().angles_rad[:, femur], atol=1e-5)


def test_an_unknown_clip_is_named_with_its_neighbour(folder: Path) -> None:
    with pytest.raises(UnknownName, match="Did you mean '91_03'"):
        MotionLibrary(folder).load("91_3")


def test_markers_are_no_motion(folder: Path) -> None:
    with pytest.raises(BadInput, match="holds markers"):
        MotionLibrary(folder).load("91_04")


def test_without_a_rate_an_amc_is_refused_until_it_is_given(folder: Path) -> None:
    (folder / "manifest.csv").unlink()
    with pytest.raises(BadInput, match=r"`motion\.rate_hz` in the scenario"):
        MotionLibrary(folder).load("91_01")
    assert MotionLibrary(folder, rate_hz=120.0).load("91_01").rate_hz == 120.0


def test_the_skeleton_may_lie_above_or_alone(folder: Path) -> None:
    library = MotionLibrary(folder, rate_hz=120.0)
    (folder / "91" / "91.asf").rename(folder / "91.asf")
    assert len(library.load("91_01")) == 24
    (folder / "91.asf").rename(folder / "91" / "anyone.asf")
    assert len(library.load("91_01")) == 24
    (folder / "91" / "another.asf").write_text(asf_text(clip().skeleton))
    with pytest.raises(BadFile, match=r"2 skeletons, none called 91\.asf"):
        library.load("91_01")
    (folder / "91" / "another.asf").unlink()
    (folder / "91" / "anyone.asf").unlink()
    with pytest.raises(BadFile, match="no skeleton beside it"):
        library.load("91_01")


def test_links_out_of_the_folder_are_ignored_and_named(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    outside = tmp_path_factory.mktemp("outside")
    motion = clip(name="92_01")
    target = write_clip(outside, motion)
    links = [folder / name for name in ("92", "92_01.amc", "nowhere.amc")]
    links[0].symlink_to(outside / "92", target_is_directory=True)
    links[1].symlink_to(target)
    links[2].symlink_to(folder / "absent.amc")
    library = MotionLibrary(folder)
    assert library.ignored_paths == tuple(links)
    assert "92_01" not in library.names()
    with pytest.raises(UnknownName, match=r"Ignored \(links that lead outside .*/92, .*/92_01\.amc") as error:
        library.load("92_01")
    assert str(copy(error.value)) == str(error.value)  # as on the way out of a worker process
    with pytest.raises(UnknownName):
        library.load("../outside/92_01")


def test_links_inside_the_folder_are_followed_and_loops_end(folder: Path) -> None:
    (folder / "walk.amc").symlink_to(Path("91") / "91_01.amc")
    (folder / "again").symlink_to("deep", target_is_directory=True)
    (folder / "deep" / "loop").symlink_to(folder, target_is_directory=True)
    library = MotionLibrary(folder)
    assert library.ignored_paths == ()
    assert library.names() == ("91_01", "91_02", "91_03", "91_05", "walk")
    assert len(library.entry("91_01").copies) == 2
    walk = library.load("walk")
    assert (walk.name, walk.rate_hz, walk.behaviour) == ("walk", 60.0, "walking")
    np.testing.assert_array_equal(walk.angles_rad, library.load("91_01").angles_rad)


def test_a_folder_that_is_a_link_is_a_library(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    link = tmp_path_factory.mktemp("links") / "mocap"
    link.symlink_to(folder, target_is_directory=True)
    assert MotionLibrary(link).names() == MotionLibrary(folder).names()
    assert MotionLibrary(link).load("91_02").name == "91_02"


def test_a_library_of_two_folders_has_the_clips_of_both(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    other = tmp_path_factory.mktemp("other")
    write_clip(other, clip(name="92_01"))
    (other / "91_02.bvh").write_bytes((folder / "deep" / "91_02.bvh").read_bytes())
    library = MotionLibrary([folder, other], rate_hz=100.0)
    assert library.names() == ("91_01", "91_02", "91_03", "91_05", "92_01")
    assert (library.load("91_01").rate_hz, library.load("92_01").rate_hz) == (60.0, 100.0)
    assert library.entry("91_02").copies == (other / "91_02.bvh",)
    assert MotionLibrary((folder, str(folder))).entries() == MotionLibrary(folder).entries()


def test_one_name_for_two_motions_is_refused_with_both_files(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    other = tmp_path_factory.mktemp("other")
    (other / "91_02.bvh").write_text(bvh_text(clip(12)))
    with pytest.raises(BadInput) as error:
        MotionLibrary([folder, other])
    assert str(folder / "deep" / "91_02.bvh") in str(error.value)
    assert str(other / "91_02.bvh") in str(error.value)


def write_takes(top: Path, places: dict[str, int], suffix: str = ".bvh") -> Path:
    """BVH files of clips of different lengths, by place in a library."""
    for place, frames in places.items():
        path = top / f"{place}{suffix}"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(bvh_text(clip(frames)))
    return top


@pytest.mark.parametrize("index", ["", "path,subject\nAnna/take_001.bvh,anna\nBert/take_001.bvh,bert\n"])
def test_two_performers_with_one_file_name_are_two_clips(tmp_path: Path, index: str) -> None:
    write_takes(tmp_path, {"Anna/take_001": 12, "Bert/take_001": 15, "Bert/take_002": 18})
    if index:
        (tmp_path / "manifest.csv").write_text(index)
    library = MotionLibrary(tmp_path)
    assert library.names() == ("Anna/take_001", "Bert/take_001", "take_002")
    assert [len(library.load(name)) for name in library.names()] == [12, 15, 18]
    assert [library.entry(f"{who}/take_001").subject.lower() for who in ("Anna", "Bert")] == ["anna", "bert"]
    assert library.entry("take_002").subject == "Bert"  # his folder, as for his other take
    assert [entry.copies for entry in library.entries()] == [(), (), ()]
    known = [LibrarySource(library).performer(name) for name in library.names()]
    assert known == (["anna", "bert", ""] if index else ["", "", ""]), "a part of a path is no known performer"
    assert library.load("Bert/take_001").name == "Bert/take_001"
    with pytest.raises(BadInput, match=r"2 different takes\. Name one of Anna/take_001, Bert/take_001"):
        library.load("take_001")


def test_an_index_reaches_no_file_outside_its_folder(tmp_path: Path) -> None:
    write_takes(tmp_path, {"outside": 12, "library/=1+1": 12, "library/..a": 15})
    top = tmp_path / "library"
    rows = (f"{path},x,walking" for path in ("../outside.bvh", tmp_path / "outside.bvh", "..", "/", "", "=1+1.bvh"))
    (top / "manifest.csv").write_text("\n".join(["path,subject,behaviour", *filter(lambda row: row[0] != ",", rows)]))
    library = MotionLibrary(top)
    assert library.names() == ("..a", "=1+1")
    assert [library.entry(name).behaviour for name in library.names()] == ["", "walking"]


@pytest.mark.parametrize("text", ["a\x1b[2J", "a\x07", "\u202eba"])
def test_control_characters_reach_no_terminal(text: str, tmp_path: Path) -> None:
    """In the index they are refused with their line; a file of such a name is left out and counted."""
    write_takes(tmp_path, {"take_001": 12, text: 15})
    library = MotionLibrary(tmp_path)
    assert library.names() == ("take_001",)
    assert library.ignored_paths == (tmp_path / f"{text}.bvh",)
    (note,) = ignored_paths_note(library.ignored_paths)
    assert note.isprintable()
    for column in ("subject", "behaviour", "note"):
        (tmp_path / "manifest.csv").write_text(f"path,{column}\ntake_001.bvh,{text}\n")
        with pytest.raises(BadFile, match=r"manifest\.csv, line 2: the control character") as refused:
            MotionLibrary(tmp_path)
        assert str(refused.value).isprintable()


def test_equal_files_at_two_places_are_one_clip_unless_the_index_says_otherwise(tmp_path: Path) -> None:
    write_takes(tmp_path, {"Anna/take_001": 12, "copy/take_001": 12, "copy/deep/take_001": 15})
    assert MotionLibrary(tmp_path).names() == ("Anna/take_001", "copy/deep/take_001")
    (tmp_path / "copy" / "deep" / "take_001.bvh").unlink()
    (tmp_path / "copy" / "deep" / "take_001.bvh").symlink_to(tmp_path / "Anna" / "take_001.bvh")
    entry = MotionLibrary(tmp_path).entry("take_001")
    assert entry.path == tmp_path / "Anna" / "take_001.bvh"
    assert entry.copies == (tmp_path / "copy" / "deep" / "take_001.bvh", tmp_path / "copy" / "take_001.bvh")
    for column, values in (("subject", ("anna", "bert")), ("fps", ("60", "120"))):
        index = f"path,{column}\nAnna/take_001.bvh,{values[0]}\ncopy/take_001.bvh,{values[1]}\n"
        (tmp_path / "manifest.csv").write_text(index)
        assert "copy/take_001" in MotionLibrary(tmp_path).names()
    (tmp_path / "manifest.csv").write_text("path,fps\nAnna/take_001.bvh,60\ncopy/take_001.bvh,60.0\n")
    assert MotionLibrary(tmp_path).names() == ("take_001",)


def test_a_clip_at_two_rates_is_two_clips(tmp_path: Path) -> None:
    for rate_hz in (60.0, 120.0):
        path = tmp_path / f"{rate_hz:g}hz" / "91_01.bvh"
        path.parent.mkdir()
        path.write_text(bvh_text(clip()).replace("Frame Time: .0083333", f"Frame Time: {1.0 / rate_hz}"))
    library = MotionLibrary(tmp_path)
    assert [library.load(name).rate_hz for name in ("60hz/91_01", "120hz/91_01")] == pytest.approx([60.0, 120.0])
    assert {entry.subject for entry in library.entries()} == {"91"}
    assert LibrarySource(library).performer("60hz/91_01") == "91"


def test_formats_of_one_place_are_one_take_and_those_of_two_places_only_by_subject_and_trial(tmp_path: Path) -> None:
    write_takes(tmp_path, {"Anna/take_001": 12, "bvh/91_07": 12})
    for place, frames in (("Anna/take_001", 12), ("Bert/take_001", 15)):
        (tmp_path / place).parent.mkdir(exist_ok=True)
        (tmp_path / f"{place}.c3d").write_bytes(place.encode())
        np.savez(tmp_path / f"{place}.npz", allow_pickle=False, **amass_arrays(clip(frames)))
    (tmp_path / "91_07.c3d").write_bytes(b"markers")
    for ending in ("_poses", "_stageii"):
        np.savez(tmp_path / f"91_07{ending}.npz", allow_pickle=False, **amass_arrays(clip(12)))
    library = MotionLibrary(tmp_path)
    assert library.names() == ("91_07", "Anna/take_001", "Bert/take_001")
    copies = [sorted(file.name for file in library.entry(name).copies) for name in library.names()]
    amass = ["91_07_poses.npz", "91_07_stageii.npz"]
    assert copies == [["91_07.c3d", *amass], ["take_001.c3d", "take_001.npz"], ["take_001.c3d"]]


def test_markers_of_another_place_leave_the_name_of_the_motion(tmp_path: Path) -> None:
    write_takes(tmp_path, {"Anna/take_001": 12})
    (tmp_path / "take_001.c3d").write_bytes(b"markers")
    library = MotionLibrary(tmp_path)
    assert library.names() == ("take_001",)
    assert [entry.name for entry in library.entries()] == ["./take_001", "take_001"]


def test_files_that_differ_in_the_case_of_letters_are_different_clips(tmp_path: Path) -> None:
    write_takes(tmp_path, {"take_001": 12, "Take_001": 15})
    write_takes(tmp_path, {"take_001": 18}, ".BVH")
    if len(list(tmp_path.iterdir())) < 3:
        pytest.skip("this file system does not tell capital from small letters")
    library = MotionLibrary(tmp_path)
    assert {name: len(library.load(name)) for name in library.names()} == {
        "./take_001.BVH": 18,
        "./take_001.bvh": 12,
        "Take_001": 15,
    }


def test_folders_of_a_library_may_contain_each_other(folder: Path) -> None:
    entries = MotionLibrary([folder, folder / "deep"]).entries()
    assert [(entry.name, entry.copies) for entry in entries] == [
        (entry.name, entry.copies) for entry in MotionLibrary(folder).entries()
    ]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("path,fps\n91/91_01.amc,fast\n", "line 2: fps 'fast'"),
        ("path,fps\n91/91_01.amc,-5\n", "line 2: fps '-5'"),
        ("path,frames\n91/91_01.amc,nan\n", "line 2: frames 'nan'"),
        ("name,fps\n91_01,60\n", "line 2: a row without a path"),
        ('path,fps\n"91/91_01.amc,60\n', "unexpected end of data"),
        ("path\n\xff\xfe\n", "codec"),
    ],
)
def test_a_bad_index_is_refused(folder: Path, text: str, found: str) -> None:
    (folder / "manifest.csv").write_bytes(text.encode("latin-1"))
    with pytest.raises(BadFile) as error:
        MotionLibrary(folder)
    assert found in str(error.value)


def test_a_library_is_a_folder(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="is no folder"):
        MotionLibrary(tmp_path / "absent")


def test_the_staged_library_is_whole(mocap: Path) -> None:
    library = MotionLibrary(mocap)
    assert len(library.names()) >= 100
    boxing = library.entry("13_17")
    assert (boxing.format, boxing.behaviour, boxing.rate_hz, boxing.frames) == ("amc", "boxing", 120.0, 4840)
    assert [copy.suffix for copy in library.entry("02_01").copies] == [".bvh", ".c3d"]


def test_a_file_that_the_index_names_twice_is_refused_and_forms_of_its_path_are_one(tmp_path: Path) -> None:
    write_takes(tmp_path, {"Zoe\u0308/gang_001": 12})
    index = tmp_path / "manifest.csv"
    rows = "path,subject\nZo\u00eb\\gang_001.bvh,zoe\n./Zo\u00eb/gang_001.bvh,zoe\n"
    index.write_text(rows, encoding="utf-8")
    assert MotionLibrary(tmp_path).entry("gang_001").subject == "zoe"
    index.write_text(f"{rows}Zoe\u0308/gang_001.bvh,anna\n", encoding="utf-8")
    with pytest.raises(BadFile, match="twice, with different values"):
        MotionLibrary(tmp_path)


def test_an_amc_file_that_lost_its_last_frames_is_refused(folder: Path) -> None:
    (folder / "manifest.csv").write_text(INDEX.replace(",24,", ",25,"))
    with pytest.raises(BadFile, match=r"24 frames; expected 25, as manifest\.csv says"):
        MotionLibrary(folder).load("91_01")
