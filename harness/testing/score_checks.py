"""Can these scores be believed? Checks on true motion, called by `harness doctor`."""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import pack, standard_skeleton, unpack
from harness.core.motion import BodyMotion
from harness.core.skeleton import Skeleton
from harness.score.metrics import DEFINITIONS
from harness.score.null_methods import score_null_methods
from harness.score.score import Scores, score_estimate

TRUTH_METRIC_OF = {
    "jitter_m_s3": "jitter_true_m_s3",
    "foot_skate_mm_s": "foot_skate_true_mm_s",
    "penetration_mm": "penetration_true_mm",
    "float_mm": "float_true_mm",
}
"""Metrics of one motion alone, and the truth's own value: an oracle reaches that, not zero."""
ERROR_METRICS = tuple(
    name
    for name, d in DEFINITIONS.items()
    if d.pool != "none" and name not in {*TRUTH_METRIC_OF, *TRUTH_METRIC_OF.values()}
)
"""Metrics that are zero for the truth."""
_ZERO_TOLERANCE = 1e-9


@dataclass(frozen=True)
class InstallationCheck:
    """One thing that was tried."""

    name: str
    ok: bool
    detail: str

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def check_scores(takes: Sequence[BodyMotion], skeleton: Skeleton | None = None) -> list[InstallationCheck]:
    """Oracle, null methods, closed forms and evo on true motion of at least 3 s each, on the body `skeleton`."""
    body = skeleton or standard_skeleton()
    found = [score_null_methods(body, take.rate_hz, take.qpos) for take in takes]
    return [
        _check_oracle([nulls["oracle"] for nulls in found]),
        _check_null_methods([{name: s.metrics for name, s in nulls.items()} for nulls in found]),
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
        f"not so: {', '.join(dict.fromkeys(wrong))}"
        if wrong
        else f"{len(ERROR_METRICS)} metrics on {len(oracles)} takes"
    )
    return InstallationCheck("the truth scores zero", not wrong, detail)


def _is_zero(value: float | None, truth: float | None) -> bool:
    return value == truth if value is None or truth is not None else abs(value) <= _ZERO_TOLERANCE


def _check_null_methods(nulls: Sequence[Mapping[str, Mapping[str, float | None]]]) -> InstallationCheck:
    """Oracle < last value < mean pose and frozen pose, by the mean joint angle over all takes."""
    names = ("oracle", "last_value", "mean_pose", "frozen_pose")
    mean = {name: float(np.mean([take[name]["joint_angle_mean_deg"] or 0.0 for take in nulls])) for name in names}
    ok = mean["oracle"] < mean["last_value"] < min(mean["mean_pose"], mean["frozen_pose"])
    detail = ", ".join(f"{name.replace('_', ' ')} {value:.2f} deg" for name, value in mean.items())
    return InstallationCheck("null methods are in order", ok, detail)


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
    found = {metric: scores.metrics[metric] for metric in expected}
    ok = all(value is not None and abs(value - expected[metric]) < 1e-6 for metric, value in found.items())
    text = ", ".join(f"{metric} {'not measured' if v is None else f'{v:.6g}'}" for metric, v in found.items())
    return InstallationCheck(f"closed form: {name}", ok, text)


def _score_all_frames(body: Skeleton, take: BodyMotion, estimate_qpos: Floats) -> Scores:
    frames = len(take)
    return score_estimate(
        body, take.rate_hz, take.qpos, estimate_qpos, np.arange(frames), np.zeros(frames, int), np.full(frames, np.nan)
    )


def _check_against_evo(body: Skeleton, take: BodyMotion) -> InstallationCheck:
    """Root position error against evo's absolute pose error (translation, no alignment), where evo is installed."""
    name = "evo agrees on the root's position"
    program = find_evo()
    if program is None:
        return InstallationCheck(name, True, "not tried: evo is not installed")
    estimate = np.array(take.qpos)
    time_s = np.arange(len(take)) / take.rate_hz
    estimate[:, :3] += 0.1 * np.stack([np.sin(time_s), np.cos(3.0 * time_s), np.sin(2.0 * time_s)], axis=1)
    scores = score_estimate(
        body, take.rate_hz, take.qpos, estimate, np.arange(len(take)), np.zeros(len(take), int),
        np.full(len(take), np.nan), warm_up_s=0.0,
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
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
    """The `evo_ape` of this environment or of the path; None where it is not installed."""
    beside = Path(sys.executable).with_name("evo_ape")
    return str(beside) if beside.is_file() else shutil.which("evo_ape")


def run_evo_ape_m(program: str, truth: Path, estimate: Path) -> float:
    """Mean absolute pose error of two TUM files, translation part, nothing aligned [m], as evo prints it."""
    home = truth.parent  # evo writes its settings into the home folder when it first runs
    done = subprocess.run(
        [program, "tum", str(truth), str(estimate)],
        env={**os.environ, "HOME": str(home), "MPLBACKEND": "agg"},
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    rows = dict(line.split() for line in done.stdout.splitlines() if len(line.split()) == 2)
    return float(rows["mean"])
