"""ASF and AMC: a written motion is read back, and errors name their line."""

import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.core.humanoid24 import BONES, standard_skeleton
from harness.core.motion import Clip
from harness.core.skeleton import forward_kinematics
from harness.errors import BadFile, BadInput
from harness.mocap.library import MotionLibrary
from harness.mocap.read import file_checks
from harness.mocap.read.amc import read_amc, read_amc_clip
from harness.mocap.read.asf import read_asf, read_asf_file
from tests.mocap.sample_files import UNIT_M, amc_text, asf_text, clip

ASF, AMC = asf_text(standard_skeleton()), amc_text(clip(4))


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_a_skeleton_comes_back(tmp_path: Path, newline: str) -> None:
    file = tmp_path / "91.asf"
    file.write_bytes(asf_text(standard_skeleton(), newline).encode())
    found, _ = read_asf(file).subset(BONES)
    wanted = standard_skeleton()
    assert set(read_asf(file).names) == set(BONES)
    assert (found.names, found.parents, found.hinges) == (wanted.names, wanted.parents, wanted.hinges)
    np.testing.assert_allclose(found.bone_m, wanted.bone_m, atol=1e-12)
    np.testing.assert_allclose(found.axes, wanted.axes, atol=1e-9)


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_a_motion_comes_back(tmp_path: Path, newline: str) -> None:
    motion = clip(wild=True)
    (tmp_path / "91.asf").write_text(ASF)
    (tmp_path / "91_01.amc").write_bytes(amc_text(motion, newline).encode())
    found = read_amc_clip(tmp_path / "91.asf", tmp_path / "91_01.amc", rate_hz=60.0)
    _, dofs = found.skeleton.subset(BONES)
    assert (found.name, found.subject, found.rate_hz, len(found)) == ("91_01", "91", 60.0, len(motion))
    np.testing.assert_allclose(found.angles_rad[:, dofs], motion.angles_rad, atol=1e-12)
    np.testing.assert_allclose(found.root_m, motion.root_m, atol=1e-12)
    np.testing.assert_allclose(np.abs(np.sum(found.world_from_root * motion.world_from_root, axis=1)), 1.0, atol=1e-12)


def test_axis_order_and_bones_without_hinges(tmp_path: Path) -> None:
    """A bone's axis angles rotate its hinges in order: ZYX of (0, 0, 90) rotates about x, which takes y to z."""
    text = """:version 1.10
:units
  length 0.45
  angle deg
:root
  order TX TY TZ RX RY RZ
:bonedata
begin
  name a # the only bone
  direction 0 1 0
  length 5
  axis 0 0 90 ZYX
  dof ry
end
:hierarchy
begin
root a
end
"""
    (tmp_path / "a.asf").write_text(text)
    skeleton = read_asf(tmp_path / "a.asf")
    np.testing.assert_allclose(skeleton.bone_m, [[0.0, 0.0, 5.0 * 0.0254 / 0.45]], atol=1e-12)
    np.testing.assert_allclose(skeleton.axes, [[1.0, 0.0, 0.0]], atol=1e-12)  # the file's z is the world's x


BAD_ASF = [
    # what is replaced in a sound file, by what, and what the message must say
    ("# made by a test", "HIERARCHY", "line 1: 'HIERARCHY'; expected a section"),
    ("  length 0.45\n", "", "no :units with a length"),
    ("length 0.45", "length 0", "line 6: a unit of length 0"),
    ("length 0.45", "length nan", "line 6: 'nan' for the unit of length"),
    ("length 0.45", "length 1000", "a longest bone of 0.000196 m; expected 0.1 to 1 m"),
    ("angle deg", "angle grad", "line 7: angles in 'grad'"),
    ("TX TY TZ RX RY RZ", "RX RY RZ TX TY TZ", "line 11: root order"),
    ("axis XYZ", "axis ZYX", "line 12: root axis ZYX"),
    ("orientation 0 0 0", "orientation 90 0 0", "line 14: root orientation 90 0 0"),
    ("orientation 0 0 0", "orientation 0 0", "line 14: 2 numbers for the root's orientation"),
    ("  begin", "  name ghost", "line 16: 'name' outside a bone"),
    ("     name lowerback", "  begin", "line 18: a bone inside a bone"),
    ("     name upperback\n", "", "without a usable name"),
    ("     name upperback", "     name lowerback", "bone lowerback twice"),
    ("     name upperback", "     name root", "bone root twice"),
    ("     direction ", "     direction x ", "line 19: 4 numbers for the direction of bone lowerback"),
    ("     direction ", "     direction 3 0 0\n     colour ", "line 20: 'colour' in a bone"),
    ("     length ", "     length inf\n     id ", "line 20: 'inf' for the length of bone lowerback"),
    ("     length ", "     length -1\n     id ", "without a usable length"),
    ("   XYZ", "   XYX", "line 21: axis"),
    ("dof rx ry rz", "dof rx ry rz l", "line 22: dof rx ry rz l"),
    ("dof rx ry rz", "dof rx rx rz", "line 22: dof rx rx rz"),
    ("    thorax lowerneck", "    thorax tail", "unknown bone tail"),
    ("    lfemur ltibia", "    lfemur ltibia rtibia", "rfemur above rtibia, which hangs on lfemur"),
    ("    lfemur ltibia", "    lfemur ltibia root", "which hangs on no bone, being the root"),
    ("    root lowerback", "    root", "bone lowerback that does not hang on the root"),
    ("    upperneck head", "    head head", "bone head that does not hang on the root (an orphan or a cycle)"),
]


@pytest.mark.parametrize(("old", "new", "found"), BAD_ASF)
def test_a_bad_skeleton_is_refused_with_the_reason(tmp_path: Path, old: str, new: str, found: str) -> None:
    assert old in ASF
    error = _refused(read_asf, tmp_path / "x.asf", ASF.replace(old, new, 1).encode())
    assert found in error


@pytest.mark.parametrize(
    ("spoil", "found"),
    [
        (b"", "an empty file"),
        (b"\n \r\n", "blank lines only"),
        (ASF.encode()[:300] + b"\0", "binary data"),
        (ASF.encode()[: ASF.index(":hierarchy")], "no :hierarchy with bones"),
        (ASF.encode()[: ASF.index("dof rx")], "no :bonedata with bones"),
        (ASF.encode()[: ASF.index("    rtibia rfoot")], "bone rfoot that does not hang on the root"),
    ],
)
def test_a_cut_or_foreign_skeleton_is_refused(tmp_path: Path, spoil: bytes, found: str) -> None:
    assert found in _refused(read_asf, tmp_path / "x.asf", spoil)


def test_a_given_unit_overrules_the_file(tmp_path: Path) -> None:
    (tmp_path / "x.asf").write_text(ASF.replace("length 0.45", "length 1000"))
    skeleton, unit_m = read_asf_file(tmp_path / "x.asf", unit_m=UNIT_M)
    assert unit_m == UNIT_M
    assert skeleton.length_m.max() == pytest.approx(standard_skeleton().length_m.max())


FRAME_2 = AMC.index("\n2\n") + 1
BAD_AMC = [
    ("#!OML", "OML", "line 1: 'OML:ASF"),
    (":DEGREES", ":RADIANS", "line 4: '1'; expected :DEGREES and then frame 1"),
    ("\n1\n", "\n²\n", "line 4: '²'; expected :DEGREES and then frame 1"),
    ("\n1\n", "\n" + "1" * 5000 + "\n", "expected :DEGREES and then frame 1"),
    ("\n2\n", "\n" + "2" * 5000 + "\n", "expected frame 2"),
    ("\nlradius ", "\nlradius 1000001\nlwrist ", "'1000001' for lradius"),
    ("\n2\n", "\n1\n", "line 28: frame 1 again; expected frame 2"),
    ("\n2\n", "\n3\n", "line 28: '3'; expected frame 2"),
    ("\nlfemur", "\nltail", "line 11: unknown bone 'ltail'"),
    ("\nltibia", "\nlfemur 1 2 3\nltibia", "line 12: bone lfemur twice in one frame"),
    ("\nlfoot", "\nroot 0 0 0 0 0 0\nlfoot", "bone root twice in one frame"),
    ("\nlradius ", "\nlradius 1 ", "2 numbers for lradius (does the ASF belong to this AMC?); expected 1"),
    ("\nlradius ", "\nlradius nan\nlwrist ", "'nan' for lradius"),
    ("\nlradius ", "\nlradius 1e400\nlwrist ", "'1e400' for lradius"),
    ("\nlradius ", "\nlradius 12..5\nlwrist ", "'12..5' for lradius"),
]


@pytest.mark.parametrize(("old", "new", "found"), BAD_AMC)
def test_a_bad_motion_is_refused_with_the_line(tmp_path: Path, old: str, new: str, found: str) -> None:
    assert old in AMC
    assert found in _refused(_read, tmp_path / "x.amc", AMC.replace(old, new, 1).encode("latin-1"))


def test_rows_of_a_later_frame_are_held_to_the_first(tmp_path: Path) -> None:
    first, later = AMC[:FRAME_2], AMC[FRAME_2:]
    swapped = later.replace("lfoot", "LFOOT", 1).replace("ltibia", "lfoot", 1).replace("LFOOT", "ltibia", 1)
    assert "bone ltibia; expected lfoot, as in the first frame" in _refused(
        _read, tmp_path / "x.amc", (first + swapped).encode()
    )
    missing = "\n".join(line for line in later.split("\n") if not line.startswith("lfoot"))
    assert "bone ltibia; expected lfoot" in _refused(_read, tmp_path / "x.amc", (first + missing).encode())


@pytest.mark.parametrize("bones", [1, 5, 22])
def test_a_motion_cut_inside_a_frame_is_refused(tmp_path: Path, bones: int) -> None:
    lines = AMC.split("\n")
    error = _refused(_read, tmp_path / "x.amc", "\n".join([*lines[: 28 + bones], ""]).encode())
    assert "inside frame 2" in error


def test_every_cut_of_a_motion_is_refused_or_leaves_whole_frames(tmp_path: Path) -> None:
    skeleton, file = standard_skeleton(), tmp_path / "x.amc"
    ends = {i for i in range(len(AMC)) if AMC[:i].endswith("\n") and AMC[i:].split("\n", 1)[0].isdigit()}
    assert len(ends) == 4
    for end in [*range(0, len(AMC), 37), *ends]:
        file.write_text(AMC[:end])
        if end in ends and end > AMC.index("root"):
            assert len(read_amc(file, skeleton, rate_hz=120.0)) >= 1
        else:
            with pytest.raises(BadFile):
                read_amc(file, skeleton, rate_hz=120.0)


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, float("nan"), float("inf")])
def test_a_rate_that_is_none_is_refused(tmp_path: Path, rate_hz: float) -> None:
    (tmp_path / "x.amc").write_text(AMC)
    with pytest.raises(BadInput):
        read_amc(tmp_path / "x.amc", standard_skeleton(), rate_hz=rate_hz)


def test_a_huge_file_is_refused_before_it_is_read(tmp_path: Path) -> None:
    huge = tmp_path / "x.amc"
    with huge.open("wb") as file:
        file.truncate(file_checks.LIMIT_BYTES + 1)  # a hole: it takes no room on the disk
    skeleton = standard_skeleton()
    tracemalloc.start()
    with pytest.raises(BadFile, match="at most 268,435,456 bytes"):
        read_amc(huge, skeleton, rate_hz=120.0)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 1_000_000
    assert "no such file" in _refused_path(tmp_path / "absent.amc")
    assert "a folder" in _refused_path(tmp_path)


def test_memory_stays_near_what_the_motion_needs(tmp_path: Path) -> None:
    text = amc_text(clip(1))
    frame = text[text.index("\n1\n") + 3 :]
    file = tmp_path / "x.amc"
    head = text[: text.index("\n1\n") + 1]
    file.write_text(head + "".join(f"{t}\n{frame}" for t in range(1, 3001)))
    tracemalloc.start()
    read_amc(file, standard_skeleton(), rate_hz=120.0)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 3.0 * file.stat().st_size


def test_five_thousand_frames_load_within_a_second(tmp_path: Path) -> None:
    file = tmp_path / "91_01.amc"
    file.write_text(amc_text(clip(5000)))
    start_s = time.process_time()  # that of a busy machine goes on more slowly than its clock
    read_amc(file, standard_skeleton(), rate_hz=120.0)
    assert time.process_time() - start_s < 1.0


@pytest.mark.long
def test_every_staged_motion_parses(mocap: Path) -> None:
    """All clips are complete; in every 40th frame the body has a person's height above a floor near z = 0."""
    library = MotionLibrary(mocap)
    motions = [entry for entry in library.entries() if entry.format == "amc"]
    assert len(motions) >= 1
    for entry in motions:
        motion = library.load(entry.name)
        assert entry.frames in (None, len(motion)), entry.name
        assert len(motion.skeleton.names) == 30
        some = slice(None, None, 40)
        pose = forward_kinematics(
            motion.skeleton, motion.root_m[some], motion.world_from_root[some], motion.angles_rad[some]
        )
        lowest, highest = pose.end_m[..., 2].min(axis=1), pose.end_m[..., 2].max(axis=1)
        assert -0.2 < float(np.median(lowest)) < 0.7, entry.name
        assert 0.7 < float(np.median(highest - lowest)) < 2.3, entry.name
        assert np.abs(np.median(motion.angles_rad, axis=0)).max() <= np.pi


def test_every_staged_skeleton_parses(mocap: Path) -> None:
    skeletons = [read_asf(file) for file in sorted(mocap.rglob("*.asf"))]
    assert skeletons
    for skeleton in skeletons:
        assert len(skeleton.names) == 30
        np.testing.assert_allclose(skeleton.subset(BONES)[0].axes, standard_skeleton().axes, atol=1e-6)
        leg = skeleton.length_m[[skeleton.index("lfemur"), skeleton.index("ltibia")]].sum()
        assert 0.7 < leg < 0.95


def _read(path: Path) -> Clip:
    return read_amc(path, standard_skeleton(), rate_hz=120.0)


def _refused(read: Callable[[Path], object], file: Path, content: bytes) -> str:
    """The message of the BadFile that reading raises: one line, with advice."""
    file.write_bytes(content)
    with pytest.raises(BadFile) as error:
        read(file)
    assert error.value.advice
    assert "\n" not in str(error.value)
    return str(error.value)


def _refused_path(path: Path) -> str:
    with pytest.raises(BadFile) as error:
        _read(path)
    return str(error.value)
