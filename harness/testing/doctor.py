"""`harness doctor`: does this installation measure what it should, and which optional parts are missing."""

import importlib.util
import os
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from harness.body import humanoid, retargeting
from harness.body.kinematics import Kinematics
from harness.body.mounts import DEFAULT_MOUNTS
from harness.core import rotations
from harness.core.humanoid24 import standard_skeleton
from harness.core.motion import Clip
from harness.errors import HarnessError
from harness.mocap import synthetic
from harness.mocap.library import MotionLibrary
from harness.mocap.sources import MOCAP_VARIABLE, find_library_folders
from harness.report.kit.render_process import RenderJob, RenderProcess
from harness.simulate import noise
from harness.simulate.simulation import TrackerConfig, simulate_tracker
from harness.testing.score_checks import InstallationCheck, check_scores

OPTIONAL_PACKAGES = {
    "plotly": "the interactive view of the report (extra viz)",
    "imageio_ffmpeg": "movies (extra viz)",
    "ezc3d": "C3D files (extra c3d)",
    "pythonosc": "live poses by VMC protocol (extra live)",
    "pylsl": "live poses by the Lab Streaming Layer (extra lsl)",
    "mink": "the reference of `harness bench ik` (extra bench)",
}
_STREAM_TOLERANCE_M = 1e-5
"""A centimetre in float32 is good to 1e-7 m at arm's length, to 1e-6 m across a hall."""
_STATIONS = ("left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head")


def check_installation(folder: Path | None) -> list[InstallationCheck]:
    """Scores on true motion, the stream against the truth, then what is optional.

    A missing optional part is told and is no failure; a library that was named and cannot be read is one.
    """
    clips = [synthetic.generate(b, "p1", 1, seed=1, duration_s=6.0) for b in synthetic.BEHAVIOURS]
    takes = [retargeting.retarget_to_own_body(clip)[1] for clip in clips]
    return [*check_scores(takes), _check_stream(clips[0]), *_check_optional_parts(), _check_library(folder)]


def _check_stream(clip: Clip) -> InstallationCheck:
    """Perfect trackers come back through the device's bytes where MuJoCo has them, but for float32."""
    body, take = retargeting.retarget_to_own_body(clip)
    mounts = [DEFAULT_MOUNTS[station] for station in _STATIONS]
    seen = simulate_tracker(body, take, mounts, TrackerConfig(slot_s=0.0), noise.noise_preset("clean"), seed=1)
    known, kinematics, worst_m = seen.calibration, Kinematics(body), 0.0
    bones = [body.skeleton.index(bone) for bone in known.bones]
    for frame, instant in zip(seen.frames, seen.frame_index, strict=True):
        kinematics.set(seen.truth_qpos[instant])
        there_m, _ = kinematics.station_poses(bones, known.mount_m, known.bone_from_station)
        said_m = rotations.rotate(known.world_from_tracker, frame.position_m) + known.tracker_origin_m
        worst_m = max(worst_m, float(np.abs(said_m - there_m).max()))
    ok = len(seen.frames) == len(seen.truth_qpos) and worst_m < _STREAM_TOLERANCE_M
    return InstallationCheck(
        "the stream tells the truth", ok, f"{len(seen.frames)} frames, {1e3 * worst_m:.1e} mm at most"
    )


def _check_optional_parts() -> list[InstallationCheck]:
    missing = _rendering_problem()
    checks = [InstallationCheck("rendered pictures", True, f"missing: {missing}" if missing else "available")]
    for module, what in OPTIONAL_PACKAGES.items():
        there = importlib.util.find_spec(module) is not None
        checks.append(InstallationCheck(what, True, "available" if there else f"missing: {module} is not installed"))
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    return [
        *checks,
        InstallationCheck("a browser for the page's test", True, browser or "missing: no chromium on PATH"),
    ]


def _rendering_problem() -> str:
    """Why no picture can be rendered here, "" if one was."""
    standing, bone_m = humanoid.tpose(standard_skeleton())[None], standard_skeleton().bone_m
    with TemporaryDirectory(prefix="harness-doctor-") as folder:
        file = Path(folder) / "picture.png"
        return RenderProcess([RenderJob(file, bone_m, bone_m, standing, standing)]).finish()


def _check_library(folder: Path | None) -> InstallationCheck:
    if folder is None and not os.environ.get(MOCAP_VARIABLE):
        return InstallationCheck("real motion", True, f"none named (--mocap DIR or {MOCAP_VARIABLE})")
    try:
        names = MotionLibrary(find_library_folders(folder)).names()
    except HarnessError as error:
        return InstallationCheck("real motion", False, str(error))
    return InstallationCheck("real motion", bool(names), f"{len(names)} clips")
