"""Inspection of a motion file (`harness inspect`): what the file holds, with evidence, and what is wrong with it.

Nothing is guessed where the evidence is ambiguous: the error says what is missing and which option gives it.
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.humanoid24 import has_bones, select_bones
from harness.core.motion import Clip
from harness.core.skeleton import Skeleton, forward_kinematics
from harness.errors import BadFile, BadInput
from harness.mocap import motion_checks
from harness.mocap.clip_file import CMU_NAME, find_skeleton_file, motion_format, read_library_file
from harness.mocap.index import INDEX_NAME, rate_from_index, unknown_rate_error
from harness.mocap.library import LibraryFolders, MotionLibrary, as_folders
from harness.mocap.motion_checks import Inspection
from harness.mocap.read.file_checks import check_size
from harness.mocap.read.joint_clip import LEG_BONES, rest_positions

if TYPE_CHECKING:
    from harness.mocap.read.c3d import MarkerClip

LEG_M = (0.55, 1.15)
"""Range of people's leg lengths, thigh plus shin [m]; 20 skeletons of CMU have 0.74 to 0.90."""
ROOT_HEIGHT_IN_LEGS = (0.05, 5.0)
"""Range of the root's median height over z = 0, in leg lengths; CMU's clips have 0.82 to 1.50."""
UPRIGHT_SHARE = 0.4
"""Least share of frames with the head over the feet; the cartwheels of 49_08 have 0.59."""
RATE_IN_FILE = "recorded in the file"
_IN_METRES = {"mvnx": "MVNX", "npz": "AMASS"}
"""Formats that are always in metres, and their names."""
FOOT_HEIGHT_SHARE = 0.12
"""Joints no higher in the rest pose than this share of its height belong to the feet."""


def inspect_file(
    path: Path | str, *, rate_hz: float | None = None, unit: float | None = None, library: LibraryFolders | None = None
) -> Inspection:
    """Inspect an AMC, BVH, MVNX, AMASS npz or C3D file.

    `unit` is the length of 1 in the file [m]. The index of a folder of `library` may name the file's rate, and the
    library may hold the motion that was recorded with the markers of a C3D file. Raises BadFile for a file that cannot
    be read or understood, and BadInput where the caller must give what the file does not say.
    """
    path = Path(path)
    kind = motion_format(path)
    if unit is not None and not 0.0 < unit < np.inf:
        raise BadInput(f"A unit of {unit} m cannot be.", "Give the length of 1 in the file in metres (--unit).")
    if kind == "amc":
        return _inspect_amc(path, rate_hz, unit, library)
    if rate_hz is not None:
        raise BadInput(f"{path.name} records its own rate.", "Leave out --rate.")
    if kind == "bvh":
        return _inspect_bvh(path, unit)
    if kind == "c3d":
        return _inspect_c3d(path, unit, library)
    if unit is not None:
        raise BadInput(f"{path.name} is in metres, as all {_IN_METRES[kind]} files are.", "Leave out --unit.")
    facts = inspect_clip(read_library_file(path, path.parent, None))
    return replace(
        facts,
        name=path.stem,
        format=kind,
        height_m=None if kind == "npz" else facts.height_m,
        rate_evidence=RATE_IN_FILE,
        unit_evidence=f"{_IN_METRES[kind]} is in metres",
        up=f"z ({facts.up})",
    )


def inspect_clip(clip: Clip) -> Inspection:
    """Inspect a clip in memory.

    If the clip has the 24 bones of `core.humanoid24`, only these are checked, and the joint limits too.
    """
    skeleton = clip.skeleton
    pose = forward_kinematics(skeleton, clip.root_m, clip.world_from_root, clip.angles_rad)
    humanoid = has_bones(skeleton)
    bones = [skeleton.index(bone) for bone in (select_bones(skeleton)[0] if humanoid else skeleton).names]
    rest_m = np.concatenate([np.zeros((1, 3)), rest_positions(skeleton.parents, skeleton.bone_m)[bones]])
    names = ("root", *(skeleton.names[b] for b in bones))
    position_m = np.concatenate([clip.root_m[:, None], pose.end_m[:, bones]], axis=1)
    facts = _inspect_points(clip.name, names, position_m, rest_m, clip.rate_hz)
    facts = replace(facts, height_m=float(np.ptp(rest_m[:, 2])), notes=clip.notes)
    if not humanoid:
        return facts
    facts = replace(facts, turns=motion_checks.find_turns(skeleton, clip.angles_rad, clip.rate_hz))
    leg = 0.5 * sum(float(skeleton.length_m[skeleton.index(bone)]) for bone in LEG_BONES)
    above = float(np.median(clip.root_m[:, 2])) / leg
    doubts = list(facts.doubts)
    if not LEG_M[0] <= leg <= LEG_M[1]:
        doubts.append(f"legs of {leg:.3g} m: is the unit right?")
    if not ROOT_HEIGHT_IN_LEGS[0] <= above <= ROOT_HEIGHT_IN_LEGS[1]:
        doubts.append(f"the root is {above:.3g} leg lengths above z = 0: are root and bones in one unit?")
    evidence = f"legs of {leg:.2f} m"
    facts = replace(facts, height_m=_standing_height_m(skeleton), unit_evidence=evidence, doubts=tuple(doubts))
    if not motion_checks.has_standard_hinges(skeleton):
        return facts
    share, most, hinge = motion_checks.measure_limit_violations(skeleton, clip.angles_rad)
    worst = f"{hinge} by {np.rad2deg(most):.1f} deg" if share else ""
    return replace(facts, limits_share=share, limits_worst=worst)


def _inspect_amc(path: Path, rate_hz: float | None, unit_m: float | None, library: LibraryFolders | None) -> Inspection:
    from harness.mocap.read.amc import read_amc
    from harness.mocap.read.asf import read_asf_file

    check_size(path, "an AMC motion")
    rate, evidence = (rate_hz, "as given") if rate_hz is not None else _rate_from_index(path, library)
    file = path.resolve()
    skeleton_file = find_skeleton_file(file, file.parents[min(2, len(file.parents) - 1)])
    skeleton, length_m = read_asf_file(skeleton_file, unit_m=unit_m)
    facts = inspect_clip(read_amc(path, skeleton, rate_hz=rate, unit_m=length_m))
    why = "as given" if unit_m is not None else "length in the ASF's :units"
    return replace(
        facts,
        format="amc",
        rate_evidence=evidence,
        unit_m=length_m,
        unit_evidence=f"{why}; {facts.unit_evidence}",
        up=f"y ({facts.up})",
    )


def _inspect_bvh(path: Path, unit_m: float | None) -> Inspection:
    from harness.mocap.read.bvh import read_bvh, to_humanoid_clip

    joint_clip = read_bvh(path, unit_m=unit_m)
    clip = to_humanoid_clip(joint_clip)
    if clip is not None:
        facts = inspect_clip(clip)
    else:
        rest_m = joint_clip.rest_m()
        facts = _inspect_points(path.stem, joint_clip.names, joint_clip.world()[0], rest_m, joint_clip.rate_hz)
        facts = replace(facts, height_m=float(np.ptp(rest_m[:, 2])))
    return replace(
        facts,
        format="bvh",
        rate_evidence=RATE_IN_FILE,
        unit_m=joint_clip.unit_m,
        unit_evidence=joint_clip.unit_evidence,
        up=f"y ({facts.up})",
    )


def _inspect_c3d(path: Path, unit_m: float | None, library: LibraryFolders | None) -> Inspection:
    from harness.mocap.read.c3d import read_c3d

    markers = read_c3d(path, unit_m=unit_m)
    visible: Bools = np.isfinite(markers.position_m[..., 0])
    if not visible.any():
        raise BadFile(path, "no marker in any frame", "positions of markers", "Export it again.")
    facts = _inspect_points(path.stem, markers.labels, markers.position_m, None, markers.rate_hz)
    return replace(
        facts,
        format="c3d",
        rate_evidence=RATE_IN_FILE,
        unit_m=markers.unit_m,
        unit_evidence=markers.unit_evidence,
        up=markers.up_evidence,
        missing_share=float(1.0 - visible.mean()),
        missing_markers=tuple(label for m, label in enumerate(markers.labels) if not visible[:, m].all()),
        notes=(
            *markers.notes,
            *(() if library is None else _marker_spread_notes(path, markers, MotionLibrary(library))),
        ),
    )


def _marker_spread_notes(path: Path, markers: "MarkerClip", library: MotionLibrary) -> tuple[str, ...]:
    """How firmly each marker sits on its bone, if the library has the motion of the same take."""
    if markers.name not in library.names():
        return ()
    takes = {copy.resolve() for copy in library.entry(markers.name).copies}
    if not CMU_NAME.fullmatch(markers.name) and path.resolve() not in takes:
        return ()
    from harness.mocap.read.c3d import measure_marker_spreads

    spreads = measure_marker_spreads(markers, library.load(markers.name))
    text = ", ".join(f"{s.label} {s.bone} {1000.0 * s.spread_m:.0f}" for s in spreads)
    return (f"standard deviation of each marker about the bone that it follows in {markers.name} [mm]: {text}",)


def _inspect_points(
    name: str, labels: tuple[str, ...], position_m: Floats, rest_m: Floats | None, rate_hz: float
) -> Inspection:
    """The checks that need only positions (T, P, 3) of joints or markers, and those in the rest pose (P, 3) [m]."""
    feet, up, doubts = _feet_and_up(labels, position_m, rest_m)
    floor_m, contact_share = motion_checks.estimate_floor(position_m, feet)
    speed_m_s, joint, frame = motion_checks.find_fastest_joint(labels, position_m, rate_hz)
    return Inspection(
        name=name,
        frames=len(position_m),
        rate_hz=rate_hz,
        up=up,
        floor_m=floor_m,
        contact_share=contact_share,
        fastest_m_s=speed_m_s,
        fastest_joint=joint,
        fastest_frame=frame,
        spikes=motion_checks.find_spikes(labels, position_m, rate_hz),
        frozen=motion_checks.find_frozen_frames(position_m),
        doubts=doubts,
    )


def _feet_and_up(
    labels: tuple[str, ...], position_m: Floats, rest_m: Floats | None
) -> tuple[Ints, str, tuple[str, ...]]:
    """Indices of the feet's points, the evidence that z is up, and the evidence against it."""
    if rest_m is None:
        return np.arange(len(labels)), "", ()
    height = rest_m[:, 2]
    tall = np.ptp(height)
    feet = np.flatnonzero(height < height.min() + FOOT_HEIGHT_SHARE * tall)
    head = int(height.argmax())
    rise = position_m[:, head] - position_m[:, feet].mean(axis=1)
    above = float(np.mean(rise[:, 2] > 0.5 * np.sqrt(np.sum(rise**2, axis=1))))
    stands = bool(tall >= np.ptp(rest_m, axis=0).max() * 0.7)
    up = f"the rest pose {'stands along it' if stands else 'does not stand along it'}; "
    up += f"{labels[head]} is over the feet in {100 * above:.0f} % of the frames"
    doubts = []
    if not stands:
        doubts.append("the rest pose does not stand upright: is another axis up?")
    if above < UPRIGHT_SHARE:
        doubts.append(f"the body is upright in {100 * above:.0f} % of the frames only: is another axis up?")
    return feet, up, tuple(doubts)


def _standing_height_m(skeleton: Skeleton) -> float:
    """Height of the body with its legs and back straight, from the end of the head to the end of a foot [m]."""
    back = ("lowerback", "upperback", "thorax", "lowerneck", "upperneck", "head")
    length = {name: float(skeleton.length_m[skeleton.index(name)]) for name in (*back, *LEG_BONES)}
    drop = sum(
        float(-skeleton.bone_m[skeleton.index(bone), 2]) for bone in ("lhipjoint", "rhipjoint", "lfoot", "rfoot")
    )
    return sum(length[bone] for bone in back) + 0.5 * (sum(length[bone] for bone in LEG_BONES) + drop)


def _rate_from_index(path: Path, library: LibraryFolders | None) -> tuple[float, str]:
    """The rate in the index [Hz] and the evidence; BadInput if no index names it."""
    rate_hz = rate_from_index(path, () if library is None else as_folders(library))
    if rate_hz is None:
        raise unknown_rate_error(path.name)
    return rate_hz, f"from {INDEX_NAME} of the library"
