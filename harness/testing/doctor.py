"""`harness doctor`: check that this installation scores and streams correctly, and list missing optional parts."""

import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from harness.body import DEFAULT_MOUNTS, Kinematics, retarget_to_own_body, tpose
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import pack, standard_skeleton, unpack
from harness.core.motion import BodyMotion, Clip
from harness.core.progress import report_step
from harness.core.skeleton import Skeleton
from harness.errors import HarnessError
from harness.mocap import MOCAP_VARIABLE, LibraryFolders, MotionLibrary, find_library_folders, synthetic
from harness.report.kit import RenderJob, RenderProcess
from harness.score import DEFINITIONS, Scores, score_estimate, score_null_methods
from harness.simulate import TrackerConfig, noise_preset, simulate_tracker
from harness.testing.compilation_check import check_compilation, describe_cache
from harness.testing.device_checks import check_emulated_device, describe_serial_ports
from harness.testing.results_checks import check_results

OPTIONAL_PACKAGES = {
    "imageio_ffmpeg": "movies (extra viz)",
    "pythonosc": "live poses by VMC protocol (extra live)",
    "pylsl": "live poses by the Lab Streaming Layer (extra lsl)",
    "mink": "the solver that `harness bench ik` compares with (extra bench)",
    "faiss": "the index that `harness bench index` compares with (extra bench)",
}
_STREAM_TOLERANCE_M = 1e-5
"""Centimetres in float32 resolve 1e-7 m at arm's length and 1e-6 m across a hall."""
_STATIONS = ("left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head")
TRUTH_METRIC_OF = {
    "jitter_m_s3": "jitter_true_m_s3",
    "foot_skate_mm_s": "foot_skate_true_mm_s",
    "penetration_mm": "penetration_true_mm",
    "float_mm": "float_true_mm",
}
"""Metrics of a single motion -> the metric of the truth: an oracle reaches that value instead of zero."""
ERROR_METRICS = tuple(
    name
    for name, d in DEFINITIONS.items()
    if d.pool != "none" and name not in {*TRUTH_METRIC_OF, *TRUTH_METRIC_OF.values()}
)
"""Metrics that are zero when the estimate is the truth."""
_ZERO_TOLERANCE = 1e-9


class InstallationCheck(NamedTuple):
    """Result of one check."""

    name: str
    ok: bool
    detail: str
    """What was measured or is missing."""


def check_installation(folder: LibraryFolders | None) -> list[InstallationCheck]:
    """Check the scores on true motion, the stream against the truth, results on disk, and the optional parts.

    A missing optional part is listed and is not a failure. A named library that cannot be read is a failure.
    """
    report_step("compilation")
    checks = [("functions are compiled", *check_compilation()), ("machine code", True, describe_cache())]
    report_step("scores")
    clips = [synthetic.generate(b, "p1", 1, seed=1, duration_s=6.0) for b in synthetic.BEHAVIOURS]
    scores = check_scores([retarget_to_own_body(clip)[1] for clip in clips])
    report_step("stream")
    stream = _check_stream(clips[0])
    report_step("results")
    further = list(check_results())
    report_step("device")
    further += [(f"an emulated device over {kind.upper()}", *check_emulated_device(kind)) for kind in ("tcp", "udp")]
    further.append(("serial ports", True, describe_serial_ports()))
    report_step("optional parts")
    first, later = ([InstallationCheck(*check) for check in some] for some in (checks, further))
    return [*first, *scores, stream, *later, *_check_optional_parts(), _check_library(folder)]


def _check_stream(clip: Clip) -> InstallationCheck:
    """Stations without noise, decoded from device bytes, must be where MuJoCo puts them, within float32 rounding."""
    body, take = retarget_to_own_body(clip)
    mounts = [DEFAULT_MOUNTS[station] for station in _STATIONS]
    simulation = simulate_tracker(body, take, mounts, TrackerConfig(slot_s=0.0), noise_preset("clean"), seed=1)
    calibration, kinematics, worst_m = simulation.calibration, Kinematics(body), 0.0
    bones = [body.skeleton.index(bone) for bone in calibration.bones]
    for frame, index in zip(simulation.frames, simulation.frame_index, strict=True):
        kinematics.set(simulation.truth_qpos[index])
        true_m, _ = kinematics.station_poses(bones, calibration.mount_m, calibration.bone_from_station)
        read_m = rotations.rotate(calibration.world_from_tracker, frame.position_m) + calibration.tracker_origin_m
        worst_m = max(worst_m, float(np.abs(read_m - true_m).max()))
    frames = len(simulation.frames)
    ok = frames == len(simulation.truth_qpos) and worst_m < _STREAM_TOLERANCE_M
    detail = f"{frames} frames, largest error {1e3 * worst_m:.1e} mm"
    return InstallationCheck("the simulated stream agrees with the true motion", ok, detail)


def _check_optional_parts() -> list[InstallationCheck]:
    missing = _rendering_problem()
    checks = [InstallationCheck("rendered pictures", True, f"missing: {missing}" if missing else "available")]
    if renderer := os.environ.get("MUJOCO_GL"):
        unused = f"MUJOCO_GL={renderer} has no effect: pictures are drawn by VTK"
        checks.append(InstallationCheck("renderer of MuJoCo", True, unused))
    for module, purpose in OPTIONAL_PACKAGES.items():
        installed = importlib.util.find_spec(module) is not None
        detail = "available" if installed else f"missing: {module} is not installed"
        checks.append(InstallationCheck(purpose, True, detail))
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    detail = browser or "missing: no chromium or google-chrome on PATH"
    return [*checks, InstallationCheck("a browser for the test of report pages", True, detail)]


def _rendering_problem() -> str:
    """Render a picture: the reason why that failed, or "" where it worked."""
    standing, bone_m = tpose(standard_skeleton())[None], standard_skeleton().bone_m
    with TemporaryDirectory(prefix="harness-doctor-") as folder:
        file = Path(folder) / "picture.png"
        with RenderProcess([RenderJob(file, bone_m, bone_m, standing, standing)]) as rendering:
            return rendering.finish()


def _check_library(folder: LibraryFolders | None) -> InstallationCheck:
    if folder is None and not os.environ.get(MOCAP_VARIABLE):
        return InstallationCheck("motion library", True, f"none given (--mocap DIR or {MOCAP_VARIABLE})")
    try:
        names = MotionLibrary(find_library_folders(folder)).names()
    except HarnessError as error:
        return InstallationCheck("motion library", False, str(error))
    return InstallationCheck("motion library", bool(names), f"{len(names)} clips")


def check_scores(takes: Sequence[BodyMotion], skeleton: Skeleton | None = None) -> list[InstallationCheck]:
    """Check the metrics with oracle, null methods, closed forms and evo.

    `takes` are true motion of at least 3 s each, on the body of `skeleton`.
    """
    body = skeleton or standard_skeleton()
    scores = [score_null_methods(body, take.rate_hz, take.qpos) for take in takes]
    return [
        _check_oracle([nulls["oracle"] for nulls in scores]),
        _check_null_methods([{name: s.metrics for name, s in nulls.items()} for nulls in scores]),
        *_check_closed_forms(body, takes[0]),
        _check_lag(body, takes[0]),
        _check_against_evo(body, takes[0]),
    ]


def _check_oracle(oracles: Sequence[Scores]) -> InstallationCheck:
    wrong = [
        name
        for scores in oracles
        for name in (*ERROR_METRICS, *TRUTH_METRIC_OF)
        if not _is_zero(scores.metrics[name], scores.metrics.get(TRUTH_METRIC_OF.get(name, "")))
    ]
    detail = (
        f"not zero: {', '.join(dict.fromkeys(wrong))}"
        if wrong
        else f"{len(ERROR_METRICS)} metrics on {len(oracles)} takes"
    )
    return InstallationCheck("the true motion scores zero", not wrong, detail)


def _is_zero(value: float | None, truth: float | None) -> bool:
    return value == truth if value is None or truth is not None else abs(value) <= _ZERO_TOLERANCE


def _check_null_methods(nulls: Sequence[Mapping[str, Mapping[str, float | None]]]) -> InstallationCheck:
    """Expected order by the mean joint angle error of all takes: oracle < last value < mean pose and frozen pose."""
    names = ("oracle", "last_value", "mean_pose", "frozen_pose")
    mean = {name: float(np.mean([take[name]["joint_angle_mean_deg"] or 0.0 for take in nulls])) for name in names}
    ok = mean["oracle"] < mean["last_value"] < min(mean["mean_pose"], mean["frozen_pose"])
    detail = ", ".join(f"{name.replace('_', ' ')} {value:.2f} deg" for name, value in mean.items())
    return InstallationCheck("null methods rank as expected", ok, detail)


def _check_closed_forms(body: Skeleton, take: BodyMotion) -> list[InstallationCheck]:
    root_m, quaternion, angles_rad = unpack(take.qpos)
    bent = np.array(angles_rad)
    bent[:, 0] += np.deg2rad(4.8)
    quarter = rotations.about_z(0.5 * np.pi)
    turned = pack(rotations.rotate(quarter, root_m), rotations.multiply(quarter, quaternion), angles_rad)
    moved = pack(root_m + np.array([0.03, 0.0, -0.04]), quaternion, angles_rad)
    hinge = {"joint_angle_mean_deg": 4.8 / len(body.axes)}
    cases = (
        ("moved 50 mm", moved, {"mpjpe_mm": 50.0, "mpjpe_root_mm": 0.0}),
        ("one hinge off by 4.8 deg", pack(root_m, quaternion, bent), hinge),
        ("turned by 90 deg", turned, {"root_angle_deg": 90.0, "mpjre_deg": 0.0, "mpjpe_pa_mm": 0.0}),
    )
    return [
        _check_values(name, _score_all_frames(body, take, estimate), expected) for name, estimate, expected in cases
    ]


def _check_lag(body: Skeleton, take: BodyMotion) -> InstallationCheck:
    late = np.concatenate([np.repeat(take.qpos[:1], 2, axis=0), take.qpos[:-2]])
    return _check_values("two frames late", _score_all_frames(body, take, late), {"lag_ms": 2e3 / take.rate_hz})


def _check_values(name: str, scores: Scores, expected: Mapping[str, float]) -> InstallationCheck:
    measured = {metric: scores.metrics[metric] for metric in expected}
    ok = all(value is not None and abs(value - expected[metric]) < 1e-6 for metric, value in measured.items())
    text = ", ".join(f"{metric} {'not measured' if v is None else f'{v:.6g}'}" for metric, v in measured.items())
    return InstallationCheck(f"closed form: {name}", ok, text)


def _score_all_frames(body: Skeleton, take: BodyMotion, estimate_qpos: Floats) -> Scores:
    frames = len(take)
    return score_estimate(
        body, take.rate_hz, take.qpos, estimate_qpos, np.arange(frames), np.zeros(frames, int), np.full(frames, np.nan)
    )


def _check_against_evo(body: Skeleton, take: BodyMotion) -> InstallationCheck:
    """Compare the root position error with evo's absolute pose error (translation, no alignment), if installed."""
    name = "evo gives the same root position error"
    program = find_evo()
    if program is None:
        return InstallationCheck(name, True, "skipped: evo is not installed")
    estimate = np.array(take.qpos)
    time_s = np.arange(len(take)) / take.rate_hz
    estimate[:, :3] += 0.1 * np.stack([np.sin(time_s), np.cos(3.0 * time_s), np.sin(2.0 * time_s)], axis=1)
    scores = score_estimate(
        body, take.rate_hz, take.qpos, estimate, np.arange(len(take)), np.zeros(len(take), int),
        np.full(len(take), np.nan), warm_up_s=0.0,
    )  # fmt: skip
    with TemporaryDirectory() as folder:
        files = Path(folder) / "truth.tum", Path(folder) / "estimate.tum"
        for file, qpos in zip(files, (take.qpos, estimate), strict=True):
            np.savetxt(file, np.column_stack([time_s, qpos[:, :3], qpos[:, 4:7], qpos[:, 3]]), fmt="%.9f")
        try:
            theirs_mm = 1e3 * run_evo_ape_m(program, *files)
        except (subprocess.SubprocessError, OSError) as error:
            return InstallationCheck(name, False, f"evo failed: {error}")
    ours_mm = scores.metrics["root_position_mm"] or 0.0
    return InstallationCheck(name, abs(ours_mm - theirs_mm) < 1.5e-3, f"ours {ours_mm:.3f} mm, evo {theirs_mm:.3f} mm")


def find_evo() -> str | None:
    """Path of `evo_ape`, in this environment or on PATH; None where it is not installed."""
    program = Path(sys.executable).with_name("evo_ape")
    return str(program) if program.is_file() else shutil.which("evo_ape")


def run_evo_ape_m(program: str, truth: Path, estimate: Path) -> float:
    """Mean absolute pose error of two TUM files as evo prints it: translation part, no alignment [m]."""
    home = truth.parent  # evo writes its settings into the home folder when it first runs
    done = subprocess.run(
        [program, "tum", str(truth), str(estimate)],
        env={**os.environ, "HOME": str(home), "MPLBACKEND": "agg"},
        cwd=home,
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    rows = dict(line.split() for line in done.stdout.splitlines() if len(line.split()) == 2)
    return float(rows["mean"])
