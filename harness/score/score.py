"""Score of an estimated motion: every metric per frame, per joint and as one number."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.estimate import Origin, Status, has_pose
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, ShapeError
from harness.score import angles, positions, timing
from harness.score.loops import COVERAGE_FLOOR, WARM_UP_S, LoopFrames, score_loops
from harness.score.metrics import DEFINITIONS
from harness.score.pair import Pair, compute_poses, hinged_bones, joint_names
from harness.score.uncertainty import SigmaSums, score_sigma

UNDISTURBED_AFTER_S = 0.5
"""A frame is undisturbed when every station has reported for this long [s] (choice): time to find the body again."""


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of F estimates."""

    metrics: Mapping[str, float | None]
    """Metric -> value, in the order of `metrics.DEFINITIONS`; None means "not measured"."""
    per_frame: Mapping[str, Floats]
    """Metric -> (F,) values; NaN where undefined (no contact, a gap, an estimate that is not finite)."""
    per_joint: Mapping[str, Mapping[str, float]]
    """Metric -> hinge, bone or joint -> mean over the scored frames."""
    scored: Bools
    """(F,) scored frames: finite and after the warm-up."""
    sigma: Mapping[str, float] = field(default_factory=dict)
    """Scores of the stated standard deviations, see `uncertainty.SIGMA_DEFINITIONS`; empty without them."""


def score_estimate(
    skeleton: Skeleton,
    rate_hz: float,
    truth_qpos: Floats,
    estimate_qpos: Floats,
    frame_index: Ints,
    status: Ints,
    step_ms: Floats,
    *,
    origin: Ints | None = None,
    complete: Bools | None = None,
    cpu_ms: tuple[Floats, Floats] | None = None,
    angle_sigma_rad: Floats | None = None,
    estimate_skeleton: Skeleton | None = None,
    warm_up_s: float = WARM_UP_S,
    floor: float = COVERAGE_FLOOR,
) -> Scores:
    """Score F estimates of E true frames at an even rate; ShapeError, BadInput.

    - `skeleton`: the skeleton of the truth; `estimate_skeleton`: that of the estimate, the same by default;
    - `truth_qpos` (E, 55), `estimate_qpos` (F, 55);
    - `frame_index` (F,): the true frame of each estimate, strictly increasing;
    - `status` (F,): values of `Status`;
    - `step_ms` (F,): wall time of each step, NaN where not timed;
    - `origin` (F,): values of `Origin`, all MODEL by default;
    - `complete` (F,): frames in which every station reported, all by default;
    - `angle_sigma_rad` (F, 48): standard deviations of the hinge angles, in the order of `qpos`, if any are stated;
    - `cpu_ms`: CPU time (F,) of the steps and (F,) of the reference (see `timing.step_relative`), NaN where not timed.
    """
    if angle_sigma_rad is not None and np.shape(angle_sigma_rad) != (len(estimate_qpos), len(skeleton.axes)):
        expected_shape = f"({len(estimate_qpos)}, {len(skeleton.axes)})"
        raise ShapeError("score", "angle_sigma_rad", np.shape(angle_sigma_rad), expected_shape)
    origin = np.full(len(estimate_qpos), Origin.MODEL) if origin is None else np.asarray(origin)
    complete = np.ones(len(estimate_qpos), bool) if complete is None else np.asarray(complete)
    frame_index, status, step_ms = _check_shapes(skeleton, truth_qpos, estimate_qpos, frame_index, status, step_ms)
    truth, rows = compute_poses(skeleton, truth_qpos), np.arange(len(frame_index))
    found = score_loops(
        truth,
        rate_hz,
        estimate_qpos,
        [LoopFrames(rows, frame_index, range(len(truth_qpos)))],
        estimate_skeleton=estimate_skeleton,
        warm_up_s=warm_up_s,
    )
    (scored_pair,), measured, warm, scored = found.pairs, found.pooled(), found.warm, found.scored
    undisturbed = scored & undisturbed_frames(complete, frame_index, rate_hz)
    measured["fallback_share"] = _share(origin[undisturbed] == Origin.FALLBACK)
    measured["root_drift_mm_s"] = positions.root_drift_mm_s(scored_pair)
    measured["lag_ms"] = timing.lag_ms(
        truth.angles_rad, scored_pair.estimate.angles_rad, scored_pair.frame_index, rate_hz
    )
    timed = warm & (rows > 0)
    measured |= timing.step_times_ms(step_ms[timed])
    measured["step_relative"] = float("nan") if cpu_ms is None else timing.step_relative(cpu_ms[0][timed], cpu_ms[1])
    measured["first_step_ms"] = float(step_ms[0]) if len(step_ms) else float("nan")
    counts: dict[str, float] = {
        "frames_matched": found.matched,
        "frames_expected": found.expected,
        "coverage": found.coverage,
        "frames_warm_up": int((~warm).sum()),
        "frames_held": int((status[scored] == Status.HELD).sum()),
        "frames_lost": int((status[scored] == Status.LOST).sum()),
        "frames_fallback": int((origin[scored] == Origin.FALLBACK).sum()),
        "frames_bridged": int((origin[scored] == Origin.BRIDGED).sum()),
        "frames_not_finite": int((~has_pose(estimate_qpos)).sum()),
    }
    enough = found.is_enough(floor)
    metrics = {
        name: counts[name] if name in counts else measured[name] if enough and np.isfinite(measured[name]) else None
        for name in DEFINITIONS
    }
    per_joint, sigma = (_per_joint(scored_pair), dict[str, float]()) if enough else ({}, {})
    if enough and angle_sigma_rad is not None:
        sums = score_sigma(truth_qpos[frame_index[scored]], estimate_qpos[scored], angle_sigma_rad[scored])
        sigma, per_joint = sums.scores(), per_joint | _sigma_per_joint(skeleton, sums)
    return Scores(metrics, found.per_frame, per_joint, scored, sigma)


def undisturbed_frames(complete: Bools, frame_index: Ints, rate_hz: float) -> Bools:
    """(F,) frames that end a run of complete frames, without a gap, of at least `UNDISTURBED_AFTER_S`.

    `complete` (F,) has the frames in which every station reported, `frame_index` (F,) their true frames. Frames before
    the first count as complete.
    """
    frames = round(UNDISTURBED_AFTER_S * rate_hz)
    rows = np.arange(len(complete))
    broken = ~complete
    broken[1:] |= np.diff(frame_index) > 1
    last = np.maximum.accumulate(np.where(broken, rows, -frames))
    out: Bools = complete & (rows - last >= frames)
    return out


def _share(values: Bools) -> float:
    """Share of true values; NaN without values."""
    return float(values.mean()) if len(values) else float("nan")


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


def _sigma_per_joint(skeleton: Skeleton, sums: SigmaSums) -> dict[str, dict[str, float]]:
    return {
        name: dict(zip(skeleton.dof_names, map(float, values), strict=True)) for name, values in sums.by_hinge().items()
    }


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
        raise BadInput(
            "frame_index is not strictly increasing within the true frames.", "Give each frame one estimate."
        )
    if not np.isfinite(truth_qpos).all():
        raise BadInput("The truth is not finite.", "Cut the take to the part with known motion.")
    return index, np.asarray(status, dtype=np.int64), np.asarray(step_ms, dtype=float)
