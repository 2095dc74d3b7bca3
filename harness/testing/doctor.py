"""`harness doctor`: does this installation measure what it should, and which optional parts are missing."""

import importlib.util
import os
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from harness.body import humanoid, retargeting
from harness.body.kinematics import Kinematics
from harness.body.mounts import DEFAULTS
from harness.core import rotations
from harness.core.humanoid24 import standard_skeleton
from harness.core.motion import Clip
from harness.errors import HarnessError
from harness.mocap import synthetic
from harness.mocap.library import MotionLibrary
from harness.mocap.sources import VARIABLE, library_folder
from harness.report.kit.render_process import Job, Rendering
from harness.simulate import noise
from harness.simulate.simulation import TrackerConfig, simulate
from harness.testing.score_checks import Check, check_scores

OPTIONAL = {
    "plotly": "the interactive view of the report (extra viz)",
    "imageio_ffmpeg": "movies (extra viz)",
    "ezc3d": "C3D files (extra c3d)",
    "pythonosc": "live poses by VMC protocol (extra live)",
    "pylsl": "live poses by the Lab Streaming Layer (extra lsl)",
    "mink": "the reference of `harness bench ik` (extra bench)",
}
_STREAM_SLACK_M = 1e-5
"""A centimetre in float32 is good to 1e-7 m at arm's length, to 1e-6 m across a hall."""
_SIX = ("left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head")


def examine(folder: Path | None) -> list[Check]:
    """Scores on true motion, the stream against the truth, then what is optional.

    A missing optional part is told and is no failure; a library that was named and cannot be read is one.
    """
    clips = [synthetic.generate(b, "p1", 1, seed=1, duration_s=6.0) for b in synthetic.BEHAVIOURS]
    takes = [retargeting.to_own_body(clip)[1] for clip in clips]
    return [*check_scores(takes), _stream(clips[0]), *_optional(), _library(folder)]


def _stream(clip: Clip) -> Check:
    """Perfect trackers come back through the device's bytes where MuJoCo has them, but for float32."""
    body, take = retargeting.to_own_body(clip)
    mounts = [DEFAULTS[station] for station in _SIX]
    seen = simulate(body, take, mounts, TrackerConfig(slot_s=0.0), noise.level("clean"), seed=1)
    known, kinematics, worst_m = seen.calibration, Kinematics(body), 0.0
    bones = [body.skeleton.index(bone) for bone in known.bones]
    for frame, instant in zip(seen.frames, seen.frame_index, strict=True):
        kinematics.set(seen.truth_qpos[instant])
        there_m, _ = kinematics.station_poses(bones, known.mount_m, known.bone_from_station)
        said_m = rotations.rotate(known.world_from_tracker, frame.position_m) + known.tracker_origin_m
        worst_m = max(worst_m, float(np.abs(said_m - there_m).max()))
    ok = len(seen.frames) == len(seen.truth_qpos) and worst_m < _STREAM_SLACK_M
    return Check("the stream tells the truth", ok, f"{len(seen.frames)} frames, {1e3 * worst_m:.1e} mm at most")


def _optional() -> list[Check]:
    missing = _picture()
    checks = [Check("rendered pictures", True, f"missing: {missing}" if missing else "available")]
    for module, what in OPTIONAL.items():
        there = importlib.util.find_spec(module) is not None
        checks.append(Check(what, True, "available" if there else f"missing: {module} is not installed"))
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    return [*checks, Check("a browser for the page's test", True, browser or "missing: no chromium on PATH")]


def _picture() -> str:
    """Why no picture can be rendered here, "" if one was."""
    standing, bone_m = humanoid.tpose(standard_skeleton())[None], standard_skeleton().bone_m
    with TemporaryDirectory(prefix="harness-doctor-") as folder:
        file = Path(folder) / "picture.png"
        return Rendering([Job(file, bone_m, bone_m, standing, standing)]).finish()


def _library(folder: Path | None) -> Check:
    if folder is None and not os.environ.get(VARIABLE):
        return Check("real motion", True, f"none named (--mocap DIR or {VARIABLE})")
    try:
        names = MotionLibrary(library_folder(folder)).names()
    except HarnessError as error:
        return Check("real motion", False, str(error))
    return Check("real motion", bool(names), f"{len(names)} clips")
