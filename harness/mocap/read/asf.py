"""Acclaim skeleton files (ASF), in the dialect of the CMU motion capture library.

Lengths divided by the header's `length` unit are inches (CMU: 0.45, so a value of 1 is 56.444 mm). A bone's
`direction` is in the file's world axes (x left, y up, z forward) in the rest pose; its `axis` angles give the
frame whose coordinate axes are the bone's hinges. The reader converts everything to the world axes of `core`:
x forward, y left, z up, metres. https://research.cs.wisc.edu/graphics/Courses/cs-838-1999/Jeff/ASF-AMC.html
describes the format; the unit was checked against the free fall of recorded jumps.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.errors import BadFile
from harness.mocap.read.file_checks import parse_numbers, read_lines

WORLD_FROM_ASF: Floats = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Acclaim's axes (x left, y up, z forward) in the world's (x forward, y left, z up)."""
INCH_M = 0.0254
LIMIT_BYTES = 2**20
"""Largest ASF file that is read; CMU's have 6 to 7 kB."""
ROOT_ORDER = ("TX", "TY", "TZ", "RX", "RY", "RZ")

_FORMAT = "an ASF skeleton"
_AXIS_INDEX = {"X": 0, "Y": 1, "Z": 2}


@dataclass
class _BoneData:
    line: int
    name: str = ""
    direction: Sequence[float] = ()
    length: float = -1.0
    axis_deg: Sequence[float] = ()
    axis_order: str = "XYZ"
    dof: tuple[str, ...] = ()


@dataclass
class _AsfSections:
    """Contents of the sections of a file, before they are checked against each other."""

    length_unit: float = 0.0
    degrees: bool = True
    root_order: tuple[str, ...] = ()
    bones: dict[str, _BoneData] = field(default_factory=dict)
    parent_of: dict[str, str] = field(default_factory=dict)


def read_asf(path: Path | str) -> Skeleton:
    """Read the skeleton of an ASF file with all its bones (CMU: 30), in metres and world axes; see `read_asf_file`."""
    return read_asf_file(path)[0]


def read_asf_file(path: Path | str, *, unit_m: float | None = None) -> tuple[Skeleton, float]:
    """Read the skeleton of an ASF file, and the length of 1 in it and in the AMC files that belong to it [m].

    Bones are depth first in the order of the hierarchy. `unit_m` replaces the unit of length in the file [m].

    Raises BadFile with the line for anything that cannot be understood: units, unknown or repeated bones, a bone
    with two parents, none, or among its own ancestors.
    """
    path = Path(path)
    draft = _AsfSections()
    section, bone = "", None
    for line, text in enumerate(read_lines(path, _FORMAT, LIMIT_BYTES), start=1):
        words = text.split("#", 1)[0].split()
        if not words:
            continue
        if words[0].startswith(":"):
            section, bone = words[0].lower(), None
        elif section == ":units":
            _parse_units(path, draft, words, line)
        elif section == ":root":
            _parse_root(path, draft, words, line)
        elif section == ":bonedata":
            bone = _parse_bone(path, draft, bone, words, line)
        elif section == ":hierarchy":
            _parse_hierarchy(path, draft, words, line)
        elif not section:
            raise BadFile(path, f"{text.strip()[:40]!r}", "a section such as :version", f"Is it {_FORMAT}?", line)
    return _build_file(path, draft, unit_m)


def _parse_units(path: Path, draft: _AsfSections, words: list[str], line: int) -> None:
    if words[0] == "length":
        (draft.length_unit,) = parse_numbers(path, words[1:], 1, "the unit of length", line)
        if draft.length_unit <= 0.0:
            raise BadFile(path, f"a unit of length {words[1]}", "above 0", "CMU's files say 0.45.", line)
    elif words[0] == "angle":
        if words[1:] not in (["deg"], ["rad"]):
            raise BadFile(path, f"angles in {' '.join(words[1:])!r}", "deg or rad", "Correct :units.", line)
        draft.degrees = words[1] == "deg"


def _parse_root(path: Path, draft: _AsfSections, words: list[str], line: int) -> None:
    key, values = words[0].lower(), words[1:]
    if key == "order":
        draft.root_order = tuple(word.upper() for word in values)
        if draft.root_order != ROOT_ORDER:
            raise BadFile(path, f"root order {' '.join(values)}", " ".join(ROOT_ORDER), "Export it so.", line)
    elif key == "axis" and [word.upper() for word in values] != ["XYZ"]:
        raise BadFile(path, f"root axis {' '.join(values)}", "XYZ", "Export it so.", line)
    elif key in ("position", "orientation") and any(parse_numbers(path, values, 3, f"the root's {key}", line)):
        raise BadFile(path, f"root {key} {' '.join(values)}", "0 0 0, as in CMU's files", "Export it so.", line)


def _parse_bone(
    path: Path, draft: _AsfSections, bone: _BoneData | None, words: list[str], line: int
) -> _BoneData | None:
    key, values = words[0].lower(), words[1:]
    if key == "begin":
        if bone is not None:
            raise BadFile(path, "a bone inside a bone", "end before begin", "Is a line missing?", line)
        return _BoneData(line)
    if bone is None:
        raise BadFile(path, f"{words[0][:40]!r} outside a bone", "begin", "Is a line missing?", line)
    if key == "end":
        _add_bone(path, draft, bone, line)
        return None
    what = f"the {key} of bone {bone.name or '?'}"
    if key == "name" and len(values) == 1:
        bone.name = values[0]
    elif key == "direction":
        bone.direction = parse_numbers(path, values, 3, what, line)
    elif key == "length":
        (bone.length,) = parse_numbers(path, values, 1, what, line)
    elif key == "axis":
        bone.axis_order = values[-1].upper() if len(values) == 4 else ""
        if sorted(bone.axis_order) != ["X", "Y", "Z"]:
            raise BadFile(path, f"axis {' '.join(values)}", "three angles and an order such as XYZ", "Fix it.", line)
        bone.axis_deg = parse_numbers(path, values[:3], 3, what, line)
    elif key == "dof":
        bone.dof = tuple(word.lower() for word in values)
        if len(set(bone.dof)) < len(bone.dof) or not set(bone.dof) <= {"rx", "ry", "rz"}:
            advice = "Bones that slide or stretch are not supported."
            raise BadFile(path, f"dof {' '.join(values)}", "each of rx, ry, rz at most once", advice, line)
    elif key not in ("id", "limits", "bodymass", "cofmass") and not key.startswith("("):
        raise BadFile(path, f"{words[0][:40]!r} in a bone", "a keyword of the format", "Is the line complete?", line)
    return bone


def _add_bone(path: Path, draft: _AsfSections, bone: _BoneData, line: int) -> None:
    """Add a finished bone; BadFile unless it is complete, new, and its direction is a unit vector."""
    lacking = [
        key
        for key, missing in (
            ("name", not bone.name),
            ("direction", not bone.direction),
            ("length", bone.length < 0.0),
            ("axis", not bone.axis_deg),
        )
        if missing
    ]
    if lacking:
        found = f"bone {bone.name or '?'} without a usable {', '.join(lacking)}"
        raise BadFile(path, found, "name, direction, length (0 or more) and axis", "Fetch it again.", line)
    if bone.name in draft.bones or bone.name == "root":
        raise BadFile(path, f"bone {bone.name} twice", "each bone once", "Remove one.", bone.line)
    if bone.length > 0.0 and abs(np.sqrt(np.sum(np.square(bone.direction))) - 1.0) > 0.01:
        raise BadFile(path, f"a direction of bone {bone.name} that is no unit vector", "length 1", "Fix it.", line)
    draft.bones[bone.name] = bone


def _parse_hierarchy(path: Path, draft: _AsfSections, words: list[str], line: int) -> None:
    if words in (["begin"], ["end"]):
        return
    for name in words:
        if name not in draft.bones and name != "root":
            raise BadFile(path, f"unknown bone {name[:40]}", "one of :bonedata", "Is a bone missing?", line)
    for child in words[1:]:
        if child in draft.parent_of or child == "root":
            above = draft.parent_of.get(child, "no bone, being the root")
            raise BadFile(path, f"{words[0]} above {child}, which hangs on {above}", "one parent", "Fix it.", line)
        draft.parent_of[child] = words[0]


def _build_file(path: Path, draft: _AsfSections, unit_m: float | None) -> tuple[Skeleton, float]:
    for missing, what in (
        (not draft.length_unit, ":units with a length"),
        (not draft.root_order, ":root with an order"),
        (not draft.bones, ":bonedata with bones"),
        (not draft.parent_of, ":hierarchy with bones"),
    ):
        if missing:
            raise BadFile(path, f"no {what}", f"{_FORMAT} with one", "Is the file complete?")
    names = _depth_first(draft.parent_of)
    lost = [name for name in draft.bones if name not in names]
    if lost:
        found = f"bone {lost[0]} that does not hang on the root (an orphan or a cycle)"
        raise BadFile(path, found, "every bone below the root", "Correct :hierarchy.", draft.bones[lost[0]].line)
    bones = [draft.bones[name] for name in names]
    metres = INCH_M / draft.length_unit if unit_m is None else unit_m
    skeleton = Skeleton(
        names=names,
        parents=tuple(names.index(draft.parent_of[n]) if draft.parent_of[n] != "root" else -1 for n in names),
        bone_m=np.array([WORLD_FROM_ASF @ np.asarray(b.direction) * b.length * metres for b in bones]),
        hinges=tuple(b.dof for b in bones),
        axes=np.array([axis for b in bones for axis in _hinge_axes(b, draft.degrees)]).reshape(-1, 3),
    )
    longest = float(skeleton.length_m.max())
    if not 0.1 <= longest <= 1.0:  # a person's longest bone, thigh or shin, has 0.2 to 0.8 m
        found = f"a longest bone of {longest:.3g} m"
        raise BadFile(path, found, "0.1 to 1 m", "Correct length in :units (CMU: 0.45), or give --unit.")
    return skeleton, metres


def _depth_first(parent_of: dict[str, str]) -> tuple[str, ...]:
    """Names of the bones below the root, parents first."""
    children: dict[str, list[str]] = {}
    for child, parent in parent_of.items():
        children.setdefault(parent, []).append(child)
    order, waiting = [], list(reversed(children.get("root", [])))
    while waiting:
        order.append(waiting.pop())
        waiting.extend(reversed(children.get(order[-1], [])))
    return tuple(order)


def _hinge_axes(bone: _BoneData, degrees: bool) -> list[Floats]:
    """World axes of a bone's hinges: the axes of its frame, which the angles of `axis` rotate in order."""
    angles = np.deg2rad(bone.axis_deg) if degrees else np.asarray(bone.axis_deg)
    turn = np.eye(3)
    for angle, letter in zip(angles, bone.axis_order, strict=True):
        turn = rotations.to_matrix(rotations.exp(angle * np.eye(3)[_AXIS_INDEX[letter]])) @ turn
    return [WORLD_FROM_ASF @ turn[:, _AXIS_INDEX[channel[1].upper()]] for channel in bone.dof]
