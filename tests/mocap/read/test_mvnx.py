"""MVNX: the motion of segments is read as hinge angles, and what is no sound MVNX file is refused with the line."""

import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import numpy as np
import pytest

from harness.core import rotations
from harness.core.humanoid24 import BONES
from harness.core.skeleton import forward_kinematics
from harness.errors import BadFile
from harness.mocap.clip_file import read_clip
from harness.mocap.file_inspection import inspect_clip, inspect_file
from harness.mocap.read import mvnx, mvnx_text
from harness.mocap.read.joint_clip import fit_hinges
from tests.mocap.sample_files import clip
from tests.mocap.sample_files import mvnx_text as sample_text

EXACT = tuple(bone for bone in BONES if bone not in ("upperneck", "head"))
"""Bones whose angles are read exactly; one segment moves the two others."""
TEXT = sample_text(clip(3))


@pytest.mark.parametrize("version", [3, 4])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_mvnx_comes_back_as_angles(tmp_path: Path, version: int, newline: str) -> None:
    """The head's two bones, which one segment moves, are as before at the end of their chain."""
    motion = clip()
    file = tmp_path / "91_01.mvnx"
    file.write_text(sample_text(motion, version=version, newline=newline), newline="")
    fit, residual_rad = fit_hinges(mvnx.read_mvnx(file), mvnx.MVN_MAP)
    assert (len(fit), fit.rate_hz, fit.name, fit.subject) == (len(motion), 120.0, "91_01", "91")
    np.testing.assert_allclose(fit.root_m, motion.root_m, atol=1e-12)
    np.testing.assert_allclose(fit.world_from_root, motion.world_from_root, atol=1e-9)
    for bone in EXACT:
        where = motion.skeleton.dof_of_bone[motion.skeleton.index(bone)]
        np.testing.assert_allclose(fit.angles_rad[:, where], motion.angles_rad[:, where], atol=1e-6)
    assert residual_rad[:, BONES.index("head")].max() < 1e-6


def test_lengths_of_bones_are_those_of_the_file(tmp_path: Path) -> None:
    motion = clip(3)
    skeleton = motion.skeleton.with_bones(motion.skeleton.bone_m * 1.1)
    file = tmp_path / "x.mvnx"
    file.write_text(sample_text(clip(3, skeleton=skeleton)))
    found = mvnx.read_mvnx_clip(file)
    chain = [b for b, bone in enumerate(BONES) if bone not in ("upperneck", "head")]
    np.testing.assert_allclose(found.skeleton.bone_m[chain], skeleton.bone_m[chain], atol=1e-9)
    np.testing.assert_allclose(found.skeleton.length_m, skeleton.length_m, rtol=0.01)
    assert any("leaves out the length of lhand, rhand" in note for note in found.notes)


def test_joints_are_where_the_file_says(tmp_path: Path) -> None:
    """Ends of limbs, by forward kinematics of the fitted angles, lie at the positions that the file holds."""
    file = tmp_path / "x.mvnx"
    file.write_text(sample_text(clip()))
    place = np.stack(mvnx_text.parse_mvnx(file).position_m)
    found = read_clip(file)
    pose = forward_kinematics(found.skeleton, found.root_m, found.world_from_root, found.angles_rad)
    ends = {
        "thorax": "Neck",
        "lclavicle": "LeftUpperArm",
        "rwrist": "RightHand",
        "lfoot": "LeftToe",
        "rtibia": "RightFoot",
    }
    for bone, segment in ends.items():
        np.testing.assert_allclose(
            pose.end_m[:, BONES.index(bone)], place[:, list(mvnx.SEGMENTS).index(segment)], atol=1e-6
        )
    assert not any("positions in the file" in note for note in found.notes)


def test_segments_are_found_by_name_and_props_are_passed_over(tmp_path: Path) -> None:
    """Segments in another order with a 24th one between them, as recordings with props have."""
    lines, motion = TEXT.split("\n"), clip(3)
    begin, end = lines.index("<segments>") + 1, lines.index("</segments>")
    starts = [k for k in range(begin, end) if lines[k].startswith("<segment ")]
    blocks = [lines[a:b] for a, b in zip(starts, [*starts[1:], end], strict=True)]
    prop = ['<segment label="Prop1" id="24">', "<points>", "</points>", "</segment>"]
    order = np.random.default_rng(3).permutation(24)
    lines[begin:end] = [line for k in order for line in [*blocks, prop][k]]
    for k, line in enumerate(lines):
        for tag, width in (("orientation", 4), ("position", 3)):
            if line.startswith(f"<{tag}>"):
                rows = [*np.array(line[len(tag) + 2 : -len(tag) - 3].split()).reshape(23, width), ["0.5"] * width]
                lines[k] = f"<{tag}>{' '.join(word for row in order for word in rows[row])}</{tag}>"
    file = tmp_path / "x.mvnx"
    file.write_text("\n".join(lines))
    np.testing.assert_allclose(read_clip(file).root_m, motion.root_m, atol=1e-12)


def test_a_position_that_does_not_fit_the_joints_is_noted(tmp_path: Path) -> None:
    file = tmp_path / "x.mvnx"
    place = TEXT.split("<position>")[3].split("</position>")[0]
    words = place.split()
    words[3 * 22] = str(float(words[3 * 22]) + 0.2)
    file.write_text(TEXT.replace(place, " ".join(words)))
    (note,) = [note for note in mvnx.read_mvnx(file).notes if "positions" in note]
    assert note == "positions in the file are up to 200 mm from those of the joints (LeftToe in frame 2)"


def test_an_upper_body_recording_is_noted(tmp_path: Path) -> None:
    file = tmp_path / "x.mvnx"
    file.write_text(TEXT.replace("<subject ", '<subject configuration="UpperBody" '))
    assert any("configuration UpperBody" in note for note in mvnx.read_mvnx(file).notes)


def test_inspection_knows_rate_unit_and_height(tmp_path: Path) -> None:
    file = tmp_path / "91_01.mvnx"
    file.write_text(sample_text(clip(40)))
    found = inspect_file(file)
    assert (found.format, found.rate_hz, found.unit_m, found.unit_evidence) == ("mvnx", 120.0, 1.0, "MVNX is in metres")
    assert found.height_m == pytest.approx(inspect_clip(clip(2)).height_m, abs=0.01)
    assert found.doubts == ()


FRAME = TEXT[TEXT.index('<frame time="1"') : TEXT.index('<frame time="2"')]
SEGMENT = TEXT[TEXT.index('<segment label="LeftToe"') : TEXT.index("</segments>")]
BAD = [
    ("<mvnx ", "<bvh ", "line 2: the element bvh"),
    ('version="4"', 'version="2"', "line 2: MVNX of version '2'; expected version 3 or 4"),
    ("</mvnx>", "", "no well-formed XML"),
    ("</frames>", "", "no well-formed XML (mismatched tag)"),
    ('frameRate="120"', 'frameRate="0"', "a frameRate of 0"),
    ('frameRate="120"', 'frameRate="fast"', "'fast' for frameRate"),
    ('frameRate="120"', "", "'' for frameRate"),
    (FRAME, FRAME.replace('index="1"', 'index="7"'), "frame 7 after frame 0"),
    (FRAME, FRAME.replace('index="1"', 'index="-1"'), "the frame index '-1'"),
    (FRAME, FRAME.replace("<position>", "<position>1 "), "70 numbers for the position of 23 segments in frame 2"),
    (FRAME, FRAME.replace("<orientation>", "<orientation>nan ", 1), "93 numbers for the orientation"),
    (
        FRAME,
        FRAME.replace("<position>", "<velocity>").replace("</position>", "</velocity>"),
        "frame 2 without position",
    ),
    ('type="normal"', 'type="tpose"', "no frame of type normal"),
    (SEGMENT, "", "92 numbers for the orientation of 22 segments in frame 1"),
    ('label="LeftToe"', 'label="LeftToes"', "no segment LeftToe"),
    ('label="LeftToe"', 'label="RightToe"', "the segment 'RightToe'; expected a new label"),
    ('label="jL5Origin"', 'label="jL5S1"', "0 joints that both Pelvis and L5 list"),
    ('label="pTopOfHead"', 'label="top"', "no point pTopOfHead of Head"),
    ("<pos_b>0.01 0.02 0.03</pos_b>", "<pos_b>0.01 0.02</pos_b>", "2 numbers for the point pPelvisLandmark of Pelvis"),
    ("<comment>made by a test &amp; not by MVN</comment>", "<subject frameRate='1'/>", "a second subject"),
]


@pytest.mark.parametrize(("old", "new", "found"), BAD, ids=[found for *_, found in BAD])
def test_bad_mvnx_is_refused_with_the_line(tmp_path: Path, old: str, new: str, found: str) -> None:
    assert old in TEXT
    count = -1 if old == 'type="normal"' else 1
    file = tmp_path / "x.mvnx"
    file.write_text(TEXT.replace(old, new, count))
    with pytest.raises(BadFile) as error:
        mvnx.read_mvnx(file)
    assert found in str(error.value)


def test_a_quaternion_must_have_unit_length(tmp_path: Path) -> None:
    file = tmp_path / "x.mvnx"
    words = TEXT.split("<orientation>")[2].split()
    file.write_text(TEXT.replace(f"<orientation>{words[0]} ", "<orientation>0.1 "))
    with pytest.raises(BadFile, match=r"line \d+: a quaternion of length 0\.\d+ in frame 1"):
        mvnx.read_mvnx(file)


ENTITIES = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10 if n else "lol"}">' for n in range(10))
DECLARATIONS = [
    f"<!DOCTYPE mvnx [{ENTITIES}]>",
    '<!DOCTYPE mvnx [<!ENTITY comment SYSTEM "file:///etc/hostname">]>',
    '<!DOCTYPE mvnx [<!ATTLIST frame type CDATA "normal">]>',
    "<!DOCTYPE mvnx []>",
]


@pytest.mark.parametrize("declaration", DECLARATIONS)
def test_declarations_inside_the_file_are_refused(tmp_path: Path, declaration: str) -> None:
    """Entities that expand to gigabytes, and those that would read other files."""
    file = tmp_path / "x.mvnx"
    body = TEXT.split("\n", 1)[1].replace("made by a test", "&e9; &comment;")
    file.write_text(f'<?xml version="1.0"?>\n{declaration}\n{body}')
    with pytest.raises(BadFile, match=r"line 2: declarations inside the file"):
        mvnx.read_mvnx(file)


def test_a_document_type_is_not_fetched_and_its_entities_are_refused(tmp_path: Path) -> None:
    asked = []

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        doctype = f'<!DOCTYPE mvnx SYSTEM "http://127.0.0.1:{server.server_port}/schema.dtd">\n'
        file = tmp_path / "x.mvnx"
        file.write_text(TEXT.replace("<mvnx ", f"{doctype}<mvnx ", 1))
        assert len(mvnx.read_mvnx(file)) == 3
        file.write_text(file.read_text().replace("made by a test", "&unknown;"))
        with pytest.raises(BadFile, match="the entity unknown"):
            mvnx.read_mvnx(file)
        server.shutdown()
        thread.join()
    assert asked == []


def test_sizes_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "x.mvnx"
    file.write_text("<mvnx version='4'>" + "<a>" * 100)
    with pytest.raises(BadFile, match="inside each other 32 times"):
        mvnx.read_mvnx(file)
    file.write_text(TEXT.replace("<orientation>", "<orientation>" + "1 " * 60_000))
    with pytest.raises(BadFile, match="over 100,000 characters in orientation"):
        mvnx.read_mvnx(file)
    monkeypatch.setattr(mvnx_text, "MAX_FRAMES", 2)
    file.write_text(TEXT)
    with pytest.raises(BadFile, match="more frames; expected at most 2"):
        mvnx.read_mvnx(file)
    monkeypatch.setattr(mvnx_text, "LIMIT_BYTES", 1000)
    with pytest.raises(BadFile, match="at most 1,000 bytes"):
        mvnx.read_mvnx(file)


@pytest.mark.parametrize("encoding", ["utf-16", "latin-1"])
def test_other_encodings_are_read_if_the_file_names_them(tmp_path: Path, encoding: str) -> None:
    file = tmp_path / "x.mvnx"
    text = TEXT.replace("UTF-8", encoding).replace("made by a test", "prüfung")
    file.write_bytes(text.encode(encoding))
    assert len(mvnx.read_mvnx(file)) == 3
    file.write_bytes(text.replace(encoding, "gb2312").encode("latin-1"))
    with pytest.raises(BadFile, match=r"no (readable text|well-formed XML)"):
        mvnx.read_mvnx(file)


def test_zero_pose_is_a_t_with_straight_legs(tmp_path: Path) -> None:
    """Identity orientations: arms out with the palms down, legs down, feet ahead, and no residual."""
    file = tmp_path / "rest.mvnx"
    begin, end = (
        TEXT.index("<orientation>", TEXT.index('type="normal"')),
        TEXT.index("</orientation>", TEXT.index('"normal"')),
    )
    file.write_text(TEXT[:begin] + "<orientation>" + "1 0 0 0 " * 23 + TEXT[end:])
    fit, residual_rad = fit_hinges(mvnx.read_mvnx(file), mvnx.MVN_MAP)
    assert residual_rad[0].max() < 1e-6
    pose = forward_kinematics(fit.skeleton, fit.root_m, fit.world_from_root, fit.angles_rad)
    bone = (pose.end_m - pose.start_m)[0]
    unit = bone / np.linalg.norm(bone, axis=1)[:, None]
    np.testing.assert_allclose(unit[BONES.index("lhumerus")], [0.0, 1.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(unit[BONES.index("rwrist")], [0.0, -1.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(unit[BONES.index("ltibia")], [0.0, 0.0, -1.0], atol=1e-3)
    np.testing.assert_allclose(unit[BONES.index("rfemur")], [0.0, 0.0, -1.0], atol=1e-3)
    assert unit[BONES.index("lfoot")][0] > 0.9


def test_a_bent_elbow_bends_the_elbow(tmp_path: Path) -> None:
    """The left forearm turned by -80 deg about the vertical points forward: 80 deg at the elbow's hinge."""
    bent = rotations.about_z(-np.deg2rad(80.0))
    order = list(mvnx.SEGMENTS)
    turns = np.tile(rotations.IDENTITY, (23, 1))
    turns[[order.index("LeftForeArm"), order.index("LeftHand")]] = bent
    begin, end = (
        TEXT.index("<orientation>", TEXT.index('type="normal"')),
        TEXT.index("</orientation>", TEXT.index('"normal"')),
    )
    file = tmp_path / "bent.mvnx"
    file.write_text(TEXT[:begin] + "<orientation>" + " ".join(map(str, turns.ravel())) + TEXT[end:])
    fit, residual_rad = fit_hinges(mvnx.read_mvnx(file), mvnx.MVN_MAP)
    elbow = fit.skeleton.dof_of_bone[BONES.index("lradius")]
    np.testing.assert_allclose(np.rad2deg(fit.angles_rad[0, elbow]), 80.0, atol=0.1)
    assert residual_rad[0].max() < np.deg2rad(0.1)
