"""One estimated motion against the truth: every metric, per frame, per joint and as one number."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.estimate import Status
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, ShapeError
from harness.score import angles, contact, positions, timing
from harness.score.metrics import DEFINITIONS, FRAME_METRICS, Pool
from harness.score.pair import Pair, compute_poses, hinged_bones, joint_names

WARM_UP_S = 1.0
"""Estimates before this time of a take are no part of any score [s] (choice)."""
COVERAGE_FLOOR = 0.5
"""With fewer of the expected frames matched, nothing but coverage is measured (choice)."""


@dataclass(frozen=True, eq=False)
class Scores:
    """Numbers about F estimates."""

    metrics: Mapping[str, float | None]
    """By the names of `metrics.DEFINITIONS`, in that order; None is "not measured"."""
    per_frame: Mapping[str, Floats]
    """(F,) each; NaN where undefined (no contact, a gap, an estimate that is not finite)."""
    per_joint: Mapping[str, Mapping[str, float]]
    """Metric -> hinge, bone or joint -> mean over the scored frames."""
    scored: Bools
    """(F,) the frames that count: after the warm-up and finite."""


def score_estimate(
    skeleton: Skeleton,
    rate_hz: float,
    truth_qpos: Floats,
    estimate_qpos: Floats,
    frame_index: Ints,
    status: Ints,
    step_ms: Floats,
    *,
    cpu_ms: tuple[Floats, Floats] | None = None,
    estimate_skeleton: Skeleton | None = None,
    warm_up_s: float = WARM_UP_S,
    floor: float = COVERAGE_FLOOR,
) -> Scores:
    """Judge F estimates of E true frames at an even rate.

    The truth stands on `skeleton`, the estimate on the one that its method believed in: the same by default.
    `truth_qpos` (E, 55), `estimate_qpos` (F, 55), `frame_index` (F,) the true frame that each estimate is of,
    strictly increasing, `status` (F,), `step_ms` (F,) with NaN where not timed, `cpu_ms` (F,) of
    the steps and (F,) of the reference (see `timing.step_relative`), NaN likewise. Raises ShapeError and BadInput.
    """
    frame_index, status, step_ms = _check_shapes(skeleton, truth_qpos, estimate_qpos, frame_index, status, step_ms)
    warm_up = int(np.ceil(warm_up_s * rate_hz - 1e-9))
    finite = np.isfinite(estimate_qpos).all(axis=1) & (np.linalg.norm(estimate_qpos[:, 3:7], axis=1) > 0.0)
    warm = frame_index >= warm_up
    scored = finite & warm
    expected = max(len(truth_qpos) - warm_up, 0)
    coverage = scored.sum() / expected if expected else 0.0

    truth = compute_poses(skeleton, truth_qpos)
    ground_m = contact.ground_m(truth) if len(truth_qpos) else 0.0
    known = frame_index[finite]
    estimate = compute_poses(estimate_skeleton or skeleton, estimate_qpos[finite])
    pair = Pair(truth.at(known), estimate, known, rate_hz, ground_m)
    per_frame = {name: np.full(len(frame_index), np.nan) for name in FRAME_METRICS}
    for name, function in FRAME_METRICS.items():
        if len(known):
            per_frame[name][finite] = function(pair)

    measured: dict[str, float] = {
        name: pool_frames(per_frame[name][scored], DEFINITIONS[name].pool) for name in FRAME_METRICS
    }
    judged = pair.at(known >= warm_up)
    measured["root_drift_mm_s"] = positions.root_drift_mm_s(judged)
    measured["lag_ms"] = timing.lag_ms(truth.angles_rad, judged.estimate.angles_rad, judged.frame_index, rate_hz)
    timed = warm & (np.arange(len(step_ms)) > 0)
    measured |= timing.step_times_ms(step_ms[timed])
    measured["step_relative"] = float("nan") if cpu_ms is None else timing.step_relative(cpu_ms[0][timed], cpu_ms[1])
    measured["first_step_ms"] = float(step_ms[0]) if len(step_ms) else float("nan")
    counts: dict[str, float] = {
        "frames_matched": int(scored.sum()),
        "frames_expected": expected,
        "coverage": float(coverage),
        "frames_warm_up": int((~warm).sum()),
        "frames_held": int((status[scored] == Status.HELD).sum()),
        "frames_lost": int((status[scored] == Status.LOST).sum()),
        "frames_not_finite": int((~finite).sum()),
    }
    enough = expected > 0 and coverage >= floor
    metrics = {
        name: counts[name] if name in counts else measured[name] if enough and np.isfinite(measured[name]) else None
        for name in DEFINITIONS
    }
    return Scores(metrics, per_frame, _per_joint(judged) if enough else {}, scored)


def pool_frames(values: Floats, pool: Pool) -> float:
    """One number from per-frame values, those that are undefined left out; NaN of none."""
    known = values[np.isfinite(values)]
    if not len(known) or pool == "none":
        return float("nan")
    return float(np.sqrt(np.mean(known**2))) if pool == "rms" else float(np.mean(known))


def _per_joint(pair: Pair) -> dict[str, dict[str, float]]:
    hinge_deg = angles.hinge_errors_deg(pair)
    bones = [pair.skeleton.names[b] for b in hinged_bones(pair.skeleton)]
    columns = {
        "joint_angle_mean_deg": (pair.skeleton.dof_names, hinge_deg.mean(axis=0)),
        "joint_angle_rms_deg": (pair.skeleton.dof_names, np.sqrt(np.mean(hinge_deg**2, axis=0))),
        "mpjre_deg": (bones, angles.local_errors_deg(pair).mean(axis=0)),
        "mpjpe_mm": (joint_names(pair.skeleton), positions.joint_errors_mm(pair).mean(axis=0)),
    }
    return {metric: dict(zip(names, map(float, row), strict=True)) for metric, (names, row) in columns.items()}


def _check_shapes(
    skeleton: Skeleton, truth_qpos: Floats, estimate_qpos: Floats, frame_index: Ints, status: Ints, step_ms: Floats
) -> tuple[Ints, Ints, Floats]:
    width, frames = 7 + len(skeleton.axes), len(estimate_qpos)
    for name, found, expected in (
        ("truth_qpos", np.shape(truth_qpos), (len(truth_qpos), width)),
        ("estimate_qpos", np.shape(estimate_qpos), (frames, width)),
        ("frame_index", np.shape(frame_index), (frames,)),
        ("status", np.shape(status), (frames,)),
        ("step_ms", np.shape(step_ms), (frames,)),
    ):
        if found != expected:
            raise ShapeError("score", name, found, str(expected))
    index = np.asarray(frame_index, dtype=np.int64)
    if frames and (index[0] < 0 or index[-1] >= len(truth_qpos) or (np.diff(index) <= 0).any()):
        raise BadInput("frame_index does not rise strictly within the true frames.", "Give each frame one estimate.")
    if not np.isfinite(truth_qpos).all():
        raise BadInput("The truth is not finite.", "Cut the take where its motion is known.")
    return index, np.asarray(status, dtype=np.int64), np.asarray(step_ms, dtype=float)
