"""MVNX files of Xsens MVN: the orientations of 23 segments, measured with inertial sensors.

Segments have the axes of the world (x forward, y left, z up, metres) in a T-pose with straight legs and the palms down.
Each orientation takes a segment's axes to the world's. The file gives joints and landmarks in these axes, so the bones
have the lengths that MVN estimated for the performer. The pose follows from the orientations and these points; the
positions in the file serve as a check.

The 24 bones follow the segment that holds their middle, and the root lies where the lumbar spine meets the pelvis, as
in CMU's skeletons. MVN has no joint inside the forearm; its twist goes to the wrist bone. Toes are left out. No file
from a device was at hand: the reader was written after the manual and published files.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.core.motion import Clip
from harness.errors import BadFile
from harness.mocap.read.joint_clip import FROM_T_POSE, BoneMapping, JointClip, JointMap, to_clip
from harness.mocap.read.mvnx_text import MvnxText, parse_mvnx

SEGMENTS: Mapping[str, str] = {
    "Pelvis": "",
    "L5": "Pelvis",
    "L3": "L5",
    "T12": "L3",
    "T8": "T12",
    "Neck": "T8",
    "Head": "Neck",
    "RightShoulder": "T8",
    "RightUpperArm": "RightShoulder",
    "RightForeArm": "RightUpperArm",
    "RightHand": "RightForeArm",
    "LeftShoulder": "T8",
    "LeftUpperArm": "LeftShoulder",
    "LeftForeArm": "LeftUpperArm",
    "LeftHand": "LeftForeArm",
    "RightUpperLeg": "Pelvis",
    "RightLowerLeg": "RightUpperLeg",
    "RightFoot": "RightLowerLeg",
    "RightToe": "RightFoot",
    "LeftUpperLeg": "Pelvis",
    "LeftLowerLeg": "LeftUpperLeg",
    "LeftFoot": "LeftLowerLeg",
    "LeftToe": "LeftFoot",
}
"""Segment -> the segment above it, in the order of MVN's full body."""

_CHECKED_M = 0.005
"""Difference between positions in the file and those of the joints above which a note is made [m]."""
_PARTIAL = ("UpperBody", "LowerBody")


def _mvn_map() -> dict[str, BoneMapping]:
    mapping = {
        "root": BoneMapping("Pelvis", start="L5"),
        "lowerback": BoneMapping("L5", "L3"),
        "upperback": BoneMapping("T12", "T8", start="L3"),
        "thorax": BoneMapping("T8", "Neck"),
        "lowerneck": BoneMapping("Neck", "Head"),
        "upperneck": BoneMapping("Head", "Head_middle"),
        "head": BoneMapping("Head", "Head_end", start="Head_middle"),
    }
    for side, s in (("Left", "l"), ("Right", "r")):
        bones = {
            "clavicle": BoneMapping(f"{side}Shoulder", f"{side}UpperArm", start="Neck"),
            "humerus": BoneMapping(f"{side}UpperArm", f"{side}ForeArm"),
            "radius": BoneMapping(f"{side}ForeArm", f"{side}ForeArm_middle"),
            "wrist": BoneMapping(f"{side}ForeArm", f"{side}Hand", start=f"{side}ForeArm_middle"),
            "hand": BoneMapping(f"{side}Hand"),
            "hipjoint": BoneMapping("Pelvis", f"{side}UpperLeg", start="L5"),
            "femur": BoneMapping(f"{side}UpperLeg", f"{side}LowerLeg"),
            "tibia": BoneMapping(f"{side}LowerLeg", f"{side}Foot"),
            "foot": BoneMapping(f"{side}Foot", f"{side}Toe"),
        }
        mapping |= {f"{s}{bone}": to for bone, to in bones.items()}
    return {bone: to.with_rest_pose(FROM_T_POSE.get(bone)) for bone, to in mapping.items()}


MVN_MAP: JointMap = _mvn_map()
"""Segment of each of the 24 bones, and the joints at the bone's ends."""


def read_mvnx(path: Path | str) -> JointClip:
    """Read the motion of an MVNX file on MVN's 23 segments, every frame of type `normal`.

    Points that divide the forearms and the head, and the top of the head, follow as joints that do not turn. Raises
    BadFile, with the line where it has one, for another format, for missing segments and joints, and for damage.
    """
    path = Path(path)
    text = parse_mvnx(path)
    names, offset_m = _joint_offsets(path, text)
    parents = tuple(-1 if not parent else names.index(parent) for parent in _parents().values())
    columns = [list(text.points_m).index(segment) for segment in SEGMENTS]
    world = np.stack(text.orientation)[:, columns]
    world /= np.linalg.norm(world, axis=-1, keepdims=True)
    position_m = np.stack(text.position_m)[:, columns]
    local = np.tile(rotations.IDENTITY, (len(world), len(names), 1))
    for joint in range(len(SEGMENTS)):
        turn = world[:, joint]
        local[:, joint] = turn if joint == 0 else rotations.multiply(rotations.inverse(world[:, parents[joint]]), turn)
    clip = JointClip(
        name=path.stem,
        subject=path.stem.split("_", 1)[0],
        source=path.parent.name,
        behaviour="",
        names=names,
        parents=parents,
        offset_m=offset_m,
        rate_hz=text.rate_hz,
        root_m=position_m[:, 0],
        parent_from_joint=local,
        unit_evidence="metres, as all MVNX files",
        notes=_notes(text),
    )
    return _with_position_note(clip, position_m)


def read_mvnx_clip(path: Path | str) -> Clip:
    """Read an MVNX file as a clip of the 24 bones. Raises BadFile."""
    return to_clip(read_mvnx(path), MVN_MAP)


def _parents() -> dict[str, str]:
    """Joint -> the joint above it: the segments, then the points that divide bones or end them."""
    fixed = {"Head_middle": "Head", "Head_end": "Head"}
    return {**SEGMENTS, **fixed, **{f"{side}ForeArm_middle": f"{side}ForeArm" for side in ("Right", "Left")}}


def _joint_offsets(path: Path, text: MvnxText) -> tuple[tuple[str, ...], Floats]:
    """Names of the joints, and their offsets (J, 3) from the joints above in the rest pose [m]."""
    if missing := [segment for segment in SEGMENTS if segment not in text.points_m]:
        advice = "Export a recording of the full body."
        raise BadFile(path, f"no segment {', '.join(missing[:4])}", f"the {len(SEGMENTS)} segments of MVN", advice)
    offset = {segment: _shared_joint(path, text, segment, parent) for segment, parent in SEGMENTS.items() if parent}
    mean = standard_skeleton()
    length = dict(zip(mean.names, mean.length_m.tolist(), strict=True))
    top = np.array(_point(path, text, "Head", "pTopOfHead"))
    offset |= {"Head_middle": top * (length["upperneck"] / (length["upperneck"] + length["head"])), "Head_end": top}
    for side, s in (("Right", "r"), ("Left", "l")):
        share = length[f"{s}radius"] / (length[f"{s}radius"] + length[f"{s}wrist"])
        offset[f"{side}ForeArm_middle"] = share * offset[f"{side}Hand"]
    names = tuple(_parents())
    return names, np.array([offset.get(name, np.zeros(3)) for name in names])


def _shared_joint(path: Path, text: MvnxText, segment: str, parent: str) -> Floats:
    """Offset of a segment's origin from its parent's: the joint that both list, whose name depends on the version."""
    mine, above = text.points_m[segment], text.points_m[parent]
    joints = [label for label in mine if label.startswith("j") and label in above]
    if len(joints) != 1:
        found = f"{len(joints)} joints that both {parent} and {segment} list"
        raise BadFile(path, found, "one, such as jL5S1", "Export it with the points of the segments.")
    out: Floats = np.array(above[joints[0]]) - np.array(mine[joints[0]])
    return out


def _point(path: Path, text: MvnxText, segment: str, label: str) -> tuple[float, ...]:
    if label not in text.points_m[segment]:
        raise BadFile(
            path, f"no point {label} of {segment}", "MVN's points", "Export it with the points of the segments."
        )
    return text.points_m[segment][label]


def _notes(text: MvnxText) -> tuple[str, ...]:
    configuration = text.subject.get("configuration", "")
    if not configuration.startswith(_PARTIAL):
        return ()
    return (f"recorded with the configuration {configuration[:40]}: segments without sensors follow the pelvis",)


def _with_position_note(clip: JointClip, position_m: Floats) -> JointClip:
    """The clip, with a note if the positions in the file (T, 23, 3) are not those that its joints give."""
    error_m = np.linalg.norm(clip.world()[0][:, : len(SEGMENTS)] - position_m, axis=-1)
    if error_m.max() < _CHECKED_M:
        return clip
    frame, segment = np.unravel_index(int(error_m.argmax()), error_m.shape)
    place = f"{clip.names[int(segment)]} in frame {int(frame) + 1}"
    note = f"positions in the file are up to {1e3 * error_m.max():.0f} mm from those of the joints ({place})"
    return replace(clip, notes=(*clip.notes, note))
