"""Small synthetic motion files in the dialects that the parsers must read; none is copied from CMU."""

import warnings
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.core.motion import Clip
from harness.core.skeleton import Skeleton
from harness.mocap.read.amass import JOINTS, SMPL_MAP
from harness.mocap.read.asf import INCH_M, WORLD_FROM_ASF
from harness.mocap.read.bvh import CMU_MAP
from harness.mocap.read.joint_clip import FROM_T_POSE
from harness.mocap.read.mvnx import SEGMENTS

UNIT_M = INCH_M / 0.45
LEFT_OUT = ("thorax", "lwrist", "rwrist")
"""Bones whose length CMU's BVH conversion leaves out."""


def clip(
    frames: int = 24,
    *,
    name: str = "91_01",
    rate_hz: float = 120.0,
    wild: bool = False,
    skeleton: Skeleton | None = None,
) -> Clip:
    """Smooth motion of a skeleton (the mean one) about a crouch; `wild` angles come near to gimbal lock and wrap."""
    skeleton = skeleton or standard_skeleton()
    rng = np.random.default_rng(7)
    t = np.arange(frames)[:, None] / rate_hz
    phase = rng.uniform(0.0, 6.0, size=len(skeleton.axes))
    size = 3.0 if wild else 0.15
    turn = rng.normal(size=3) * 0.3
    return Clip(
        name=name,
        subject=name.split("_")[0],
        source="synthetic",
        behaviour="",
        skeleton=skeleton,
        rate_hz=rate_hz,
        root_m=np.array([0.1, -0.2, 0.95]) + 0.05 * np.sin(3.0 * t + np.arange(3)),
        world_from_root=rotations.continuous(rotations.exp(turn * np.sin(2.0 * t + 0.4))),
        angles_rad=size * np.sin(2.0 * np.pi * 0.7 * t + phase),
    )


def asf_text(skeleton: Skeleton, newline: str = "\n") -> str:
    """The skeleton as an ASF file, with the sections, comments and uneven blanks of CMU's."""
    lines = ["# made by a test", ":version 1.10", ":name VICON", ":units", "  mass 1.0", "  length 0.45", "  angle deg"]
    lines += [":documentation", "   anything may stand here", ":root", "   order TX TY TZ RX RY RZ", "   axis XYZ"]
    lines += ["   position 0 0 0  ", "   orientation 0 0 0 ", ":bonedata"]
    for b, name in enumerate(skeleton.names):
        length = skeleton.length_m[b] / UNIT_M
        direction = skeleton.bone_m[b] @ WORLD_FROM_ASF / skeleton.length_m[b]
        channels = skeleton.hinges[b]
        frame = _frame(channels, skeleton.axes[skeleton.dof_of_bone[b]] @ WORLD_FROM_ASF)
        axis = _euler_deg(frame, "xyz")
        lines += ["  begin", f"     id {b + 1} ", f"     name {name}", f"     direction {_words(direction)} "]
        lines += [f"     length {float(length)!r}   ", f"     axis {_words(axis)}   XYZ"]
        if channels:
            lines += [f"    dof {' '.join(channels)}", "    limits (-160.0 20.0)"]
            lines += ["           (-70.0 70.0)"] * (len(channels) - 1)
        lines.append("  end")
    lines += [":hierarchy", "  begin"]
    for b, name in [(-1, "root"), *enumerate(skeleton.names)]:
        children = [child for child, parent in zip(skeleton.names, skeleton.parents, strict=True) if parent == b]
        if children:
            lines.append(f"    {name} {' '.join(children)}")
    return newline.join([*lines, "  end", ""])


def amc_text(motion: Clip, newline: str = "\n") -> str:
    """The motion as an AMC file for `asf_text` of its skeleton; rows are not in the order of the bones."""
    matrix = rotations.to_matrix(motion.world_from_root)
    euler = _euler_deg(WORLD_FROM_ASF.T @ matrix @ WORLD_FROM_ASF, "xyz")
    root = np.concatenate([motion.root_m @ WORLD_FROM_ASF / UNIT_M, euler], axis=1)
    degrees = np.rad2deg(motion.angles_rad)
    lines = ["#!OML:ASF F:\\SOME PLACE\\x.ASF", ":FULLY-SPECIFIED", ":DEGREES"]
    bones = [b for b, channels in enumerate(motion.skeleton.hinges) if channels][::-1]
    for t in range(len(motion)):
        lines += [str(t + 1), f"root {_words(root[t])}"]
        lines += [f"{motion.skeleton.names[b]} {_words(degrees[t, motion.skeleton.dof_of_bone[b]])}" for b in bones]
    return newline.join([*lines, ""])


def bvh_text(motion: Clip, *, t_pose: bool = True, unit_m: float = UNIT_M) -> str:
    """The motion in the layout of CMU's BVH conversion, exact for bones whose length it keeps."""
    skeleton = motion.skeleton
    bone_of = {drive.joint: bone for bone, drive in CMU_MAP.items()}
    tip_of = {drive.tip: bone for bone, drive in CMU_MAP.items()}
    local = _parent_from_bone(motion)
    rows, lines = [], ["HIERARCHY"]

    def offset(joint: str) -> str:
        bone = tip_of.get(joint)
        vector = (
            np.zeros(3)
            if bone is None or bone in LEFT_OUT
            else skeleton.bone_m[skeleton.index(bone)] @ WORLD_FROM_ASF / unit_m
        )
        return _words(vector)

    def add(joint: str) -> None:
        bone = bone_of[joint]
        kind = "ROOT" if bone == "root" else "JOINT"
        positions = "6 Xposition Yposition Zposition" if bone == "root" else "3"
        lines.extend([f"{kind} {joint}", "{", f"\tOFFSET {offset(joint)}"])
        lines.append(f"\tCHANNELS {positions} Zrotation Yrotation Xrotation ")
        quaternion = motion.world_from_root if bone == "root" else local[bone]
        rows.append(_zyx_deg(quaternion))
        index = -1 if bone == "root" else skeleton.index(bone)
        below = [name for name, parent in zip(skeleton.names, skeleton.parents, strict=True) if parent == index]
        for child in below:
            add(CMU_MAP[child].joint)
        if not below:
            tip = CMU_MAP[bone].tip
            assert tip is not None
            if tip.endswith("_end"):
                lines.extend(["End Site", "{", f"\tOFFSET {offset(tip)}", "}"])
            else:
                lines.extend([f"JOINT {tip}", "{", f"\tOFFSET {offset(tip)}"])
                lines.extend(
                    ["\tCHANNELS 3 Zrotation Yrotation Xrotation", "End Site", "{", "\tOFFSET 0 0 0", "}", "}"]
                )
                rows.append(np.zeros((len(motion), 3)))
        lines.append("}")

    add("Hips")
    values = np.concatenate([motion.root_m @ WORLD_FROM_ASF / unit_m, *rows], axis=1)
    if t_pose:
        first = np.zeros((1, values.shape[1]))
        first[:, :3] = values[0, :3]
        values = np.concatenate([first, values])
    lines += ["MOTION", f"Frames: {len(values)}", "Frame Time: .0083333", *(_words(row) for row in values), ""]
    return "\n".join(lines)


def amass_arrays(motion: Clip) -> dict[str, Floats]:
    """The motion as arrays of an AMASS file; joints without a bone do not move."""
    world = _world_from_bone(motion)
    joints = {drive.joint: bone for bone, drive in reversed(list(SMPL_MAP.items()))}
    joints |= {"left_elbow": "lwrist", "right_elbow": "rwrist", "neck": "upperneck"}
    turned = np.zeros((len(motion), len(JOINTS), 4))
    poses = np.zeros((len(motion), 156))
    smpl_from_ours = rotations.from_matrix(WORLD_FROM_ASF.T)
    for j, (name, parent) in enumerate(JOINTS):
        above = turned[:, parent] if parent >= 0 else np.broadcast_to(rotations.IDENTITY, (len(motion), 4))
        turned[:, j] = above
        if name in joints:
            bone = world[joints[name]]
            turned[:, j] = rotations.multiply(bone, rotations.inverse(np.array(SMPL_MAP[joints[name]].joint_from_bone)))
        local = rotations.multiply(rotations.inverse(above), turned[:, j])
        if parent < 0:
            local = rotations.multiply(local, rotations.inverse(smpl_from_ours))
        else:
            local = rotations.multiply(rotations.multiply(smpl_from_ours, local), rotations.inverse(smpl_from_ours))
        poses[:, 3 * j : 3 * j + 3] = rotations.log(local)
    return {"poses": poses, "trans": np.array(motion.root_m), "mocap_framerate": np.array(motion.rate_hz)}


_BONE_OF_SEGMENT = {
    "Pelvis": "root",
    "L5": "lowerback",
    "L3": "upperback",
    "T12": "upperback",
    "T8": "thorax",
    "Neck": "lowerneck",
    "Head": "head",
    **{
        f"{side}{segment}": f"{s}{bone}"
        for side, s in (("Right", "r"), ("Left", "l"))
        for segment, bone in (
            *(("Shoulder", "clavicle"), ("UpperArm", "humerus"), ("ForeArm", "wrist"), ("Hand", "hand")),
            *(("UpperLeg", "femur"), ("LowerLeg", "tibia"), ("Foot", "foot"), ("Toe", "foot")),
        )
    },
}


def mvnx_text(motion: Clip, *, version: int = 4, newline: str = "\n") -> str:
    """The motion as an MVNX file in the layout of MVN 2019 (version 4) or MVN Studio 4 (version 3).

    The head's segment follows the last bone of its chain, and the forearm's the wrist bone.
    """
    world, offset = _mvn_orientations(motion), _mvn_offsets(motion.skeleton)
    pelvis = -0.5 * (offset["RightUpperLeg"] + offset["LeftUpperLeg"])  # the hips' middle, seen from the root
    offset = {name: vector + (pelvis if SEGMENTS[name] == "Pelvis" else 0.0) for name, vector in offset.items()}
    place = {"Pelvis": motion.root_m - rotations.rotate(world["Pelvis"], pelvis)}
    for name, parent in SEGMENTS.items():
        if parent:
            place[name] = place[parent] + rotations.rotate(world[parent], offset[name])
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    if version == 3:
        lines.append('<!DOCTYPE mvnx SYSTEM "http://www.xsens.com/mvn/mvnx/schema.dtd">')
    lines += [f'<mvnx xmlns="http://www.xsens.com/mvn/mvnx" version="{version}">', '<mvn version="a test"/>']
    lines += ["<comment>made by a test &amp; not by MVN</comment>"]
    lines += [f'<subject label="{motion.subject}" frameRate="{motion.rate_hz:g}" segmentCount="23">', "<segments>"]
    lines += _mvn_segment_lines(offset, motion.skeleton, "pos_s" if version == 3 else "pos_b")
    lines += ["</segments>", '<frames segmentCount="23" sensorCount="17" jointCount="22">']
    turns, places = np.stack([world[name] for name in SEGMENTS], 1), np.stack([place[name] for name in SEGMENTS], 1)
    frames = [(-1, "identity" if version == 4 else "npose"), *((t, "normal") for t in range(len(motion)))]
    for t, kind in frames:
        turn = turns[t] if t >= 0 else np.tile(rotations.IDENTITY, (23, 1))
        index = f'index="{t}" ' if t >= 0 else ""
        lines += [f'<frame time="{max(t, 0)}" {index}tc="" ms="0" type="{kind}">']
        lines += [f"<orientation>{_words(turn.ravel())}</orientation>"]
        lines += [f"<position>{_words(places[t].ravel())}</position>", "<velocity>0 0 0</velocity>", "</frame>"]
    return newline.join([*lines, "</frames>", "</subject>", '<securityCode code="0"/>', "</mvnx>", ""])


def _mvn_orientations(motion: Clip) -> dict[str, Floats]:
    world = _world_from_bone(motion)
    return {
        segment: rotations.multiply(world[bone], rotations.inverse(np.array(FROM_T_POSE.get(bone, rotations.IDENTITY))))
        for segment, bone in _BONE_OF_SEGMENT.items()
    }


def _mvn_offsets(skeleton: Skeleton) -> dict[str, Floats]:
    """Origin of each segment in the axes of the one above it, the pelvis taken to lie at the root [m]."""

    def vector(bone: str) -> Floats:
        turn = np.array(FROM_T_POSE.get(bone, rotations.IDENTITY))
        return rotations.rotate(turn, skeleton.bone_m[skeleton.index(bone)])

    offset = {"L5": np.zeros(3), "L3": vector("lowerback"), "T12": 0.5 * vector("upperback")}
    offset |= {"T8": 0.5 * vector("upperback"), "Neck": vector("thorax"), "Head": vector("lowerneck")}
    for side, s in (("Right", "r"), ("Left", "l")):
        offset |= {f"{side}Shoulder": vector("thorax"), f"{side}UpperArm": vector(f"{s}clavicle")}
        offset |= {f"{side}ForeArm": vector(f"{s}humerus"), f"{side}Hand": vector(f"{s}radius") + vector(f"{s}wrist")}
        offset |= {f"{side}UpperLeg": vector(f"{s}hipjoint"), f"{side}LowerLeg": vector(f"{s}femur")}
        offset |= {f"{side}Foot": vector(f"{s}tibia"), f"{side}Toe": vector(f"{s}foot")}
    return offset


def _mvn_segment_lines(offset: dict[str, Floats], skeleton: Skeleton, tag: str) -> list[str]:
    lines = []
    top = skeleton.bone_m[skeleton.index("upperneck")] + skeleton.bone_m[skeleton.index("head")]
    for number, name in enumerate(SEGMENTS, 1):
        points = {f"p{name}Landmark": np.array([0.01, 0.02, 0.03])}
        points |= {f"j{name}Origin": np.zeros(3)} if name != "Pelvis" else {}
        points |= {f"j{child}Origin": offset[child] for child, parent in SEGMENTS.items() if parent == name}
        points |= {"pTopOfHead": top} if name == "Head" else {}
        lines += [f'<segment label="{name}" id="{number}">', "<points>"]
        lines += [f'<point label="{p}"><{tag}>{_words(place)}</{tag}></point>' for p, place in points.items()]
        lines += ["</points>", "</segment>"]
    return lines


def write_clip(folder: Path, motion: Clip) -> Path:
    """An AMC with its ASF beside it, laid out like CMU's site; the AMC's path."""
    place = folder / motion.subject
    place.mkdir(parents=True, exist_ok=True)
    (place / f"{motion.subject}.asf").write_text(asf_text(motion.skeleton))
    amc = place / f"{motion.name}.amc"
    amc.write_text(amc_text(motion))
    return amc


def _words(values: Floats) -> str:
    return " ".join(repr(float(value)) for value in values)


def _frame(channels: tuple[str, ...], axes: Floats) -> Floats:
    """A rotation matrix whose columns for these channels are the given axes."""
    frame = np.zeros((3, 3))
    known = ["xyz".index(channel[1]) for channel in channels]
    for column, axis in zip(known, axes, strict=True):
        frame[:, column] = axis
    if len(known) == 0:
        return np.eye(3)
    if len(known) == 1:
        aside = np.cross(frame[:, known[0]], np.eye(3)[np.argmin(np.abs(frame[:, known[0]]))])
        known.append((known[0] + 1) % 3)
        frame[:, known[1]] = aside / np.linalg.norm(aside)
    if len(known) == 2:
        last = 3 - sum(known)
        frame[:, last] = np.cross(frame[:, (last + 1) % 3], frame[:, (last + 2) % 3])
    return frame


def _parent_from_bone(motion: Clip) -> dict[str, Floats]:
    """Quaternions (T, 4) of each bone relative to its parent."""
    skeleton = motion.skeleton
    out = {}
    for b, name in enumerate(skeleton.names):
        turn = np.broadcast_to(rotations.IDENTITY, (len(motion), 4))
        where = skeleton.dof_of_bone[b]
        for d in range(where.start, where.stop):
            turn = rotations.multiply(rotations.exp(motion.angles_rad[:, d, None] * skeleton.axes[d]), turn)
        out[name] = turn
    return out


def _world_from_bone(motion: Clip) -> dict[str, Floats]:
    local = _parent_from_bone(motion)
    out = {"root": np.array(motion.world_from_root)}
    for name, parent in zip(motion.skeleton.names, motion.skeleton.parents, strict=True):
        out[name] = rotations.multiply(out["root" if parent < 0 else motion.skeleton.names[parent]], local[name])
    return out


def _zyx_deg(quaternion: Floats) -> Floats:
    """Angles (T, 3) of Z, Y and X channels [deg] in the file's axes."""
    matrix = WORLD_FROM_ASF.T @ rotations.to_matrix(quaternion) @ WORLD_FROM_ASF
    return _euler_deg(matrix, "ZYX")


def _euler_deg(matrix: Floats, order: Literal["xyz", "ZYX"]) -> Floats:
    """scipy's Euler angles [deg]; at gimbal lock, one of the equivalent solutions."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        out: Floats = Rotation.from_matrix(matrix).as_euler(order, degrees=True)
    return out
