"""AMASS archives (npz): the pose parameters of the SMPL body models, read as plain arrays.

A file has `poses` (T, 3 J) axis-angle vectors, `trans` (T, 3) and its rate. J is 24 (SMPL), 52 (SMPL-H) or 55 (SMPL-X);
the first 22 joints are the same body in all three (https://github.com/vchoutas/smplx, joint_names.py), and only these
are used. The rest pose is a T: x left, y up, z forward; the root vector turns it into a world with z up.

A file does not hold bone lengths and the position of the pelvis, which follow from `betas` by a licensed body model.
So the motion is applied to the mean skeleton of the 24 bones, and the root is placed at `trans` (the true pelvis is a
constant vector of up to 0.25 m away). The model's rest pose is taken to have legs straight down and arms along x.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import Clip
from harness.core.npz_file import read_npz
from harness.errors import BadFile
from harness.mocap.read.asf import WORLD_FROM_ASF
from harness.mocap.read.file_checks import LIMIT_BYTES, MAX_VALUE, check_size
from harness.mocap.read.joint_clip import FROM_T_POSE, BoneMapping, JointClip, JointMap, to_clip

JOINTS: tuple[tuple[str, int], ...] = (
    ("pelvis", -1),
    ("left_hip", 0),
    ("right_hip", 0),
    ("spine1", 0),
    ("left_knee", 1),
    ("right_knee", 2),
    ("spine2", 3),
    ("left_ankle", 4),
    ("right_ankle", 5),
    ("spine3", 6),
    ("left_foot", 7),
    ("right_foot", 8),
    ("neck", 9),
    ("left_collar", 9),
    ("right_collar", 9),
    ("head", 12),
    ("left_shoulder", 13),
    ("right_shoulder", 14),
    ("left_elbow", 16),
    ("right_elbow", 17),
    ("left_wrist", 18),
    ("right_wrist", 19),
)
"""Name and parent of the joints that SMPL, SMPL-H and SMPL-X share, in the order of `poses`."""

_FORMAT = "an AMASS npz"
_POSE_WIDTHS = (72, 156, 165)
_RATE_KEYS = ("mocap_framerate", "mocap_frame_rate")


def _smpl_map() -> dict[str, BoneMapping]:
    mapping = {
        "root": BoneMapping("pelvis"),
        "lowerback": BoneMapping("spine1"),
        "upperback": BoneMapping("spine2"),
        "thorax": BoneMapping("spine3"),
        "lowerneck": BoneMapping("neck"),
        "upperneck": BoneMapping("neck"),
        "head": BoneMapping("head"),
    }
    for side, s in (("left", "l"), ("right", "r")):
        mapping[f"{s}clavicle"] = BoneMapping(f"{side}_collar")
        mapping[f"{s}humerus"] = BoneMapping(f"{side}_shoulder")
        mapping[f"{s}radius"] = BoneMapping(f"{side}_elbow")
        mapping[f"{s}wrist"] = BoneMapping(f"{side}_elbow")
        mapping[f"{s}hand"] = BoneMapping(f"{side}_wrist")
        mapping[f"{s}hipjoint"] = BoneMapping("pelvis")
        mapping[f"{s}femur"] = BoneMapping(f"{side}_hip")
        mapping[f"{s}tibia"] = BoneMapping(f"{side}_knee")
        mapping[f"{s}foot"] = BoneMapping(f"{side}_ankle")
    return {bone: to.with_rest_pose(FROM_T_POSE.get(bone)) for bone, to in mapping.items()}


SMPL_MAP: JointMap = _smpl_map()
"""Joint of each of the 24 bones. The forearm's twist goes to the wrist bone; toes are left out."""


def read_amass(path: Path | str) -> JointClip:
    """Read the motion of an AMASS file on the 22 body joints; joint offsets are zero, since the file has none.

    Only the named arrays are read, as plain numbers; nothing in the archive is unpickled. Raises BadFile.
    """
    path = Path(path)
    check_size(path, _FORMAT)
    names = ("poses", "trans", *_RATE_KEYS)
    arrays = read_npz(path, _FORMAT, "Fetch it again.", limit_bytes=LIMIT_BYTES, names=names)
    poses, trans = (_numbers(path, arrays, name) for name in ("poses", "trans"))
    rate_hz = _rate_hz(path, arrays)
    frames = trans.shape[0] if trans.ndim else 0
    if (
        frames == 0
        or trans.shape != (frames, 3)
        or poses.ndim != 2
        or poses.shape not in [(frames, w) for w in _POSE_WIDTHS]
    ):
        shapes = f"poses {poses.shape} and trans {trans.shape}"
        raise BadFile(path, shapes, "(T, 72, 156 or 165) and (T, 3), T at least 1", "Is it another kind of npz?")
    turn = rotations.exp(poses[:, : 3 * len(JOINTS)].reshape(frames, len(JOINTS), 3))
    local = np.concatenate([turn[..., :1], turn[..., 1:] @ WORLD_FROM_ASF.T], axis=-1)
    local[:, 0] = rotations.multiply(turn[:, 0], rotations.from_matrix(WORLD_FROM_ASF.T))
    return JointClip(
        name=path.stem,
        subject=path.stem.split("_", 1)[0],
        source=path.parent.name,
        behaviour="",
        names=tuple(name for name, _ in JOINTS),
        parents=tuple(parent for _, parent in JOINTS),
        offset_m=np.zeros((len(JOINTS), 3)),
        rate_hz=rate_hz,
        root_m=trans,
        parent_from_joint=local,
        notes=("root placed at trans; the pelvis of the body model is a constant vector away",),
    )


def read_amass_clip(path: Path | str) -> Clip:
    """Read an AMASS file as a clip on the mean skeleton of the 24 bones. Raises BadFile."""
    return to_clip(read_amass(path), SMPL_MAP)


def _rate_hz(path: Path, arrays: Mapping[str, NDArray[Any]]) -> float:
    present = [key for key in _RATE_KEYS if key in arrays]
    if not present:
        raise BadFile(path, "no frame rate", " or ".join(_RATE_KEYS), "Is it another kind of npz?")
    rate = _numbers(path, arrays, present[0])
    if any(not np.array_equal(_numbers(path, arrays, key), rate) for key in present):
        raise BadFile(path, f"{' and '.join(present)} that differ", "one rate", "Remove the wrong one.")
    if rate.size != 1 or not 0.0 < float(rate.flat[0]) < 1e5:
        raise BadFile(path, f"{present[0]} of {rate.tolist()!s:.40}", "one rate above 0 Hz", "Fetch it again.")
    return float(rate.flat[0])


def _numbers(path: Path, arrays: Mapping[str, NDArray[Any]], key: str) -> Floats:
    """One array of finite real numbers; BadFile."""
    if key not in arrays:
        raise BadFile(path, f"no array {key}", f"poses, trans, {_RATE_KEYS[0]}", f"Is it {_FORMAT}?")
    if arrays[key].dtype.kind not in "fiu":
        raise BadFile(path, f"array {key} of {arrays[key].dtype}", "plain numbers", "Fetch it again.")
    values: Floats = arrays[key].astype(float)
    if not bool(np.all(np.abs(values) < MAX_VALUE)):
        raise BadFile(path, f"a value of {key} that is not a finite number", "finite numbers", "Fetch it again.")
    return values
