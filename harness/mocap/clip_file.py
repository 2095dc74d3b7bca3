"""One motion file as a clip, whatever its format."""

import re
from dataclasses import replace
from pathlib import Path

from harness.core.file_kind import wrong_file
from harness.core.motion import Clip
from harness.core.skeleton import unwrap_angles
from harness.errors import BadFile, BadInput
from harness.mocap.index import rate_from_index, unknown_rate_error
from harness.mocap.read.file_checks import check_size

CLIP_FORMATS = ("amc", "bvh", "mvnx", "npz", "c3d")
_EXPECTED = f"a motion file ({', '.join(f'.{suffix}' for suffix in CLIP_FORMATS)})"
"""Suffixes of motion files, the preferred one first. C3D files hold markers and cannot be read as a clip."""
CMU_NAME = re.compile(r"(\d+_\d+)(_poses|_stageii)?")
"""Subject and trial of CMU's library ("13_17"), with the endings that AMASS adds."""
_ASF_FOLDERS_ABOVE = 3
"""How many folders above an AMC file may hold its skeleton, the file's own folder counted."""


def read_clip(path: Path | str, rate_hz: float | None = None) -> Clip:
    """Read the motion in an AMC, BVH, MVNX (Xsens) or AMASS npz file; the suffix tells the format.

    The clip is in world axes (x forward, y left, z up) [m] with unwrapped angles [rad]. An AMC file moves the skeleton
    of its ASF file (CMU: 30 bones), which is found beside it or up to two folders above. BVH files, of CMU's
    conversion or written by this package, MVNX and AMASS files are fitted to the 24 bones of `core.humanoid24`.

    `rate_hz` is the frame rate of an AMC file, which records none [Hz]; without it, the `manifest.csv` of a folder
    above must name the rate. Raises BadFile for a file that cannot be read; BadInput for an AMC file of unknown rate,
    for a rate where the file records its own, and for ASF and C3D files, which hold no motion of a skeleton.
    """
    path = Path(path)
    if motion_format(path) == "amc":
        file = path.resolve()
        top = file.parents[min(_ASF_FOLDERS_ABOVE, len(file.parents)) - 1]
        return read_library_file(path, top, rate_hz if rate_hz is not None else rate_from_index(path))
    if rate_hz is not None:
        raise BadInput(f"{path.name} records its own frame rate.", "Give no rate for it.")
    return read_library_file(path, path.parent, None)


def read_library_file(path: Path, top: Path, rate_hz: float | None) -> Clip:
    """`read_clip` for a file of the library in the folder `top`; `rate_hz` is used for AMC files only [Hz]."""
    kind = motion_format(path)
    if kind == "c3d":
        advice = "Give its AMC, BVH, MVNX or npz file; `harness.mocap.read.c3d.read_c3d` reads the markers."
        raise BadInput(f"{path.name} is a C3D file, which holds markers.", advice)
    if kind == "bvh":
        from harness.mocap.read.bvh import read_bvh_clip

        clip = read_bvh_clip(path)
    elif kind == "mvnx":
        from harness.mocap.read.mvnx import read_mvnx_clip

        clip = read_mvnx_clip(path)
    elif kind == "npz":
        from harness.mocap.read.amass import read_amass_clip

        clip = read_amass_clip(path)
    else:
        from harness.mocap.read.amc import read_amc_clip

        if rate_hz is None:
            raise unknown_rate_error(path.name)
        clip = read_amc_clip(find_skeleton_file(path, top), path, rate_hz=rate_hz)
    return replace(clip, name=clip_name(path), angles_rad=unwrap_angles(clip.skeleton, clip.angles_rad))


def motion_format(path: Path) -> str:
    """One of FORMATS, by the suffix. BadInput for a skeleton without motion (ASF), BadFile for another suffix."""
    kind = path.suffix.lower().lstrip(".")
    if kind == "asf":
        raise BadInput(f"{path.name} is a skeleton without motion.", "Name an AMC file of it.")
    if kind not in CLIP_FORMATS:
        check_size(path, _EXPECTED)
        advice = "A motion file needs the suffix of its format."
        raise wrong_file(path, f"the suffix {path.suffix!r}", _EXPECTED, advice)
    return kind


def find_skeleton_file(amc: Path, top: Path) -> Path:
    """The ASF file of an AMC file: named after its subject, beside it or in a folder above it up to `top`.

    Without one, the only ASF file beside the AMC file. If the AMC file is a link, its target is searched from too.
    Raises BadFile if there is none, or several beside it of which none has the subject's name.
    """
    for file in dict.fromkeys((amc, amc.resolve())):
        subject = file.stem.split("_", 1)[0]
        for folder in file.parents:
            for stem in (file.stem, subject):
                for suffix in (".asf", ".ASF"):
                    if (folder / f"{stem}{suffix}").is_file():
                        return folder / f"{stem}{suffix}"
            if folder == top:
                break
    subject = amc.stem.split("_", 1)[0]
    beside = sorted(path for path in amc.parent.iterdir() if path.suffix.lower() == ".asf")
    if len(beside) == 1:
        return beside[0]
    found = "no skeleton" if not beside else f"{len(beside)} skeletons, none called {subject}.asf,"
    raise BadFile(amc, f"{found} beside it", f"{subject}.asf", "Put the ASF file of this subject beside the AMC file.")


def clip_name(path: Path) -> str:
    """Name of the clip in a file: its stem, without the endings that AMASS adds to subject and trial."""
    match = CMU_NAME.fullmatch(path.stem)
    return match[1] if match else path.stem
